//! A scene that stays alive: the document and its history, the derived scene that follows each edit, the backend that follows
//! that, and how all of them are compared.
//!
//! `orthant edit` runs scripts on it; the tests of editing and the soak run random operations. [`geometry`], [`rays`] and
//! [`aovs`] compare what is resident with what a full derivation makes resident; [`aim`] says where they look.

pub mod aim;
pub mod aovs;
mod check;
pub mod geometry;
pub mod rays;

use crate::failure::{Exit, Failure};
use crate::job::backend::{AnyBackend, backend_failure};
use orthant_render::derived::sync::SyncReport;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::SceneBatch;
use orthant_resident::compare::Touched;
use orthant_scene::Scene;
use orthant_scene::animation::{AnimationPlayer, Pose};
use orthant_scene::edit::Cursor;
use orthant_scene::edit::script::{Operation, Outcome, Session};
use orthant_vulkan::VulkanBackend;
use std::collections::HashSet;
use std::time::{Duration, Instant};

/// Rows of render nodes that are moved into holes after one operation, at most.
const HOLES_AT_ONCE: u32 = 1 << 16;

/// Why an operation is not carried out.
#[derive(Debug)]
pub enum Stopped {
    /// It makes no sense, for this reason; nothing has changed.
    Refused(String),
    /// Something else went wrong.
    Failed(Failure),
}

/// What following one or more edits came to.
#[derive(Clone, Copy, Debug)]
pub struct Followed {
    /// What the sync found and wrote.
    pub synced: SyncReport,
    /// Time of the sync and of the backend.
    pub time: Duration,
    /// Holes that were closed afterwards.
    pub holes_closed: u32,
}

/// The scene and all that follows it.
pub struct Live {
    /// The document.
    pub scene: Scene,
    /// Its history, and the labels of a script.
    pub session: Session,
    /// What was derived from it.
    pub derived: DerivedScene,
    /// The backend, if one follows too.
    pub backend: Option<AnyBackend>,
    /// On a device, what is loaded from full derivations to be compared with; opened by the first comparison.
    loaded: Option<Box<VulkanBackend>>,
    /// The overlay of `set_time`. It is not part of the document, and not saved.
    pub pose: Pose,
    cursor: Cursor,
    player: AnimationPlayer,
    /// What edits could not do as they were asked to, and has not been said yet.
    notes: Vec<String>,
    /// What has been said.
    said: HashSet<String>,
    /// How many warnings of the derivation have been looked at.
    looked_at: usize,
    /// The pose before the last operation, where it was a time that was set.
    pose_before: Option<Pose>,
}

impl Live {
    /// Derives the scene, and loads a backend with it, if one is to follow. `options` is made live; its pose is the rest pose
    /// until a time is set.
    ///
    /// # Errors
    /// If it cannot be derived (bad input), or the backend refuses it: the device has no room for it (missing), or a fault of
    /// the program (internal).
    pub fn new(
        mut scene: Scene,
        session: Session,
        options: DeriveOptions,
        mut backend: Option<AnyBackend>,
    ) -> Result<Self, Failure> {
        scene.prepare_edits();
        let options = DeriveOptions { live: true, ..options };
        let mut derived = DerivedScene::derive(&scene, &options)
            .map_err(|e| Failure::new(Exit::BadInput, e.what).at(e.place).remedy(e.remedy))?;
        let batch = derived.load_batch();
        if let Some(backend) = &mut backend {
            backend.apply(batch).map_err(backend_failure)?;
        }
        let cursor = scene.change_log().cursor();
        let player = AnimationPlayer::new(options.max_bytes);
        let pose = options.pose;
        let (notes, said, looked_at, pose_before) = (Vec::new(), HashSet::new(), 0, None);
        Ok(Self {
            scene,
            session,
            derived,
            backend,
            loaded: None,
            pose,
            cursor,
            player,
            notes,
            said,
            looked_at,
            pose_before,
        })
    }

    /// Carries an operation out on the document, or sets the time. What follows the document does not follow yet: edits that
    /// are followed together merge.
    ///
    /// # Errors
    /// [`Stopped::Refused`].
    pub fn edit(&mut self, operation: &Operation) -> Result<(), Stopped> {
        self.pose_before = None;
        let outcome = self.session.run(&mut self.scene, operation).map_err(|e| Stopped::Refused(e.to_string()))?;
        if let Outcome::Edited(applied) = &outcome {
            self.notes.extend(applied.iter().flat_map(|applied| applied.notes.iter().cloned()));
        }
        if let Outcome::TimeSet { seconds, animation } = outcome {
            let pose = match animation {
                Some(id) => {
                    let pose = self.player.pose(&self.scene, id, seconds);
                    pose.map_err(|e| Stopped::Refused(e.to_string()))?
                }
                None => Pose::default(),
            };
            self.pose_before = Some(std::mem::replace(&mut self.pose, pose));
        }
        Ok(())
    }

    /// Lets the derived scene and the backend follow what was edited since the last time. In debug builds the rows that were
    /// touched are compared afterwards.
    ///
    /// # Errors
    /// [`Stopped::Refused`] if the document holds what cannot be shown (geometry that cannot be decoded, more than fits into
    /// the memory): [`Live::take_back`] takes the last operation back. [`Stopped::Failed`] if the backend refuses the batch, or
    /// has other rows afterwards.
    pub fn follow(&mut self) -> Result<Followed, Stopped> {
        let start = Instant::now();
        let (synced, touched) = self.sync()?;
        let time = start.elapsed();
        self.check_touched(touched).map_err(Stopped::Failed)?;
        let holes_closed = self.close_holes().map_err(Stopped::Failed)?;
        Ok(Followed { synced, time, holes_closed })
    }

    /// Takes the operation back that was carried out last, because what follows cannot follow it. The sync after one that
    /// failed derives everything anew. O(scene).
    ///
    /// # Errors
    /// Faults of the program: what was there before can be shown.
    pub fn take_back(&mut self, operation: &Operation) -> Result<(), Failure> {
        let internal = |what: String| Failure::new(Exit::Internal, what);
        self.session.take_back(&mut self.scene, operation).map_err(|e| internal(e.to_string()))?;
        self.notes.clear();
        if let Some(pose) = self.pose_before.take() {
            self.pose = pose;
        }
        match self.sync() {
            Ok((_, touched)) => self.check_touched(touched),
            Err(Stopped::Failed(failure)) => Err(failure),
            Err(Stopped::Refused(what)) => Err(internal(what)),
        }
    }

    /// What of the scene is shown or merged otherwise than the files say, if that was not said before.
    pub fn new_warnings(&mut self) -> Vec<String> {
        let mut new = std::mem::take(&mut self.notes);
        new.extend(self.player.warnings().iter().map(ToString::to_string));
        // A derivation anew begins its list anew.
        let from = if self.derived.warnings.len() < self.looked_at { 0 } else { self.looked_at };
        new.extend(self.derived.warnings[from..].iter().map(ToString::to_string));
        self.looked_at = self.derived.warnings.len();
        new.retain(|warning| self.said.insert(warning.clone()));
        new
    }

    fn sync(&mut self) -> Result<(SyncReport, Option<Touched>), Stopped> {
        let synced = match self.scene.change_log().take(&mut self.cursor) {
            Some(changes) => self.derived.sync(&self.scene, &self.pose, &changes),
            // The operation touched more than the log of changes keeps.
            None => self.derived.derive_anew(&self.scene, &self.pose),
        };
        let (batch, report) = synced.map_err(|e| Stopped::Refused(e.to_string()))?;
        let touched = self.apply(batch).map_err(Stopped::Failed)?;
        Ok((report, touched))
    }

    /// Hands a batch to the backend. In debug builds it is returned which rows it touches.
    fn apply(&mut self, batch: SceneBatch) -> Result<Option<Touched>, Failure> {
        let Some(backend) = &mut self.backend else { return Ok(None) };
        let touched = cfg!(debug_assertions).then(|| Touched::of(&batch));
        backend.apply(batch).map_err(backend_failure)?;
        Ok(touched)
    }

    /// Moves render nodes into holes where more than half of their rows are holes: between operations, not as a part of one.
    /// Returns how many holes are closed.
    fn close_holes(&mut self) -> Result<u32, Failure> {
        if !self.derived.holes_are_due() {
            return Ok(0);
        }
        let before = self.derived.free_render_nodes();
        let closed = self.derived.close_holes(&self.scene, HOLES_AT_ONCE);
        let (batch, _) = closed.map_err(|e| Failure::new(Exit::Internal, e.to_string()))?;
        let touched = self.apply(batch)?;
        self.check_touched(touched)?;
        Ok(before - self.derived.free_render_nodes())
    }
}
