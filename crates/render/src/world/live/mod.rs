//! A world that is edited while it is shown.
//!
//! [`LiveWorld`] owns the authoritative world, the derived world that mirrors the backend's active set, and the queue of what the second
//! is behind the first. A patch goes to the world at once ([`LiveWorld::apply_patch`]) and its dirty boxes to the queue; each frame
//! [`LiveWorld::tick`] brings as many of them to the backend as its [`Budget`] allows, near the camera first. A camera that moves
//! writes nothing.
//!
//! * `boxes`: disjoint boxes that cover exactly what was put in;
//! * `queue`: which of them is next;
//! * `budget`: what a frame may spend;
//! * `tick`: operations, and what becomes of one that is refused;
//! * `compaction`, `compact`: the background rebuild;
//! * `sah`: the quality of the tree, by what is written;
//! * `diagnostics`: what a frame did.

mod boxes;
mod budget;
mod compact;
mod compaction;
mod diagnostics;
mod queue;
mod sah;
mod tick;

pub use boxes::{BoxSet, Inserted, Waiting};
pub use budget::Budget;
pub use compaction::CompactionOptions;
pub use diagnostics::{
    ArenaCounts, CompactionDiagnostics, CompactionState, Diagnostics, Occupancies, Occupancy, Revisions,
};
pub use queue::{EditQueue, Next, PATIENCE};

use super::{BuildOptions, DerivedWorld, OpLimits, Quality, WorldError, load};
use budget::Meter;
use compaction::{Run, Schedule};
use orthant_resident::{Backend, BackendError};
use orthant_world::{Aabb4, Applied, ApplyError, Content, World, WorldPatch};
use sah::SahMeter;
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::time::Instant;

/// How a live world works.
#[derive(Clone, Debug, Default)]
pub struct LiveOptions {
    /// What is shown of the world, and about which origin.
    pub build: BuildOptions,
    /// What one operation may touch.
    pub limits: OpLimits,
    /// When the background rebuild is due.
    pub compaction: CompactionOptions,
    /// Frames after which age counts in the queue; `None` for [`PATIENCE`].
    pub patience: Option<u64>,
}

/// Why a live world cannot go on. What the backend shows is then what it showed before, if it is there at all.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LiveError {
    /// The world is too large for its arenas.
    #[error(transparent)]
    World(#[from] WorldError),
    /// A patch that was offered is refused. The world is as it was before it.
    #[error(transparent)]
    Patch(#[from] ApplyError),
    /// The backend failed for good.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// Rebuilding the set, because it could not follow, failed again and again.
    #[error("the resident world could not be made anew in {tries} tries: {reason}")]
    Rebuild {
        /// How often it was tried.
        tries: u32,
        /// Why the last one failed.
        reason: String,
    },
}

/// What a tick brought up to date, for whoever checks that a frame shows what it should: the active set equals a shadow of the
/// world to which the same boxes were copied.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Whether the tick took a snapshot: the staging set begins as the active one.
    pub snapshot: bool,
    /// Boxes in which the active set now equals the world.
    pub active: Vec<Aabb4>,
    /// Boxes in which the staging set, or the snapshot that it is made from, now equals the world.
    pub staging: Vec<Aabb4>,
    /// Whether the staging set then took the active one's place.
    pub swapped: bool,
}

/// A world that is edited while it is shown.
pub struct LiveWorld {
    world: World,
    derived: DerivedWorld,
    sah: SahMeter,
    queue: EditQueue,
    options: LiveOptions,
    frame: u64,
    /// The revision to which the backend's active set was brought.
    resident: u64,
    run: Option<Run>,
    schedule: Schedule,
    /// Why the active set no longer follows. It shows what it showed until a new one takes its place.
    broken: Option<String>,
    rebuilds: u64,
    /// Patches that wait for the time of a tick, in their order.
    offered: VecDeque<WorldPatch>,
    /// What happened since the last tick.
    pending: Pending,
    trace: Trace,
}

/// What patches did since the last tick.
#[derive(Clone, Copy, Debug, Default)]
struct Pending {
    patches: u64,
    noops: u64,
    ms: f64,
    coalesced: u64,
}

impl LiveWorld {
    /// Derives all of the world. [`Self::load`] makes a backend show it.
    ///
    /// # Errors
    /// [`WorldError`] if it is too large.
    pub fn new(world: World, options: LiveOptions) -> Result<Self, WorldError> {
        let derived = DerivedWorld::build(&world, &options.build)?;
        let sah = SahMeter::new(derived.mirror());
        Ok(Self {
            world,
            resident: derived.mirror().revision,
            derived,
            sah,
            queue: EditQueue::new(options.patience.unwrap_or(PATIENCE)),
            options,
            frame: 0,
            run: None,
            schedule: Schedule::default(),
            broken: None,
            rebuilds: 0,
            offered: VecDeque::new(),
            pending: Pending::default(),
            trace: Trace::default(),
        })
    }

    /// Makes a backend show what is derived: at the beginning, and in the place of a backend that was lost. Gives the bytes.
    ///
    /// # Errors
    /// [`LiveError`]: of the backend, or of a world that has become too large.
    pub fn load(&mut self, backend: &mut dyn Backend) -> Result<u64, LiveError> {
        // A staging set that was being filled is not the new backend's.
        if let Some(run) = self.run.take() {
            run.discard();
        }
        if self.broken.is_some() {
            // What was planned last did not arrive.
            self.derived = DerivedWorld::build(&self.world, &self.options.build)?;
            self.sah = SahMeter::new(self.derived.mirror());
            self.queue = EditQueue::new(self.options.patience.unwrap_or(PATIENCE));
            self.broken = None;
        }
        let loaded = load(backend, &self.derived)?;
        self.resident = self.derived.mirror().revision;
        Ok(loaded.bytes)
    }

    /// Takes a patch for later: ticks apply what is offered, in its order, within half of the budget's time. So a burst of patches
    /// costs no frame more than its share. A patch that is refused makes its tick an error, and the next ones go on.
    pub fn offer_patch(&mut self, patch: WorldPatch) {
        self.offered.push_back(patch);
    }

    /// Patches that wait for the time of a tick.
    pub fn offered(&self) -> usize {
        self.offered.len()
    }

    /// Applies what was offered, as far as the time goes, and one at least. Gives its milliseconds.
    fn take_offered(&mut self, meter: &Meter) -> Result<f64, ApplyError> {
        let before = self.pending.ms;
        while let Some(patch) = self.offered.pop_front() {
            self.apply_patch(&patch)?;
            if !meter.has_room_within(0.5) {
                break;
            }
        }
        Ok(self.pending.ms - before)
    }

    /// Applies a patch to the world, at once, and queues what it changed.
    ///
    /// # Errors
    /// [`ApplyError`]; nothing is changed then.
    pub fn apply_patch(&mut self, patch: &WorldPatch) -> Result<Applied, ApplyError> {
        let start = Instant::now();
        let applied = self.world.apply(patch)?;
        self.pending.patches += 1;
        self.pending.noops += u64::from(applied.is_noop());
        for changed in &applied.changed {
            self.push(self.unit_of_rewriting(changed));
        }
        // What is new far from the changes is old content in other pieces.
        for &id in &applied.added {
            if let Some(region) = self.world.region(id)
                && !applied.changed.iter().any(|changed| changed.overlaps(&region.bounds))
            {
                self.queue.push_untidy(region.bounds, self.frame);
            }
        }
        self.queue.push_palette(&applied.palette);
        if let Some(run) = &mut self.run {
            // Before any box of theirs is replayed.
            run.palette.extend(&applied.palette);
        }
        self.pending.ms += start.elapsed().as_secs_f64() * 1e3;
        Ok(applied)
    }

    fn push(&mut self, bounds: Aabb4) {
        if !bounds.overlaps(self.derived.clip()) {
            return;
        }
        let inserted = self.queue.push(bounds, self.frame);
        self.pending.coalesced += u64::from(inserted.replaced) + u64::from(inserted.covered);
    }

    /// The whole region of a chunk for a change within it: a chunk is written as a whole, however much of it changed.
    fn unit_of_rewriting(&self, changed: &Aabb4) -> Aabb4 {
        let mut unit = *changed;
        let _first = self.world.query(changed, |_, region| {
            if matches!(region.content, Content::Chunk { .. }) && region.bounds.contains(changed) {
                unit = region.bounds;
            }
            ControlFlow::Break(())
        });
        unit
    }

    /// Asks for a compaction, with the reason to record. It begins with the next tick that finds none under way.
    pub fn request_compaction(&mut self, reason: &str) {
        self.schedule.asked = Some(reason.to_owned());
        self.schedule.not_before = 0;
    }

    /// The authoritative world.
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// The mirror of the active set.
    pub const fn derived(&self) -> &DerivedWorld {
        &self.derived
    }

    /// What the active set is behind.
    pub const fn queue(&self) -> &EditQueue {
        &self.queue
    }

    /// Whether the active set shows the world as it is, in as few pieces as it will, and nothing goes on in the background.
    pub fn is_settled(&self) -> bool {
        self.offered.is_empty()
            && self.queue.is_idle()
            && self.run.is_none()
            && self.broken.is_none()
            && self.schedule.asked.is_none()
    }

    /// Whether a compaction or a rebuild is under way.
    pub const fn is_compacting(&self) -> bool {
        self.run.is_some()
    }

    /// Whether edits reach the active set. After a batch that was refused they wait until the rebuilt set takes its place.
    pub const fn is_following(&self) -> bool {
        self.broken.is_none()
    }

    /// What the last tick brought up to date.
    pub const fn trace(&self) -> &Trace {
        &self.trace
    }
}
