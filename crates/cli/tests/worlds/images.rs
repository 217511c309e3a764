//! Images of worlds through the CPU backend.

use super::Random;
use super::patches::{UNIT, empty_world, patch};
use orthant_cpu::CpuBackend;
use orthant_render::world::view::{Look, Mode, Turns, WorldCamera};
use orthant_render::world::{BuildOptions, DerivedWorld, light, load};
use orthant_resident::environment::Sun;
use orthant_resident::frame::{Aov, Estimator, PixelFilter, Tile};
use orthant_resident::world::{Shade, WorldView};
use orthant_resident::{Backend, Environment, Film, Frame};
use orthant_world::edit::{fill_box, voxel_bounds};
use orthant_world::{Block, BlockId, Point4, Scale, World};
use std::time::Duration;

/// A blue sky and a sun.
pub fn sky() -> Environment {
    let direction = glam::Vec3::new(0.4, 0.8, 0.45).normalize().to_array();
    let sun = Sun { direction, radiance: [2000.0, 1900.0, 1700.0], cos_radius: 0.9996 };
    Environment { sun: Some(sun), ..Environment::constant([0.4, 0.5, 0.8]) }
}

/// Both ways of shading.
pub fn shades() -> [Shade; 2] {
    [light::preview_light(&sky()), Shade::Path]
}

/// The three image modes.
pub const MODES: [Mode; 3] =
    [Mode::Slice, Mode::Integral { layers: 6, hidden_zoom: 1.0, mix: 8.0 }, Mode::Thick { each_side: 1, spacing: 0.5 }];

/// A backend that holds the world under the sky.
pub fn backend(derived: &DerivedWorld) -> CpuBackend {
    let mut backend = CpuBackend::new();
    backend.set_environment(sky()).expect("an environment");
    load(&mut backend, derived).expect("an empty set");
    backend
}

pub fn derive(world: &World) -> DerivedWorld {
    DerivedWorld::build(world, &BuildOptions::default()).expect("a small world")
}

pub fn frame(view: WorldView, width: u32, height: u32, aovs: Vec<Aov>) -> Frame {
    Frame {
        camera: WorldCamera::camera(&view, 0.6),
        width,
        height,
        tile: Tile { x: 0, y: 0, width, height },
        samples: 0..2,
        keep_blocks: false,
        seed: 7,
        max_depth: 4,
        roulette_depth: 3,
        firefly_clamp: None,
        estimator: Estimator::Mis,
        filter: PixelFilter::Box,
        aovs,
        threads: 0,
        world: Some(view),
    }
}

pub fn render(backend: &mut CpuBackend, frame: Frame) -> Film {
    let ticket = backend.submit(frame).expect("a frame");
    while !backend.poll(ticket, Duration::from_secs(60)).expect("the last frame").is_done() {}
    backend.read_film(ticket).expect("the last frame")
}

fn look(shade: Shade) -> Look {
    Look { shade, distance: 200.0, edges: 0.04 }
}

const AOVS: [Aov; 7] = [Aov::Albedo, Aov::Normal, Aov::Depth, Aov::Position, Aov::Block, Aov::Face, Aov::Cell];

#[test]
fn a_world_a_million_units_away_gives_the_same_image() {
    let million = 1_000_000 * UNIT;
    let mut films: Vec<Vec<Film>> = Vec::new();
    for base in [[0; 4], [million, -million, -million, 0], [-million, million, million, 0]] {
        let mut random = Random(77);
        let mut world = empty_world();
        for _ in 0..60 {
            for patch in patch(&mut random, &world, base) {
                world.apply(&patch).expect("a patch");
            }
        }
        let mut backend = backend(&derive(&world));
        let at = [3 * UNIT / 4, 5 * UNIT, 30 * UNIT, UNIT / 2];
        let position = Point4::from_raw(std::array::from_fn(|a| base[a] + at[a]));
        let camera = WorldCamera::new(position, &Turns { yaw: 11.0, xw: 4.0, zw: -3.0, pitch: -8.0 });
        let mut shown = Vec::new();
        for mode in MODES {
            for shade in shades() {
                shown.push(render(&mut backend, frame(camera.view(&mode, &look(shade)), 48, 32, AOVS.to_vec())));
            }
        }
        films.push(shown);
    }
    for (i, film) in films[0].iter().enumerate() {
        assert!(films[1][i] == *film && films[2][i] == *film, "image {i} differs");
        let blocks = &film.aovs[4].1;
        let hits = blocks.iter().filter(|&&block| block > 0.0).count();
        assert!(hits > blocks.len() / 8 && hits < blocks.len(), "image {i} shows {hits} blocks of {}", blocks.len());
        assert!(film.sum.iter().flatten().all(|v| v.is_finite()));
    }
}

#[test]
fn normals_of_large_and_small_blocks_are_exact_far_from_the_origin() {
    let turns = |yaw: f64, zw: f64, pitch: f64| Turns { yaw, xw: 0.0, zw, pitch };
    // Which face a camera sees that looks along this axis, to its positive end or its negative one.
    let looks = [
        (turns(-90.0, 0.0, 0.0), 0, true),
        (turns(90.0, 0.0, 0.0), 0, false),
        (turns(0.0, 0.0, 90.0), 1, true),
        (turns(0.0, 0.0, -90.0), 1, false),
        (turns(180.0, 0.0, 0.0), 2, true),
        (turns(0.0, 0.0, 0.0), 2, false),
        (turns(0.0, 90.0, 0.0), 3, true),
        (turns(0.0, -90.0, 0.0), 3, false),
    ];
    for scale in [-3, 3] {
        let scale = Scale::new(scale).expect("a scale");
        let edge = scale.edge().raw();
        let index = [8_000_000, -8_000_001, 7_999_999, -7_000_000].map(|i: i64| i * 8192 / edge);
        let bounds = voxel_bounds(index, scale).expect("in space");
        let mut world = empty_world();
        world.apply(&fill_box(bounds, Block::of(BlockId(1), scale))).expect("a patch");
        let mut backend = backend(&derive(&world));
        for (turns, axis, positive) in looks {
            let mut position = bounds.min_raw().map(|c| c + edge / 2 - edge / 16);
            position[axis] += if positive { -7 } else { 7 } * edge;
            let camera = WorldCamera::new(Point4::from_raw(position), &turns);
            let view = camera.view(&Mode::Slice, &Look { distance: 1e3, ..look(shades()[0]) });
            let layer = view.layers[0];
            let camera = WorldCamera::camera(&view, 0.01);
            let film = render(&mut backend, Frame { camera, ..frame(view, 3, 3, AOVS.to_vec()) });
            let value = |aov: usize| film.aovs[aov].1[4 * AOVS[aov].channels()..].to_vec();
            let normal = [value(1)[0], value(1)[1], value(1)[2]];
            let mut expected = [0.0; 4];
            expected[axis] = if positive { -1.0 } else { 1.0 };
            assert_eq!(normal, layer.from_world(expected), "{scale:?} axis {axis}");
            assert_eq!(layer.to_world(normal), expected, "{scale:?} axis {axis}");
            assert_eq!((value(4)[0], value(5)[0]), (1.0, (2 * axis + usize::from(!positive)) as f32));
            let cell: Vec<f32> = (0..4).map(|a| (index[a] - position[a].div_euclid(edge)) as f32).collect();
            assert_eq!(value(6)[..4], cell, "{scale:?} axis {axis}");
        }
    }
}
