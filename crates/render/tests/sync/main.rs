//! Following edits: the state after any sequence of edits is that of a full derivation, and the batches bring a copy to it.

#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../common/mod.rs"]
mod common;
mod cost;
mod exports;
mod holes;
mod named;
mod oracle;
mod pose;
mod recover;
mod scenes;

use orthant_render::derived::sync::SyncReport;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::SceneBatch;
use orthant_resident::extent::scene_radius;
use orthant_resident::rows::{EmitterRow, LightRow, MaterialRow, MeshDesc, RenderNodeRow};
use orthant_scene::Scene;
use orthant_scene::animation::{AnimationPlayer, Pose};
use orthant_scene::edit::script::{Operation, Outcome, Session};
use orthant_scene::edit::{Cursor, EditError};
use orthant_scene::import::ImportOptions;
use serde_json::Value;
use std::path::Path;

/// What a backend has: rows that change by batches alone.
#[derive(Default)]
struct Copy {
    revision: u64,
    positions: Vec<[f32; 3]>,
    indices: Vec<u32>,
    mesh_descs: Vec<MeshDesc>,
    materials: Vec<MaterialRow>,
    lights: Vec<LightRow>,
    emitters: Vec<EmitterRow>,
    render_nodes: Vec<RenderNodeRow>,
    blas: Vec<bool>,
    scene_radius: f32,
}

impl Copy {
    fn apply(&mut self, batch: SceneBatch) {
        assert_eq!(batch.expected_revision, self.revision);
        self.revision = batch.new_revision;
        batch.positions.apply_to(&mut self.positions);
        batch.indices.apply_to(&mut self.indices);
        batch.mesh_descs.apply_to(&mut self.mesh_descs);
        batch.materials.apply_to(&mut self.materials);
        batch.lights.apply_to(&mut self.lights);
        batch.emitters.apply_to(&mut self.emitters);
        batch.render_nodes.apply_to(&mut self.render_nodes);
        self.scene_radius = batch.scene_radius;
        self.blas.resize(self.mesh_descs.len(), false);
        batch.blas_frees.iter().for_each(|&slot| self.blas[slot as usize] = false);
        assert!(batch.blas_updates.iter().all(|&slot| self.blas[slot as usize]), "what is updated is there");
        batch.blas_builds.iter().for_each(|&slot| self.blas[slot as usize] = true);
    }
}

/// Byte for byte: -0 and 0 are equal, and not the same.
fn same<T: bytemuck::Pod>(a: &[T], b: &[T]) -> bool {
    bytemuck::cast_slice::<T, u8>(a) == bytemuck::cast_slice::<T, u8>(b)
}

/// A scene with all that follows it.
struct Live {
    scene: Scene,
    session: Session,
    derived: DerivedScene,
    copy: Copy,
    cursor: Cursor,
    player: AnimationPlayer,
    pose: Pose,
}

impl Live {
    fn new(mut scene: Scene) -> Self {
        scene.prepare_edits();
        let options = DeriveOptions { live: true, ..DeriveOptions::default() };
        let mut derived = DerivedScene::derive(&scene, &options).unwrap();
        let mut copy = Copy::default();
        copy.apply(derived.load_batch());
        let cursor = scene.change_log().cursor();
        let session = Session::new(Path::new("."), ImportOptions::default());
        let player = AnimationPlayer::new(u64::MAX);
        Self { scene, session, derived, copy, cursor, player, pose: Pose::default() }
    }

    /// An edit, or another pose. What is refused changes nothing.
    fn edit(&mut self, operation: &Operation) -> Result<(), EditError> {
        if let Outcome::TimeSet { seconds, animation } = self.session.run(&mut self.scene, operation)? {
            self.pose = match animation {
                // An edit may have made an animation one that cannot be played, by another mesh with other morph targets.
                Some(id) => self.player.pose(&self.scene, id, seconds).map_err(|e| EditError::File(e.to_string()))?,
                None => Pose::default(),
            };
        }
        Ok(())
    }

    fn edit_json(&mut self, operation: Value) {
        let parsed = Operation::parse(&operation.to_string()).unwrap();
        self.edit(&parsed).unwrap_or_else(|error| panic!("{operation}: {error}"));
    }

    fn sync(&mut self) -> SyncReport {
        let changes = self.scene.change_log().take(&mut self.cursor).expect("the log reaches back far enough");
        let (batch, report) = self.derived.sync(&self.scene, &self.pose, &changes).unwrap();
        self.copy.apply(batch);
        report
    }

    fn close_holes(&mut self, max_rows: u32) -> SyncReport {
        let (batch, report) = self.derived.close_holes(&self.scene, max_rows).unwrap();
        self.copy.apply(batch);
        report
    }

    /// An edit, followed and compared.
    fn run(&mut self, operation: Value) -> SyncReport {
        self.edit_json(operation);
        let report = self.sync();
        self.check().unwrap();
        report
    }

    fn check(&self) -> Result<(), String> {
        self.derived.check(&self.scene)?;
        let (copy, derived) = (&self.copy, &self.derived);
        for (what, same) in [
            ("render nodes", same(&copy.render_nodes, &derived.render_nodes)),
            ("materials", same(&copy.materials, &derived.materials)),
            ("lights", same(&copy.lights, &derived.lights)),
            ("emitters", same(&copy.emitters, &derived.emitters)),
            ("mesh descs", same(&copy.mesh_descs, &derived.mesh_descs)),
            ("radius", copy.scene_radius == scene_radius(&copy.render_nodes, &copy.mesh_descs)),
        ] {
            if !same {
                return Err(format!("the copy has others: {what}"));
            }
        }
        for (i, desc) in derived.mesh_descs.iter().enumerate() {
            let range = |first: u32, count: u32, len: usize| count == 0 || (first + count) as usize <= len;
            let inside = range(desc.first_vertex, desc.vertex_count, copy.positions.len())
                && range(desc.first_index, desc.index_count, copy.indices.len());
            if !inside || copy.blas[i] != (desc.index_count > 0) {
                return Err(format!("geometry {i} is not resident"));
            }
        }
        Ok(())
    }
}
