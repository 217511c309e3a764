//! Long random edit sequences, undo and redo among them, over six scenes: after every edit the derived state is that of a full
//! derivation, field by field; what the CPU backend has is what was derived; and rays hit what they hit in a scene that was
//! loaded so. A failure is a script, shortened, that `orthant edit --verify` replays.
//!
//! The sequences and the shortening are those of the soak (`examples/soak`).

#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../../../render/tests/common/mod.rs"]
mod common;
#[path = "../../examples/soak/finding.rs"]
mod finding;
mod kinds;
#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../../examples/soak/minimise.rs"]
mod minimise;
#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../../../render/tests/sync/scenes.rs"]
mod scenes;
#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../../examples/soak/sequence.rs"]
mod sequence;
mod shrink;

use orthant::args::BackendArg;
use orthant_scene::export::{ExportOptions, gltf::to_glb};
use orthant_scene::import::{ImportOptions, import_path};
use sequence::{Source, Tally};
use std::path::{Path, PathBuf};

/// Sequences over each scene: 204 over the six.
const SEQUENCES: u64 = 34;
/// Edits of each.
const EDITS: usize = 200;

/// The scenes as files in a folder: what a script is replayed on is what it was found on, and they are merged into each other.
fn write_scenes(folder: &Path) -> Vec<PathBuf> {
    let write = |(name, scene): (&str, orthant_scene::Scene)| {
        let path = folder.join(format!("{}.glb", name.replace(' ', "-")));
        std::fs::write(&path, to_glb(&scene, &ExportOptions::default()).expect("exported").document).expect("a file");
        path
    };
    scenes::all().into_iter().map(write).collect()
}

fn source(files: &[PathBuf], name: &str) -> Source {
    let path = files.iter().find(|path| path.file_stem().is_some_and(|stem| stem == name)).expect("the scene");
    let scene = import_path(path, &ImportOptions::default()).expect("a scene").scene;
    Source::new(name.to_owned(), path.clone(), scene, files.to_vec(), Some(BackendArg::Cpu), Some(1))
        .expect("it can be derived")
}

/// Runs the sequences of one scene. The folder stays if one of them fails.
fn follow(name: &str) {
    let folder = tempfile::Builder::new().prefix("orthant-edits-").tempdir().expect("a folder");
    let source = source(&write_scenes(folder.path()), name);
    let mut sum = Tally::default();
    for seed in 0..SEQUENCES {
        let (tally, finding) = sequence::run(&source, seed, EDITS, None);
        sum += tally;
        let Some(finding) = finding else { continue };
        let script = folder.keep().join(format!("{name}-{seed}.jsonl"));
        let replay = finding::keep(&source, &script, finding).expect("the script is written");
        panic!(
            "{name}, seed {seed}: {}\n{} operations lead to it; replay them with\n{}",
            replay.what, replay.operations, replay.command
        );
    }
    println!("{name}: {sum}");
    assert_eq!((sum.edits, sum.checks), (SEQUENCES * EDITS as u64, SEQUENCES * EDITS as u64));
    assert!(sum.refused * 2 < sum.edits, "most edits are carried out: {sum}");
    assert!(sum.rays > 8 * sum.checks, "rays hit something: {sum}");
}

#[test]
fn a_deep_scene_its_backend_and_rays_follow_every_edit() {
    follow("deep");
}

#[test]
fn a_wide_scene_its_backend_and_rays_follow_every_edit() {
    follow("wide");
}

#[test]
fn an_instanced_scene_its_backend_and_rays_follow_every_edit() {
    follow("instanced");
}

#[test]
fn a_skinned_scene_its_backend_and_rays_follow_every_edit() {
    follow("skinned");
}

#[test]
fn a_document_of_many_scenes_its_backend_and_rays_follow_every_edit() {
    follow("many-scenes");
}

#[test]
fn a_scene_of_variants_its_backend_and_rays_follow_every_edit() {
    follow("variants");
}
