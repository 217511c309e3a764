//! Images of 256 samples, without a clamp, of equal seed: those of the device are those of the CPU backend, over the generated
//! scenes, environments and kinds of light. The shared assets take longer, and are compared on demand:
//!
//!     ORTHANT_ASSETS=FOLDER cargo test -p orthant --test vulkan -- --ignored assets_give_the_images --nocapture
//!
//! (`ORTHANT_VULKAN_SCENE=NAME` compares those alone whose name begins so.) On lavapipe the 44 of them were at most 1.5e-9 apart
//! (relative mean squared error), with means within 1e-6; generated scenes 1.8e-7 and 1e-5. That is what paths leave whose
//! decisions fall otherwise after a rounding.

use crate::{Loaded, assets, device, films_in, images, open, program};
use clap::Parser;
use orthant::args::{Cli, Command};
use orthant::image_io::{self, Display};
use orthant::job::environment;
use orthant::job::{LoadOptions, load};
use orthant_resident::{Environment, tonemap::ToneMapper};
use orthant_vulkan::VulkanBackend;
use std::path::Path;

/// Pixels, few enough for a device that is a processor.
const SIZE: (u32, u32) = (32, 24);
const SAMPLES: u32 = 256;
/// The largest relative mean squared error, and how far the means may be apart.
const ERROR: f64 = 1e-3;
const MEANS: f64 = 5e-3;

/// The light of a command line, as `render` makes it.
fn light(loaded: &Loaded, options: &[&str]) -> Environment {
    let line = ["orthant", "render", "scene.glb", "-o", "image.exr"].iter().chain(options);
    let Command::Render(args) = Cli::parse_from(line).command else { panic!("it is `render`") };
    environment::select(Some(loaded), &args, false, 1 << 30).unwrap_or_else(|e| panic!("{e}"))
}

/// What the images of a scene in some light are apart; the error says so if that is too much.
fn compare(vulkan: &mut VulkanBackend, what: &str, loaded: Loaded, environment: Environment) -> Result<(), String> {
    let [cpu, gpu] = films_in(vulkan, loaded, environment, SIZE, SAMPLES);
    let (cpu, gpu) = (cpu.resolve(), gpu.resolve());
    let brightest = cpu.as_flattened().iter().copied().fold(0.0, f32::max);
    let (error, means) = images(&cpu, &gpu);
    eprintln!("{what}: relative MSE {error:.2e}, means {means:.6}");
    if brightest == 0.0 {
        return Err(format!("{what}: it is black"));
    }
    let is_near = error <= ERROR && (means - 1.0).abs() <= MEANS;
    if is_near { Ok(()) } else { Err(format!("{what}: relative MSE {error}, means {means}")) }
}

fn generate(folder: &Path, scene: &str) -> Loaded {
    let name = format!("{}.glb", scene.split(' ').next().unwrap_or_default());
    let args: Vec<&str> = ["generate"].into_iter().chain(scene.split(' ')).chain(["-o", &name]).collect();
    program::succeed(folder, &args);
    open(&folder.join(&name))
}

#[test]
fn generated_scenes_give_the_image_of_the_cpu_backend_at_256_samples() {
    let Some(mut vulkan) = device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    for scene in [
        "cornell",
        "material-grid",
        "forest --trees 10",
        "city --nodes 300",
        "chain --depth 30",
        "grid --side 40",
        "instances --count 60",
        "animated-crowd --count 3",
    ] {
        let loaded = generate(folder.path(), scene);
        let environment = light(&loaded, &[]);
        compare(&mut vulkan, scene, loaded, environment).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn environments_give_the_image_of_the_cpu_backend_at_256_samples() {
    let Some(mut vulkan) = device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    // A bright window in a coloured gradient, which importance sampling has to find.
    let (width, height) = (64, 32);
    let texel = |x: u32, y: u32| match (x, y) {
        (40..44, 8..11) => [60.0, 50.0, 30.0],
        _ => [0.1 + x as f32 / 128.0, 0.2, 0.6 - y as f32 / 64.0],
    };
    let texels: Vec<[f32; 3]> = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    let display = Display { tonemap: ToneMapper::None, exposure: 0.0 };
    image_io::write(&f.join("room.hdr"), width, height, &texels, display).expect("an environment");
    let room = f.join("room.hdr");
    let room = room.to_str().expect("UTF-8");
    for options in [
        &["--env", "none"][..],
        &["--env", "sky", "--sun", "30,20"],
        &["--env", room, "--env-rotation", "75", "--env-intensity", "1.5"],
    ] {
        let loaded = generate(f, "material-grid");
        let environment = light(&loaded, options);
        compare(&mut vulkan, &options.join(" "), loaded, environment).unwrap_or_else(|e| panic!("{e}"));
    }
    let loaded = generate(f, "instances --count 60");
    compare(&mut vulkan, "constant", loaded, Environment::constant([0.7, 0.9, 1.1])).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn every_kind_of_light_gives_the_image_of_the_cpu_backend_at_256_samples() {
    let Some(mut vulkan) = device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    let empty = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}],
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.4}},
            {"emissiveFactor": [1, 0.8, 0.5], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 12}}}]}"#;
    std::fs::write(f.join("empty.gltf"), empty).expect("a scene");
    let room = [
        r#"{"op": "add_shape", "shape": "plane", "material": 0, "as": "floor"}"#,
        r#"{"op": "set_transform", "node": "$floor", "scale": [8, 1, 8]}"#,
        r#"{"op": "add_shape", "shape": "sphere", "material": 0, "as": "ball"}"#,
        r#"{"op": "set_transform", "node": "$ball", "translation": [0.5, 1, 0]}"#,
        r#"{"op": "add_shape", "shape": "cube", "material": 0, "as": "box"}"#,
        r#"{"op": "set_transform", "node": "$box", "translation": [-1.5, 0.7, 0.4], "rotation": [0, 0.2588, 0, 0.9659]}"#,
    ];
    // Lights shine along -Z: down, and a little aside.
    let down = r#""translation": [0.5, 4, 0.8], "rotation": [-0.6428, 0, 0, 0.766]"#;
    let place = |node: &str| format!(r#"{{"op": "set_transform", "node": "{node}", {down}}}"#);
    let punctual =
        |light: &str| vec![format!(r#"{{"op": "add_light", "light": {light}, "as": "light"}}"#), place("$light")];
    let emitter = |shape: &str| {
        vec![
            format!(r#"{{"op": "add_shape", "shape": "{shape}", "material": 1, "as": "lamp"}}"#),
            r#"{"op": "set_transform", "node": "$lamp", "translation": [0, 3.5, 0], "scale": [0.4, 0.4, 0.4], "rotation": [1, 0, 0, 0]}"#.to_owned(),
        ]
    };
    let spot = r#"{"type": "spot", "intensity": 300, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.6}}"#;
    for (kind, lines) in [
        ("point", punctual(r#"{"type": "point", "intensity": 120, "color": [1, 0.9, 0.7]}"#)),
        ("spot", punctual(spot)),
        ("directional", punctual(r#"{"type": "directional", "intensity": 3}"#)),
        ("emissive rectangle", emitter("plane")),
        ("emissive sphere", emitter("sphere")),
        ("all", [punctual(spot), emitter("cube"), punctual(r#"{"type": "directional", "intensity": 1}"#)].concat()),
    ] {
        let script: Vec<&str> = room.into_iter().chain(lines.iter().map(String::as_str)).collect();
        std::fs::write(f.join("ops.jsonl"), script.join("\n")).expect("a script");
        program::succeed(f, &["edit", "empty.gltf", "--ops", "ops.jsonl", "-o", "lit.glb"]);
        compare(&mut vulkan, kind, open(&f.join("lit.glb")), Environment::none()).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
#[ignore = "it takes minutes, and the shared assets"]
fn shared_assets_give_the_images_of_the_cpu_backend_at_256_samples() {
    let Some(mut vulkan) = device() else { return };
    let options =
        LoadOptions { scene: None, variant: None, moment: None, allow_external_files: false, max_memory: 4 << 30 };
    let only = std::env::var("ORTHANT_VULKAN_SCENE").unwrap_or_default();
    let (mut seen, mut wrong) = (0, Vec::new());
    for path in assets("gltf-khronos") {
        let Some(loaded) = load(&path, &options).ok().filter(|loaded| loaded.derived.bounds().is_some()) else {
            continue;
        };
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !name.starts_with(&only) {
            continue;
        }
        // By its own light it is black from where it is framed.
        let sky = if name.starts_with("AnisotropyBarnLamp") { &["--env", "sky"][..] } else { &[] };
        let environment = light(&loaded, sky);
        wrong.extend(compare(&mut vulkan, &name, loaded, environment).err());
        seen += 1;
    }
    eprintln!("{seen} assets; beyond the bounds: {wrong:#?}");
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(seen >= 40 || !only.is_empty(), "only {seen} assets show something");
}
