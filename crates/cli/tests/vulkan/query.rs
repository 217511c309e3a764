//! The path tracer of ray queries beside the ray tracing pipeline: the same bytes, AOVs and counts of rays.

use crate::{AOVS, device_with, frame, open, program, render};
use orthant::job::environment::lights_itself;
use orthant_render::sky;
use orthant_resident::frame::Tile;
use orthant_resident::{Backend, Environment, Frame};
use orthant_vulkan::device::Tracer;

/// Rows that are cut into more dispatches than one, and do not fill their groups.
const SIZE: (u32, u32) = (50, 37);

#[test]
fn ray_queries_give_the_bytes_of_the_pipeline() {
    let folder = tempfile::tempdir().expect("folder");
    let (Some(mut pipeline), Some(mut query)) = (device_with(Some(Tracer::Pipeline)), device_with(Some(Tracer::Query)))
    else {
        return;
    };
    assert_eq!(query.vulkan_device().tracer(), Tracer::Query);
    let scenes = [
        "cornell",
        "material-grid",
        "forest --trees 10",
        "city --nodes 300",
        "chain --depth 20",
        "instances --count 60",
        "animated-crowd --count 3",
        "grid --side 40",
    ];
    for scene in scenes {
        let name = format!("{}.glb", scene.split(' ').next().unwrap_or_default());
        let args: Vec<&str> = ["generate"].into_iter().chain(scene.split(' ')).chain(["-o", &name]).collect();
        program::succeed(folder.path(), &args);
        let mut loaded = open(&folder.path().join(&name));
        let environment = if lights_itself(&loaded) { Environment::none() } else { sky::clear_sky(sky::DEFAULT_SUN) };
        let whole = frame(&loaded, SIZE, 4);
        let tile = Frame { tile: Tile { x: 7, y: 11, width: 33, height: 5 }, ..whole.clone() };
        let batch = loaded.derived.load_batch();
        let mut films = Vec::new();
        for backend in [&mut pipeline, &mut query] {
            backend.clear().expect("the device works");
            backend.apply(batch.clone()).expect("the batch is sound");
            backend.set_environment(environment.clone()).expect("the environment is sound");
            films.push([render(backend, &whole), render(backend, &tile)]);
        }
        for (a, b) in films[0].iter().zip(&films[1]) {
            assert!(a.sum.iter().any(|pixel| pixel.iter().any(|v| *v > 0.0)), "{scene}: it is not black");
            assert_eq!(a.aovs.len(), AOVS.len());
            for ((aov, a), (_, b)) in a.aovs.iter().zip(&b.aovs) {
                assert!(bytes(a) == bytes(b), "{scene}: {aov:?}");
            }
            let differ = a.sum.iter().zip(&b.sum).filter(|(a, b)| bytes(*a) != bytes(*b)).count();
            assert_eq!(differ, 0, "{scene}: pixels differ");
        }
    }
    assert_eq!(query.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
}

fn bytes(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn a_tracer_is_chosen_on_the_command_line_and_listed() {
    if device_with(None).is_none() {
        return;
    }
    let (_folder, path) = program::folder_with_box();
    let render = |tracer: &str, out: &str| {
        let args = ["render", "box.glb", "-o", out, "--size", "16x16", "--spp", "2", "--backend", "vulkan", "--tracer"];
        program::succeed(&path, &[&args[..], &[tracer, "--quiet"]].concat());
        program::bytes(&path, out)
    };
    let with_pipeline = render("pipeline", "a.exr");
    assert!(with_pipeline == render("query", "b.exr"));
    assert!(with_pipeline == render("auto", "c.exr"));
    let args = ["render", "box.glb", "-o", "d.exr", "--backend", "cpu", "--tracer", "query"];
    program::fail(&path, &args, 2, &["--tracer"]);
    let devices = program::json(&program::succeed(&path, &["devices", "--json"]));
    let features = devices["devices"][1]["features"].as_array().expect("features").clone();
    for feature in ["ray tracing pipelines", "ray query"] {
        assert!(features.contains(&feature.into()), "{features:?}");
    }
}
