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

/// What every format has to keep of a scene: triangles in the world, and where they are.
fn shown(folder: &Path, name: &str) -> (u64, Vec<f64>) {
    let info = common::json(&succeed(folder, &["info", name, "--json"]));
    let corner = |key: &str| -> Vec<f64> {
        info["bounds"][key].as_array().expect("bounds").iter().filter_map(|v| v.as_f64()).collect()
    };
    (info["instanced_triangles"].as_u64().expect("a count"), [corner("min"), corner("max")].concat())
}

#[test]
fn every_pair_of_formats_keeps_what_is_shown() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    let scenes: [(&str, &[&str]); 5] = [
        ("cornell", &[]),
        ("material-grid", &[]),
        ("forest", &["--trees", "2"]),
        ("instances", &["--count", "30"]),
        ("animated-crowd", &["--count", "2"]),
    ];
    const FORMATS: [&str; 4] = ["gltf", "glb", "obj", "crts"];
    for (name, options) in scenes {
        let source = format!("{name}.glb");
        succeed(f, &[&["generate", name, "-o", &source], options].concat());
        let (triangles, bounds) = shown(f, &source);
        let check = |file: &str| {
            let (found, found_bounds) = shown(f, file);
            assert_eq!(found, triangles, "{file}");
            for (i, (a, b)) in bounds.iter().zip(&found_bounds).enumerate() {
                // The box of a rotated box is larger than that of its vertices, which is what a format of world space has.
                let within = if i < 3 { b >= &(a - 1e-3) } else { b <= &(a + 1e-3) };
                let is_exact = (a - b).abs() <= 1e-3;
                assert!(is_exact || within && name != "cornell", "{file}: {bounds:?}, {found_bounds:?}");
            }
        };
        for from in FORMATS {
            let first = format!("{name}-{from}.{from}");
            succeed(f, &["convert", &source, &first]);
            check(&first);
            for to in FORMATS {
                let second = format!("{name}-{from}-{to}.{to}");
                succeed(f, &["convert", &first, &second]);
                check(&second);
            }
        }
    }
}

#[test]
fn one_scene_as_gltf_and_as_obj_is_one_picture() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    succeed(f, &["generate", "cornell", "-o", "box.gltf"]);
    // OBJ knows no surface with one side, and a lamp that shines from both is brighter.
    let mut document = common::json(&String::from_utf8(bytes(f, "box.gltf")).expect("JSON"));
    for material in document["materials"].as_array_mut().expect("materials") {
        material["doubleSided"] = true.into();
    }
    std::fs::write(f.join("box.gltf"), document.to_string()).expect("written");
    let said = succeed(f, &["convert", "box.gltf", "box.obj"]);
    assert!(!said.contains("one side"), "{said}");
    // Nor does it have cameras.
    let view = ["--eye", "0.278,0.273,-0.8", "--target", "0.278,0.273,0", "--fov", "39.3", "--env", "none"];
    for (name, image, seed) in [
        ("box.gltf", "gltf.exr", "0"),
        ("box.gltf", "other-seed.exr", "1"),
        ("box.obj", "obj.exr", "0"),
        ("box.obj", "obj.png", "0"),
    ] {
        let options = ["render", name, "-o", image, "--size", "48x48", "--spp", "128", "--seed", seed];
        succeed(f, &[&options[..], &view[..]].concat());
    }
    // Random numbers are drawn by objects, which are others: what is left is noise, as between two seeds.
    for metric in ["rmse", "rel_mse", "flip"] {
        let apart = |a: &str, b: &str| {
            let found = common::json(&succeed(f, &["compare", a, b, "--json"]));
            found[metric].as_f64().unwrap_or_else(|| panic!("no {metric} in {found}"))
        };
        let (noise, formats) = (apart("gltf.exr", "other-seed.exr"), apart("gltf.exr", "obj.exr"));
        assert!(formats < 1.3 * noise, "{metric}: {formats} between the formats, {noise} between two seeds");
    }
    let pixels = image::open(f.join("obj.png")).expect("an image").into_rgb8();
    let mean = pixels.iter().map(|&byte| f64::from(byte)).sum::<f64>() / pixels.len() as f64;
    assert!(mean > 20.0, "the lamp shines by Ke: {mean}");
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
    fail(&f, &["convert", "box.glb", "no/such/folder/out.glb"], 2, &["no/such/folder/out.glb", "check the path"]);
    assert!(!f.join("out.glb").exists());
}

#[test]
fn geometry_that_cannot_be_read_leaves_nothing_and_names_the_source() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    // Index 7 leads past the three vertices; the material has a texture, which would be copied into a folder beside.
    let document = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}], "textures": [{"source": 0}],
        "images": [{"uri": "textures/a.png"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"},
            {"componentType": 5126, "count": 3, "type": "VEC2"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 3}],
        "buffers": [{"byteLength": 40,
            "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAEHAA=="}]}"#;
    std::fs::create_dir_all(f.join("in/textures")).expect("a folder");
    std::fs::create_dir(f.join("out")).expect("a folder");
    std::fs::write(f.join("in/textures/a.png"), b"\x89PNG").expect("written");
    std::fs::write(f.join("in/bad.gltf"), document).expect("written");
    for target in ["out/new.obj", "out/new.crts"] {
        fail(f, &["convert", "in/bad.gltf", target], 3, &["in/bad.gltf: /meshes/0/primitives/0", target]);
        assert_eq!(std::fs::read_dir(f.join("out")).expect("a folder").count(), 0, "{target}");
    }
    // With readable geometry all of it is there.
    std::fs::write(f.join("in/good.gltf"), document.replace("AAEHAA==", "AAECAA==")).expect("written");
    succeed(f, &["convert", "in/good.gltf", "out/new.obj"]);
    for file in ["out/new.obj", "out/new.mtl", "out/textures/a.png"] {
        assert!(f.join(file).is_file(), "{file}");
    }
    assert!(String::from_utf8_lossy(&bytes(f, "out/new.mtl")).contains("textures/a.png"));
}

/// Kills conversions at all stages, over a target that holds one of two scenes of so many nodes.
fn kill_conversions_to(target: &str, nodes: &str) {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    succeed(f, &["generate", "city", "-o", "a.glb", "--nodes", nodes]);
    succeed(f, &["generate", "city", "-o", "b.glb", "--nodes", nodes, "--seed", "5"]);
    // What the target holds when nobody interferes: in another format, it is not the scene itself.
    let scenes = ["a", "b"].map(|name| {
        std::fs::create_dir(f.join(name)).expect("folder");
        let path = format!("{name}/{target}");
        succeed(f, &["convert", &format!("{name}.glb"), &path]);
        scene(f, &path)
    });
    assert!(scenes[0].same_document(&scenes[1]).is_err(), "two scenes that can be told apart");
    let begun = Instant::now();
    succeed(f, &["convert", "a.glb", target]);
    // The span over which the kills are spread follows what is found: a busy machine slows down and speeds up.
    let mut whole = begun.elapsed();
    let (mut killed, mut replaced) = (0, 0);
    let (mut holds, mut round) = (0, 0u32);
    while round < 40 || killed < 10 && round < 400 {
        let source = ["b.glb", "a.glb"][round as usize % 2];
        let mut child = Command::new(env!("CARGO_BIN_EXE_orthant"))
            .current_dir(f)
            .args(["convert", source, target])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(whole.mul_f64(f64::from(round % 32) / 32.0).max(Duration::from_millis(1)));
        let ended = child.try_wait().expect("a child").is_some();
        child.kill().ok();
        child.wait().expect("ended");
        killed += u32::from(!ended);
        whole = whole.mul_f64(if ended { 0.8 } else { 1.1 });
        round += 1;
        let found = scene(f, target);
        let now = scenes.iter().position(|scene| scene.same_document(&found).is_ok()).expect("one of the two, whole");
        replaced += u32::from(now != holds);
        holds = now;
    }
    assert!(killed >= 10, "only {killed} of {round} conversions were killed while they ran");
    println!("{killed} conversions killed, {replaced} of {round} had replaced the scene");
}

#[test]
fn a_killed_conversion_leaves_the_old_glb_or_the_new_one() {
    kill_conversions_to("out.glb", "3000");
}

#[test]
fn a_killed_conversion_leaves_the_old_gltf_or_the_new_one() {
    kill_conversions_to("out.gltf", "3000");
}

#[test]
fn a_killed_conversion_leaves_the_old_crts_or_the_new_one() {
    kill_conversions_to("out.crts", "2000");
}

#[test]
fn a_killed_conversion_leaves_the_old_obj_with_its_materials_or_the_new_one() {
    kill_conversions_to("out.obj", "500");
}
