//! Outputs are whole or absent, even if the program is killed.

mod common;

use common::{bytes, folder_with_box, succeed};
use std::process::{Command, Stdio};
use std::time::Duration;

#[test]
fn a_killed_rendering_leaves_the_old_image() {
    let (_guard, f) = folder_with_box();
    succeed(&f, &["render", "box.glb", "-o", "out.png", "--size", "8x8", "--spp", "1"]);
    let old = bytes(&f, "out.png");
    for wait in [20, 200] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_orthant"))
            .current_dir(&f)
            .args(["render", "box.glb", "-o", "out.png", "--size", "640x360", "--spp", "4096"])
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(Duration::from_millis(wait));
        assert_eq!(child.try_wait().expect("a child"), None, "a billion samples take longer than this");
        child.kill().expect("killed");
        child.wait().expect("ended");
        assert_eq!(bytes(&f, "out.png"), old);
    }
}

#[test]
fn a_killed_share_is_never_seen_under_its_name() {
    let (_guard, f) = folder_with_box();
    let mut child = Command::new(env!("CARGO_BIN_EXE_orthant"))
        .current_dir(&f)
        .args(["render", "box.glb", "-o", "part.share", "--size", "640x360", "--spp", "4096"])
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(300));
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert!(!f.join("part.share").exists());
}

#[test]
fn outputs_have_the_permissions_of_ordinary_files() {
    let (_guard, f) = folder_with_box();
    std::fs::write(f.join("ordinary"), "").expect("write");
    let mode = |name: &str| std::fs::metadata(f.join(name)).expect("a file").permissions();
    assert_eq!(mode("box.glb"), mode("ordinary"));
}
