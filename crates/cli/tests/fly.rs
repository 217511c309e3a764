//! `orthant world fly`: the frame loop, as its diagnostics tell it.

mod common;

use common::{fail, json, succeed};
use serde_json::Value;
use std::path::Path;

fn folder_with_platforms() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("folder");
    succeed(folder.path(), &["world", "new", "--generator", "platforms", "--half-extent", "352", "-o", "w.orw"]);
    folder
}

/// Flies, and gives a line for each frame.
fn fly(folder: &Path, scenario: &str, frames: &str, more: &[&str]) -> Vec<Value> {
    let fixed = ["world", "fly", "w.orw", "--scenario", scenario, "--frames", frames, "--diagnostics", "d.jsonl"];
    let rest = ["--backend", "cpu", "--size", "16x9", "--mode", "slice", "--distance", "400"];
    succeed(folder, &[&fixed[..], &rest[..], more].concat());
    let text = std::fs::read_to_string(folder.join("d.jsonl")).expect("diagnostics");
    let lines: Vec<Value> = text.lines().map(json).collect();
    assert_eq!(lines.len().to_string(), frames);
    for (i, line) in lines.iter().enumerate() {
        assert_eq!(line["frame"], i as u64 + 1);
        assert_eq!(line["rays"]["rays"], 16 * 9, "one ray a pixel");
        assert_eq!(line["rays"]["exhausted"], 0);
    }
    lines
}

fn sum(lines: &[Value], pointer: &str) -> u64 {
    lines.iter().map(|line| line.pointer(pointer).and_then(Value::as_u64).unwrap_or_else(|| panic!("{pointer}"))).sum()
}

#[test]
fn a_thousand_frames_of_looking_and_of_fast_flight_do_nothing_to_the_scene() {
    let folder = folder_with_platforms();
    for scenario in ["look", "fly"] {
        let lines = fly(folder.path(), scenario, "1000", &[]);
        for zero in [
            "/queue_length",
            "/untidy_length",
            "/patches",
            "/upload_bytes",
            "/edits_applied",
            "/edits_deferred",
            "/rebuilds",
            "/writes/nodes",
            "/writes/leaves",
            "/writes/payload_words",
            "/writes/palette",
            "/frees/nodes",
            "/compaction/upload_bytes",
            "/compaction/finished",
            "/compaction/given_up",
        ] {
            assert_eq!(sum(&lines, zero), 0, "{scenario}: {zero}");
        }
        assert!(lines.iter().all(|line| line["revisions"] == lines[0]["revisions"]), "{scenario}: a revision changed");
        assert!(sum(&lines, "/rays/leaf_visits") > 0, "{scenario}: nothing was seen");
    }
}

#[test]
fn churn_stays_within_its_budget_and_what_is_resident_is_what_was_planned() {
    let folder = folder_with_platforms();
    let budget =
        ["--budget-ops", "24", "--budget-bytes", "200000", "--budget-ms", "1000", "--validate", "--half-extent", "300"];
    let pictures = ["--images", "frames", "--every", "50"];
    let lines = fly(folder.path(), "churn", "150", &[&budget[..], &pictures[..]].concat());
    assert!(sum(&lines, "/patches") > 900 && sum(&lines, "/edits_applied") > 400);
    for line in &lines {
        assert!(line["edits_applied"].as_u64() <= Some(24), "{line}");
        assert_eq!(line["revisions"]["mirror"], line["revisions"]["resident"]);
        // One operation of a voxel writes at most some tens of kilobytes.
        assert!(line["upload_bytes"].as_u64() < Some(300_000), "{line}");
        assert!(line["mutation_ms"].as_f64() <= line["frame_ms"].as_f64(), "{line}");
    }
    // The bursts do not fit into a frame, and are done before the next one.
    let deferred: Vec<u64> = lines.iter().filter_map(|line| line["edits_deferred"].as_u64()).collect();
    assert!(deferred[59] > 100 && deferred[58] == 0 && deferred[110] == 0, "{deferred:?}");
    let started: Vec<&str> = lines.iter().filter_map(|line| line["compaction"]["started"].as_str()).collect();
    assert_eq!(started, ["asked for by the scenario"]);
    let ended = sum(&lines[149..], "/compaction/finished") + sum(&lines[149..], "/compaction/given_up");
    let running = lines[149]["compaction"]["state"] != "idle";
    assert!(ended == 1 || running, "{}", lines[149]);
    for picture in ["frame-000050.png", "frame-000100.png", "frame-000150.png"] {
        assert!(folder.path().join("frames").join(picture).is_file(), "{picture}");
    }
    assert_eq!(std::fs::read_dir(folder.path().join("frames")).expect("folder").count(), 3);
}

#[test]
fn a_stream_brings_the_world_to_the_camera_and_takes_it_away_behind_it() {
    let folder = folder_with_platforms();
    let lines = fly(folder.path(), "stream", "120", &["--half-extent", "160", "--validate"]);
    assert!(sum(&lines, "/patches") > 50 && sum(&lines, "/edits_applied") > 5);
    assert!(sum(&lines[60..], "/rays/leaf_visits") > 0, "the ground about the camera has come");
    let leaves: Vec<u64> = lines.iter().filter_map(|line| line["leaves"].as_u64()).collect();
    assert!(leaves.iter().max() > Some(&0) && leaves.iter().all(|&n| n < 200), "{leaves:?}");
}

#[test]
fn wrong_options_are_refused() {
    let folder = folder_with_platforms();
    let fly = |more: &[&'static str]| [&["world", "fly", "w.orw", "--diagnostics", "d.jsonl"], more].concat();
    fail(folder.path(), &fly(&["--scenario", "dance"]), 2, &["dance"]);
    fail(folder.path(), &fly(&["--scenario", "look", "--every", "3"]), 2, &["--images"]);
    let stream = ["--scenario", "stream", "--half-extent", "1e7", "--frames", "1", "--backend", "cpu"];
    fail(folder.path(), &fly(&stream), 2, &["stream cells", "--half-extent"]);
    let onto = ["world", "fly", "w.orw", "--scenario", "look", "--diagnostics", "w.orw"];
    fail(folder.path(), &onto, 2, &["the world"]);
    assert!(!folder.path().join("d.jsonl").exists());
}
