//! `orthant edit --backend vulkan`: the program follows scripts on a device, and a difference is found.

use crate::{device, program};
use orthant::failure::Exit;
use orthant::job::backend::AnyBackend;
use orthant::live::Live;
use orthant_render::DeriveOptions;
use orthant_scene::edit::script::{Operation, Session};
use orthant_scene::import::{ImportOptions, import_path};
use program::{folder_with_box, json, orthant, succeed};
use std::path::Path;

fn script(folder: &Path, lines: &[&str]) {
    std::fs::write(folder.join("ops.jsonl"), lines.join("\n")).expect("a script");
}

#[test]
fn a_script_is_followed_on_the_device_and_verified() {
    if device().is_none() {
        return;
    }
    let (_folder, path) = folder_with_box();
    let lines = [
        r#"{"op": "add_node", "name": "group", "as": "g"}"#,
        r#"{"op": "add_shape", "shape": "sphere", "parent": "$g", "material": 0, "as": "ball"}"#,
        r#"{"op": "set_transform", "node": "$ball", "translation": [0, 1, 0], "scale": [0.2, 0.2, 0.2]}"#,
        r#"{"op": "set_material", "material": 0, "set": {"emissiveFactor": [1, 1, 1]}}"#,
        r#"{"op": "delete", "node": "$ball"}"#,
        r#"{"op": "undo", "count": 3}"#,
    ];
    script(&path, &lines);
    let args = ["edit", "box.glb", "--ops", "ops.jsonl", "--verify", "--backend", "vulkan", "--device", "1"];
    let report = succeed(&path, &args);
    let ops: Vec<_> = report.lines().map(|line| json(line)["op"].clone()).collect();
    assert_eq!(ops, ["add_node", "add_shape", "set_transform", "set_material", "delete", "undo"]);
    // The same rows cross, whatever follows.
    let dirty = |text: &str| text.lines().map(|line| json(line)["upload_bytes"].clone()).collect::<Vec<_>>();
    let on_cpu = succeed(&path, &["edit", "box.glb", "--ops", "ops.jsonl", "--backend", "cpu"]);
    assert_eq!(dirty(&report), dirty(&on_cpu));
}

#[test]
fn a_time_of_an_animation_is_followed_on_the_device() {
    if device().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    succeed(path, &["generate", "animated-crowd", "--count", "2", "-o", "crowd.glb"]);
    let times = [
        r#"{"op": "set_time", "seconds": 0.3}"#,
        r#"{"op": "set_transform", "node": 1, "translation": [0, 0.5, 0]}"#,
        r#"{"op": "set_time", "seconds": 0.7, "animation": 0}"#,
        r#"{"op": "set_time", "seconds": 0, "animation": null}"#,
    ];
    script(path, &times);
    let args = ["edit", "crowd.glb", "--ops", "ops.jsonl", "--verify", "--backend", "vulkan"];
    let output = orthant(path, &args);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let report = String::from_utf8(output.stdout).expect("UTF-8");
    let updated: Vec<_> = report.lines().map(|line| json(line)["blas_updated"].as_u64() > Some(0)).collect();
    assert_eq!(updated, [true, false, true, true]);
}

#[test]
fn what_the_device_has_and_the_scene_does_not_is_found() {
    let Some(vulkan) = device() else { return };
    let (_folder, path) = folder_with_box();
    let scene = import_path(&path.join("box.glb"), &ImportOptions::default()).expect("a scene").scene;
    let session = Session::new(&path, ImportOptions::default());
    let backend = Some(AnyBackend::Vulkan(Box::new(vulkan)));
    let mut live = Live::new(scene, session, DeriveOptions::default(), backend).expect("it can be derived");
    let hits = live.check(3).expect("it is what was loaded");
    assert!(hits > 100, "{hits} pixels show something");
    live.finish().expect("it is what was loaded");
    // As if a batch had left a row out.
    let was = live.derived.render_nodes[1].world.rows[0][3];
    live.derived.render_nodes[1].world.rows[0][3] += 0.5;
    let failure = live.finish().expect_err("a row is another");
    assert!(failure.exit == Exit::Internal && failure.what.contains("row 1 of render_nodes: world"), "{failure}");
    live.derived.render_nodes[1].world.rows[0][3] = was;
    let operation = r#"{"op": "set_visible", "node": 1, "visible": false}"#;
    live.edit(&Operation::parse(operation).expect("an operation")).expect("it can be done");
    live.follow().expect("the device follows");
    live.check(4).expect("what is left is what is derived");
}
