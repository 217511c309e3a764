//! Batches against a resident scene.

use super::ResidentScene;
use super::testing::{TestMesh, batch_on, instance, load_batch, scene};
use crate::trace::Ray;
use glam::{DAffine3, DVec3, Vec3};
use orthant_resident::backend::BackendError;
use orthant_resident::batch::{ImageWrite, RowRange, RowWrites, SceneBatch, TlasAction};
use orthant_resident::rows::{MeshDesc, NodeFlags, RenderNodeRow};

fn triangle(z: f32) -> TestMesh {
    TestMesh { positions: vec![[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]], indices: vec![0, 1, 2] }
}

fn at(x: f64, primitive: u32) -> RenderNodeRow {
    instance(primitive, DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)), NodeFlags::OPAQUE)
}

/// The hit of a ray down at x, from z = 10: which RenderNode, and how far.
fn down(scene: &ResidentScene, x: f32) -> Option<(u32, f32)> {
    let ray = Ray::new(Vec3::new(x + 0.25, 0.25, 10.0), Vec3::NEG_Z);
    scene.closest_hit(&ray, |_| true).map(|hit| (hit.render_node, hit.t))
}

/// Three instances of two meshes: z = 0 at x = 0 and 5, z = 2 at x = 9.
fn three() -> ResidentScene {
    scene(&[triangle(0.0), triangle(2.0)], vec![at(0.0, 0), at(5.0, 0), at(9.0, 1)])
}

fn move_node(scene: &ResidentScene, node: u32, row: RenderNodeRow, tlas: TlasAction) -> SceneBatch {
    let mut batch = batch_on(scene);
    batch.render_nodes.ranges = vec![RowRange { first: node, rows: vec![row] }];
    batch.tlas = tlas;
    batch
}

#[test]
fn a_stale_revision_is_refused_and_changes_nothing() {
    let mut scene = three();
    let mut batch = move_node(&scene, 0, at(20.0, 0), TlasAction::Rebuild);
    batch.expected_revision = 7;
    let before = scene.render_nodes.clone();
    assert_eq!(scene.apply(batch), Err(BackendError::StaleRevision { expected: 7, resident: 1 }));
    assert_eq!((scene.revision, &scene.render_nodes), (1, &before));
    assert_eq!(down(&scene, 0.0), Some((0, 10.0)));
}

#[test]
fn an_update_moves_instances_and_writes_their_rows_only() {
    let mut scene = three();
    let report = scene.apply(move_node(&scene, 1, at(-30.0, 0), TlasAction::Update)).unwrap();
    assert_eq!((report.bytes, report.blas_built, scene.revision), (128, 0, 2));
    assert_eq!(
        [0.0, 5.0, 9.0, -30.0].map(|x| down(&scene, x)),
        [Some((0, 10.0)), None, Some((2, 8.0)), Some((1, 10.0))]
    );
}

#[test]
fn the_tlas_follows_the_rows_whatever_the_batch_asks_of_devices() {
    let mut scene = three();
    scene.apply(move_node(&scene, 1, at(-30.0, 0), TlasAction::None)).unwrap();
    assert_eq!((down(&scene, -30.0), down(&scene, 5.0)), (Some((1, 10.0)), None));
    // Nothing that a ray could tell has changed: no work.
    let recolored = RenderNodeRow { material: 7, ..at(-30.0, 0) };
    scene.apply(move_node(&scene, 1, recolored, TlasAction::Rebuild)).unwrap();
    assert_eq!(scene.tlas_work, Default::default());
}

#[test]
fn a_rebuild_takes_up_new_instances_and_drops_holes_and_hidden_ones() {
    let mut scene = three();
    let mut batch = batch_on(&scene);
    let hidden = RenderNodeRow { flags: NodeFlags::OCCUPIED, ..at(0.0, 0) };
    batch.render_nodes = RowWrites {
        len: 4,
        ranges: vec![
            RowRange { first: 0, rows: vec![hidden, RenderNodeRow::HOLE] },
            RowRange { first: 3, rows: vec![at(12.0, 1)] },
        ],
    };
    batch.tlas = TlasAction::Rebuild;
    scene.apply(batch).unwrap();
    assert_eq!(scene.tlas.len(), 2);
    assert_eq!([0.0, 5.0, 9.0, 12.0].map(|x| down(&scene, x)), [None, None, Some((2, 8.0)), Some((3, 8.0))]);
}

#[test]
fn geometry_is_rebuilt_where_the_batch_says() {
    let mut scene = three();
    let mut batch = batch_on(&scene);
    // The second mesh moves to z = 4; its vertices are 3, 4 and 5.
    batch.positions.ranges = vec![RowRange { first: 3, rows: triangle(4.0).positions }];
    batch.blas_builds = vec![1];
    batch.tlas = TlasAction::Update;
    let report = scene.apply(batch).unwrap();
    assert_eq!((report.bytes, report.blas_built), (36, 1));
    assert_eq!([0.0, 9.0].map(|x| down(&scene, x)), [Some((0, 10.0)), Some((2, 6.0))]);
}

#[test]
fn a_blas_is_refitted_while_the_same_triangles_can_be_hit_and_built_anew_where_not() {
    let mut scene = three();
    let mut deform = |z: f32, width: f32| {
        let mut batch = batch_on(&scene);
        let positions = vec![[0.0, 0.0, z], [width, 0.0, z], [0.0, 1.0, z]];
        batch.positions.ranges = vec![RowRange { first: 3, rows: positions }];
        batch.blas_updates = vec![1];
        let report = scene.apply(batch).unwrap();
        scene.validate().unwrap();
        (report.blas_built, down(&scene, 9.0))
    };
    assert_eq!(deform(4.0, 1.0), (0, Some((2, 6.0))));
    // Flat, it cannot be hit; wide again, it can.
    assert_eq!(deform(4.0, 0.0), (1, None));
    assert_eq!(deform(5.0, 1.0), (1, Some((2, 5.0))));
    assert_eq!(deform(6.0, 2.0), (0, Some((2, 4.0))));
}

#[test]
fn a_blas_whose_boxes_come_to_overlap_is_built_anew() {
    // Triangles in a row, which then change places at random: boxes of neighbours in the tree span everything.
    let corners = |x: f32| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]];
    let places =
        |step: usize| -> Vec<[f32; 3]> { (0..256).flat_map(|i| corners((i * step % 256) as f32 * 2.0)).collect() };
    let mesh = TestMesh { positions: places(1), indices: (0..768).collect() };
    let mut scene = scene(&[mesh], vec![at(0.0, 0)]);
    let mut deform = |positions: Vec<[f32; 3]>| {
        let mut batch = batch_on(&scene);
        batch.positions = RowWrites { len: 768, ranges: vec![RowRange { first: 0, rows: positions }] };
        batch.blas_updates = vec![0];
        (scene.apply(batch).unwrap().blas_built, down(&scene, 2.0))
    };
    let raised = places(1).into_iter().map(|[x, y, _]| [x, y, 1.0]).collect();
    assert_eq!(deform(raised), (0, Some((0, 9.0))));
    assert_eq!(deform(places(97)), (1, Some((0, 10.0))));
}

#[test]
fn a_freed_blas_is_gone_and_its_slot_can_be_built_again() {
    let mut scene = three();
    let mut batch = batch_on(&scene);
    batch.blas_frees = vec![0];
    batch.tlas = TlasAction::Rebuild;
    scene.apply(batch).unwrap();
    assert!(scene.blas[0].is_none());
    assert_eq!([0.0, 5.0, 9.0].map(|x| down(&scene, x)), [None, None, Some((2, 8.0))]);
    let mut batch = batch_on(&scene);
    batch.blas_builds = vec![0];
    batch.tlas = TlasAction::Rebuild;
    scene.apply(batch).unwrap();
    assert_eq!([0.0, 5.0, 9.0].map(|x| down(&scene, x)), [Some((0, 10.0)), Some((1, 10.0)), Some((2, 8.0))]);
}

#[test]
fn an_instance_whose_blas_went_without_a_tlas_action_is_not_hit() {
    let mut scene = three();
    let mut batch = batch_on(&scene);
    batch.blas_frees = vec![0];
    batch.render_nodes.len = 2;
    scene.apply(batch).unwrap();
    assert_eq!([0.0, 5.0, 9.0].map(|x| down(&scene, x)), [None, None, None]);
}

#[test]
fn a_batch_that_contradicts_itself_is_refused_and_changes_nothing() {
    type Fault = fn(&mut SceneBatch);
    let faults: [(&str, Fault); 8] = [
        ("positions: the range 5..8 leads outside 6 rows", |b| {
            b.positions.ranges = vec![RowRange { first: 5, rows: vec![[0.0; 3]; 3] }];
        }),
        ("indices: the range at row 1 overlaps", |b| {
            b.indices.ranges = vec![RowRange { first: 0, rows: vec![0; 2] }, RowRange { first: 1, rows: vec![0; 2] }];
        }),
        ("render_nodes: row 3 is new, but not written", |b| b.render_nodes.len = 5),
        ("blas_builds names RenderPrimitive 2 of 2", |b| b.blas_builds = vec![2]),
        ("blas_frees is not in ascending order", |b| b.blas_frees = vec![1, 0]),
        ("the MeshDesc of RenderPrimitive 1 leads outside the streams", |b| {
            let desc = MeshDesc { first_vertex: 4, vertex_count: 3, ..bytemuck::Zeroable::zeroed() };
            b.mesh_descs.ranges = vec![RowRange { first: 1, rows: vec![desc] }];
            b.blas_builds = vec![1];
        }),
        ("render_nodes: row 1 shows RenderPrimitive 2 of 2", |b| {
            b.render_nodes.ranges = vec![RowRange { first: 1, rows: vec![at(0.0, 2)] }];
        }),
        ("image slot 4000000000 would leave a gap", |b| {
            b.images = vec![ImageWrite { slot: 4_000_000_000, image: None }];
        }),
    ];
    let mut scene = three();
    for (message, fault) in faults {
        let mut batch = move_node(&scene, 0, at(20.0, 0), TlasAction::Rebuild);
        fault(&mut batch);
        match scene.apply(batch) {
            Err(BackendError::InvalidBatch(found)) => assert!(found.contains(message), "{found}"),
            other => panic!("{message}: {other:?}"),
        }
        assert_eq!((scene.revision, down(&scene, 0.0)), (1, Some((0, 10.0))));
    }
}

#[test]
fn indices_out_of_range_and_degenerate_triangles_are_never_hit() {
    let mut mesh = triangle(0.0);
    mesh.indices = vec![0, 1, 9, 0, 1, 1, u32::MAX, 0, 1];
    let scene = scene(&[mesh], vec![at(0.0, 0)]);
    assert!(scene.tlas.is_empty());
    assert_eq!(down(&scene, 0.0), None);
}

#[test]
fn resident_bytes_count_geometry_once() {
    let mut scene = ResidentScene::new();
    scene.apply(load_batch(&[triangle(0.0)], vec![at(0.0, 0); 3])).unwrap();
    let bytes = scene.resident_bytes();
    assert_eq!(bytes.geometry, 3 * 12 + 3 * 32 + 3 * 4);
    assert_eq!(bytes.rows, 64 + 3 * 128);
    // The BLAS: one node and one triangle number. The TLAS: two binary nodes, one wide one and the links between them. The
    // list of the rows that show the mesh.
    assert_eq!(bytes.acceleration, (256 + 4) + (2 * 64 + 256 + 2 * 4 + 1) + (4 + 3 * 8));
}
