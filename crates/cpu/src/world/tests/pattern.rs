//! What varies over a face.

use super::super::pattern::{FacePoint, orientation_axes, pattern_factor};
use super::super::testing::{Content, Random, UNIT, bits, opaque};
use super::super::{RayEnd, WorldRay, WorldScene, trace_ray};
use crate::world::surface::{BlockSurface, layer_normal, layer_runs};
use glam::Vec3;
use orthant_resident::world::rows::{UNKNOWN_COLOR, pattern};
use orthant_resident::world::{BlockRow, Layer, WorldArenas, WorldCounts};
use std::collections::HashSet;

const RUNS: [bool; 4] = [true; 4];

#[test]
fn orientations_are_the_192_rotations_in_lexicographic_order() {
    let mut seen = HashSet::new();
    for code in 0..192 {
        let axes = orientation_axes(code);
        assert!(seen.insert(axes));
        let inversions = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b))).filter(|&(a, b)| axes[a].0 > axes[b].0);
        let negative = axes.iter().filter(|axis| axis.1).count();
        assert_eq!((inversions.count() + negative) % 2, 0, "the determinant is 1");
    }
    assert_eq!(orientation_axes(0), [(0, false), (1, false), (2, false), (3, false)]);
    assert_eq!(orientation_axes(8).map(|axis| axis.0), [0, 1, 3, 2]);
    assert_eq!(orientation_axes(23 * 8).map(|axis| axis.0), [3, 2, 1, 0]);
    assert_eq!(orientation_axes(5), [(0, true), (1, false), (2, true), (3, false)]);
    assert_eq!(orientation_axes(200), orientation_axes(0));
}

#[test]
fn a_turned_block_turns_its_coordinates() {
    let local = [0.1, 0.2, 0.3, 0.4];
    let point = FacePoint::new(local, 1, 0, RUNS);
    assert_eq!((point.place, point.normal), ([0.1, 0.3, 0.4], 1));
    // X and Y are exchanged, and the image of x points backwards, which makes w point forwards.
    let code = (0..192).find(|&c| orientation_axes(c) == [(1, true), (0, false), (2, false), (3, false)]).unwrap();
    let point = FacePoint::new(local, 1, code, RUNS);
    assert_eq!((point.place, point.normal), ([0.1, 0.3, 0.4], 0));
    let point = FacePoint::new(local, 0, code, RUNS);
    assert_eq!((point.place, point.normal), ([1.0 - 0.2, 0.3, 0.4], 1));
}

#[test]
fn axes_across_the_layer_have_no_lines() {
    let point = FacePoint::new([0.5, 0.0, 0.5, 0.01], 1, 0, RUNS);
    assert!(point.is_edge(0.05) && !point.is_edge(0.005));
    let slice = FacePoint::new([0.5, 0.0, 0.5, 0.01], 1, 0, [true, true, true, false]);
    assert!(!slice.is_edge(0.05));
    assert!(FacePoint::new([0.98, 0.0, 0.5, 0.5], 1, 0, RUNS).is_edge(0.05));
}

#[test]
fn patterns_multiply_the_colour() {
    let arenas = WorldArenas { payload: vec![0xff00_00ff, 0x0000_ff00, 0xffff_ffff, 0], ..WorldArenas::default() };
    let scene = WorldScene::new(&arenas, [0; 4], 1);
    let factor = |row: &BlockRow, place: [f32; 3]| {
        pattern_factor(&scene, row, 1, &FacePoint { place, runs: [true; 3], normal: 1 })
    };
    let checker = BlockRow { pattern: pattern::CHECKER, cells: 4, contrast: 0.5, ..opaque([1.0; 3]) };
    assert_eq!(factor(&checker, [0.1, 0.1, 0.1]), Vec3::ONE);
    assert_eq!(factor(&checker, [0.3, 0.1, 0.1]), Vec3::splat(0.5));
    assert_eq!(factor(&checker, [0.3, 0.1, 1.0]), Vec3::ONE);
    let texture = BlockRow { pattern: pattern::TEXTURE, cells: 0, texture_size: 1 << 8, ..opaque([1.0; 3]) };
    assert_eq!(factor(&texture, [0.9, 0.2, 0.9]), Vec3::X);
    assert_eq!(factor(&texture, [0.9, 0.7, 0.9]), Vec3::Y);
    let beyond = BlockRow { cells: 4, ..texture };
    assert_eq!(factor(&beyond, [0.0; 3]), Vec3::from_array(UNKNOWN_COLOR));
    let noise = BlockRow { pattern: pattern::NOISE, cells: 4, contrast: 0.25, ..opaque([1.0; 3]) };
    let mut random = Random(5);
    let values: Vec<f32> = (0..1000).map(|_| factor(&noise, std::array::from_fn(|_| random.unit())).x).collect();
    assert!(values.iter().all(|v| (0.25..=1.0).contains(v)));
    let (low, high) = values.iter().fold((1.0_f32, 0.0_f32), |(l, h), &v| (l.min(v), h.max(v)));
    assert!(low < 0.45 && high > 0.8, "{low} {high}");
    assert!(
        (factor(&noise, [0.0, 0.3, 0.6]).x - factor(&noise, [1.0, 0.3, 0.6]).x).abs() < 1e-6,
        "it goes on in the next block"
    );
}

#[test]
fn the_place_in_a_block_is_at_its_own_scale() {
    // A block of 8 units, of which a part is left, seen from an anchor a million units out.
    let base = [8_000_008_i64 * UNIT, -16 * UNIT, 0, 24 * UNIT];
    let mut content = Content::default();
    content.uniform(base, base.map(|c| c + 4 * UNIT), bits(1, 3));
    let arenas = content.arenas(base);
    let anchor = base.map(|c| c + UNIT);
    let scene = WorldScene::new(&arenas, anchor, 100);
    let ray = WorldRay::new(&scene, [0.5, 9.0, 0.25, 1.0], [0.0, -1.0, 0.0, 0.0], 0.0, 1e3);
    let RayEnd::Hit(hit) = trace_ray(&scene, &ray, &mut WorldCounts::default()).end else { panic!("no hit") };
    assert_eq!((hit.t, hit.axis, hit.positive), (6.0, 1, true));
    let surface = BlockSurface::new(&scene, &ray, &hit, RUNS, 0.0);
    assert_eq!((surface.face, surface.id, surface.cell), (3, 1, [0; 4]));
    // x is at 1.5 of 8 units, so within lines of 0.2; z is at 1.25 and w at 2.
    assert_eq!(BlockSurface::new(&scene, &ray, &hit, RUNS, 0.16).albedo, surface.albedo * 0.5);
    assert_eq!(BlockSurface::new(&scene, &ray, &hit, RUNS, 0.15).albedo, surface.albedo);
}

#[test]
fn a_number_that_the_palette_has_not_is_drawn_in_the_warning_colour() {
    let mut content = Content::default();
    content.uniform([0; 4], [UNIT; 4], bits(99, 0));
    let arenas = content.arenas([0; 4]);
    let scene = WorldScene::new(&arenas, [0; 4], 100);
    let ray = WorldRay::new(&scene, [0.5, 0.5, 3.0, 0.5], [0.0, 0.0, -1.0, 0.0], 0.0, 1e3);
    let RayEnd::Hit(hit) = trace_ray(&scene, &ray, &mut WorldCounts::default()).end else { panic!("no hit") };
    assert_eq!(BlockSurface::new(&scene, &ray, &hit, RUNS, 0.0).albedo, Vec3::from_array(UNKNOWN_COLOR));
}

#[test]
fn normals_are_projected_into_the_layer() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let layer = Layer {
        axes: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, half, half]],
        right: [1.0, 0.0, 0.0],
        up: [0.0, 1.0, 0.0],
        forward: [0.0, 0.0, -1.0],
    };
    assert_eq!(layer_normal(&layer, 1, false, Vec3::X), -Vec3::Y);
    assert_eq!(layer_normal(&layer, 3, true, Vec3::X), Vec3::Z);
    assert_eq!(layer_normal(&layer, 2, false, Vec3::X), -Vec3::Z);
    assert_eq!(layer_runs(&layer), RUNS);
    let slice = Layer { axes: [layer.axes[0], layer.axes[1], [0.0, 0.0, 1.0, 0.0]], ..layer };
    assert_eq!(layer_runs(&slice), [true, true, true, false]);
    assert_eq!(layer_normal(&slice, 3, true, Vec3::X), Vec3::X);
}
