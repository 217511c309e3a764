//! The Vulkan backend beside the CPU backend: the same rows resident, the same hits, the same images. Without a device the
//! tests say so, unless `ORTHANT_REQUIRE_VULKAN=1`. The validation layers have nothing to say.

use orthant::job::{LoadOptions, Loaded, environment::lights_itself, load};
use orthant::metrics::hits::{Hits, hits};
use orthant_cpu::CpuBackend;
use orthant_render::DerivedScene;
use orthant_render::camera::View;
use orthant_render::sky;
use orthant_resident::frame::{Aov, Estimator, PixelFilter, Tile};
use orthant_resident::{Backend, Environment, Film, Frame};
use orthant_scene::Scene;
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::device::{DeviceOptions, Tracer};
use std::path::Path;
use std::time::Duration;

mod cache;
#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../../../render/tests/common/mod.rs"]
mod common;
mod edits;
mod failure;
mod images;
mod live;
#[path = "../common/mod.rs"]
mod program;
mod query;
mod raster;
#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../../../render/tests/sync/scenes.rs"]
mod scenes;
mod stages;

/// A device under the validation layers, or `None` where there is none and none has to be.
fn device() -> Option<VulkanBackend> {
    device_with(None)
}

fn device_with(tracer: Option<Tracer>) -> Option<VulkanBackend> {
    let required = std::env::var("ORTHANT_REQUIRE_VULKAN").is_ok_and(|v| v == "1");
    match VulkanBackend::new(&DeviceOptions { validate: true, tracer, ..DeviceOptions::default() }) {
        Ok(backend) => Some(backend),
        Err(error) if required => panic!("ORTHANT_REQUIRE_VULKAN is set: {error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

const AOVS: [Aov; 7] = [Aov::Albedo, Aov::Normal, Aov::Depth, Aov::Position, Aov::Node, Aov::Primitive, Aov::Material];

fn open(path: &Path) -> Loaded {
    let options =
        LoadOptions { scene: None, variant: None, moment: None, allow_external_files: false, max_memory: 4 << 30 };
    load(path, &options).unwrap_or_else(|e| panic!("{e}"))
}

fn frame(loaded: &Loaded, size: (u32, u32), samples: u32) -> Frame {
    frame_of(&loaded.scene, &loaded.derived, size, samples).expect("the scene shows something")
}

/// What the first camera sees, or a view of everything.
fn frame_of(scene: &Scene, derived: &DerivedScene, (width, height): (u32, u32), samples: u32) -> Option<Frame> {
    let aspect = f64::from(width) / f64::from(height);
    let view = View::first_camera(scene, derived, aspect);
    let view = view.or_else(|| derived.bounds().map(|b| View::framing(b, aspect)))?;
    Some(Frame {
        camera: view.to_camera(derived.origin),
        width,
        height,
        tile: Tile { x: 0, y: 0, width, height },
        samples: 0..samples,
        keep_blocks: false,
        seed: 3,
        max_depth: 6,
        roulette_depth: 3,
        firefly_clamp: None,
        estimator: Estimator::Mis,
        filter: PixelFilter::BlackmanHarris { radius: 1.5 },
        aovs: AOVS.to_vec(),
        threads: 0,
        world: None,
    })
}

fn render(backend: &mut dyn Backend, frame: &Frame) -> Film {
    let ticket = backend.submit(frame.clone()).expect("the frame is sound");
    while !backend.poll(ticket, Duration::from_secs(1)).expect("the device works").is_done() {}
    backend.read_film(ticket).expect("the film is there")
}

/// Films of both backends, in the light that the program chooses.
fn films(vulkan: &mut VulkanBackend, path: &Path, size: (u32, u32), samples: u32) -> [Film; 2] {
    let loaded = open(path);
    let environment = if lights_itself(&loaded) { Environment::none() } else { sky::clear_sky(sky::DEFAULT_SUN) };
    films_in(vulkan, loaded, environment, size, samples)
}

/// Films of both backends.
fn films_in(
    vulkan: &mut VulkanBackend,
    mut loaded: Loaded,
    environment: Environment,
    size: (u32, u32),
    samples: u32,
) -> [Film; 2] {
    let frame = frame(&loaded, size, samples);
    let batch = loaded.derived.load_batch();
    vulkan.clear().expect("the device works");
    let mut cpu = CpuBackend::new();
    cpu.apply(batch.clone()).expect("the batch is sound");
    vulkan.apply(batch).expect("the batch is sound");
    cpu.set_environment(environment.clone()).expect("the environment is sound");
    vulkan.set_environment(environment).expect("the environment is sound");
    let films = [render(&mut cpu, &frame), render(vulkan, &frame)];
    assert_eq!(vulkan.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
    films
}

/// Relative mean squared error of an image beside another, and the ratio of their means.
fn images(reference: &[[f32; 3]], test: &[[f32; 3]]) -> (f64, f64) {
    let (mut error, mut sums) = (0.0, [0.0f64; 2]);
    for (r, t) in reference.as_flattened().iter().zip(test.as_flattened()) {
        let (r, t) = (f64::from(*r), f64::from(*t));
        error += (r - t).powi(2) / (r * r + 1e-2);
        sums[0] += r;
        sums[1] += t;
    }
    (error / reference.as_flattened().len() as f64, sums[1] / sums[0])
}

#[test]
fn generated_scenes_give_the_hits_and_the_images_of_the_cpu_backend() {
    let folder = tempfile::tempdir().expect("folder");
    let scenes = [
        "cornell",
        "material-grid",
        "forest --trees 20",
        "city --nodes 500",
        "chain --depth 40",
        "instances --count 100",
        "animated-crowd --count 4",
    ];
    let only = std::env::var("ORTHANT_VULKAN_SCENE").ok();
    let Some(mut vulkan) = device() else { return };
    for scene in scenes.iter().filter(|scene| only.as_ref().is_none_or(|only| scene.starts_with(only.as_str()))) {
        let name = format!("{}.glb", scene.split(' ').next().unwrap_or_default());
        let mut args = vec!["generate"];
        args.extend(scene.split(' '));
        args.extend(["-o", &name]);
        program::succeed(folder.path(), &args);
        let [cpu, gpu] = films(&mut vulkan, &folder.path().join(&name), (64, 48), 16);
        let Hits { differ, unexplained, depth } = hits(&cpu, &gpu);
        let (error, means) = images(&cpu.resolve(), &gpu.resolve());
        eprintln!(
            "{scene}: {differ} pixels differ, {unexplained} unexplained, depth {depth:.1e}; relative MSE {error:.2e}, means {means:.5}"
        );
        assert!(
            differ <= 64 * 48 / 100 && unexplained == 0,
            "{scene}: {differ} pixels, {unexplained} of them unexplained"
        );
        assert!(depth <= 1e-4, "{scene}: depths differ by {depth}");
        assert!(error <= 1e-2 && (means - 1.0).abs() <= 0.01, "{scene}: {error} {means}");
    }
}

/// What is handed in at once ends before the longest of these paths do.
#[test]
fn long_paths_are_those_of_the_cpu_backend() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    program::succeed(folder.path(), &["generate", "cornell", "-o", "cornell.glb"]);
    let loaded = open(&folder.path().join("cornell.glb"));
    let frame = Frame { max_depth: 500, roulette_depth: 40, ..frame(&loaded, (40, 24), 19) };
    let mut loaded = loaded;
    let batch = loaded.derived.load_batch();
    let mut cpu = CpuBackend::new();
    cpu.apply(batch.clone()).expect("the batch is sound");
    vulkan.apply(batch).expect("the batch is sound");
    let finish = |backend: &mut dyn Backend| {
        let ticket = backend.submit(frame.clone()).expect("the frame is sound");
        let status = loop {
            let status = backend.poll(ticket, Duration::from_secs(1)).expect("the device works");
            if status.is_done() {
                break status;
            }
        };
        (status, backend.read_film(ticket).expect("the film is there"))
    };
    let (expected, reference) = finish(&mut cpu);
    let (found, film) = finish(&mut vulkan);
    assert_eq!((found.done, found.rays.camera), (expected.done, expected.rays.camera));
    let bounces = found.rays.bounce as f64 / expected.rays.bounce as f64;
    assert!((bounces - 1.0).abs() < 1e-3, "{} rays between surfaces, not {}", found.rays.bounce, expected.rays.bounce);
    let (error, means) = images(&reference.resolve(), &film.resolve());
    assert!(error <= 1e-3 && (means - 1.0).abs() <= 1e-3, "{error} {means}");
    assert_eq!(vulkan.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
}

/// glTF files of a folder of shared assets.
fn assets(folder: &str) -> Vec<std::path::PathBuf> {
    let Ok(root) = std::env::var("ORTHANT_ASSETS") else {
        eprintln!("skipped: ORTHANT_ASSETS is not set");
        return Vec::new();
    };
    let folder = Path::new(&root).join(folder);
    let read = |folder: &Path| std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut found = Vec::new();
    for entry in read(&folder).flatten().filter(|entry| entry.path().is_dir()) {
        let is_gltf = |path: &Path| path.extension().is_some_and(|e| e == "gltf" || e == "glb");
        found.extend(read(&entry.path()).flatten().map(|file| file.path()).filter(|path| is_gltf(path)));
    }
    found.sort();
    found
}

#[test]
fn shared_assets_give_the_hits_of_the_cpu_backend() {
    let assets = assets("gltf-khronos");
    if assets.is_empty() {
        return;
    }
    let Some(mut vulkan) = device() else { return };
    let mut seen = 0;
    for path in &assets {
        let options =
            LoadOptions { scene: None, variant: None, moment: None, allow_external_files: false, max_memory: 4 << 30 };
        if !load(path, &options).is_ok_and(|loaded| loaded.derived.bounds().is_some()) {
            continue;
        }
        let [cpu, gpu] = films(&mut vulkan, path, (64, 48), 1);
        let Hits { differ, unexplained, depth } = hits(&cpu, &gpu);
        let (error, means) = images(&cpu.resolve(), &gpu.resolve());
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        eprintln!(
            "{name}: {differ} pixels differ, {unexplained} unexplained, depth {depth:.1e}; relative MSE {error:.2e}, means {means:.5}"
        );
        assert!(unexplained <= 3, "{name}: {differ} pixels, {unexplained} of them unexplained");
        assert!(depth <= 1e-4, "{name}: depths differ by {depth}");
        seen += 1;
    }
    assert!(seen >= 40, "only {seen} assets show something");
}

/// The least that a backend without a scene has in use, in bytes and allocations: what a scene before it had is given back by later
/// submissions, and each emptying has something of its own on the way.
fn emptied(vulkan: &mut VulkanBackend) -> (u64, usize) {
    let device = vulkan.vulkan_device().clone();
    let rounds = (0..12).map(|_| {
        vulkan.clear().expect("the device works");
        // A readback waits for all that is in flight.
        vulkan.read_back().expect("the device works");
        (device.used(), device.allocated().1)
    });
    rounds.reduce(|least, now| (least.0.min(now.0), least.1.min(now.1))).unwrap_or_default()
}

/// Asserts that a backend has no more in use than before: but for the tables that an emptying may have on the way.
fn assert_emptied(vulkan: &mut VulkanBackend, before: (u64, usize)) {
    let now = emptied(vulkan);
    assert!(now.0 <= before.0 + (32 << 10) && now.1 <= before.1 + 1, "{now:?} is in use, and before it was {before:?}");
}
