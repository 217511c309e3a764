//! The raster preview: the surfaces that the path tracer meets, exact colours where they are known, and images that do not
//! depend on culling, on the order of what is blended, or on how the scene came about.

use crate::{device, frame_of, open, program, render};
use orthant::job::Loaded;
use orthant::job::environment::lights_itself;
use orthant::metrics::hits::{Hits, hits};
use orthant_cpu::CpuBackend;
use orthant_render::{DeriveOptions, DerivedScene, sky};
use orthant_resident::camera::{Camera, Projection};
use orthant_resident::frame::{Aov, Estimator, PixelFilter, Tile};
use orthant_resident::sampling::hash_mix;
use orthant_resident::{Backend, Environment, Film, Frame};
use orthant_scene::Scene;
use orthant_scene::animation::Pose;
use orthant_scene::edit::script::{Operation, Session};
use orthant_scene::import::ImportOptions;
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::raster::{RasterOptions, RasterView};
use std::path::{Path, PathBuf};
use std::time::Duration;

fn rasterize(vulkan: &mut VulkanBackend, frame: &Frame, options: RasterOptions) -> Film {
    let ticket = vulkan.submit_raster(frame.clone(), options).expect("the frame is sound");
    while !vulkan.poll(ticket, Duration::from_secs(1)).expect("the device works").is_done() {}
    let film = vulkan.read_film(ticket).expect("the film is there");
    assert_eq!(vulkan.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
    film
}

fn aov(film: &Film, wanted: Aov) -> &[f32] {
    &film.aovs.iter().find(|(aov, _)| *aov == wanted).expect("it was asked for").1
}

fn view(view: RasterView) -> RasterOptions {
    RasterOptions { view, ..RasterOptions::default() }
}

/// Writes a document of squares of side 2 about the origin that face +Z: each with the JSON of its node's transform and of
/// its material.
fn squares(folder: &Path, name: &str, squares: &[(&str, &str)]) -> PathBuf {
    let mut bytes = Vec::new();
    let mut floats = |values: &[f32]| bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    floats(&[-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0]);
    floats(&[0.0, 0.0, 1.0].repeat(4));
    floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    std::fs::write(folder.join("square.bin"), &bytes).expect("write");
    let list = |part: &dyn Fn(usize, &(&str, &str)) -> String| -> String {
        squares.iter().enumerate().map(|(i, s)| part(i, s)).collect::<Vec<_>>().join(",")
    };
    let nodes = list(&|i, (transform, _)| format!(r#"{{"mesh":{i},{transform}}}"#));
    let meshes = list(&|i, _| {
        format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":{i}}}]}}"#
        )
    });
    let materials = list(&|_, (_, material)| format!("{{{material}}}"));
    let roots = list(&|i, _| i.to_string());
    let document = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["KHR_materials_unlit"],"scene":0,"scenes":[{{"nodes":[{roots}]}}],
        "nodes":[{nodes}],"meshes":[{meshes}],"materials":[{materials}],
        "buffers":[{{"uri":"square.bin","byteLength":{}}}],
        "bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":48}},
        {{"buffer":0,"byteOffset":96,"byteLength":32}},{{"buffer":0,"byteOffset":128,"byteLength":12}}],
        "accessors":[
        {{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-1,-1,0],"max":[1,1,0]}},
        {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"}},
        {{"bufferView":3,"componentType":5123,"count":6,"type":"SCALAR"}}]}}"#,
        bytes.len()
    );
    let path = folder.join(name);
    std::fs::write(&path, document).expect("write");
    path
}

const IN_PLACE: &str = r#""translation":[0,0,0]"#;

/// From +Z, parallel: a square about the origin fills the middle half of `size` pixels each way.
fn parallel(loaded: &Loaded, size: u32, samples: u32) -> Frame {
    let origin = loaded.derived.origin.as_vec3().to_array();
    Frame {
        camera: Camera {
            position: [-origin[0], -origin[1], 5.0 - origin[2]],
            right: [1.0, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            forward: [0.0, 0.0, -1.0],
            projection: Projection::Orthographic { half_height: 2.0 },
            lens_radius: 0.0,
            focus_distance: 5.0,
            near: 0.0,
            far: f32::INFINITY,
        },
        width: size,
        height: size,
        tile: Tile { x: 0, y: 0, width: size, height: size },
        samples: 0..samples,
        keep_blocks: false,
        seed: 0,
        max_depth: 8,
        roulette_depth: 4,
        firefly_clamp: None,
        estimator: Estimator::Mis,
        filter: PixelFilter::Box,
        aovs: Vec::new(),
        threads: 0,
        world: None,
    }
}

fn load(vulkan: &mut VulkanBackend, loaded: &mut Loaded, environment: Environment) {
    vulkan.clear().expect("the device works");
    vulkan.apply(loaded.derived.load_batch()).expect("the batch is sound");
    vulkan.set_environment(environment).expect("the environment is sound");
}

fn pixel(film: &Film, x: u32, y: u32) -> [f32; 3] {
    film.resolve()[(y * film.tile.width + x) as usize]
}

fn assert_near(is: [f32; 3], should: [f32; 3], tolerance: f32, what: &str) {
    let near = is.iter().zip(should).all(|(a, b)| (a - b).abs() <= tolerance);
    assert!(near, "{what}: {is:?} and should be {should:?}");
}

#[test]
fn pixel_centres_see_what_the_path_tracer_meets() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    for scene in ["cornell", "material-grid", "forest --trees 20", "city --nodes 500", "chain --depth 40"] {
        let name = format!("{}.glb", scene.split(' ').next().unwrap_or_default());
        let mut args = vec!["generate"];
        args.extend(scene.split(' '));
        args.extend(["-o", &name]);
        program::succeed(folder.path(), &args);
        let mut loaded = open(&folder.path().join(&name));
        let frame = frame_of(&loaded.scene, &loaded.derived, (96, 72), 1).expect("the scene shows something");
        let batch = loaded.derived.load_batch();
        let mut cpu = CpuBackend::new();
        cpu.apply(batch.clone()).expect("the batch is sound");
        vulkan.clear().expect("the device works");
        vulkan.apply(batch).expect("the batch is sound");
        let films = [render(&mut cpu, &frame), rasterize(&mut vulkan, &frame, RasterOptions::default())];
        let Hits { differ, unexplained, depth } = hits(&films[0], &films[1]);
        eprintln!("{scene}: {differ} pixels differ, {unexplained} unexplained, depth {depth:.1e}");
        assert!(differ <= 96 * 72 / 100, "{scene}: {differ} pixels differ");
        assert!(unexplained <= 3, "{scene}: {unexplained} of {differ} pixels are unexplained");
        assert!(depth <= 1e-3, "{scene}: depths differ by {depth}");
    }
}

#[test]
fn debug_views_have_the_values_of_the_document() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    let material = r#""pbrMetallicRoughness":{"baseColorFactor":[0.25,0.5,0.75,1],"metallicFactor":0.375,
        "roughnessFactor":0.625},"emissiveFactor":[0.125,0.25,0.5]"#;
    let mut loaded = open(&squares(folder.path(), "a.gltf", &[(IN_PLACE, material)]));
    load(&mut vulkan, &mut loaded, Environment::constant([1.0; 3]));
    let frame = Frame { aovs: crate::AOVS.to_vec(), ..parallel(&loaded, 16, 1) };
    // Pixel (5, 7) is centred at (-0.625, 0.125) of the square, pixel (0, 0) is beside it.
    let mut check = |what: RasterView, should: [f32; 3], beside: [f32; 3]| {
        let film = rasterize(&mut vulkan, &frame, view(what));
        assert_near(pixel(&film, 5, 7), should, 1e-4, &format!("{what:?}"));
        assert_near(pixel(&film, 0, 0), beside, 0.0, &format!("{what:?} beside"));
        film
    };
    let color = |index: u32| {
        let bits = hash_mix(index + 1);
        [0, 8, 16].map(|shift| 0.1 + ((bits >> shift) & 0xff) as f32 * (0.9 / 255.0))
    };
    let none = [0.0; 3];
    check(RasterView::BaseColor, [0.25, 0.5, 0.75], none);
    check(RasterView::Metallic, [0.375; 3], none);
    check(RasterView::Roughness, [0.625; 3], none);
    check(RasterView::Normals, [0.5, 0.5, 1.0], none);
    check(RasterView::Tangents, [1.0, 0.5, 0.5], none);
    check(RasterView::Uvs, [0.1875, 0.4375, 0.0], none);
    check(RasterView::Emissive, [0.125, 0.25, 0.5], none);
    check(RasterView::Node, color(0), none);
    check(RasterView::Primitive, color(0), none);
    check(RasterView::Material, color(0), none);
    let wires = check(RasterView::Wireframe, [0.05; 3], none);
    assert_eq!(pixel(&wires, 8, 7), [1.0; 3], "the diagonal is an edge");
    // Image-based light on a flat surface is on all of it the same, and adds to what it emits.
    let film = check(RasterView::Shaded, pixel_of_shaded(), [1.0; 3]);
    let at = 7 * 16 + 5;
    assert_eq!((aov(&film, Aov::Depth)[at], aov(&film, Aov::Node)[at]), (5.0, 0.0));
    assert_eq!((aov(&film, Aov::Primitive)[at], aov(&film, Aov::Material)[at]), (0.0, 0.0));
    let triple = |which: Aov| {
        let values = &aov(&film, which)[3 * at..];
        [values[0], values[1], values[2]]
    };
    assert_near(triple(Aov::Albedo), [0.25, 0.5, 0.75], 1e-6, "albedo");
    assert_near(triple(Aov::Normal), [0.0, 0.0, 1.0], 1e-4, "normal");
    assert_near(triple(Aov::Position), [-0.625, 0.125, 0.0], 1e-5, "position");
    assert!(aov(&film, Aov::Depth)[0].is_infinite() && aov(&film, Aov::Node)[0] == -1.0, "nothing is beside it");
}

/// What a surface of the material of the test above shows under a white sky: the albedo of its lobes, and its emission. The
/// albedo is integrated here, from the tables of the BSDF.
fn pixel_of_shaded() -> [f32; 3] {
    use orthant_resident::energy::EnergyRow;
    let (base, metallic, roughness) = ([0.25f32, 0.5, 0.75], 0.375f32, 0.625f32);
    let row = EnergyRow::new(roughness);
    let (at, mean) = (row.at(1.0), row.average());
    let albedo = |f0: f32, f90: f32| f0 * (at.a - at.b) + f90 * at.b;
    let (d0, d90) = (0.04, 1.0);
    let emission = [0.125, 0.25, 0.5];
    std::array::from_fn(|c| {
        let f0 = d0 * (1.0 - metallic) + base[c] * metallic;
        let diffuse = base[c] * (1.0 - metallic) * (1.0 - albedo(d0, d90));
        let fresnel = (20.0 * base[c] + 1.0) / 21.0;
        let multiple = fresnel * fresnel * mean.a / (1.0 - fresnel * (1.0 - mean.a)) * metallic * (1.0 - at.a);
        albedo(f0, d90 * (1.0 - metallic) + metallic) + diffuse + multiple + emission[c]
    })
}

#[test]
fn unlit_colours_are_exact_and_edges_are_covered_by_four_samples() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    let unlit =
        r#""pbrMetallicRoughness":{"baseColorFactor":[0.25,0.5,0.75,1]},"extensions":{"KHR_materials_unlit":{}}"#;
    // Half a pixel to the right: the pixels at its sides are half covered.
    let moved = r#""translation":[0.125,0,0]"#;
    let mut loaded = open(&squares(folder.path(), "a.gltf", &[(moved, unlit)]));
    load(&mut vulkan, &mut loaded, Environment::none());
    for samples in [1, 4, 64] {
        let frame = parallel(&loaded, 16, samples);
        let film = rasterize(&mut vulkan, &frame, RasterOptions::default());
        assert_eq!(film.samples, samples);
        assert_eq!(pixel(&film, 8, 8), [0.25, 0.5, 0.75], "{samples} samples");
        assert_eq!(pixel(&film, 2, 8), [0.0; 3], "{samples} samples");
        let tolerance = if samples == 64 { 0.02 } else { 0.0 };
        for x in [4, 12] {
            assert_near(pixel(&film, x, 8), [0.125, 0.25, 0.375], tolerance, &format!("{samples} samples, column {x}"));
        }
    }
    // A part of the image is that part of the image.
    let whole = rasterize(&mut vulkan, &parallel(&loaded, 16, 4), RasterOptions::default());
    let tile = Tile { x: 3, y: 5, width: 6, height: 4 };
    let part = rasterize(&mut vulkan, &Frame { tile, ..parallel(&loaded, 16, 4) }, RasterOptions::default());
    for y in 0..4 {
        for x in 0..6 {
            assert_near(pixel(&part, x, y), pixel(&whole, 3 + x, 5 + y), 1e-6, "tile");
        }
    }
}

#[test]
fn a_white_surface_in_a_white_world_is_white() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    // Tilted, so that it is seen at an angle.
    let tilted = r#""rotation":[0,0.5,0,0.8660254]"#;
    for metallic in [0, 1] {
        for roughness in ["0", "0.1", "0.3", "0.6", "1"] {
            let material =
                format!(r#""pbrMetallicRoughness":{{"metallicFactor":{metallic},"roughnessFactor":{roughness}}}"#);
            let mut loaded = open(&squares(folder.path(), "a.gltf", &[(tilted, &material)]));
            load(&mut vulkan, &mut loaded, Environment::constant([0.5, 1.0, 2.0]));
            let film = rasterize(&mut vulkan, &parallel(&loaded, 16, 4), RasterOptions::default());
            let what = format!("metallic {metallic}, roughness {roughness}");
            let [r, g, b] = pixel(&film, 8, 8);
            assert_near([2.0 * r, g, 0.5 * b], [1.0; 3], 2e-3, &what);
        }
    }
}

#[test]
fn image_based_light_turns_with_the_environment_and_is_scaled_by_it() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    let material = r#""pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":1}"#;
    let mut loaded = open(&squares(folder.path(), "a.gltf", &[(IN_PLACE, material)]));
    // White in front of the square (+Z, the middle of the map looks along -Z), black behind it.
    let texels = (0..32 * 16).map(|i| if (8..24).contains(&(i % 32)) { [0.0; 3] } else { [1.0; 3] }).collect();
    let map = orthant_resident::environment::EnvironmentMap { width: 32, height: 16, texels };
    let mut environment = Environment { map: Some(map.into()), ..Environment::none() };
    load(&mut vulkan, &mut loaded, environment.clone());
    let frame = parallel(&loaded, 16, 4);
    let mut shown = |environment: &Environment| {
        vulkan.set_environment(environment.clone()).expect("the environment is sound");
        pixel(&rasterize(&mut vulkan, &frame, RasterOptions::default()), 8, 8)[0]
    };
    assert!((shown(&environment) - 1.0).abs() < 0.05, "all of what it faces is white");
    environment.intensity = 3.0;
    assert!((shown(&environment) - 3.0).abs() < 0.15, "three times as bright");
    environment.intensity = 1.0;
    environment.rotation = std::f32::consts::FRAC_PI_2;
    assert!((shown(&environment) - 0.5).abs() < 0.05, "half of what it faces is white");
    environment.rotation = std::f32::consts::PI;
    assert!(shown(&environment) < 0.05, "what it faces is black");
}

#[test]
fn punctual_light_is_that_of_the_path_tracer() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    let plain = squares(
        folder.path(),
        "a.gltf",
        &[(IN_PLACE, r#""pbrMetallicRoughness":{"metallicFactor":0.4,"roughnessFactor":0.5}"#)],
    );
    let text = std::fs::read_to_string(&plain).expect("read");
    let lights = r#""extensions":{"KHR_lights_punctual":{"lights":[
        {"type":"point","intensity":20,"color":[1,0.5,0.25]},{"type":"spot","intensity":30,"spot":{"outerConeAngle":0.6}},
        {"type":"directional","intensity":2}]}},"#;
    let nodes = r#""nodes":[{"translation":[1,1,2],"extensions":{"KHR_lights_punctual":{"light":0}}},
        {"translation":[-0.5,0,3],"extensions":{"KHR_lights_punctual":{"light":1}}},
        {"rotation":[0.3,0.1,0,0.94],"extensions":{"KHR_lights_punctual":{"light":2}}},"#;
    let text = text
        .replace(r#""KHR_materials_unlit""#, r#""KHR_materials_unlit","KHR_lights_punctual""#)
        .replace(r#""asset""#, &format!(r#"{lights}"asset""#))
        .replace(r#""nodes":[0]"#, r#""nodes":[0,1,2,3]"#)
        .replace(r#""nodes":[{"mesh""#, &format!(r#"{nodes}{{"mesh""#));
    std::fs::write(&plain, text).expect("write");
    let mut loaded = open(&plain);
    assert_eq!(loaded.derived.lights.len(), 3);
    load(&mut vulkan, &mut loaded, Environment::none());
    // One edge after the light, so that the square alone is what is lit.
    let frame = Frame { max_depth: 2, ..parallel(&loaded, 16, 1024) };
    let traced = render(&mut vulkan, &frame);
    let shown = rasterize(&mut vulkan, &Frame { samples: 0..4, ..frame }, RasterOptions::default());
    for (x, y) in [(5, 5), (8, 8), (10, 6), (6, 10)] {
        let (a, b) = (pixel(&shown, x, y), pixel(&traced, x, y));
        let near = a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 0.03 * b);
        assert!(near && b[0] > 0.05, "pixel {x},{y}: {a:?} and traced {b:?}");
    }
}

#[test]
fn the_order_of_what_is_blended_does_not_matter() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    let material = |color: &str| {
        format!(
            r#""alphaMode":"BLEND","doubleSided":true,"pbrMetallicRoughness":{{"baseColorFactor":[{color},0.5]}},
            "extensions":{{"KHR_materials_unlit":{{}}}}"#
        )
    };
    let [red, green, blue] = ["1,0,0", "0,1,0", "0,0,1"].map(material);
    let layers = [
        (r#""translation":[0,0,1]"#, red.as_str()),
        (r#""translation":[0.25,0.25,0]"#, green.as_str()),
        (r#""translation":[-0.25,0.25,-1]"#, blue.as_str()),
    ];
    let mut films = Vec::new();
    for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
        let mut loaded = open(&squares(folder.path(), "a.gltf", &order.map(|i: usize| layers[i])));
        load(&mut vulkan, &mut loaded, Environment::constant([1.0; 3]));
        let frame = parallel(&loaded, 32, 4);
        films.push(rasterize(&mut vulkan, &frame, RasterOptions::default()));
    }
    for film in &films[1..] {
        for (a, b) in films[0].resolve().iter().zip(film.resolve()) {
            assert_near(*a, b, 1e-5, "another order");
        }
    }
    // One layer alone is exact: the lower right of the first square.
    assert_near(pixel(&films[0], 22, 22), [1.0, 0.5, 0.5], 1e-5, "red over white");
    let [r, g, b] = pixel(&films[0], 16, 16);
    assert!(r > g && g > b, "what is nearer counts for more: {r} {g} {b}");
}

#[test]
fn culling_leaves_out_what_is_not_seen_and_changes_no_pixel() {
    let folder = tempfile::tempdir().expect("folder");
    let Some(mut vulkan) = device() else { return };
    for scene in ["forest --trees 40", "city --nodes 2000", "animated-crowd --count 9"] {
        let name = format!("{}.glb", scene.split(' ').next().unwrap_or_default());
        let mut args = vec!["generate"];
        args.extend(scene.split(' '));
        args.extend(["-o", &name]);
        program::succeed(folder.path(), &args);
        let mut loaded = open(&folder.path().join(&name));
        let environment = if lights_itself(&loaded) { Environment::none() } else { sky::clear_sky(sky::DEFAULT_SUN) };
        let mut frame = frame_of(&loaded.scene, &loaded.derived, (80, 60), 8).expect("the scene shows something");
        frame.aovs.clear();
        // Closer, so that there is something beside the view.
        if let Projection::Perspective { tan_half_fov_y } = &mut frame.camera.projection {
            *tan_half_fov_y *= 0.4;
        }
        load(&mut vulkan, &mut loaded, environment);
        let culled = rasterize(&mut vulkan, &frame, RasterOptions::default());
        let drawn = vulkan.raster_report().drawn;
        let all = rasterize(&mut vulkan, &frame, RasterOptions { culls: false, ..RasterOptions::default() });
        let of = vulkan.raster_report().drawn;
        eprintln!("{scene}: {drawn} of {of} render nodes are drawn");
        assert!(drawn > 0 && drawn < of, "{scene}: {drawn} of {of} render nodes are drawn");
        assert!(culled.sum == all.sum, "{scene}: culling changes the image");
    }
}

#[test]
fn what_was_edited_looks_as_if_it_had_been_loaded_so() {
    let folder = tempfile::tempdir().expect("folder");
    let (Some(mut vulkan), Some(mut fresh)) = (device(), device()) else { return };
    program::succeed(folder.path(), &["generate", "material-grid", "-o", "a.glb"]);
    let mut scene: Scene = open(&folder.path().join("a.glb")).scene;
    scene.prepare_edits();
    let options = DeriveOptions { live: true, ..DeriveOptions::default() };
    let mut derived = DerivedScene::derive(&scene, &options).expect("the scene is sound");
    vulkan.apply(derived.load_batch()).expect("the batch is sound");
    let mut cursor = scene.change_log().cursor();
    let mut session = Session::new(Path::new("."), ImportOptions::default());
    let environment = sky::clear_sky(sky::DEFAULT_SUN);
    vulkan.set_environment(environment.clone()).expect("the environment is sound");
    fresh.set_environment(environment.clone()).expect("the environment is sound");
    let frame = frame_of(&scene, &derived, (80, 60), 4).expect("the scene shows something");
    let mut before = rasterize(&mut vulkan, &frame, RasterOptions::default());
    for operation in [
        r#"{"op":"set_visible","node":9,"visible":false}"#,
        r#"{"op":"set_transform","node":12,"translation":[0.3,1.0,0.5],"scale":[-1,1,1]}"#,
        r#"{"op":"delete","node":15}"#,
        r#"{"op":"set_visible","node":9,"visible":true}"#,
        r#"{"op":"duplicate","node":12}"#,
    ] {
        session.run(&mut scene, &Operation::parse(operation).expect("an operation")).expect("it is carried out");
        let changes = scene.change_log().take(&mut cursor).expect("the log is long enough");
        let (batch, _) = derived.sync(&scene, &Pose::default(), &changes).expect("the scene is sound");
        vulkan.apply(batch).expect("the batch is sound");
        let mut anew = DerivedScene::derive(&scene, &DeriveOptions::default()).expect("the scene is sound");
        fresh.clear().expect("the device works");
        fresh.apply(anew.load_batch()).expect("the batch is sound");
        fresh.set_environment(environment.clone()).expect("the environment is sound");
        let ids = Frame { aovs: vec![Aov::Depth, Aov::Primitive, Aov::Material], ..frame.clone() };
        let followed = rasterize(&mut vulkan, &ids, RasterOptions::default());
        let loaded = rasterize(&mut fresh, &ids, RasterOptions::default());
        let (same, all) = (followed.sum.iter().zip(&loaded.sum), followed.sum.len());
        let differ = same.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 1e-3 * (1.0 + b))).count();
        assert!(differ <= all / 500, "{operation}: {differ} of {all} pixels differ from a scene that is loaded so");
        assert_eq!(aov(&followed, Aov::Depth), aov(&loaded, Aov::Depth), "{operation}");
        if !operation.contains("duplicate") {
            assert!(followed.sum != before.sum, "{operation} is seen");
        }
        before = followed;
    }
}

#[test]
fn the_command_writes_previews_views_aovs_and_what_they_took() {
    if device().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    program::succeed(f, &["generate", "cornell", "-o", "c.glb"]);
    let raster = ["render", "c.glb", "--renderer", "raster", "--backend", "vulkan", "--size", "24x24", "--quiet"];
    let run = |rest: &[&str]| program::succeed(f, &[&raster, rest].concat());
    run(&["-o", "a.exr", "--spp", "6", "--aov", "depth,albedo", "--stats", "s.json", "--validate"]);
    let stats = program::json(&std::fs::read_to_string(f.join("s.json")).expect("stats"));
    assert_eq!((&stats["backend"], &stats["raster"]["passes"]), (&"vulkan".into(), &2.into()));
    assert_eq!(stats["samples"], 24 * 24 * 6);
    assert!(stats["raster"]["drawn"].as_u64().is_some_and(|drawn| drawn > 0));
    assert!(f.join("a.depth.exr").exists() && f.join("a.albedo.exr").exists());
    // A view is neither exposed nor tone-mapped.
    run(&["-o", "n.png", "--spp", "4", "--view", "normals"]);
    run(&["-o", "m.png", "--spp", "4", "--view", "normals", "--exposure", "3", "--tonemap", "aces"]);
    assert_eq!(program::bytes(f, "n.png"), program::bytes(f, "m.png"));
    run(&["-o", "s.png", "--spp", "4"]);
    run(&["-o", "e.png", "--spp", "4", "--exposure", "3"]);
    assert_ne!(program::bytes(f, "s.png"), program::bytes(f, "e.png"));
}
