//! Compaction in the background: an optimised tree over packed arenas, made on another thread and swapped in at a frame boundary.
//!
//! 1. **Snapshot** of the leaves at revision R: a list of pages.
//! 2. **Build** (`worker`): equal neighbours are joined (`join`), the tree is built by the surface area heuristic, arenas are packed.
//! 3. **Fill**: the thread hands over batches, and each frame takes as many to the staging set as its budget allows.
//! 4. **Replay**: boxes in which the active set changed since R are planned again on the new set, from the world.
//! 5. **Swap** of the sets when nothing is left to replay. The old one is dropped on the thread of the build.
//!
//! If edits outrun it (more boxes to replay than [`CompactionOptions::max_backlog`]), or if a backend refuses a batch, it is given up
//! with the reason on record, and begun again.

mod join;
mod worker;

pub(super) use worker::{Built, Gone, Job, Message, Worker};

use super::boxes::BoxSet;
use super::diagnostics::{CompactionState, Occupancies};
use orthant_world::BlockId;
use std::collections::BTreeSet;

/// When a compaction is due, and when it is given up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompactionOptions {
    /// The cost by the surface area heuristic, over that of the set when it was made, above which it is.
    pub sah_growth: f64,
    /// The part of any arena that is free above which it is, 0 to 1.
    pub free_share: f64,
    /// Rows below which an arena is not looked at.
    pub min_rows: u64,
    /// Operations since the last one before which it is not, unless asked for; of large sets, an eighth of the leaves.
    pub min_edits: u64,
    /// Boxes to replay above which it is given up.
    pub max_backlog: usize,
    /// Bytes of a batch for the staging set.
    pub slice_bytes: u64,
    /// Frames until it is tried again after it was given up; doubled each time, up to 64 times as many.
    pub pause: u64,
}

impl Default for CompactionOptions {
    fn default() -> Self {
        Self {
            sah_growth: 1.25,
            free_share: 0.5,
            min_rows: 4096,
            min_edits: 1024,
            max_backlog: 1 << 15,
            slice_bytes: 256 << 10,
            pause: 30,
        }
    }
}

impl CompactionOptions {
    /// Never, unless it is asked for.
    pub const ON_DEMAND: Self = Self {
        sah_growth: f64::INFINITY,
        free_share: f64::INFINITY,
        min_rows: u64::MAX,
        min_edits: u64::MAX,
        max_backlog: 1 << 15,
        slice_bytes: 256 << 10,
        pause: 30,
    };

    /// Why a compaction is due, if it is.
    pub(super) fn due(&self, edits: u64, leaves: u64, growth: f64, occupancy: &Occupancies) -> Option<String> {
        if edits < self.min_edits.max(leaves / 8) {
            return None;
        }
        if growth > self.sah_growth {
            return Some(format!("the SAH cost is {growth:.3} times that of the set when it was made"));
        }
        let arenas = [("nodes", occupancy.nodes), ("leaves", occupancy.leaves), ("payload", occupancy.payload)];
        let (name, arena) = arenas
            .into_iter()
            .find(|(_, arena)| arena.live + arena.free >= self.min_rows && arena.free_share() > self.free_share)?;
        Some(format!("{:.0} % of the {name} arena are free", arena.free_share() * 100.0))
    }
}

/// A compaction that is under way.
pub(super) struct Run {
    pub worker: Worker,
    /// Whether the staging set was begun.
    pub is_filling: bool,
    /// The set, once all of it was handed over.
    pub built: Option<Box<Built>>,
    /// Boxes in which the active set changed since the snapshot.
    pub backlog: BoxSet,
    /// Boxes that replaying left in pieces.
    pub untidy: Vec<orthant_world::Aabb4>,
    /// Materials that changed since the snapshot.
    pub palette: BTreeSet<BlockId>,
    /// The fewest boxes that were ever left to replay, and the frames since then.
    pub progress: (usize, u32),
    /// Whether the active set no longer follows: then frames show it as it is until the swap.
    pub is_rebuild: bool,
}

impl Run {
    pub fn new(worker: Worker, is_rebuild: bool) -> Self {
        Self {
            worker,
            is_filling: false,
            built: None,
            backlog: BoxSet::default(),
            untidy: Vec::new(),
            palette: BTreeSet::new(),
            progress: (usize::MAX, 0),
            is_rebuild,
        }
    }

    /// Whether edits keep up with what is replayed: then they have to wait until it is done. Counts a frame.
    pub fn is_stalled(&mut self) -> bool {
        const PATIENCE: u32 = 32;
        let (least, frames) = &mut self.progress;
        if self.built.is_none() || self.backlog.len() < *least {
            (*least, *frames) = (self.backlog.len(), 0);
        } else {
            *frames += 1;
        }
        *frames > PATIENCE
    }

    /// Gives it up.
    pub fn discard(self) {
        let Self { worker, built, backlog, .. } = self;
        worker.discard((built, backlog));
    }

    pub fn state(&self) -> CompactionState {
        match (self.is_filling, &self.built) {
            (_, Some(_)) => CompactionState::Replaying,
            (true, None) => CompactionState::Filling,
            (false, None) => CompactionState::Building,
        }
    }
}

/// When the next one may begin, and why it is wanted.
#[derive(Debug, Default)]
pub(super) struct Schedule {
    /// A reason that somebody gave.
    pub asked: Option<String>,
    /// Operations since the set was made.
    pub edits: u64,
    /// The frame before which none is begun.
    pub not_before: u64,
    /// Times in a row that one was given up.
    pub failures: u32,
    /// Times in a row that a rebuild was.
    pub failed_rebuilds: u32,
    pub finished: u64,
    pub discarded: u64,
}

impl Schedule {
    /// One was given up.
    pub fn pause(&mut self, frame: u64, options: &CompactionOptions) {
        self.discarded += 1;
        self.not_before = frame + (options.pause << self.failures.min(6));
        self.failures += 1;
    }

    /// One came to its end.
    pub fn finish(&mut self) {
        self.finished += 1;
        self.failures = 0;
        self.edits = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::super::diagnostics::Occupancy;
    use super::*;

    #[test]
    fn a_compaction_is_due_by_cost_or_by_holes_but_not_before_enough_edits() {
        let options = CompactionOptions::default();
        let full = Occupancies::default();
        assert_eq!(options.due(1023, 0, 9.0, &full), None);
        assert_eq!(options.due(1024, 80_000, 9.0, &full), None, "an eighth of the leaves");
        assert!(options.due(1024, 0, 1.3, &full).is_some_and(|why| why.contains("SAH")));
        assert_eq!(options.due(1024, 0, 1.2, &full), None);
        let holes = |live, free| Occupancies { leaves: Occupancy { live, free }, ..full };
        assert!(options.due(1024, 0, 1.0, &holes(2000, 3000)).is_some_and(|why| why.contains("60 % of the leaves")));
        assert_eq!(options.due(1024, 0, 1.0, &holes(20, 30)), None, "a small arena");
        assert_eq!(CompactionOptions::ON_DEMAND.due(u64::MAX - 1, 0, 9.0, &holes(0, 1 << 30)), None);
    }

    #[test]
    fn pauses_grow_with_each_failure_and_end_with_a_success() {
        let options = CompactionOptions { pause: 10, ..CompactionOptions::default() };
        let mut schedule = Schedule::default();
        schedule.pause(100, &options);
        assert_eq!(schedule.not_before, 110);
        schedule.pause(200, &options);
        assert_eq!(schedule.not_before, 220);
        schedule.finish();
        schedule.pause(300, &options);
        assert_eq!((schedule.not_before, schedule.discarded, schedule.finished), (310, 3, 1));
    }
}
