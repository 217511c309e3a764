//! `orthant edit`.

mod common;

use common::{bytes, fail, folder_with_box, json, orthant, succeed};
use std::path::Path;

fn script(folder: &Path, lines: &[&str]) {
    std::fs::write(folder.join("ops.jsonl"), lines.join("\n")).expect("a script");
}

const EDITS: [&str; 9] = [
    r#"{"op": "add_node", "name": "group", "as": "g"}"#,
    r#"{"op": "add_shape", "shape": "sphere", "parent": "$g", "material": 0, "as": "ball"}"#,
    r#"{"op": "set_transform", "node": "$ball", "translation": [0, 1, 0], "scale": [0.2, 0.2, 0.2]}"#,
    r#"{"op": "duplicate", "node": "$g", "as": "h"}"#,
    r#"{"op": "reparent", "node": "$h", "parent": "$g", "keep_world": true}"#,
    r#"{"op": "set_material", "material": 0, "set": {"pbrMetallicRoughness": {"roughnessFactor": 0.25}}}"#,
    r#"{"op": "set_visible", "node": "$ball", "visible": false}"#,
    r#"{"op": "undo", "count": 2}"#,
    r#"{"op": "redo"}"#,
];

#[test]
fn a_script_edits_a_scene_and_every_operation_is_verified_and_reported() {
    let (_folder, path) = folder_with_box();
    script(&path, &EDITS);
    let args = [
        "edit",
        "box.glb",
        "--ops",
        "ops.jsonl",
        "-o",
        "new.glb",
        "--report",
        "r.jsonl",
        "--verify",
        "--backend",
        "cpu",
    ];
    succeed(&path, &args);
    let text = String::from_utf8(bytes(&path, "r.jsonl")).expect("UTF-8");
    let report: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(report.len(), EDITS.len());
    for entry in &report {
        for key in [
            "op",
            "edit_us",
            "sync_us",
            "dirty",
            "upload_bytes",
            "instances_written",
            "tlas",
            "blas_built",
            "blas_updated",
            "holes_closed",
            "render_nodes",
            "free_slots",
            "revision",
        ] {
            assert!(!entry[key].is_null(), "{key} in {entry}");
        }
        for key in ["render_nodes", "all", "materials", "lights", "primitives_changed"] {
            assert!(!entry["dirty"][key].is_null(), "{key} in {entry}");
        }
    }
    // An empty node is nowhere resident, a new shape builds its BLAS, a material is one row.
    assert_eq!((&report[0]["upload_bytes"], &report[0]["tlas"]), (&0.into(), &"none".into()));
    assert_eq!((&report[1]["blas_built"], &report[1]["tlas"]), (&1.into(), &"rebuild".into()));
    assert_eq!((&report[2]["instances_written"], &report[2]["tlas"]), (&1.into(), &"update".into()));
    assert_eq!((&report[5]["dirty"]["materials"], &report[5]["instances_written"]), (&1.into(), &0.into()));
    let info = json(&succeed(&path, &["info", "new.glb", "--json"]));
    let old = json(&succeed(&path, &["info", "box.glb", "--json"]));
    let grown = |key: &str| info[key].as_u64().expect(key) - old[key].as_u64().expect(key);
    assert_eq!((grown("nodes"), grown("meshes"), grown("materials"), grown("render_nodes")), (4, 1, 0, 2));
}

#[test]
fn holes_are_closed_between_operations_when_most_rows_are_holes() {
    let (_folder, path) = folder_with_box();
    let lines: Vec<String> = (0..20)
        .map(|i| format!(r#"{{"op": "add_shape", "shape": "cube", "as": "s{i}"}}"#))
        .chain((0..15).map(|i| format!(r#"{{"op": "delete", "node": "$s{i}"}}"#)))
        .chain([r#"{"op": "undo", "count": 15}"#.to_owned()])
        .collect();
    script(&path, &lines.iter().map(String::as_str).collect::<Vec<_>>());
    succeed(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "--report", "r.jsonl", "--verify", "--backend", "cpu"]);
    let text = String::from_utf8(bytes(&path, "r.jsonl")).expect("UTF-8");
    let report: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let number = |line: usize, key: &str| report[line][key].as_u64().expect(key);
    for line in 20..35 {
        let (rows, free) = (number(line, "render_nodes"), number(line, "free_slots"));
        assert!(free * 2 <= rows, "line {line}: {free} of {rows} are free");
        // Before, a row fewer was free than in the line before and this one together.
        assert_eq!(number(line, "holes_closed") > 0, number(line - 1, "free_slots") + 1 > free);
    }
    assert!(report.iter().any(|line| line["holes_closed"].as_u64() > Some(5)), "{text}");
    assert_eq!(number(35, "render_nodes") - number(35, "free_slots"), number(19, "render_nodes"));
}

#[test]
fn undoing_everything_writes_the_bytes_that_no_edit_writes() {
    let (_folder, path) = folder_with_box();
    script(&path, &[]);
    succeed(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "-o", "same.glb"]);
    let undo = r#"{"op": "undo", "count": 6}"#;
    script(&path, &[&EDITS, &[undo][..]].concat());
    succeed(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "-o", "undone.glb", "--verify"]);
    assert!(bytes(&path, "same.glb") == bytes(&path, "undone.glb"));
}

#[test]
fn a_refused_operation_names_its_line_and_writes_nothing() {
    let (_folder, path) = folder_with_box();
    script(&path, &[EDITS[0], "", r#"{"op": "delete", "node": 9999}"#, EDITS[1]]);
    let args = ["edit", "box.glb", "--ops", "ops.jsonl", "-o", "new.glb"];
    fail(&path, &args, 3, &["ops.jsonl: line 3: /node: there is no node 9999"]);
    assert!(!path.join("new.glb").exists());
    let going = orthant(&path, &[&args[..], &["--keep-going"]].concat());
    assert_eq!(going.status.code(), Some(0));
    let said = String::from_utf8_lossy(&going.stderr).into_owned();
    assert!(said.contains("line 3") && said.contains("1 operations were refused"), "{said}");
    assert!(path.join("new.glb").exists());
}

#[test]
fn wrong_usage_and_missing_parts_have_their_codes() {
    let (_folder, path) = folder_with_box();
    script(&path, &[r#"{"op": "set_time", "seconds": 1}"#]);
    fail(&path, &["edit", "box.glb", "--ops", "ops.jsonl"], 3, &["line 1", "/seconds", "no animation"]);
    fail(&path, &["edit", "box.glb", "--ops", "none.jsonl"], 3, &["none.jsonl"]);
    fail(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "-o", "x.png"], 2, &["x.png"]);
    fail(&path, &["edit", "box.glb"], 2, &["--ops"]);
    script(&path, &["{\"op\": \"delete\""]);
    fail(&path, &["edit", "box.glb", "--ops", "ops.jsonl"], 3, &["ops.jsonl: line 1"]);
}

#[test]
fn another_file_is_merged_from_beside_the_script() {
    let (_folder, path) = folder_with_box();
    succeed(&path, &["generate", "forest", "--trees", "3", "-o", "forest.glb"]);
    script(
        &path,
        &[
            r#"{"op": "merge_scene", "path": "forest.glb", "as": "f"}"#,
            r#"{"op": "set_transform", "node": "$f", "scale": [0.1, 0.1, 0.1]}"#,
        ],
    );
    succeed(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "-o", "both.glb", "--verify", "--backend", "cpu"]);
    let count =
        |file: &str| json(&succeed(&path, &["info", file, "--json"]))["render_nodes"].as_u64().expect("a count");
    assert_eq!(count("both.glb"), count("box.glb") + count("forest.glb"));
}

/// A triangle whose index 7 leads past its three vertices.
const BROKEN: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]},
        {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 3}],
    "buffers": [{"byteLength": 40,
        "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAEHAA=="}]}"#;

#[test]
fn geometry_that_cannot_be_decoded_refuses_the_operation_and_the_rest_goes_on() {
    let (_folder, path) = folder_with_box();
    std::fs::write(path.join("broken.gltf"), BROKEN).expect("a file");
    let merge = r#"{"op": "merge_scene", "path": "broken.gltf", "as": "g"}"#;
    script(&path, &[merge]);
    fail(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "-o", "new.glb"], 3, &["ops.jsonl: line 1"]);
    assert!(!path.join("new.glb").exists());
    // The others lead to what they lead to without it, and what it made cannot be redone.
    let args = |output| {
        ["edit", "box.glb", "--ops", "ops.jsonl", "-o", output, "--verify", "--backend", "cpu", "--keep-going"]
    };
    script(&path, &[EDITS[0], EDITS[1], EDITS[2], EDITS[3], merge, r#"{"op": "redo"}"#]);
    let output = orthant(&path, &args("with.glb"));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("2 operations were refused"), "{said}");
    script(&path, &EDITS[..4]);
    succeed(&path, &args("without.glb"));
    assert!(bytes(&path, "with.glb") == bytes(&path, "without.glb"));
}

#[test]
fn what_an_edit_brings_that_is_not_shown_is_said_once() {
    let (_folder, path) = folder_with_box();
    let points = r#"{"asset": {"version": "2.0", "copyright": "(c) somebody"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": "nowhere.png"}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]}]}"#;
    std::fs::write(path.join("points.gltf"), points).expect("a file");
    let merge = r#"{"op": "merge_scene", "path": "points.gltf"}"#;
    script(&path, &[merge, r#"{"op": "undo"}"#, r#"{"op": "redo"}"#, merge]);
    let output = orthant(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "-o", "new.glb", "--verify"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{said}");
    for words in ["1 primitives have no triangles", "copyright"] {
        assert_eq!(said.matches(words).count(), 1, "{words}: {said}");
    }
    let quiet = orthant(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "-o", "new.glb", "--quiet"]);
    assert!(quiet.stderr.is_empty() && quiet.status.success());
}

#[test]
fn a_merged_file_that_claims_more_than_the_limit_is_refused() {
    let (_folder, path) = folder_with_box();
    // A thousand million vertices, in a file of a few hundred bytes: without a view they are zeros.
    let bomb = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "count": 999999999, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]}]}"#;
    std::fs::write(path.join("bomb.gltf"), bomb).expect("a file");
    script(&path, &[r#"{"op": "merge_scene", "path": "bomb.gltf"}"#, EDITS[0]]);
    let args = ["edit", "box.glb", "--ops", "ops.jsonl", "-o", "new.glb", "--max-memory", "64MiB"];
    fail(&path, &args, 3, &["ops.jsonl: line 1"]);
    assert!(!path.join("new.glb").exists());
    // Without it the rest goes on as if it had not been there.
    let going = orthant(&path, &[&args[..], &["--keep-going", "--verify"]].concat());
    assert_eq!(going.status.code(), Some(0), "{}", String::from_utf8_lossy(&going.stderr));
    script(&path, &[EDITS[0]]);
    succeed(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "-o", "without.glb"]);
    assert!(bytes(&path, "new.glb") == bytes(&path, "without.glb"));
}

#[test]
fn a_scene_that_is_moved_far_away_and_back_is_what_a_derivation_about_its_origin_is() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    succeed(f, &["generate", "instances", "--count", "4", "-o", "s.glb"]);
    let script: String = [[1e7, 0.0, 0.0], [1e6, 1e6, 0.0], [0.0, 0.0, 0.0]]
        .iter()
        .map(|[x, y, z]| format!("{{\"op\":\"set_transform\",\"node\":0,\"translation\":[{x},{y},{z}]}}\n"))
        .collect();
    std::fs::write(f.join("ops.jsonl"), script).expect("the script");
    succeed(f, &["edit", "s.glb", "--ops", "ops.jsonl", "--verify", "--backend", "cpu"]);
}

#[test]
fn what_is_merged_can_be_shown_also_where_nothing_shows_it_yet() {
    let (_folder, path) = folder_with_box();
    // The broken triangle, which no node shows.
    std::fs::write(path.join("broken.gltf"), BROKEN.replace(r#""nodes": [{"mesh": 0}]"#, r#""nodes": [{}]"#))
        .expect("a file");
    let before = succeed(&path, &["info", "box.glb", "--json"]);
    script(&path, &[r#"{"op": "merge_scene", "path": "broken.gltf"}"#]);
    for verify in [&[][..], &["--verify", "--backend", "cpu"]] {
        let edit = [&["edit", "box.glb", "--ops", "ops.jsonl", "-o", "out.glb"], verify].concat();
        fail(&path, &edit, 3, &["ops.jsonl: line 1", "vertex index 7 is out of range"]);
    }
    script(
        &path,
        &[
            r#"{"op": "merge_scene", "path": "broken.gltf"}"#,
            r#"{"op": "rename", "node": 0, "name": "renamed"}"#,
            r#"{"op": "merge_scene", "path": "broken.gltf"}"#,
        ],
    );
    let edit =
        ["edit", "box.glb", "--ops", "ops.jsonl", "-o", "out.glb", "--keep-going", "--verify", "--backend", "cpu"];
    succeed(&path, &edit);
    let bounds = |text: &str| json(text)["bounds"].clone();
    assert_eq!(bounds(&succeed(&path, &["info", "out.glb", "--json"])), bounds(&before));
}

#[test]
fn a_byte_order_mark_alone_is_no_operation() {
    let (_folder, path) = folder_with_box();
    std::fs::write(path.join("ops.jsonl"), "\u{feff}\n\n{\"op\": \"rename\", \"node\": 0, \"name\": \"x\"}\r\n")
        .expect("a script");
    succeed(&path, &["edit", "box.glb", "--ops", "ops.jsonl"]);
}
