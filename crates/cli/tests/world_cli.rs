//! Worlds on the command line: made, counted, changed, converted, refused.

mod common;

use common::{bytes, fail, json, orthant, succeed};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A folder with `flat.orw` (ground within 32 units of the origin), `platforms.orw` and `terrain.orw`.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().to_owned();
    for (name, half) in [("flat", "32"), ("platforms", "352"), ("terrain", "32")] {
        let file = format!("{name}.orw");
        succeed(&path, &["world", "new", "--generator", name, "--seed", "5", "--half-extent", half, "-o", &file]);
    }
    (folder, path)
}

fn info(folder: &Path, file: &str) -> Value {
    json(&succeed(folder, &["world", "info", file, "--json"]))
}

fn lines(folder: &Path, file: &str) -> Vec<Value> {
    String::from_utf8(bytes(folder, file)).expect("UTF-8").lines().map(json).collect()
}

#[test]
fn a_generated_world_is_counted_by_hand() {
    let (_guard, f) = folder();
    let flat = info(&f, "flat.orw");
    assert_eq!(flat["format"], "orw");
    assert_eq!((&flat["regions"], &flat["dense_chunks"]), (&json!(1), &json!(0)));
    assert_eq!(flat["leaves"], json!({ "uniform": 1, "chunk_array": 0, "tetra": 0 }));
    assert_eq!(flat["blocks"], json!(64_u64 * 8 * 64 * 64));
    assert_eq!(flat["bounds"], json!({ "min": [-32, -8, -32, -32], "max": [32, 0, 32, 32] }));
    assert_eq!(flat["dimensions"], 4);
    assert_eq!(flat["bytes"]["file"], bytes(&f, "flat.orw").len());
    let terrain = info(&f, "terrain.orw");
    assert_eq!((&terrain["dimensions"], &terrain["bounds"]["max"][3]), (&json!(3), &json!(1)));
    assert!(terrain["dense_chunks"].as_u64() > Some(0));
    assert_eq!(json(&succeed(&f, &["info", "terrain.orw", "--json"])), terrain);
    succeed(&f, &["world", "new", "--generator", "empty", "-o", "empty.orw"]);
    let empty = info(&f, "empty.orw");
    assert_eq!((&empty["blocks"], &empty["bounds"]), (&json!(0), &Value::Null));
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_another_world() {
    let (_guard, f) = folder();
    for (name, half) in [("platforms", "352"), ("terrain", "32")] {
        let new = |seed: &str| {
            let args = ["world", "new", "--generator", name, "--half-extent", half, "-o", "n.orw", "--seed", seed];
            succeed(&f, &args);
            bytes(&f, "n.orw")
        };
        assert_eq!(new("5"), bytes(&f, &format!("{name}.orw")));
        assert_ne!(new("6"), bytes(&f, &format!("{name}.orw")));
    }
}

#[test]
fn patches_change_a_world_and_taking_them_back_restores_its_bytes() {
    let (_guard, f) = folder();
    std::fs::write(
        f.join("there.jsonl"),
        "\u{feff}{\"set\": [3, -1, 4, 5], \"block\": \"air\"}\n\n{\"set\": [6, -1, 4, 5], \"block\": \"ground\"}\n\
         {\"fill\": {\"min\": [0, 0, 0, 0], \"max\": [2, 3, 4, \"0.5\"]}, \"scale\": -1, \"block\": 1}\n",
    )
    .expect("script");
    let apply = |patches: &str, from: &str, to: &str| {
        let args = ["world", "apply", from, "--patches", patches, "-o", to, "--report", "r.jsonl", "--verify"];
        succeed(&f, &args);
        lines(&f, "r.jsonl")
    };
    let report = apply("there.jsonl", "flat.orw", "there.orw");
    assert_eq!(report.len(), 3);
    // The hole: two slabs along x, z and w (the chunk is as high as the ground), and the chunk; and the writes of W3.
    let (hole, nothing) = (&report[0], &report[1]);
    assert_eq!((&hole["op"], &hole["changed"], &hole["batches"]), (&json!("set"), &json!(1), &json!(1)));
    assert_eq!((&hole["leaves"], &hole["leaves_removed"]), (&json!(7), &json!(1)));
    let number = |entry: &Value, key: &str| entry[key].as_u64().unwrap_or_else(|| panic!("{key} in {entry}"));
    let changed = number(hole, "leaves_added") + number(hole, "leaves_removed") + number(hole, "leaves_changed");
    assert!(number(hole, "node_writes") <= changed * (4 * number(hole, "depth") + 32), "{hole}");
    for key in ["node_writes", "leaf_writes", "payload_writes", "palette_writes", "freed_nodes", "freed_leaves"] {
        assert_eq!(nothing[key], 0, "what is there already writes no {key}");
    }
    assert_eq!((&nothing["expected_revision"], &nothing["upload_bytes"]), (&nothing["new_revision"], &json!(0)));
    // Boxes of half a unit: 4 x 6 x 8 x 1.
    let counted = info(&f, "there.orw");
    assert_eq!(counted["blocks"], json!(64 * 8 * 64 * 64 - 1 + 4 * 6 * 8));

    std::fs::write(
        f.join("back.jsonl"),
        "{\"set\": [3, -1, 4, 5], \"block\": \"ground\"}\n{\"fill\": {\"min\": [0, 0, 0, 0], \"max\": [2, 3, 4, 1]}, \"block\": \"air\"}\n",
    )
    .expect("script");
    let report = apply("back.jsonl", "there.orw", "back.orw");
    assert_eq!(report[0]["freed_payload_spans"], 1);
    assert_eq!((&report[1]["leaves"], info(&f, "back.orw")["regions"].clone()), (&json!(1), json!(1)));
    assert_eq!(bytes(&f, "back.orw"), bytes(&f, "flat.orw"));
    // The world may be written onto itself.
    succeed(&f, &["world", "apply", "there.orw", "--patches", "back.jsonl", "-o", "there.orw"]);
    assert_eq!(bytes(&f, "there.orw"), bytes(&f, "flat.orw"));
}

#[test]
fn balls_patches_and_generators_are_followed_to_the_last_leaf() {
    let (_guard, f) = folder();
    let script = [
        r#"{"sphere": {"center": [0, -2, 0, 0.5], "radius": 9.5}, "block": "air"}"#,
        r#"{"sphere": {"center": [4, 6, 0, 0], "radius": 3}, "scale": -1, "block": {"id": 1, "orientation": 5, "scale": -1}}"#,
        r#"{"patch": {"authoritative_bounds": {"min": [-9, 0, -9, 0], "max": [9, 9, 9, 1]}, "subtree": {"branch": [
            {"bounds": {"min": [-9, 0, -9, 0], "max": [0, 2, 0, 1]}, "uniform": 7}]},
            "palette": [{"id": 7, "material": {"name": "glass", "color": [0.9, 0.9, 1], "transparency": {"absorption": [1, 0.5, 0.1]}}}]}}"#,
        r#"{"patch": {"authoritative_bounds": {"min": [-40, -40, -40, 0], "max": [-8, 40, 40, 1]},
            "subtree": {"procedural": {"generator": "terrain", "seed": 3}}}}"#,
        r#"{"fill": {"min": [-1000000, -7, -1000000, -1000000], "max": [1000000, -6, 1000000, 1000000]}, "block": 1}"#,
    ];
    let text: String = script.iter().map(|line| line.replace('\n', " ") + "\n").collect();
    std::fs::write(f.join("s.jsonl"), text).expect("script");
    for world in ["flat.orw", "platforms.orw", "terrain.orw"] {
        succeed(
            &f,
            &["world", "apply", world, "--patches", "s.jsonl", "-o", "o.orw", "--report", "r.jsonl", "--verify"],
        );
        let (report, counted) = (lines(&f, "r.jsonl"), info(&f, "o.orw"));
        assert_eq!(report.len(), script.len());
        assert_eq!(report[2]["materials"], 1, "{world}: glass");
        let of_terrain = report[3]["palette_writes"].as_u64();
        assert_eq!(of_terrain >= Some(5), world != "terrain.orw", "{world}: the materials of terrain come once");
        assert_eq!(report[4]["leaves"], counted["regions"], "{world}: a leaf for every region in the end");
        assert!(counted["materials"].as_array().expect("a list").contains(&json!("glass")));
    }
}

#[test]
fn a_bad_line_is_named_with_its_fault_and_nothing_is_written() {
    let (_guard, f) = folder();
    let cases: [(&str, &[&str]); 15] = [
        ("hello", &["no JSON object"]),
        (r#"{"set": [0,0,0,0], "block": 1"#, &["column", "no JSON"]),
        (r#"{"set": [0,0,0,0]}"#, &["no \"block\""]),
        (r#"{"set": [0,0,0], "block": 1}"#, &["length 3"]),
        (r#"{"set": [0,0,0,0], "block": "moon"}"#, &["moon", "add the material"]),
        (r#"{"set": [0,0,0,0], "block": 70000}"#, &["70000", "65535"]),
        (r#"{"set": [0,0,0,0], "block": 1, "scale": 16}"#, &["-16 to 15"]),
        (r#"{"set": [0,0,0,0], "block": 1, "size": 1}"#, &["size"]),
        (r#"{"set": [9223372036854775807,0,0,0], "block": 1}"#, &["beyond the space"]),
        (r#"{"fill": {"min": [0,0,0,0], "max": [1,0,1,1]}, "block": 1}"#, &["axis y", "min < max"]),
        (r#"{"fill": {"min": [0.1,0,0,0], "max": [1,1,1,1]}, "block": 1}"#, &["1/65536"]),
        (r#"{"sphere": {"center": [0,0,0,0], "radius": 0}, "block": 1}"#, &["radius"]),
        (r#"{"sphere": {"center": [0,0,0,0], "radius": 1000000}, "block": 1}"#, &["coarser scale"]),
        (
            r#"{"patch": {"authoritative_bounds": {"min": [0,0,0,0], "max": [1,1,1,1]}, "subtree": {"solid": 1}}}"#,
            &["solid"],
        ),
        (
            r#"{"patch": {"authoritative_bounds": {"min": [-1e9,-1e9,-1e9,-1e9], "max": [1e9,1e9,1e9,1e9]},
               "subtree": {"procedural": {"generator": "platforms"}}}}"#,
            &["regions", "split"],
        ),
    ];
    let good = r#"{"set": [1, -1, 1, 1], "block": "air"}"#;
    for (bad, words) in cases {
        let bad = bad.replace('\n', " ");
        std::fs::write(f.join("bad.jsonl"), format!("{good}\n\n{bad}\n{good}\n")).expect("script");
        let args = ["world", "apply", "flat.orw", "--patches", "bad.jsonl", "-o", "out.orw", "--report", "r.jsonl"];
        fail(&f, &args, 3, &[&["bad.jsonl", "line 3", "nothing is written"], words].concat());
        assert!(!f.join("out.orw").exists() && !f.join("r.jsonl").exists(), "{bad}");
        succeed(&f, &[&args[..], &["--keep-going", "--verify", "--quiet"]].concat());
        let report = lines(&f, "r.jsonl");
        assert_eq!((report.len(), &report[1]["line"]), (3, &json!(3)), "{bad}");
        assert!(report[1]["refused"].as_str().is_some_and(|why| why.contains(words[0])), "{}", report[1]);
        assert_eq!(info(&f, "out.orw")["blocks"], json!(64 * 8 * 64 * 64 - 1), "a refused patch leaves nothing behind");
        std::fs::remove_file(f.join("out.orw")).expect("written");
        std::fs::remove_file(f.join("r.jsonl")).expect("written");
    }
}

#[test]
fn a_damaged_world_is_an_error_with_its_offset_and_what_is_intact_can_be_had() {
    let (_guard, f) = folder();
    let whole = bytes(&f, "terrain.orw");
    std::fs::write(f.join("cut.orw"), &whole[..whole.len() - 20]).expect("write");
    for command in [
        &["info", "cut.orw"][..],
        &["render", "cut.orw", "-o", "x.png"],
        &["convert", "cut.orw", "x.orw"],
        &["world", "apply", "cut.orw", "--patches", "none.jsonl", "-o", "x.orw"],
    ] {
        fail(&f, command, 3, &["cut.orw", "byte", "--salvage"]);
    }
    let output = orthant(&f, &["convert", "cut.orw", "mended.orw", "--salvage"]);
    assert!(output.status.success() && String::from_utf8_lossy(&output.stderr).contains("warning: cut.orw: byte"));
    assert_eq!(bytes(&f, "mended.orw"), whole, "only the last section was hurt, which holds a count");
    fail(&f, &["info", "terrain.orw", "--max-memory", "10KiB"], 3, &["terrain.orw", "raise --max-memory"]);
}

#[test]
fn what_is_no_world_is_refused_by_its_content() {
    let (_guard, f) = folder();
    succeed(&f, &["generate", "cornell", "-o", "box.glb"]);
    for (from, to, words) in [
        ("box.glb", "a.orw", ["a.orw", "byte 0"]),
        ("terrain.orw", "a.vox", ["a.vox", "MagicaVoxel"]),
        ("box.glb", "a.schem", ["a.schem", "byte"]),
        ("terrain.orw", "a.litematic", ["a.litematic", "byte"]),
        ("terrain.orw", "a.schematic", ["a.schematic", "byte"]),
    ] {
        std::fs::copy(f.join(from), f.join(to)).expect("copied");
        fail(&f, &["info", to], 3, &words);
        fail(&f, &["convert", to, "x.orw"], 3, &words);
    }
    std::fs::create_dir(f.join("dir.orw")).expect("a folder");
    fail(&f, &["info", "dir.orw"], 3, &["dir.orw", "folder"]);
    fail(&f, &["info", "none.orw"], 3, &["none.orw"]);
    fail(&f, &["convert", "terrain.orw", "x.glb"], 2, &["x.glb", ".orw", "--world"]);
    fail(&f, &["convert", "box.glb", "x.orw"], 2, &["x.orw", "world"]);
    fail(&f, &["info", "terrain.orw", "--mesh-descs"], 2, &["--mesh-descs"]);
    fail(&f, &["info", "box.glb", "--salvage"], 2, &["--salvage"]);
}

#[test]
fn outputs_of_worlds_are_checked_first() {
    let (_guard, f) = folder();
    std::fs::write(f.join("s.jsonl"), "").expect("script");
    std::fs::write(f.join("s.orw"), "").expect("script");
    let apply = |rest: &[&str], words: &[&str]| {
        fail(&f, &[&["world", "apply", "flat.orw", "--patches"], rest].concat(), 2, words);
    };
    apply(&["s.jsonl", "-o", "x.glb"], &["x.glb", ".orw"]);
    apply(&["s.orw", "-o", "s.orw"], &["s.orw", "--patches"]);
    apply(&["s.jsonl", "-o", "x.orw", "--report", "flat.orw"], &["--report", "the world"]);
    apply(&["s.jsonl", "-o", "x.orw", "--report", "x.orw"], &["--report", "-o"]);
    apply(&["s.jsonl", "-o", "none/x.orw"], &["none"]);
    for (rest, word) in
        [(["--generator", "moon", "-o", "x.orw"], "platforms"), (["--generator", "flat", "-o", "x.png"], ".orw")]
    {
        fail(&f, &[&["world", "new"], &rest[..]].concat(), 2, &[word]);
    }
    for half in ["0", "-3", "nan", "1e300", "0.1"] {
        fail(&f, &["world", "new", "--generator", "flat", "-o", "x.orw", "--half-extent", half], 2, &["--half-extent"]);
    }
    for name in ["terrain", "platforms"] {
        let args =
            ["world", "new", "--generator", name, "-o", "x.orw", "--half-extent", "30000000", "--max-memory", "50MiB"];
        fail(&f, &args, 2, &["--half-extent", "--max-memory"]);
    }
    assert!(!f.join("x.orw").exists());
}

/// The shared voxel files: models of one piece have as many blocks as their inventory counts.
#[test]
fn voxel_files_of_other_programs_become_worlds() {
    let Some(assets) = std::env::var_os("ORTHANT_ASSETS").map(PathBuf::from) else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    let counts = [
        ("vox/mini-mikes-metro-minis/scene_house6.vox", 207_466),
        ("vox/mini-mikes-metro-minis/veh_truck1.vox", 4272),
        ("vox/opengametools/chr_knight.vox", 398),
        ("vox/vengi-tests/splitobjects.vox", 17_208),
        ("minecraft/prismarine/smallhouse1.schem", 3201),
        ("minecraft/vengi/test.litematic", 11_722),
    ];
    for (name, blocks) in counts {
        let path = assets.join(name);
        let path = path.to_str().expect("UTF-8");
        let read = json(&succeed(f, &["info", path, "--json", "--quiet"]));
        assert_eq!((&read["blocks"], &read["dimensions"]), (&json!(blocks), &json!(3)), "{name}");
        assert_eq!(read["format"].as_str(), path.rsplit('.').next(), "{name}");
        succeed(f, &["convert", path, "out.orw", "--quiet"]);
        let written = info(f, "out.orw");
        for key in ["blocks", "regions", "leaves", "bounds", "materials"] {
            assert_eq!(written[key], read[key], "{name}: {key}");
        }
        succeed(f, &["convert", "out.orw", "again.orw"]);
        assert_eq!(bytes(f, "again.orw"), bytes(f, "out.orw"), "{name}");
    }
}
