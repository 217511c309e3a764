//! Compiled pipelines are kept between runs, and what is wrong with them hurts nobody.

use crate::{device, program};
use std::path::{Path, PathBuf};
use std::process::Command;

fn render(folder: &Path, cache: &[(&str, &Path)]) -> Vec<u8> {
    let args = ["render", "box.glb", "-o", "x.exr", "--size", "8x8", "--spp", "1", "--backend", "vulkan", "--quiet"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_orthant"));
    command.current_dir(folder).args(args).env_remove("ORTHANT_PIPELINE_CACHE").envs(cache.iter().copied());
    let output = command.output().expect("the program runs");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    program::bytes(folder, "x.exr")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder).map(|entries| entries.flatten().map(|entry| entry.path()).collect()).unwrap_or_default()
}

#[test]
fn pipelines_are_kept_in_the_users_folder_and_a_damaged_file_is_made_anew() {
    if device().is_none() {
        return;
    }
    let (_folder, path) = program::folder_with_box();
    let user = path.join("user");
    let xdg = [("XDG_CACHE_HOME", user.as_path())];
    let image = render(&path, &xdg);
    let kept = files(&user.join("orthant"));
    let [file] = kept.as_slice() else { panic!("one file, and not {kept:?}") };
    let made = std::fs::read(file).expect("the file");
    // What is as it was is not written again.
    let before = std::fs::metadata(file).and_then(|m| m.modified()).expect("a time");
    assert!(image == render(&path, &xdg));
    assert_eq!(std::fs::metadata(file).and_then(|m| m.modified()).expect("a time"), before);
    for damaged in [&b"nonsense"[..], &made[..made.len() / 2], &[]] {
        std::fs::write(file, damaged).expect("the file");
        assert!(image == render(&path, &xdg));
        assert!(std::fs::read(file).expect("the file").len() > damaged.len(), "it is made anew");
    }
    // Where nothing can be written, nothing is said.
    std::fs::remove_file(file).expect("the file");
    std::fs::write(path.join("no-folder"), "").expect("a file");
    assert!(image == render(&path, &[("ORTHANT_PIPELINE_CACHE", &path.join("no-folder"))]));
    assert!(image == render(&path, &[xdg[0], ("ORTHANT_PIPELINE_CACHE", Path::new("off"))]));
    assert_eq!(files(&user.join("orthant")), [] as [PathBuf; 0]);
    let own = path.join("own");
    assert!(image == render(&path, &[xdg[0], ("ORTHANT_PIPELINE_CACHE", &own)]));
    assert_eq!((files(&user.join("orthant")).len(), files(&own).len()), (0, 1));
}
