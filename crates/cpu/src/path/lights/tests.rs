//! Light tables follow batches: they are those of the rows as they are, at the cost of what changed.

use super::LightTables;
use crate::scene::ResidentScene;
use crate::scene::testing::{TestMesh, batch_on, instance, load_batch};
use glam::{DAffine3, DVec3};
use orthant_resident::SceneBatch;
use orthant_resident::batch::{RowRange, RowWrites, TlasAction};
use orthant_resident::extent::scene_radius;
use orthant_resident::lights::LightWork;
use orthant_resident::rows::{EmitterRow, LightKind, LightRow, MeshDesc, MeshFlags, NONE, NodeFlags, RenderNodeRow};
use orthant_resident::sampling::hash_combine;

/// A quad, and a pair of triangles that is none.
fn meshes() -> [TestMesh; 2] {
    [1.0, 1.5].map(|x| TestMesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [x, 1.0, 0.0], [0.0, 1.0, 0.0]],
        indices: vec![0, 1, 2, 0, 2, 3],
    })
}

fn place(step: u32) -> DAffine3 {
    let coordinate = |k| f64::from(hash_combine(step, k) % 10_000) / 50.0;
    DAffine3::from_translation(DVec3::new(coordinate(0), coordinate(1), coordinate(2)))
}

/// Of the instances of both meshes, every `lamps`th emits.
fn load(nodes: u32, lamps: u32) -> SceneBatch {
    let mut emitters = Vec::new();
    let rows = (0..nodes).map(|i| {
        let mut row = instance(i % 2, place(i), 0);
        if i.is_multiple_of(lamps) {
            row.emitter = emitters.len() as u32;
            emitters.push(emitter(i, 1.0));
        }
        row
    });
    let mut batch = load_batch(&meshes(), rows.collect());
    for range in &mut batch.mesh_descs.ranges {
        for (desc, mesh) in range.rows.iter_mut().zip(&meshes()) {
            desc.flags = MeshFlags::of_parallelogram(&mesh.positions, &mesh.indices);
            (desc.bounds_min, desc.bounds_max) = ([0.0; 3], mesh.positions[2]);
        }
    }
    batch.emitters = RowWrites::whole(emitters);
    batch
}

fn emitter(render_node: u32, power: f32) -> EmitterRow {
    EmitterRow { render_node, triangle_count: 2, power, ..EmitterRow::HOLE }
}

/// A scene whose tables follow it.
#[derive(Default)]
struct Followed {
    scene: ResidentScene,
    tables: LightTables,
}

impl Followed {
    fn validate(&self) -> Result<(), String> {
        self.tables.validate(&self.scene, scene_radius(&self.scene.render_nodes, &self.scene.mesh_descs))
    }

    fn new(batch: SceneBatch) -> Self {
        let mut followed = Self::default();
        followed.apply(batch);
        followed
    }

    fn apply(&mut self, mut batch: SceneBatch) -> LightWork {
        let mut after = self.scene.clone();
        after.apply(batch.clone()).unwrap();
        batch.scene_radius = scene_radius(&after.render_nodes, &after.mesh_descs);
        let changes = self.scene.light_changes(&batch);
        self.scene.apply(batch).unwrap();
        self.tables.update(&self.scene, &changes).work
    }

    fn nodes(&mut self, rows: Vec<(u32, RenderNodeRow)>, emitters: RowWrites<EmitterRow>) -> LightWork {
        let ranges = rows.into_iter().map(|(first, row)| RowRange { first, rows: vec![row] }).collect();
        let mut batch = batch_on(&self.scene);
        batch.render_nodes.ranges = ranges;
        (batch.emitters, batch.tlas) = (emitters, TlasAction::Rebuild);
        self.apply(batch)
    }

    /// Against tables that were made of the rows as they are.
    fn check(&self) {
        self.validate().unwrap();
    }
}

#[test]
fn moving_what_does_not_emit_touches_no_light() {
    let mut followed = Followed::new(load(10_000, 10));
    assert_eq!(followed.tables.emitters.len(), 1000);
    followed.check();
    for step in 0..10 {
        let row = instance(1, place(step), 0);
        let none = RowWrites::none(1000);
        assert_eq!(followed.nodes(vec![(10 * step + 7, row)], none), LightWork::default());
    }
    followed.check();
}

#[test]
fn moving_one_emitter_touches_its_path_whatever_the_number() {
    for lamps in [100, 1000, 10_000u32] {
        let mut followed = Followed::new(load(lamps, 1));
        for step in 0..40 {
            let at = hash_combine(step, 3) % lamps;
            let row = RenderNodeRow { emitter: at, ..instance(at % 2, place(lamps + step), 0) };
            let work = followed.nodes(vec![(at, row)], RowWrites::none(lamps));
            let most = 9 * u64::from(lamps.ilog2());
            assert!(work.rows == 1 && work.visited <= most && work.written <= most, "{lamps}: {work:?}");
        }
        followed.check();
    }
}

#[test]
fn emitters_that_come_go_move_and_change_are_followed() {
    let mut followed = Followed::new(load(200, 3));
    for step in 0..400u32 {
        let random = |k: u32, below: u32| hash_combine(step, k) % below;
        let at = random(1, 200);
        let mut row = RenderNodeRow {
            emitter: followed.scene.render_nodes[at as usize].emitter,
            ..instance(random(2, 2), place(step), 0)
        };
        if random(3, 4) == 0 {
            row.flags |= NodeFlags::DOUBLE_SIDED;
        }
        let mut emitters = followed.scene.emitters.clone();
        match (row.emitter, random(4, 3)) {
            // It goes dark.
            (emitter, 0) if emitter != NONE => {
                emitters[emitter as usize] = EmitterRow::HOLE;
                row.emitter = NONE;
            }
            // It lights up, in a hole or at the end.
            (NONE, _) => {
                let hole = emitters.iter().position(|row| *row == EmitterRow::HOLE).unwrap_or(emitters.len());
                emitters.resize(emitters.len().max(hole + 1), EmitterRow::HOLE);
                emitters[hole] = emitter(at, 1.0 + random(5, 9) as f32);
                row.emitter = hole as u32;
            }
            (emitter, _) => emitters[emitter as usize].power = 0.5 + random(6, 9) as f32,
        }
        let old = &followed.scene.emitters;
        let changed = (0..emitters.len()).filter(|&i| old.get(i) != Some(&emitters[i]));
        let ranges = changed.map(|i| RowRange { first: i as u32, rows: vec![emitters[i]] }).collect();
        followed.nodes(vec![(at, row)], RowWrites { len: emitters.len() as u32, ranges });
        if step % 10 == 0 {
            followed.check();
        }
    }
    // A shorter buffer.
    let mut batch = batch_on(&followed.scene);
    let last = followed.scene.emitters.len() as u32 - 1;
    let gone = followed.scene.render_nodes.iter().position(|row| row.emitter == last);
    batch.emitters.len = last;
    if let Some(node) = gone {
        let row = RenderNodeRow { emitter: NONE, ..followed.scene.render_nodes[node] };
        batch.render_nodes.ranges = vec![RowRange { first: node as u32, rows: vec![row] }];
    }
    followed.apply(batch);
    followed.check();
}

#[test]
fn emitters_follow_geometry_that_is_written_in_its_place() {
    let mut followed = Followed::new(load(100, 5));
    let mut batch = batch_on(&followed.scene);
    let desc = MeshDesc { bounds_max: [7.0; 3], flags: 0, ..followed.scene.mesh_descs[0] };
    batch.mesh_descs.ranges = vec![RowRange { first: 0, rows: vec![desc] }];
    let work = followed.apply(batch);
    assert_eq!(work.rows, 10, "those of one mesh alone");
    assert!(followed.tables.quad(0).is_none());
    followed.check();
    // Positions alone move the corners of quads.
    let mut followed = Followed::new(load(100, 5));
    let mut batch = batch_on(&followed.scene);
    let corners = [[0.0; 3], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    batch.positions.ranges = vec![RowRange { first: 0, rows: corners.to_vec() }];
    batch.blas_builds = vec![0];
    assert_eq!(followed.apply(batch).rows, 10);
    followed.check();
}

#[test]
fn one_punctual_light_costs_its_path_and_the_others_nothing() {
    let light = |i: u32| LightRow {
        kind: LightKind::Point as u32,
        position: place(i).translation.as_vec3().to_array(),
        color: [1.0; 3],
        ..LightRow::HOLE
    };
    let mut batch = load(10, 20);
    batch.lights = RowWrites::whole((0..5000).map(light).collect());
    let mut followed = Followed::new(batch);
    let mut batch = batch_on(&followed.scene);
    batch.lights.ranges = vec![RowRange { first: 77, rows: vec![light(6000)] }];
    let work = followed.apply(batch);
    assert!(work.rows == 1 && work.visited <= 9 * 12, "{work:?}");
    assert_eq!(followed.tables.punctual.tree.get(77).unwrap().lower, light(6000).position);
    let batch = batch_on(&followed.scene);
    assert_eq!(followed.apply(batch), LightWork::default());
    let mut batch = batch_on(&followed.scene);
    batch.lights.len = 70;
    followed.apply(batch);
    assert_eq!(followed.tables.punctual.tree.len(), 70);
    followed.check();
}

#[test]
fn what_differs_from_the_rows_is_found() {
    let damaged = |damage: &dyn Fn(&mut Followed)| {
        let mut batch = load(100, 5);
        batch.lights =
            RowWrites::whole(vec![LightRow { kind: LightKind::Point as u32, color: [1.0; 3], ..LightRow::HOLE }; 20]);
        let mut followed = Followed::new(batch);
        followed.check();
        damage(&mut followed);
        followed.validate().unwrap_err()
    };
    assert!(damaged(&|f| f.scene.render_nodes[5].world.rows[0][3] += 1e-3).contains("emitter 1 "));
    assert!(damaged(&|f| f.scene.render_nodes[6].world.rows[0][3] += 1e6).contains("radius"));
    assert!(damaged(&|f| f.scene.emitters[3].power += 1.0).contains("emitter 3 "));
    assert!(damaged(&|f| f.scene.lights[7].color = [2.0; 3]).contains("light 7 "));
    assert!(damaged(&|f| f.scene.lights[7] = LightRow::HOLE).contains("local"));
    assert!(damaged(&|f| f.tables.emitters.nodes[0].bounds.intensity += 1.0).contains("emitter tree: node 0"));
}
