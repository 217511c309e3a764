//! The TLAS after many batches, beside one that is built from the same rows.

use super::ResidentScene;
use super::testing::{TestMesh, batch_on, instance, load_batch, scene};
use crate::trace::Ray;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use orthant_resident::batch::RowRange;
use orthant_resident::rows::{NodeFlags, RenderNodeRow};
use proptest::prelude::*;

fn tetrahedron(size: f32) -> TestMesh {
    TestMesh {
        positions: vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]],
        indices: vec![0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3],
    }
}

fn meshes() -> Vec<TestMesh> {
    vec![tetrahedron(1.0), tetrahedron(0.3), TestMesh::default()]
}

/// A number in 0..1 that looks random.
fn random(seed: u64) -> f64 {
    let mut x = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((x ^ x >> 31) >> 11) as f64 / (1u64 << 53) as f64
}

fn place(seed: u64, spread: f64) -> RenderNodeRow {
    let at = |k: u64| (random(4 * seed + k) - 0.5) * spread;
    let map = DAffine3::from_rotation_translation(DQuat::from_rotation_y(at(3)), DVec3::new(at(0), at(1), at(2)));
    instance((seed % 3) as u32, map, NodeFlags::OPAQUE | NodeFlags::DOUBLE_SIDED)
}

/// Rows from one on.
type Write = (u32, Vec<RenderNodeRow>);

fn apply(scene: &mut ResidentScene, writes: Vec<Write>, blas_builds: Vec<u32>) {
    let mut batch = batch_on(scene);
    batch.render_nodes.ranges = writes.into_iter().map(|(first, rows)| RowRange { first, rows }).collect();
    let end = batch.render_nodes.ranges.last().map_or(0, |range| range.first + range.rows.len() as u32);
    batch.render_nodes.len = batch.render_nodes.len.max(end);
    batch.blas_builds = blas_builds;
    scene.apply(batch).expect("the batch of a test is valid");
}

fn assert_is_fresh(scene: &ResidentScene, seed: u64) {
    scene.validate().expect("the TLAS is that of the rows");
    let mut fresh = ResidentScene::new();
    let mut batch = load_batch(&meshes(), scene.render_nodes.clone());
    batch.positions.ranges[0].rows = scene.positions.clone();
    fresh.apply(batch).expect("the rows are good");
    for i in 0..20 {
        let at = |k: u64| ((random(seed + 100 * i + k) - 0.5) * 30.0) as f32;
        let origin = Vec3::new(at(0), at(1), at(2));
        let ray = Ray::new(origin, Vec3::new(at(3), at(4), at(5)) - origin);
        assert_eq!(scene.closest_hit(&ray, |_| true), fresh.closest_hit(&ray, |_| true));
        assert_eq!(scene.any_hit(&ray, |_| true), fresh.any_hit(&ray, |_| true));
    }
}

#[derive(Clone, Debug)]
enum Op {
    Place(u32, u8),
    Hide(u32, u8),
    Remove(u32, u8),
    Shrink(u8),
    Deform(u32),
}

fn op() -> impl Strategy<Value = Op> {
    prop_oneof![
        6 => (any::<u32>(), 1..60u8).prop_map(|(row, n)| Op::Place(row, n)),
        6 => any::<u32>().prop_map(|row| Op::Place(row, 1)),
        2 => (any::<u32>(), 1..60u8).prop_map(|(row, n)| Op::Hide(row, n)),
        2 => (any::<u32>(), 1..60u8).prop_map(|(row, n)| Op::Remove(row, n)),
        1 => (1..60u8).prop_map(Op::Shrink),
        2 => (0..2u32).prop_map(Op::Deform),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]
    #[test]
    fn after_any_batches_the_tlas_is_that_of_the_rows(ops in prop::collection::vec((op(), any::<u32>()), 1..60)) {
        let mut scene = scene(&meshes(), Vec::new());
        for (op, seed) in ops {
            let seed = u64::from(seed);
            let len = scene.render_nodes.len() as u32;
            match op {
                Op::Place(row, n) => {
                    let rows = (0..u64::from(n)).map(|i| place(seed + i, 20.0)).collect();
                    apply(&mut scene, vec![(row % (len + 1), rows)], vec![]);
                }
                Op::Hide(row, n) | Op::Remove(row, n) if len > 0 => {
                    let first = row % len;
                    let mut rows: Vec<_> = scene.render_nodes[first as usize..].to_vec();
                    rows.truncate(usize::from(n));
                    for row in &mut rows {
                        if matches!(op, Op::Hide(..)) {
                            row.flags &= !NodeFlags::VISIBLE;
                        } else {
                            *row = RenderNodeRow::HOLE;
                        }
                    }
                    apply(&mut scene, vec![(first, rows)], vec![]);
                }
                Op::Shrink(n) => {
                    let mut batch = batch_on(&scene);
                    batch.render_nodes.len = len.saturating_sub(u32::from(n));
                    scene.apply(batch).expect("rows may go");
                }
                Op::Deform(mesh) => {
                    let mut batch = batch_on(&scene);
                    let size = 0.1 + random(seed) as f32 * 2.0;
                    let rows = tetrahedron(size).positions;
                    batch.positions.ranges = vec![RowRange { first: 4 * mesh, rows }];
                    if seed.is_multiple_of(2) {
                        batch.blas_builds = vec![mesh];
                    } else {
                        batch.blas_updates = vec![mesh];
                    }
                    scene.apply(batch).expect("geometry may change");
                }
                Op::Hide(..) | Op::Remove(..) => {}
            }
            assert_is_fresh(&scene, seed);
        }
    }
}

#[test]
fn a_batch_costs_the_tlas_what_it_changes_at_any_size() {
    let written = [1_000u32, 10_000, 100_000].map(|n| {
        let rows = (0..u64::from(n)).map(|i| place(3 * i, f64::from(n).cbrt() * 3.0)).collect();
        let mut scene = scene(&meshes(), rows);
        let spread = f64::from(n).cbrt() * 3.0;
        let mut most = 0;
        for i in 0..50u32 {
            apply(&mut scene, vec![(i * 7919 % n, vec![place(u64::from(3 * (n + i)), spread)])], vec![]);
            let work = scene.tlas_work;
            assert_eq!((work.moved, work.inserted, work.removed, work.rebuilt), (1, 0, 0, false));
            most = most.max(work.nodes_written);
        }
        // A group of a hundred that appears beside all others.
        let group = (0..100u64)
            .map(|i| {
                let at = DVec3::new(spread + (i % 10) as f64, (i / 10) as f64, 0.0);
                instance(0, DAffine3::from_translation(at), NodeFlags::OPAQUE)
            })
            .collect();
        apply(&mut scene, vec![(n, group)], vec![]);
        assert_eq!((scene.tlas_work.inserted, scene.tlas_work.rebuilt), (100, false));
        [most, scene.tlas_work.nodes_written]
    });
    for [one, group] in written {
        // The paths to where it was and to where it is, rotations beside them: not more than the depth asks for.
        assert!(one <= 60 && group <= 100, "{written:?}");
    }
}

#[test]
fn after_many_edits_rays_cost_little_more_than_in_a_fresh_tree() {
    let n = 5_000u64;
    let mut scene = scene(&meshes(), (0..n).map(|i| place(3 * i, 50.0)).collect());
    for i in 0..100_000u64 {
        let row = (random(i) * n as f64) as u32;
        let new = match i % 10 {
            0 => RenderNodeRow { flags: NodeFlags::OCCUPIED, ..scene.render_nodes[row as usize] },
            _ => place(3 * (n + i), 50.0),
        };
        apply(&mut scene, vec![(row, vec![new])], vec![]);
    }
    scene.validate().expect("the TLAS is that of the rows");
    let fresh = super::testing::scene(&meshes(), scene.render_nodes.clone());
    let ratio = scene.tlas.expected_nodes() / fresh.tlas.expected_nodes();
    assert!(ratio < 1.3, "{ratio}");
}
