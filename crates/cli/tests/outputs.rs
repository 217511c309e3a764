//! Outputs that cannot be written are refused before the work begins.

mod common;

use common::{bytes, fail, folder_with_box, succeed};

#[test]
fn every_command_that_writes_checks_its_outputs_first() {
    let (_guard, f) = folder_with_box();
    succeed(&f, &["render", "box.glb", "-o", "all.share", "--size", "8x8", "--spp", "16"]);
    std::fs::write(f.join("ops.jsonl"), "").expect("a script");
    std::fs::create_dir(f.join("folder.glb")).expect("a folder");
    std::fs::create_dir(f.join("folder.png")).expect("a folder");
    // Work that would take hours, if it began.
    let long = ["--size", "1920x1080", "--spp", "1000000"];
    let render = |rest: &[&'static str]| [&["render", "box.glb"], rest, &long].concat();
    let edit = ["edit", "box.glb", "--ops", "ops.jsonl"];
    for (args, words) in [
        (render(&["-o", "none/a.png"]), ["none/a.png", "folder none does not exist"]),
        (render(&["-o", "folder.png"]), ["-o folder.png", "is a folder"]),
        (render(&["-o", "a.png", "--stats", "none/s.json"]), ["--stats none/s.json", "folder none"]),
        (render(&["-o", "a.png", "--stats", "a.png"]), ["--stats a.png", "-o a.png"]),
        (render(&["-o", "a.png", "--stats", "box.glb"]), ["--stats box.glb", "the scene box.glb"]),
        (render(&["-o", "a.depth.exr", "--env", "./a.depth.exr"]), ["-o a.depth.exr", "--env ./a.depth.exr"]),
        (render(&["-o", "a.png", "--aov", "depth", "--stats", "a.depth.exr"]), ["--stats a.depth.exr", "--aov"]),
        ([&edit[..], &["-o", "none/b.glb"]].concat(), ["none/b.glb", "folder none"]),
        ([&edit[..], &["-o", "folder.glb"]].concat(), ["folder.glb", "is a folder"]),
        ([&edit[..], &["-o", "b.glb", "--report", "./b.glb"]].concat(), ["--report ./b.glb", "-o b.glb"]),
        ([&edit[..], &["--report", "ops.jsonl"]].concat(), ["--report ops.jsonl", "the script ops.jsonl"]),
        ([&edit[..], &["--report", "box.glb"]].concat(), ["--report box.glb", "the scene box.glb"]),
        (vec!["convert", "box.glb", "none/c.gltf"], ["none/c.gltf", "folder none"]),
        (vec!["convert", "box.glb", "folder.glb"], ["folder.glb", "is a folder"]),
        (vec!["generate", "cornell", "-o", "none/d.glb"], ["none/d.glb", "folder none"]),
        (vec!["generate", "cornell", "-o", "folder.glb"], ["folder.glb", "is a folder"]),
        (vec!["merge", "all.share", "-o", "none/e.png"], ["none/e.png", "folder none"]),
    ] {
        fail(&f, &args, 2, &words);
    }
    // The scene itself may be written anew.
    succeed(&f, &[&edit[..], &["-o", "box.glb"]].concat());
    succeed(&f, &["convert", "box.glb", "box.glb"]);
    succeed(&f, &["merge", "all.share", "-o", "e.png"]);
}

#[test]
fn what_a_scene_or_a_script_refers_to_is_no_output() {
    let (_guard, f) = folder_with_box();
    succeed(&f, &["convert", "box.glb", "a.gltf"]);
    succeed(&f, &["convert", "box.glb", "a.obj"]);
    succeed(&f, &["convert", "box.glb", "part.glb"]);
    std::fs::write(f.join("ops.jsonl"), "{\"op\":\"merge_scene\",\"path\":\"part.glb\"}\n").expect("a script");
    std::fs::write(f.join("beside.jsonl"), "{\"op\":\"merge_scene\",\"path\":\"a.gltf\"}\n").expect("a script");
    let before: Vec<_> = ["a.bin", "a.mtl", "part.glb", "box.glb"].map(|name| (name, bytes(&f, name))).into();
    let long = ["-o", "a.png", "--size", "1920x1080", "--spp", "1000000"];
    let render = |rest: &[&'static str]| [&["render"], rest, &long].concat();
    for (args, words) in [
        (render(&["a.gltf", "--stats", "a.bin"]), ["--stats a.bin", "a.gltf"]),
        (render(&["a.obj", "--stats", "./a.mtl"]), ["--stats ./a.mtl", "a.obj"]),
        (vec!["edit", "a.gltf", "--ops", "ops.jsonl", "--report", "a.bin"], ["--report a.bin", "a.gltf"]),
        (vec!["edit", "box.glb", "--ops", "ops.jsonl", "-o", "part.glb"], ["-o part.glb", "ops.jsonl: line 1"]),
        (
            vec!["edit", "box.glb", "--ops", "beside.jsonl", "--report", "a.bin"],
            ["--report a.bin", "beside.jsonl: line 1"],
        ),
    ] {
        fail(&f, &args, 2, &words);
    }
    for (name, content) in before {
        assert_eq!(bytes(&f, name), content, "{name}");
    }
}
