//! Light transport in worlds, and in a world and a scene in one frame.

use crate::arenas::Recipe;
use crate::common::{SceneBuilder, cuboid, lambert, lamp, quad, sphere};
use crate::preview::{GLASS, INTEGRAL, ORIGIN, THICK, WORLD, averaged, differing_colors, differing_hits, keep, turns};
use crate::{Mode, aov, assert_silent, both, device, device_with, frame, render};
use glam::Vec3;
use orthant_cpu::CpuBackend;
use orthant_resident::environment::Sun;
use orthant_resident::frame::Aov;
use orthant_resident::rows::{LightKind, LightRow};
use orthant_resident::world::Shade;
use orthant_resident::world::view::EXHAUSTED_COLOR;
use orthant_resident::{Backend, BackendError, Environment, Film, Frame, TicketStatus};
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::device::Tracer;

const SIZE: (u32, u32) = (32, 24);

/// Light from all around, and a sun.
fn light() -> Environment {
    let sun = Sun {
        direction: Vec3::new(0.3, 0.8, 0.4).normalize().to_array(),
        radiance: [300.0, 280.0, 250.0],
        cos_radius: 0.9995,
    };
    Environment { sun: Some(sun), ..Environment::constant([0.4, 0.5, 0.7]) }
}

fn path_frame(step: u32, mode: &Mode, samples: u32) -> Frame {
    let mut frame = frame(ORIGIN, [0.3, 1.7, -0.4, 0.61], &turns(step), mode, SIZE, samples);
    frame.world.as_mut().expect("it shows one").shade = Shade::Path;
    frame
}

/// Pixels whose colours differ by more than rounding, and how far the means are apart.
fn difference(reference: &Film, test: &Film) -> (usize, f32) {
    let (r, t) = (reference.resolve(), test.resolve());
    let mean = |c: &[[f32; 3]]| c.iter().map(|&c| Vec3::from_array(c)).sum::<Vec3>().element_sum();
    (differing_colors(&r, &t), (mean(&t) / mean(&r) - 1.0).abs())
}

/// Both films are of the same random numbers: pixels are equal but for decisions that fall otherwise after a rounding.
fn assert_equal(what: &str, [(reference, expected), (film, found)]: [(Film, TicketStatus); 2]) {
    keep(&format!("{what} cpu"), &reference);
    keep(&format!("{what} vulkan"), &film);
    let (colors, means) = difference(&reference, &film);
    let (hits, depth) = differing_hits(&reference, &film);
    let [albedo, normal] = [Aov::Albedo, Aov::Normal]
        .map(|wanted| differing_colors(&averaged(&reference, wanted), &averaged(&film, wanted)));
    eprintln!(
        "{what}: {colors} colours, means {means:.1e}, {hits} hits, depth {depth:.1e}, {albedo} albedos, {normal} normals; {:?} {:?}",
        found.rays, found.world
    );
    let most = film.sum.len() / 50;
    assert!(colors <= most && means < 2e-3, "{what}: {colors} pixels have other colours, means are {means} apart");
    assert!(hits <= most && depth < 1e-4 && albedo <= most && normal <= most, "{what}: {hits} {albedo} {normal}");
    assert_eq!(found.rays.camera, expected.rays.camera, "{what}");
    let near = |a: u64, b: u64| (a as f64 / b as f64 - 1.0).abs() < 5e-3;
    assert!(near(found.rays.bounce, expected.rays.bounce), "{what}: {:?} {:?}", found.rays, expected.rays);
    assert!(near(found.rays.shadow, expected.rays.shadow), "{what}: {:?} {:?}", found.rays, expected.rays);
    assert!(near(found.world.rays, expected.world.rays), "{what}: {:?} {:?}", found.world, expected.world);
    assert_eq!(found.done, found.total, "{what}");
}

fn lit(vulkan: &mut VulkanBackend, cpu: &mut CpuBackend) {
    cpu.set_environment(light()).expect("the environment is sound");
    vulkan.set_environment(light()).expect("the environment is sound");
}

#[test]
fn paths_in_a_world_are_those_of_the_cpu_backend_in_every_mode() {
    let Some(mut vulkan) = device() else { return };
    for (name, recipe) in [("world", WORLD), ("glass", GLASS)] {
        let mut cpu = both(&mut vulkan, &recipe, ORIGIN);
        lit(&mut vulkan, &mut cpu);
        let modes = [("slice", Mode::Slice, 19), ("integral", INTEGRAL, 2), ("thick", THICK, 3)];
        for (step, (mode_name, mode, samples)) in (2..).zip(modes) {
            let frame = path_frame(step, &mode, samples);
            let films = [render(&mut cpu, &frame), render(&mut vulkan, &frame)];
            assert_equal(&format!("paths {name} {mode_name}"), films);
        }
    }
    assert_silent(&vulkan);
}

/// A scene around the camera, with a surface and a point that shine.
fn scene() -> SceneBuilder {
    SceneBuilder::default()
        .add(cuboid(Vec3::new(3.0, -1.0, -6.0), Vec3::new(1.0, 2.0, 1.0)), lambert(0.7))
        .add(sphere(Vec3::new(-3.0, 0.5, -5.0), 1.6, 12), lambert(0.5))
        .add(quad(Vec3::new(0.0, 5.0, -5.0), Vec3::new(1.5, 0.0, 0.0), Vec3::new(0.0, 0.0, 1.5)), lamp(8.0))
        .light(LightRow {
            kind: LightKind::Point as u32,
            position: [0.5, 2.0, -2.0],
            range: f32::INFINITY,
            color: [900.0, 700.0, 500.0],
            node: 0,
            ..LightRow::HOLE
        })
}

fn scene_and_world(vulkan: &mut VulkanBackend, name: &str) {
    for (kind, recipe) in [("world", WORLD), ("glass", GLASS)] {
        let recipe = Recipe { percent: 30, ..recipe };
        let mut cpu = both(vulkan, &recipe, ORIGIN);
        cpu.apply(scene().batch()).expect("the batch is sound");
        vulkan.apply(scene().batch()).expect("the batch is sound");
        lit(vulkan, &mut cpu);
        let mut frame = path_frame(0, &Mode::Slice, 17);
        // The slice X, Y, Z; the scene stands about the camera, which is away from its origin.
        let turned = crate::Turns::default();
        frame.world = crate::frame(ORIGIN, [0.3, 1.7, -0.4, 0.61], &turned, &Mode::Slice, SIZE, 1).world;
        let view = frame.world.as_mut().expect("it shows one");
        view.shade = Shade::Path;
        (frame.camera.right, frame.camera.up) = (view.layers[0].right, view.layers[0].up);
        frame.camera.forward = view.layers[0].forward;
        frame.camera.position = [0.2, 0.3, 1.0];
        frame.aovs.extend([Aov::Node, Aov::Material]);
        let films = [render(&mut cpu, &frame), render(vulkan, &frame)];
        let [nodes, blocks] =
            [Aov::Node, Aov::Block].map(|a| aov(&films[1].0, a).iter().filter(|&&v| v >= 0.0).count());
        assert!(nodes > 30 && blocks > 30, "{nodes} pixels show the scene, {blocks} the world");
        assert_eq!(aov(&films[0].0, Aov::Node), aov(&films[1].0, Aov::Node), "{name} {kind}");
        assert_equal(&format!("both {name} {kind}"), films);
        vulkan.clear().expect("the device works");
    }
    assert_silent(vulkan);
}

#[test]
fn a_scene_and_a_world_in_one_frame_are_those_of_the_cpu_backend() {
    let Some(mut vulkan) = device() else { return };
    scene_and_world(&mut vulkan, "pipeline");
}

#[test]
fn ray_queries_give_the_same_frames_of_a_scene_and_a_world() {
    let Some(mut vulkan) = device_with(Some(Tracer::Query)) else { return };
    scene_and_world(&mut vulkan, "query");
}

#[test]
fn a_scene_beside_a_world_is_seen_in_one_layer_by_light_transport_alone() {
    let Some(mut vulkan) = device() else { return };
    both(&mut vulkan, &WORLD, ORIGIN);
    vulkan.apply(scene().batch()).expect("the batch is sound");
    let preview = frame(ORIGIN, [0.0; 4], &turns(1), &Mode::Slice, SIZE, 1);
    for frame in [preview, path_frame(1, &THICK, 1)] {
        assert!(matches!(vulkan.submit(frame), Err(BackendError::InvalidFrame(_))));
    }
    assert_silent(&vulkan);
}

#[test]
fn paths_that_run_out_of_steps_are_shown_and_counted() {
    let Some(mut vulkan) = device() else { return };
    let mut cpu = both(&mut vulkan, &WORLD, ORIGIN);
    lit(&mut vulkan, &mut cpu);
    let mut frame = path_frame(2, &Mode::Slice, 1);
    frame.max_depth = 1;
    frame.aovs.clear();
    frame.world.as_mut().expect("it shows one").step_budget = 30;
    let (film, status) = render(&mut vulkan, &frame);
    let shown = film.resolve().iter().filter(|&&color| color == EXHAUSTED_COLOR).count();
    assert!(shown > 30 && shown < film.sum.len(), "{shown} pixels");
    assert_eq!(status.world.exhausted, shown as u64);
    assert_silent(&vulkan);
}
