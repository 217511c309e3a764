//! A full derivation in the place of one that followed edits, for backends that follow on: after a sync that failed, whose rows
//! may be of neither state, and where changes are not known.

use super::{Live, SyncReport};
use crate::DeriveError;
use crate::derived::{DeriveOptions, DerivedScene};
use orthant_resident::SceneBatch;
use orthant_resident::batch::ImageWrite;
use orthant_scene::Scene;
use orthant_scene::animation::Pose;
use orthant_scene::model::SceneId;

impl Live {
    /// What the scene was derived with, under another pose.
    pub(super) fn options(&self, scene: Option<SceneId>, pose: &Pose) -> DeriveOptions {
        DeriveOptions {
            scene,
            variant: self.asked_variant,
            images: self.images,
            max_bytes: self.max_bytes,
            live: true,
            pose: pose.clone(),
            origin: None,
        }
    }
}

impl DerivedScene {
    /// A full derivation in the place of this one, for edits of which the log has forgotten some. The batch writes all of it over
    /// what a backend has, as the next one after the last sync. O(scene).
    ///
    /// # Errors
    /// Those of [`DerivedScene::derive`], and if this scene was derived without [`DeriveOptions::live`]. The next sync begins
    /// here again then.
    pub fn derive_anew(&mut self, scene: &Scene, pose: &Pose) -> Result<(SceneBatch, SyncReport), DeriveError> {
        let Some(before) = &mut self.live else { return Err(super::not_live()) };
        before.has_failed = true;
        let (revision, policy, images_before) = (before.revision, before.tlas.policy, before.textures.images());
        let mut fresh = Self::derive(scene, &before.options(self.asked_scene, pose))?;
        let mut batch = fresh.load_batch();
        (batch.expected_revision, batch.new_revision) = (revision, revision + 1);
        let is_empty = |&slot: &u32| fresh.mesh_descs[slot as usize].index_count == 0;
        batch.blas_frees = (0..fresh.mesh_descs.len() as u32).filter(is_empty).collect();
        let images = batch.images.len() as u32;
        batch.images.extend((images..images_before).map(|slot| ImageWrite { slot, image: None }));
        if let Some(live) = &mut fresh.live {
            live.revision = batch.new_revision;
            live.tlas.policy = policy;
        }
        *self = fresh;
        let count = |rows: usize| rows as u32;
        let report = SyncReport {
            render_nodes: count(self.render_nodes.len()),
            whole: !self.render_nodes.is_empty(),
            materials: count(self.materials.len()),
            lights: count(self.lights.len()),
            emitters: count(self.emitters.len()),
            primitives_changed: true,
            instances_written: count(self.render_nodes.len()),
            tlas: batch.tlas,
            blas_built: count(batch.blas_builds.len()),
            blas_updated: 0,
            upload_bytes: batch.upload_bytes(),
            visited: self.hierarchy.nodes.len() as u64,
        };
        Ok((batch, report))
    }
}
