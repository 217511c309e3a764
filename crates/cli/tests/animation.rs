//! Playing animations: `set_time`, `--time` and `--animation`.

mod common;

use common::{bytes, fail, orthant, succeed};
use std::path::{Path, PathBuf};

/// A folder with a crowd of two, `crowd.glb`.
fn folder_with_crowd() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("folder");
    succeed(folder.path(), &["generate", "animated-crowd", "--count", "2", "-o", "crowd.glb"]);
    let path = folder.path().to_owned();
    (folder, path)
}

fn script(folder: &Path, lines: &[&str]) {
    std::fs::write(folder.join("ops.jsonl"), lines.join("\n")).expect("a script");
}

#[test]
fn setting_the_time_follows_at_every_operation_and_is_not_saved() {
    let (_folder, path) = folder_with_crowd();
    let lines = [
        r#"{"op": "set_time", "seconds": 0.4}"#,
        r#"{"op": "duplicate", "node": 1}"#,
        r#"{"op": "set_time", "seconds": 0.7, "animation": 0}"#,
        r#"{"op": "delete", "node": 1}"#,
        r#"{"op": "undo", "count": 2}"#,
        r#"{"op": "set_time", "seconds": 0, "animation": null}"#,
        r#"{"op": "set_time", "seconds": 0.9}"#,
    ];
    script(&path, &lines);
    let args = ["edit", "crowd.glb", "--ops", "ops.jsonl", "-o", "played.glb", "--report", "r.jsonl"];
    succeed(&path, &[&args[..], &["--verify", "--backend", "cpu"]].concat());
    let text = String::from_utf8(bytes(&path, "r.jsonl")).expect("UTF-8");
    let report: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(report.len(), lines.len());
    assert_eq!((&report[0]["op"], &report[0]["tlas"]), (&"set_time".into(), &"update".into()));
    assert!(report[0]["blas_updated"].as_u64() >= Some(2), "two figures are deformed: {}", report[0]);
    script(&path, &[]);
    succeed(&path, &["edit", "crowd.glb", "--ops", "ops.jsonl", "-o", "rest.glb"]);
    assert!(bytes(&path, "played.glb") == bytes(&path, "rest.glb"), "the rest pose is saved");
}

#[test]
fn an_animation_that_is_not_there_is_refused_where_it_is_named() {
    let (_folder, path) = folder_with_crowd();
    script(&path, &[r#"{"op": "set_time", "seconds": 1, "animation": "name:swim"}"#]);
    fail(&path, &["edit", "crowd.glb", "--ops", "ops.jsonl"], 3, &["line 1", "/animation", "swim"]);
    let small = ["render", "crowd.glb", "-o", "a.png", "--size", "8x8", "--spp", "1"];
    fail(&path, &[&small[..], &["--animation", "swim"]].concat(), 2, &["--animation swim", "only 0"]);
    fail(&path, &[&small[..], &["--animation", "7"]].concat(), 2, &["--animation 7"]);
}

#[test]
fn a_time_is_rendered_as_such() {
    let (_folder, path) = folder_with_crowd();
    let render = |name: &str, rest: &[&str]| {
        let eye = ["--eye", "0,2,6", "--target", "0,1,0", "--env", "sky"];
        let args = ["render", "crowd.glb", "-o", name, "--size", "48x32", "--spp", "4"];
        succeed(&path, &[&args[..], &eye, rest].concat());
        bytes(&path, name)
    };
    let rest = render("rest.png", &[]);
    let walking = render("a.png", &["--time", "0.4"]);
    assert!(rest != walking);
    assert!(walking == render("b.png", &["--time", "0.4", "--animation", "0"]), "the first animation is the default");
    assert!(
        render("c.png", &["--animation", "0"]) == render("d.png", &["--time", "0"]),
        "an animation without a time begins"
    );
    assert!(walking != render("e.png", &["--time", "0.9"]));
    // Shares of different times are of different pictures.
    for (name, time) in [("l.share", "0.4"), ("r.share", "0.9")] {
        let tile = if name == "l.share" { "0,0,24,32" } else { "24,0,24,32" };
        render(name, &["--time", time, "--tile", tile]);
    }
    let merged = orthant(&path, &["merge", "l.share", "r.share", "-o", "m.png"]);
    assert_ne!(merged.status.code(), Some(0));
}
