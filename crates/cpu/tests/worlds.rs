//! Frames that show worlds: alone and with a model scene, in the preview and by light transport.

mod common;
#[path = "../src/world/testing.rs"]
#[allow(dead_code, reason = "these tests use a part of it")]
mod testing;

use common::{SceneBuilder, camera, cuboid, frame, lambert, mean, render};
use glam::{DAffine3, Vec3};
use orthant_cpu::CpuBackend;
use orthant_resident::environment::Sun;
use orthant_resident::frame::Aov;
use orthant_resident::world::view::EXHAUSTED_COLOR;
use orthant_resident::world::{
    ArenaLens, BlockRow, Combine, Layer, MutationBatch, PayloadWrite, SetSlot, Shade, WorldArenas, WorldView,
};
use orthant_resident::{Backend, BackendError, Environment, Film, Frame};
use testing::{Content, UNIT, bits, glass, opaque};

/// Puts a set into a backend as a planner would.
fn load(backend: &mut CpuBackend, arenas: &WorldArenas) {
    backend.begin_staging(arenas.origin, ArenaLens::default()).unwrap();
    let words = arenas.payload.as_slice();
    let payload = (!words.is_empty()).then(|| PayloadWrite { first: 0, words: words.into() });
    let batch = MutationBatch {
        new_root: arenas.root,
        new_revision: 1,
        lens: arenas.lens(),
        node_writes: (0..).zip(arenas.nodes.iter().copied()).collect(),
        leaf_writes: (0..).zip(arenas.leaves.iter().copied()).collect(),
        payload_writes: payload.into_iter().collect(),
        palette_writes: (0..).zip(arenas.palette.iter().copied()).collect(),
        ..MutationBatch::default()
    };
    backend.apply_world(SetSlot::Staging, &batch).unwrap();
    backend.swap_sets().unwrap();
}

/// One layer, the slice X, Y, Z at the anchor, with the vectors of the frame's camera.
fn slice(frame: &Frame, anchor: [i64; 4], shade: Shade) -> WorldView {
    let axes = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let c = &frame.camera;
    WorldView {
        anchor,
        layers: vec![Layer { axes, right: c.right, up: c.up, forward: c.forward }],
        combine: Combine::Mean,
        distance: 1e4,
        shade,
        edges: 0.0,
        step_budget: 1 << 16,
    }
}

const PREVIEW: Shade = Shade::Preview {
    direction: [0.0, 0.8, 0.6],
    sun: [1.0, 1.0, 0.9],
    ambient: [0.2, 0.2, 0.3],
    zenith: [0.1, 0.2, 0.8],
    horizon: [0.5, 0.6, 0.8],
    nadir: [0.2, 0.2, 0.2],
};

fn raw(v: Vec3) -> [i64; 4] {
    let [x, y, z] = v.to_array().map(|c| (c * UNIT as f32) as i64);
    [x, y, z, UNIT / 2]
}

fn at(w: f32) -> impl Fn([f32; 3]) -> [i64; 4] {
    move |[x, y, z]| [x, y, z, w].map(|c| (c * UNIT as f32) as i64)
}

/// A white surface that is as rough as can be; 1 is a floor, 2 what stands on it.
fn set(content: Content) -> WorldArenas {
    let mut arenas = content.arenas([0; 4]);
    arenas.palette = vec![BlockRow { flags: 0, ..opaque([0.0; 3]) }];
    arenas.palette.extend([opaque([0.8; 3]), opaque([0.5; 3]), glass([0.1, 0.3, 0.7])]);
    arenas.palette.push(BlockRow { emission: [6.0, 5.0, 4.0], ..opaque([0.0; 3]) });
    arenas.palette.push(opaque([1.0; 3]));
    arenas
}

fn box_of(content: &mut Content, low: [f32; 3], high: [f32; 3], id: u32) {
    content.uniform(at(0.0)(low), at(1.0)(high), bits(id, 0));
}

fn sky() -> Environment {
    Environment {
        sun: Some(Sun {
            direction: Vec3::new(0.3, 0.8, 0.4).normalize().to_array(),
            radiance: [400.0; 3],
            cos_radius: 0.9995,
        }),
        ..Environment::constant([0.4, 0.5, 0.7])
    }
}

const FLOOR: [[f32; 3]; 2] = [[-8.0, -2.0, -8.0], [8.0, 0.0, 8.0]];
const CUBE: [[f32; 3]; 2] = [[-1.0, 0.0, -2.0], [1.0, 3.0, 1.0]];

fn look() -> Frame {
    frame(camera(Vec3::new(4.0, 5.0, 6.0), Vec3::new(0.0, 1.0, 0.0), 45.0), 48, 32, 16)
}

fn scene_of(boxes: &[([[f32; 3]; 2], f32)]) -> SceneBuilder {
    boxes.iter().fold(SceneBuilder::default(), |scene, &([low, high], albedo)| {
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        // Blocks are dielectrics of glTF's index.
        let material = orthant_resident::rows::MaterialRow { ior: 1.5, roughness: 1.0, ..lambert(albedo) };
        scene.add_at(cuboid((low + high) / 2.0, (high - low) / 2.0), material, DAffine3::IDENTITY)
    })
}

/// The share of pixels that differ by more than a thousandth, and the difference of the means.
fn difference(a: &Film, b: &Film) -> (f32, f32) {
    let (x, y) = (a.resolve(), b.resolve());
    let far = x.iter().zip(&y).filter(|(p, q)| {
        let (p, q) = (Vec3::from_array(**p), Vec3::from_array(**q));
        p.distance(q) > 1e-3 * (p.length() + q.length())
    });
    (far.count() as f32 / x.len() as f32, (mean(a) - mean(b)).length() / mean(b).length())
}

#[test]
fn blocks_models_and_both_together_give_one_image() {
    let plain = look();
    let anchor = raw(Vec3::from_array(plain.camera.position));
    let mut in_world = plain.clone();
    in_world.world = Some(slice(&plain, anchor, Shade::Path));

    let mut models = scene_of(&[(FLOOR, 0.8), (CUBE, 0.5)]).backend(sky());
    let expected = render(&mut models, plain);

    let mut blocks = CpuBackend::new();
    blocks.set_environment(sky()).unwrap();
    let mut content = Content::default();
    box_of(&mut content, FLOOR[0], FLOOR[1], 1);
    box_of(&mut content, CUBE[0], CUBE[1], 2);
    load(&mut blocks, &set(content));
    let (far, means) = difference(&render(&mut blocks, in_world.clone()), &expected);
    assert!(far < 0.03 && means < 2e-3, "blocks: {far} of the pixels, {means} of the mean");

    for floor_is_block in [true, false] {
        let (block, id, model) = if floor_is_block { (FLOOR, 1, (CUBE, 0.5)) } else { (CUBE, 2, (FLOOR, 0.8)) };
        let mut both = scene_of(&[model]).backend(sky());
        let mut content = Content::default();
        box_of(&mut content, block[0], block[1], id);
        load(&mut both, &set(content));
        let (far, means) = difference(&render(&mut both, in_world.clone()), &expected);
        assert!(far < 0.03 && means < 2e-3, "both: {far} of the pixels, {means} of the mean");
    }
}

#[test]
fn white_blocks_under_a_white_sky_vanish() {
    let mut content = Content::default();
    box_of(&mut content, FLOOR[0], FLOOR[1], 5);
    content.dense(true, 13, [0, 0, 0, 0], |p| if (p[0] ^ p[1] ^ p[2]) & 3 == 0 { bits(5, -3) } else { 0 });
    let mut backend = CpuBackend::new();
    backend.set_environment(Environment::constant([1.0; 3])).unwrap();
    load(&mut backend, &set(content));
    let mut frame = look();
    frame.max_depth = 200;
    frame.world = Some(slice(&frame, raw(Vec3::from_array(frame.camera.position)), Shade::Path));
    let film = render(&mut backend, frame);
    let radiance = mean(&film);
    assert!((radiance - Vec3::ONE).abs().max_element() < 5e-3, "{radiance}");
}

#[test]
fn glass_takes_its_share_of_what_is_seen_and_of_the_sun() {
    let mut content = Content::default();
    box_of(&mut content, FLOOR[0], FLOOR[1], 1);
    let bare = set(content.clone());
    box_of(&mut content, [-8.0, 1.0, -8.0], [8.0, 3.0, 8.0], 3);
    let roofed = set(content);
    // From straight above, under a sun straight above, both ways lead through two units of glass.
    let mut frame = frame(camera(Vec3::new(0.0, 6.0, 0.0), Vec3::ZERO, 1.0), 8, 8, 16);
    frame.max_depth = 2;
    frame.world = Some(slice(&frame, raw(Vec3::new(0.0, 6.0, 0.0)), Shade::Path));
    let sun = Sun { direction: [0.0, 1.0, 0.0], radiance: [1000.0; 3], cos_radius: 0.99999 };
    let seen = [&bare, &roofed].map(|arenas| {
        let mut backend = CpuBackend::new();
        backend.set_environment(Environment { sun: Some(sun), ..Environment::none() }).unwrap();
        load(&mut backend, arenas);
        mean(&render(&mut backend, frame.clone()))
    });
    let expected = seen[0] * Vec3::new(-0.4, -1.2, -2.8).map(f32::exp);
    assert!(((seen[1] - expected) / expected).abs().max_element() < 1e-3, "{} for {expected}", seen[1]);
}

#[test]
fn a_block_that_shines_lights_what_is_around_it() {
    // A floor far larger than the lamp's height above it, lit by a lamp that fills the sky but for a gap.
    let mut content = Content::default();
    box_of(&mut content, [-500.0, -2.0, -500.0], [500.0, 0.0, 500.0], 1);
    box_of(&mut content, [-500.0, 4.0, -500.0], [500.0, 5.0, 500.0], 4);
    let mut backend = CpuBackend::new();
    load(&mut backend, &set(content));
    let mut frame = frame(camera(Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.5, 0.0, 0.0), 10.0), 8, 8, 64);
    frame.max_depth = 2;
    frame.world = Some(slice(&frame, raw(Vec3::new(0.0, 2.0, 0.0)), Shade::Path));
    let radiance = mean(&render(&mut backend, frame));
    // The lamp reflects nothing: the floor reflects about 0.8 of it.
    let share = radiance / Vec3::new(6.0, 5.0, 4.0);
    assert!(share.min_element() > 0.75 && share.max_element() < 0.87, "{share}");
}

#[test]
fn the_preview_is_a_sum_that_can_be_done_by_hand() {
    let mut content = Content::default();
    box_of(&mut content, FLOOR[0], FLOOR[1], 1);
    box_of(&mut content, [-8.0, 1.0, -8.0], [8.0, 3.0, 8.0], 3);
    let mut backend = CpuBackend::new();
    load(&mut backend, &set(content));
    let eye = Vec3::new(0.0, 6.0, 0.0);
    let mut frame = frame(camera(eye, Vec3::ZERO, 1.0), 5, 5, 4);
    frame.aovs = vec![Aov::Depth, Aov::Normal, Aov::Albedo, Aov::Block, Aov::Face, Aov::Cell, Aov::Node, Aov::Position];
    frame.world = Some(slice(&frame, raw(eye), PREVIEW));
    let film = render(&mut backend, frame);
    let n_l = 0.8;
    let lit = Vec3::new(0.2 + n_l, 0.2 + n_l, 0.3 + 0.9 * n_l) * 0.8 * Vec3::new(-0.2, -0.6, -1.4).map(f32::exp);
    let middle = Vec3::from_array(film.resolve()[12]);
    assert!((middle / lit - Vec3::ONE).abs().max_element() < 1e-3, "{middle} for {lit}");
    let aov = |i: usize| {
        let (aov, values) = &film.aovs[i];
        values[12 * aov.channels()..13 * aov.channels()].to_vec()
    };
    assert!((aov(0)[0] - 6.0).abs() < 1e-4);
    assert_eq!((aov(1), aov(2)), (vec![0.0, 1.0, 0.0], vec![0.8; 3]));
    assert_eq!((aov(3), aov(4), aov(5), aov(6)), (vec![1.0], vec![3.0], vec![0.0, -7.0, 0.0, 0.0], vec![-1.0]));
    assert!(Vec3::from_slice(&aov(7)).distance(Vec3::new(0.0, -6.0, 0.0)) < 1e-4);
}

#[test]
fn an_image_is_the_same_a_million_units_away() {
    let far = 1_000_000 * UNIT;
    let mut films = Vec::new();
    for (shade, by) in [(PREVIEW, 0), (PREVIEW, far), (Shade::Path, 0), (Shade::Path, far)] {
        let mut content = Content::default();
        box_of(&mut content, FLOOR[0], FLOOR[1], 1);
        content.dense(true, 13, [0, 0, 0, 0], |p| if (p[0] ^ p[1] ^ p[2]) & 3 == 0 { bits(2, -3) } else { 0 });
        content.dense(true, 13, [-1, 0, 0, 0], |p| if (p[0] + p[1] + p[2]) % 5 == 0 { bits(3, -3) } else { 0 });
        let by = [by, -by, by, 0];
        let mut backend = CpuBackend::new();
        backend.set_environment(sky()).unwrap();
        load(&mut backend, &set(content.moved(by)));
        let mut frame = look();
        let anchor = raw(Vec3::from_array(frame.camera.position));
        let mut view = slice(&frame, std::array::from_fn(|a| anchor[a] + by[a]), shade);
        view.edges = 0.05;
        frame.world = Some(view);
        films.push(render(&mut backend, frame));
    }
    assert!(films[0] == films[1] && films[2] == films[3]);
    assert!(films[0].sum.iter().any(|p| *p != films[0].sum[0]));
}

#[test]
fn a_frame_that_runs_out_of_steps_shows_it() {
    let mut content = Content::default();
    content.dense(true, 13, [0, 0, 0, 0], |p| if (p[0] ^ p[1] ^ p[2]) & 3 == 0 { bits(2, -3) } else { 0 });
    let mut backend = CpuBackend::new();
    load(&mut backend, &set(content));
    for shade in [PREVIEW, Shade::Path] {
        let mut frame = look();
        let mut view = slice(&frame, raw(Vec3::from_array(frame.camera.position)), shade);
        view.step_budget = 3;
        frame.world = Some(view);
        let ticket = backend.submit(frame).unwrap();
        let mut status = backend.poll(ticket, std::time::Duration::from_secs(60)).unwrap();
        while !status.is_done() {
            status = backend.poll(ticket, std::time::Duration::from_secs(60)).unwrap();
        }
        assert!(status.world.exhausted > 0 && status.world.exhausted < status.world.rays);
        assert_eq!(status.world.rays, status.rays.total());
        let film = backend.read_film(ticket).unwrap();
        assert!(film.resolve().iter().any(|&p| Vec3::from_array(p).distance(EXHAUSTED_COLOR.into()) < 1e-5));
    }
}

#[test]
fn a_model_scene_is_seen_with_one_layer_by_light_transport_alone() {
    let mut backend = scene_of(&[(FLOOR, 0.8)]).backend(sky());
    let mut frame = look();
    frame.world = Some(slice(&frame, [0; 4], PREVIEW));
    assert!(
        matches!(backend.submit(frame.clone()), Err(BackendError::InvalidFrame(why)) if why.contains("path tracing"))
    );
    let mut view = slice(&frame, [0; 4], Shade::Path);
    view.layers.push(view.layers[0]);
    frame.world = Some(view);
    assert!(matches!(backend.submit(frame), Err(BackendError::InvalidFrame(why)) if why.contains("one layer")));
}
