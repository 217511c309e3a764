//! Rays against what they must hit.

use super::walk::reference::{brute_force, closest_hits};
use super::{Hit, Ray};
use crate::scene::ResidentScene;
use crate::scene::testing::{TestMesh, instance, scene};
use glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot, Vec3};
use orthant_resident::rows::{NodeFlags, RenderNodeRow};
use proptest::prelude::*;
use rayon::prelude::*;
use std::collections::HashSet;

/// A triangle in the plane z = 0, counter-clockwise as seen from +z.
fn triangle() -> TestMesh {
    TestMesh { positions: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]], indices: vec![0, 1, 2] }
}

fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray {
    Ray::new(Vec3::from_array(origin), Vec3::from_array(direction))
}

fn opaque(world: DAffine3) -> Vec<RenderNodeRow> {
    vec![instance(0, world, NodeFlags::OPAQUE)]
}

#[test]
fn a_hit_has_the_weights_of_its_corners_and_the_parameter_of_the_ray() {
    let scene = scene(&[triangle()], opaque(DAffine3::from_scale(DVec3::splat(2.0))));
    // Object-space point (1, 2, 0): weights 1/4, 1/4, 1/2.
    let hit = scene.closest_hit(&ray([2.0, 4.0, 6.0], [0.0, 0.0, -0.5]), |_| unreachable!()).unwrap();
    assert_eq!((hit.t, hit.b1, hit.b2, hit.back_face), (12.0, 0.25, 0.5, false));
    assert_eq!((hit.render_node, hit.triangle), (0, 0));
}

#[test]
fn a_back_face_exists_for_double_sided_nodes_only() {
    let from_behind = ray([1.0, 1.0, -3.0], [0.0, 0.0, 1.0]);
    let one = scene(&[triangle()], opaque(DAffine3::IDENTITY));
    assert_eq!(one.closest_hit(&from_behind, |_| true), None);
    assert!(!one.any_hit(&from_behind, |_| true));
    let flags = NodeFlags::OPAQUE | NodeFlags::DOUBLE_SIDED;
    let two = scene(&[triangle()], vec![instance(0, DAffine3::IDENTITY, flags)]);
    assert!(two.closest_hit(&from_behind, |_| true).unwrap().back_face);
    assert!(two.any_hit(&from_behind, |_| true));
}

#[test]
fn a_mirrored_instance_keeps_its_front() {
    // Mirrored along x, the corners run clockwise in world space as seen from +z, but +z is still the front.
    let scene = scene(&[triangle()], opaque(DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))));
    let hit = scene.closest_hit(&ray([-1.0, 1.0, 3.0], [0.0, 0.0, -1.0]), |_| true).unwrap();
    assert!(!hit.back_face);
    assert_eq!(scene.closest_hit(&ray([-1.0, 1.0, -3.0], [0.0, 0.0, 1.0]), |_| true), None);
}

#[test]
fn both_ends_of_the_range_are_exclusive() {
    let scene = scene(&[triangle()], opaque(DAffine3::IDENTITY));
    let at_2 = ray([1.0, 1.0, 2.0], [0.0, 0.0, -1.0]);
    for (t_min, t_max, hit) in [(0.0, 2.0, false), (2.0, 9.0, false), (1.9, 2.1, true), (-5.0, 9.0, true)] {
        let ray = Ray { t_min, t_max, ..at_2 };
        assert_eq!(scene.closest_hit(&ray, |_| true).is_some(), hit, "{t_min} {t_max}");
        assert_eq!(scene.any_hit(&ray, |_| true), hit, "{t_min} {t_max}");
    }
}

#[test]
fn a_ray_passes_through_what_is_not_accepted() {
    let behind = DAffine3::from_translation(DVec3::new(0.0, 0.0, -1.0));
    let rows = vec![instance(0, DAffine3::IDENTITY, 0), instance(0, behind, NodeFlags::OPAQUE)];
    let scene = scene(&[triangle()], rows);
    let down = ray([1.0, 1.0, 2.0], [0.0, 0.0, -1.0]);
    assert_eq!(scene.closest_hit(&down, |_| true).unwrap().render_node, 0);
    assert_eq!(scene.closest_hit(&down, |hit| hit.render_node != 0).unwrap().render_node, 1);
    let short = Ray { t_max: 2.5, ..down };
    assert!(scene.any_hit(&short, |_| true));
    assert!(!scene.any_hit(&short, |_| false));
}

#[test]
fn equally_near_hits_are_settled_by_their_numbers() {
    let mut twice = triangle();
    twice.indices.extend([0, 1, 2]);
    let node = instance(0, DAffine3::IDENTITY, 0);
    let scene = scene(&[twice], vec![node; 5]);
    let down = ray([1.0, 1.0, 2.0], [0.0, 0.0, -1.0]);
    let hit = scene.closest_hit(&down, |_| true).unwrap();
    assert_eq!((hit.render_node, hit.triangle), (0, 0));
    let hit = scene.closest_hit(&down, |hit| hit.render_node >= 3 && hit.triangle == 1).unwrap();
    assert_eq!((hit.render_node, hit.triangle), (3, 1));
}

#[test]
fn a_ray_that_is_no_ray_hits_nothing() {
    let scene = scene(&[triangle()], opaque(DAffine3::IDENTITY));
    let good = ray([1.0, 1.0, 2.0], [0.0, 0.0, -1.0]);
    assert!(scene.any_hit(&good, |_| true));
    for bad in [
        ray([1.0, 1.0, 2.0], [0.0; 3]),
        ray([1.0, 1.0, 2.0], [0.0, f32::NAN, -1.0]),
        ray([1.0, 1.0, 2.0], [0.0, 0.0, f32::NEG_INFINITY]),
        ray([f32::NAN, 1.0, 2.0], [0.0, 0.0, -1.0]),
        ray([1.0, 1.0, f32::INFINITY], [0.0, 0.0, -1.0]),
        Ray { t_max: f32::NAN, ..good },
        Ray { t_min: 5.0, t_max: 4.0, ..good },
    ] {
        assert_eq!(scene.closest_hit(&bad, |_| true), None, "{bad:?}");
        assert!(!scene.any_hit(&bad, |_| true), "{bad:?}");
    }
}

#[test]
fn an_axis_parallel_ray_hits_a_flat_box_through_its_corner_and_along_its_side() {
    // A square of two triangles in the plane y = 0; its boxes have no thickness.
    let square = TestMesh {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0]],
        indices: vec![0, 2, 1, 0, 3, 2],
    };
    let scene = scene(&[square], opaque(DAffine3::IDENTITY));
    for zero in [0.0, -0.0] {
        for (x, z) in [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.0, 0.5), (1.0, 0.25)] {
            let down = ray([x, 3.0, z], [zero, -1.0, zero]);
            assert_eq!(scene.closest_hit(&down, |_| true).map(|hit| hit.t), Some(3.0), "{x} {z}");
        }
    }
}

/// What a soup is made of.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => -4.0f32..4.0,
        // Few values, so that coordinates meet.
        4 => (-4i8..=4).prop_map(f32::from),
        1 => Just(-0.0f32),
    ]
}

fn point() -> impl Strategy<Value = [f32; 3]> {
    [coordinate(), coordinate(), coordinate()]
}

/// Triangles of every kind, wholesome and not.
fn soup() -> impl Strategy<Value = TestMesh> {
    let triangle = prop_oneof![
        6 => [point(), point(), point()],
        // Small ones, which boxes tell apart.
        6 => (point(), [point(), point(), point()]).prop_map(|(c, t)| t.map(|p| std::array::from_fn(|k| c[k] + 0.1 * p[k]))),
        // Axis-aligned ones, whose boxes are flat.
        3 => ([point(), point(), point()], 0usize..3).prop_map(|(mut t, k)| { t[1][k] = t[0][k]; t[2][k] = t[0][k]; t }),
        1 => (point(), point()).prop_map(|(p, q)| [p, q, q]),
        1 => point().prop_map(|p| [p, p, p]),
        1 => point().prop_map(|p| [p, p.map(|x| 2.0 * x), p.map(|x| 4.0 * x)]),
        1 => [point(), point(), point()].prop_map(|t| t.map(|p| p.map(|x| x * 1e10))),
        1 => [point(), point(), point()].prop_map(|t| t.map(|p| p.map(|x| x * 1e-10))),
        1 => ([point(), point(), point()], prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(-1e38f32)])
            .prop_map(|(mut t, x)| { t[2][1] = x; t }),
    ];
    prop::collection::vec(triangle, 1..60).prop_map(|triangles| TestMesh {
        indices: (0..3 * triangles.len() as u32).collect(),
        positions: triangles.into_iter().flatten().collect(),
    })
}

fn transform() -> impl Strategy<Value = DAffine3> {
    let rigid = (0.0..6.3, 0.0..6.3, 0.0..6.3).prop_map(|(a, b, c)| DQuat::from_euler(EulerRot::XYZ, a, b, c));
    let scale = prop_oneof![
        Just(DVec3::ONE),
        (0.1..3.0).prop_map(DVec3::splat),
        (0.2..3.0, -3.0..-0.2, 0.2..3.0).prop_map(|(x, y, z)| DVec3::new(x, y, z)),
    ];
    let shear = (-0.5..0.5).prop_map(|s| DMat3::from_cols(DVec3::X, DVec3::new(s, 1.0, 0.0), DVec3::Z));
    let shift = prop_oneof![3 => -6.0..6.0, 1 => Just(1e4)].prop_map(|x| DVec3::new(x, -0.5 * x, 1.0));
    prop_oneof![
        1 => Just(DAffine3::IDENTITY),
        4 => (rigid, scale, shear, shift).prop_map(|(q, s, m, t)| DAffine3 {
            matrix3: DMat3::from_quat(q) * m * DMat3::from_diagonal(s),
            translation: t,
        }),
    ]
}

fn flags() -> impl Strategy<Value = u32> {
    (0u32..4).prop_map(|i| [0, NodeFlags::OPAQUE][(i & 1) as usize] | [0, NodeFlags::DOUBLE_SIDED][(i >> 1) as usize])
}

fn any_scene() -> impl Strategy<Value = ResidentScene> {
    (prop::collection::vec(soup(), 1..4), prop::collection::vec((0usize..4, transform(), flags()), 1..12)).prop_map(
        |(meshes, instances)| {
            let rows = instances.iter().map(|&(mesh, world, f)| instance((mesh % meshes.len()) as u32, world, f));
            scene(&meshes, rows.collect())
        },
    )
}

/// A ray from somewhere to a place given by an instance, a triangle and weights: corners and edges included.
#[derive(Clone, Debug)]
struct Aim {
    origin: [f32; 3],
    node: usize,
    triangle: usize,
    weights: (f32, f32),
    axis: Option<(usize, f32)>,
    range: (f32, f32),
}

fn aim() -> impl Strategy<Value = Aim> {
    let weights = prop_oneof![
        3 => (0.0f32..1.0, 0.0f32..1.0).prop_map(|(a, b)| if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) }),
        1 => prop_oneof![Just((0.0, 0.0)), Just((1.0, 0.0)), Just((0.0, 1.0))],
        1 => (0.0f32..1.0).prop_map(|a| (a, 0.0)),
        1 => (0.0f32..1.0).prop_map(|a| (a, 1.0 - a)),
    ];
    let axis = prop::option::weighted(0.3, (0usize..3, prop_oneof![Just(1.0f32), Just(-1.0f32)]));
    let range = prop_oneof![3 => Just((0.0f32, f32::INFINITY)), 1 => (0.0f32..0.5, 0.5f32..2.0)];
    (point(), any::<usize>(), any::<usize>(), weights, axis, range)
        .prop_map(|(origin, node, triangle, weights, axis, range)| Aim { origin, node, triangle, weights, axis, range })
}

impl Aim {
    fn ray(&self, scene: &ResidentScene) -> Ray {
        let node = self.node % scene.render_nodes.len();
        let row = &scene.render_nodes[node];
        let desc = &scene.mesh_descs[row.primitive as usize];
        let triangle = (self.triangle % desc.triangle_count() as usize) as u32;
        let [a, b, c] = scene.triangle_positions(node as u32, triangle);
        let (b1, b2) = self.weights;
        let target = row.world.transform_point(a * (1.0 - b1 - b2) + b * b1 + c * b2);
        let (t_min, t_max) = self.range;
        match self.axis {
            Some((axis, sign)) => {
                // Parallel to an axis, with exact zeros of either sign, through the target.
                let mut direction = [0.0 * sign; 3];
                direction[axis] = sign;
                let direction = Vec3::from_array(direction);
                Ray { origin: target - 5.0 * direction, direction, t_min, t_max: 10.0 * t_max }
            }
            None => {
                let origin = Vec3::from_array(self.origin);
                Ray { origin, direction: target - origin, t_min, t_max }
            }
        }
    }
}

/// An any-hit filter without a pattern.
fn accepts(hit: &Hit) -> bool {
    (hit.render_node.wrapping_mul(0x9e37_79b9) ^ hit.triangle.wrapping_mul(0x85eb_ca6b)) & 0x40 == 0
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn the_trees_leave_out_no_hit_of_any_soup(scene in any_scene(), aims in prop::collection::vec(aim(), 64)) {
        for aim in aims {
            let ray = aim.ray(&scene);
            let expected = brute_force(&scene, &ray, accepts);
            for hit in closest_hits(&scene, &ray, accepts) {
                prop_assert_eq!(hit, expected, "{:?}", ray);
            }
            prop_assert_eq!(scene.closest_hit(&ray, accepts), expected);
            prop_assert_eq!(scene.any_hit(&ray, accepts), expected.is_some(), "{:?}", ray);
            // Nothing is asked twice.
            let mut asked = HashSet::new();
            scene.any_hit(&ray, |hit| {
                assert!(asked.insert((hit.render_node, hit.triangle)));
                false
            });
        }
    }
}

/// Hits in `f64`, nearest first: (t, node, triangle, smallest weight).
fn exact_hits(scene: &ResidentScene, ray: &Ray) -> Vec<(f64, u32, u32, f64)> {
    let mut hits = Vec::new();
    for (node, row) in scene.render_nodes.iter().enumerate() {
        let inverse = row.inverse.rows.map(|r| r.map(f64::from));
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let map = |v: DVec3, w: f64| {
            let at = |i: usize| inverse[i][0] * v.x + inverse[i][1] * v.y + inverse[i][2] * v.z + w * inverse[i][3];
            DVec3::new(at(0), at(1), at(2))
        };
        let (o, d) = (map(o, 1.0), map(d, 0.0));
        let desc = &scene.mesh_descs[row.primitive as usize];
        for triangle in 0..desc.triangle_count() {
            let [a, b, c] = scene.triangle_positions(node as u32, triangle).map(|p| p.as_dvec3());
            let normal = (b - a).cross(c - a);
            let volume = normal.dot(d);
            let t = normal.dot(a - o) / volume;
            let p = o + t * d;
            let weight = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p).dot(normal) / normal.length_squared();
            let least = weight(a, b, p).min(weight(b, c, p)).min(weight(c, a, p));
            hits.push((t, node as u32, triangle, least));
        }
    }
    hits.retain(|hit| hit.0.is_finite());
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    hits
}

/// Rows of four instances with scales, rotations and a reflection.
fn four_instances(random: &mut Random) -> Vec<RenderNodeRow> {
    let mut rows = Vec::new();
    for _ in 0..4 {
        let axis = DVec3::from_array(random.point().map(f64::from)).normalize();
        let scale = DVec3::new(0.5, 1.0, -2.0) * f64::from(random.next() + 0.5);
        let shift = DVec3::from_array(random.point().map(|x| 6.0 * f64::from(x)));
        let world = DAffine3::from_scale_rotation_translation(scale, DQuat::from_axis_angle(axis, 2.0), shift);
        rows.push(instance(0, world, NodeFlags::OPAQUE | NodeFlags::DOUBLE_SIDED));
    }
    rows
}

#[test]
fn hits_are_those_of_a_computation_in_f64() {
    // A transform to object space rounds the ray's origin; without one a few units in the last place remain.
    hits_agree_with_f64(four_instances, 40.0);
    let flags = NodeFlags::OPAQUE | NodeFlags::DOUBLE_SIDED;
    hits_agree_with_f64(|_| vec![instance(0, DAffine3::IDENTITY, flags)], 8.0);
}

/// Compares with `f64`, and `t` within `max_ulp` units in the last place of the distances that enter.
fn hits_agree_with_f64(instances: impl Fn(&mut Random) -> Vec<RenderNodeRow>, max_ulp: f64) {
    let mut random = Random(3);
    let (mut decided, mut worst) = (0, 0.0f64);
    for _ in 0..60 {
        let mesh = TestMesh {
            positions: (0..150).map(|_| random.point().map(|x| 4.0 * x)).collect(),
            indices: (0..150).collect(),
        };
        let rows = instances(&mut random);
        let scene = scene(&[mesh], rows);
        for _ in 0..200 {
            let ray = ray(random.point().map(|x| 10.0 * x), random.point());
            let exact = exact_hits(&scene, &ray);
            // Only rays that pass every edge at a distance and every hit with one.
            if exact.iter().any(|h| h.0 > -0.1 && h.3.abs() < 1e-4) {
                continue;
            }
            let ahead: Vec<_> = exact.iter().filter(|h| h.3 > 0.0 && h.0 > 0.0).collect();
            if ahead.first().is_some_and(|h| h.0 < 1e-3) || ahead.windows(2).any(|w| w[1].0 - w[0].0 < 1e-4) {
                continue;
            }
            decided += 1;
            let hit = scene.closest_hit(&ray, |_| unreachable!());
            assert_eq!(hit.map(|h| (h.render_node, h.triangle)), ahead.first().map(|h| (h.1, h.2)));
            if let (Some(hit), Some(exact)) = (hit, ahead.first()) {
                let size = ray.origin.length().max(hit.t * ray.direction.length()) / ray.direction.length();
                let ulp = f64::from(f32::EPSILON * size);
                worst = worst.max((f64::from(hit.t) - exact.0).abs() / ulp);
            }
        }
    }
    assert!(decided > 6_000, "{decided}");
    assert!(worst < max_ulp, "{worst} ulp");
    println!("{decided} rays, at most {worst:.2} ulp");
}

/// PCG.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = ((state >> ((state >> 59) + 5)) ^ state).wrapping_mul(12_605_985_483_714_917_081);
        ((word >> 43) ^ word) as u32 as f32 / 4_294_967_808.0
    }

    /// Uniform in the cube -1..1.
    fn point(&mut self) -> [f32; 3] {
        [2.0 * self.next() - 1.0, 2.0 * self.next() - 1.0, 2.0 * self.next() - 1.0]
    }
}

/// A closed sphere of unit radius about the origin, with shared vertices.
fn sphere(rings: u32) -> TestMesh {
    let columns = 2 * rings;
    let at = |ring: u32, column: u32| match ring {
        0 => 0,
        r if r == rings => 1 + (rings - 1) * columns,
        r => 1 + (r - 1) * columns + column % columns,
    };
    let mut positions = vec![[0.0, 1.0, 0.0]];
    for ring in 1..rings {
        for column in 0..columns {
            let (st, ct) = (ring as f32 / rings as f32 * std::f32::consts::PI).sin_cos();
            let (sp, cp) = (column as f32 / columns as f32 * std::f32::consts::TAU).sin_cos();
            positions.push([st * cp, ct, st * sp]);
        }
    }
    positions.push([0.0, -1.0, 0.0]);
    let mut indices = Vec::new();
    for ring in 0..rings {
        for column in 0..columns {
            let [a, b] = [at(ring, column), at(ring, column + 1)];
            let [c, d] = [at(ring + 1, column), at(ring + 1, column + 1)];
            if ring > 0 {
                indices.extend([a, b, c]);
            }
            if ring + 1 < rings {
                indices.extend([b, d, c]);
            }
        }
    }
    TestMesh { positions, indices }
}

#[test]
fn ten_million_rays_find_no_crack_in_a_sphere() {
    let mesh = sphere(40);
    let worlds = [
        DAffine3::IDENTITY,
        DAffine3::from_scale_rotation_translation(
            DVec3::new(3.0, 0.7, 1.3),
            DQuat::from_euler(EulerRot::XYZ, 1.0, 2.0, 3.0),
            DVec3::new(10_000.0, -3_000.0, 0.1),
        ),
    ];
    for world in worlds {
        let outside = scene(std::slice::from_ref(&mesh), opaque(world));
        let flags = NodeFlags::OPAQUE | NodeFlags::DOUBLE_SIDED;
        let inside = scene(std::slice::from_ref(&mesh), vec![instance(0, world, flags)]);
        let row = outside.render_nodes[0];
        let through = (0..5_000u64).into_par_iter().map(|chunk| {
            let mut random = Random(chunk.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1);
            let mut through = 0;
            for i in 0..500 {
                // A point of the surface: a corner, a point of an edge, or any.
                let triangle = (random.next() * (mesh.indices.len() / 3) as f32) as u32;
                let [a, b, c] = outside.triangle_positions(0, triangle);
                let target = match i % 4 {
                    0 => a,
                    1 | 2 => a.lerp(b, random.next()),
                    _ => a.lerp(b, random.next()).lerp(c, random.next()),
                };
                let place = |p: Vec3| row.world.transform_point(p);
                let from_inside = loop {
                    let p = Vec3::from_array(random.point());
                    if p.length() < 0.9 {
                        break p;
                    }
                };
                let ray = Ray::new(place(from_inside), place(target) - place(from_inside));
                through += u64::from(!inside.any_hit(&ray, |_| true));
                // From outside, towards a point of the front that the ray does not graze.
                let normal = (b - a).cross(c - a).normalize();
                let away = (normal + 0.9 * Vec3::from_array(random.point())).normalize();
                let from_outside = place(target + away * (1.0 + 3.0 * random.next()));
                let direction = place(target) - from_outside;
                if normal.dot(away) > 0.2 && target.dot(away) > 0.2 {
                    through += u64::from(!outside.any_hit(&Ray::new(from_outside, direction), |_| true));
                } else {
                    through += u64::from(!inside.any_hit(&Ray::new(place(from_inside), -direction), |_| true));
                }
            }
            through
        });
        assert_eq!(through.sum::<u64>(), 0, "{world:?}");
    }
}
