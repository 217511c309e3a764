//! Exit codes and one-line errors, one class after another.

mod common;

use common::{fail, folder_with_box, json, orthant, succeed};

#[test]
fn help_and_version_are_results() {
    let folder = tempfile::tempdir().expect("folder");
    for command in ["info", "render", "merge", "compare", "generate", "world", "devices"] {
        let help = succeed(folder.path(), &[command, "--help"]);
        assert!(help.contains("Examples:"), "{command}");
    }
    assert!(succeed(folder.path(), &["--version"]).starts_with("orthant "));
}

#[test]
fn wrong_usage_is_2() {
    let (_guard, f) = folder_with_box();
    let render = |rest: &[&str], words: &[&str]| {
        let mut args = vec!["render", "box.glb", "-o", "out.png", "--size", "8x8", "--spp", "1"];
        args.extend(rest);
        fail(&f, &args, 2, words);
    };
    fail(&f, &["no-such-command"], 2, &[]);
    fail(&f, &["render", "box.glb"], 2, &["--output"]);
    render(&["--no-such-option"], &[]);
    render(&["--tonemap", "filmic"], &["khronos-neutral"]);
    render(&["--samples", "0..16"], &[".share"]);
    render(&["--tile", "0,0,9,1"], &["8x8"]);
    render(&["--eye", "1,2,3"], &["--target"]);
    render(&["--eye", "1,2,3", "--target", "1,2,3"], &["same point"]);
    render(&["--camera", "nobody"], &["camera"]);
    render(&["--scene", "7"], &["1 scenes"]);
    render(&["--variant", "x"], &["no variants"]);
    render(&["--time", "1.5"], &["box.glb", "no animations"]);
    render(&["--animation", "walk"], &["walk", "no animations"]);
    render(&["--time", "NaN"], &["finite"]);
    render(&["--view", "normals"], &["--renderer raster"]);
    render(&["--renderer", "raster", "--view", "x-ray"], &["wireframe"]);
    fail(&f, &["render", "box.glb", "-o", "o.share", "--renderer", "raster"], 2, &[".share"]);
    fail(&f, &["render", "box.glb", "-o", "out.gif"], 2, &["out.gif", ".png"]);
    fail(&f, &["render", "box.glb", "-o", "o.share", "--spp", "40", "--samples", "0..24"], 2, &["multiple of 16"]);
    fail(&f, &["render", "box.glb", "-o", "o.share", "--aov", "depth"], 2, &["AOV"]);
    fail(&f, &["generate", "cornell", "--trees", "3", "-o", "x.glb"], 2, &["--trees"]);
    fail(&f, &["generate", "city", "--nodes", "3", "-o", "x.glb"], 2, &["64"]);
    fail(&f, &["generate", "cornell", "-o", "x.obj"], 2, &[".glb"]);
    fail(&f, &["compare", "a.png", "b.png", "--fail-above", "psnr=3"], 2, &["psnr"]);
    fail(&f, &["render", "box.glb", "-o", "x.png", "--env", "1,-1,1"], 2, &["--env", "0 or more"]);
    assert!(!f.join("out.png").exists());
}

#[test]
fn bad_input_is_3_and_names_the_file() {
    let (_guard, f) = folder_with_box();
    fail(&f, &["info", "missing.glb"], 3, &["missing.glb"]);
    std::fs::write(f.join("bad.gltf"), "{ \"asset\": { \"version\": \"2.0\" }, \"scene\": 5 }").expect("write");
    fail(&f, &["info", "bad.gltf"], 3, &["bad.gltf", "/scene"]);
    std::fs::write(f.join("cut.glb"), &common::bytes(&f, "box.glb")[..100]).expect("write");
    fail(&f, &["render", "cut.glb", "-o", "x.png"], 3, &["cut.glb", "byte"]);
    fail(&f, &["render", "box.glb", "-o", "x.png", "--env", "missing.hdr"], 3, &["missing.hdr"]);
    std::fs::write(f.join("not.hdr"), "hello").expect("write");
    fail(&f, &["render", "box.glb", "-o", "x.png", "--env", "not.hdr"], 3, &["not.hdr", "byte 0"]);
    fail(&f, &["info", "box.glb", "--max-memory", "1KiB"], 3, &["box.glb"]);
    fail(&f, &["compare", "missing.png", "box.png"], 3, &["missing.png"]);
    fail(&f, &["merge", "box.glb", "-o", "x.png"], 3, &["box.glb", "byte 0"]);
}

#[test]
fn what_is_not_built_is_4() {
    let (_guard, f) = folder_with_box();
    fail(
        &f,
        &["render", "box.glb", "-o", "x.png", "--renderer", "raster", "--backend", "cpu"],
        4,
        &["--renderer path"],
    );
    fail(&f, &["render", "box.glb", "-o", "x.png", "--device", "no such card"], 4, &["devices"]);
}

#[test]
fn a_device_has_to_be_named_by_something() {
    let (_guard, f) = folder_with_box();
    std::fs::write(f.join("ops.jsonl"), "").expect("a script");
    for command in [
        &["render", "box.glb", "-o", "x.png", "--device", ""][..],
        &["edit", "box.glb", "--ops", "ops.jsonl", "--device", " "],
        &["bench", "edit", "--device", ""],
    ] {
        fail(&f, command, 2, &["--device"]);
    }
    let edit = ["edit", "box.glb", "--ops", "ops.jsonl", "--backend"];
    fail(&f, &[&edit[..], &["auto", "--device", "no such card"]].concat(), 4, &["devices"]);
    fail(&f, &[&edit[..], &["vulkan", "--device", "cpu"]].concat(), 4, &["Vulkan backend"]);
}

#[test]
fn a_machine_without_a_vulkan_driver_renders_on_the_cpu_and_says_so_where_vulkan_is_asked_for() {
    let (_guard, f) = folder_with_box();
    let render = |backend: &str| {
        let args = ["render", "box.glb", "-o", "x.png", "--size", "4x4", "--spp", "1", "--quiet", "--stats", "s.json"];
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_orthant"));
        command.current_dir(&f).args(args).args(["--backend", backend]);
        // The loader looks for drivers here and nowhere else.
        command.env("VK_DRIVER_FILES", "/there/is/none.json").env("VK_ICD_FILENAMES", "/there/is/none.json");
        command.output().expect("the program runs")
    };
    let refused = render("vulkan");
    let stderr = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(4), "{stderr}");
    assert!(stderr.contains("Vulkan") && stderr.contains("--backend cpu"), "{stderr}");
    assert_eq!(render("auto").status.code(), Some(0));
    let stats = json(&std::fs::read_to_string(f.join("s.json")).expect("stats"));
    assert_eq!(stats["backend"], "cpu");
}

#[test]
fn a_failed_check_is_5_and_still_has_its_result() {
    let (_guard, f) = folder_with_box();
    for (name, exposure) in [("a.png", "0"), ("b.png", "1")] {
        succeed(&f, &["render", "box.glb", "-o", name, "--size", "8x8", "--spp", "1", "--exposure", exposure]);
    }
    fail(&f, &["compare", "a.png", "b.png", "--fail-above", "rmse=0.001"], 5, &["rmse is", "a.png"]);
    succeed(&f, &["compare", "a.png", "a.png", "--fail-above", "max=0", "--fail-above", "flip=0"]);
    let output = orthant(&f, &["compare", "a.png", "b.png", "--json", "--fail-above", "rmse=0.001"]);
    let result = json(&String::from_utf8(output.stdout).expect("UTF-8"));
    assert_eq!(result["exceeded"], serde_json::json!(["rmse"]));
}

#[test]
fn images_of_different_sizes_cannot_be_compared() {
    let (_guard, f) = folder_with_box();
    succeed(&f, &["render", "box.glb", "-o", "a.png", "--size", "8x8", "--spp", "1"]);
    succeed(&f, &["render", "box.glb", "-o", "b.png", "--size", "8x9", "--spp", "1"]);
    fail(&f, &["compare", "a.png", "b.png"], 3, &["a.png", "b.png", "8 x 9"]);
}
