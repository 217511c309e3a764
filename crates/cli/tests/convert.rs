//! `orthant convert`: what it writes, what it says, and that a killed run leaves the old scene or the new one.

mod common;

use common::{bytes, fail, folder_with_box, succeed};
use orthant_scene::Scene;
use orthant_scene::import::{ImportOptions, import_path};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn scene(folder: &Path, name: &str) -> Scene {
    import_path(&folder.join(name), &ImportOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

#[test]
fn a_scene_goes_through_both_formats_and_stays_the_same() {
    let (_guard, f) = folder_with_box();
    assert_eq!(succeed(&f, &["convert", "box.glb", "out.gltf"]), "");
    assert_eq!(succeed(&f, &["convert", "out.gltf", "again.glb"]), "");
    let original = scene(&f, "box.glb");
    original.same_document(&scene(&f, "out.gltf")).unwrap_or_else(|e| panic!("{e}"));
    original.same_document(&scene(&f, "again.glb")).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn a_file_may_be_converted_onto_itself() {
    let (_guard, f) = folder_with_box();
    let original = scene(&f, "box.glb");
    succeed(&f, &["convert", "box.glb", "box.glb"]);
    let first = bytes(&f, "box.glb");
    original.same_document(&scene(&f, "box.glb")).unwrap_or_else(|e| panic!("{e}"));
    succeed(&f, &["convert", "box.glb", "box.glb"]);
    assert_eq!(bytes(&f, "box.glb"), first, "a second time changes nothing");
}

#[test]
fn what_the_target_does_not_hold_is_said_on_stdout() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    let document = r#"{"asset":{"version":"2.0"},"images":[{"uri":"none.png"},{"uri":"a%20b.png"}]}"#;
    std::fs::write(f.join("in.gltf"), document).expect("write");
    std::fs::write(f.join("a b.png"), b"\x89PNG").expect("write");
    let said = succeed(f, &["convert", "in.gltf", "out.glb", "--images", "embed"]);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.starts_with("/images/0: "), "{said}");
    std::fs::remove_file(f.join("a b.png")).expect("removed");
    let image = scene(f, "out.glb").images().iter().nth(1).and_then(|(_, i)| i.data.clone()).expect("embedded");
    assert_eq!(image.as_slice(), b"\x89PNG");
}

#[test]
fn wrong_usage_and_bad_input_have_their_codes() {
    let (_guard, f) = folder_with_box();
    fail(&f, &["convert", "box.glb", "out.png"], 2, &["out.png", ".gltf"]);
    fail(&f, &["convert", "box.glb"], 2, &["OUT"]);
    fail(&f, &["convert", "none.glb", "out.glb"], 3, &["none.glb", "does not exist"]);
    std::fs::write(f.join("bad.gltf"), r#"{"asset":{"version":"2.0"},"scene":3}"#).expect("write");
    fail(&f, &["convert", "bad.gltf", "out.glb"], 3, &["bad.gltf", "/scene"]);
    fail(&f, &["convert", "box.glb", "no/such/folder/out.glb"], 3, &["no/such/folder/out.glb", "check the path"]);
    assert!(!f.join("out.glb").exists());
}

/// Kills conversions at all stages, over a target that holds one of two scenes.
fn kill_conversions_to(target: &str) {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    succeed(f, &["generate", "city", "-o", "a.glb", "--nodes", "3000"]);
    succeed(f, &["generate", "city", "-o", "b.glb", "--nodes", "3000", "--seed", "5"]);
    let scenes = [scene(f, "a.glb"), scene(f, "b.glb")];
    assert!(scenes[0].same_document(&scenes[1]).is_err(), "two scenes that can be told apart");
    let begun = Instant::now();
    succeed(f, &["convert", "a.glb", target]);
    let whole = begun.elapsed();
    let (mut killed, mut replaced) = (0, 0);
    let mut holds = 0;
    for round in 0..40u32 {
        let source = ["b.glb", "a.glb"][round as usize % 2];
        let mut child = Command::new(env!("CARGO_BIN_EXE_orthant"))
            .current_dir(f)
            .args(["convert", source, target])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(whole.mul_f64(f64::from(round) / 32.0).max(Duration::from_millis(1)));
        let ended = child.try_wait().expect("a child").is_some();
        child.kill().ok();
        child.wait().expect("ended");
        killed += u32::from(!ended);
        let found = scene(f, target);
        let now = scenes.iter().position(|scene| scene.same_document(&found).is_ok()).expect("one of the two, whole");
        replaced += u32::from(now != holds);
        holds = now;
    }
    assert!(killed >= 10, "only {killed} of 40 conversions were killed while they ran");
    println!("{killed} conversions killed, {replaced} of 40 had replaced the scene");
}

#[test]
fn a_killed_conversion_leaves_the_old_glb_or_the_new_one() {
    kill_conversions_to("out.glb");
}

#[test]
fn a_killed_conversion_leaves_the_old_gltf_or_the_new_one() {
    kill_conversions_to("out.gltf");
}
