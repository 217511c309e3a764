//! A scene with all that follows it.

use crate::{geometry, rays};
use orthant::job::validate::validate;
use orthant_cpu::CpuBackend;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::Backend;
use orthant_scene::Scene;
use orthant_scene::animation::{AnimationPlayer, Pose};
use orthant_scene::edit::Cursor;
use orthant_scene::edit::script::{Operation, Outcome, Session};
use orthant_scene::import::ImportOptions;
use std::path::Path;

/// The scene, its history, and what was derived from it.
pub struct Follower {
    pub scene: Scene,
    pub session: Session,
    derived: DerivedScene,
    backend: Option<CpuBackend>,
    cursor: Cursor,
    pose: Pose,
    player: AnimationPlayer,
}

fn options(scene: &Scene) -> DeriveOptions {
    // Encoded images are decoded by every full derivation: in the scenes of the tests they are small.
    let encoded: usize = scene.images().values().map(|image| image.data.as_ref().map_or(0, |data| data.len())).sum();
    DeriveOptions { live: true, images: encoded < 1 << 16, ..DeriveOptions::default() }
}

impl Follower {
    pub fn new(scene: &Scene, with_backend: bool) -> Result<Self, String> {
        let mut scene = scene.clone();
        scene.prepare_edits();
        let mut derived = DerivedScene::derive(&scene, &options(&scene)).map_err(|e| e.to_string())?;
        let mut backend = with_backend.then(CpuBackend::new);
        let batch = derived.load_batch();
        if let Some(backend) = &mut backend {
            backend.apply(batch).map_err(|e| format!("the backend refuses the scene: {e}"))?;
        }
        let cursor = scene.change_log().cursor();
        let session = Session::new(Path::new("."), ImportOptions::default());
        let (pose, player) = (Pose::default(), AnimationPlayer::new(u64::MAX));
        Ok(Self { scene, session, derived, backend, cursor, pose, player })
    }

    /// One operation, followed. `false` if it was refused.
    pub fn step(&mut self, operation: &Operation) -> Result<bool, String> {
        match self.session.run(&mut self.scene, operation) {
            Ok(Outcome::TimeSet { seconds, animation }) => {
                let pose = animation.map(|id| self.player.pose(&self.scene, id, seconds)).transpose();
                // An edit may have made an animation one that cannot be played.
                let Ok(pose) = pose else { return Ok(false) };
                self.pose = pose.unwrap_or_default();
            }
            Ok(_) => {}
            Err(_) => return Ok(false),
        }
        let changes = self.scene.change_log().take(&mut self.cursor).ok_or("the log of changes is too short")?;
        let (batch, _) = self.derived.sync(&self.scene, &self.pose, &changes).map_err(|e| format!("sync: {e}"))?;
        if let Some(backend) = &mut self.backend {
            backend.apply(batch).map_err(|e| format!("the backend refuses the batch: {e}"))?;
        }
        Ok(true)
    }

    /// The incremental state against a full derivation, and what is resident against the incremental state.
    pub fn check(&self) -> Result<(), String> {
        self.derived.check(&self.scene)?;
        match &self.backend {
            Some(backend) => {
                validate(&self.derived, backend.scene()).map_err(|failure| failure.to_string())?;
                backend.validate_lights().map_err(|what| format!("lights: {what}"))
            }
            None => Ok(()),
        }
    }

    /// Resident geometry and the hits of random rays against those of a backend that was loaded from a full derivation. Gives how many rays
    /// were compared.
    pub fn check_rays(&self, seed: u64) -> Result<u64, String> {
        let Some(backend) = &self.backend else { return Ok(0) };
        let posed = DeriveOptions { pose: self.pose.clone(), ..options(&self.scene) };
        let mut fresh = DerivedScene::derive(&self.scene, &posed).map_err(|e| e.to_string())?;
        let mut loaded = CpuBackend::new();
        let batch = fresh.load_batch();
        loaded.apply(batch).map_err(|e| format!("a backend refuses the full derivation: {e}"))?;
        let (synced, fresh) = ((&self.derived, backend.scene()), (&fresh, loaded.scene()));
        geometry::compare(synced, fresh)?;
        rays::compare(synced, fresh, seed)
    }
}
