//! [`Diagnostics`]: what one frame did to a world and with it.

use orthant_resident::world::{MutationBatch, WorldCounts};

/// Revisions of the three layers. They count different things: the world counts patches that changed something, a set of arenas
/// counts the batches that led to it. Mirror and resident set are the same whenever no batch is on its way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Revisions {
    /// The authoritative world.
    pub world: u64,
    /// What the planner believes to be resident.
    pub mirror: u64,
    /// What the backend's active set was brought to.
    pub resident: u64,
}

/// Rows, by arena.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArenaCounts {
    /// Nodes of the root BVH.
    pub nodes: u64,
    /// Leaves.
    pub leaves: u64,
    /// Words of payload.
    pub payload_words: u64,
    /// Materials.
    pub palette: u64,
}

impl ArenaCounts {
    /// What a batch writes.
    pub fn written(batch: &MutationBatch) -> Self {
        Self {
            nodes: batch.node_writes.len() as u64,
            leaves: batch.leaf_writes.len() as u64,
            payload_words: batch.payload_writes.iter().map(|write| write.words.len() as u64).sum(),
            palette: batch.palette_writes.len() as u64,
        }
    }

    /// What a batch frees. Materials are never freed.
    pub fn freed(batch: &MutationBatch) -> Self {
        Self {
            nodes: batch.freed_nodes.len() as u64,
            leaves: batch.freed_leaves.len() as u64,
            payload_words: batch.freed_payload_spans.iter().map(|span| u64::from(span.end - span.start)).sum(),
            palette: 0,
        }
    }
}

impl std::ops::AddAssign for ArenaCounts {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.leaves += other.leaves;
        self.payload_words += other.payload_words;
        self.palette += other.palette;
    }
}

/// How full an arena is, in rows (of the payload: words).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Occupancy {
    /// Rows in use.
    pub live: u64,
    /// Rows on the free list.
    pub free: u64,
}

impl Occupancy {
    /// The part of the arena that is free, 0 to 1.
    pub fn free_share(&self) -> f64 {
        self.free as f64 / (self.live + self.free).max(1) as f64
    }
}

/// [`Occupancy`] of the arenas of the active set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Occupancies {
    /// Nodes of the root BVH.
    pub nodes: Occupancy,
    /// Leaves.
    pub leaves: Occupancy,
    /// Words of payload.
    pub payload: Occupancy,
}

/// How far the compaction is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompactionState {
    /// There is none.
    #[default]
    Idle,
    /// The new set is being made on another thread.
    Building,
    /// The staging set is being filled.
    Filling,
    /// The staging set is full and follows the edits since the snapshot.
    Replaying,
}

impl CompactionState {
    /// Its name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Building => "building",
            Self::Filling => "filling",
            Self::Replaying => "replaying",
        }
    }
}

/// What the compaction did in a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompactionDiagnostics {
    /// How far it is at the end of the frame.
    pub state: CompactionState,
    /// Why it was begun, if it was in this frame.
    pub started: Option<String>,
    /// Why it was given up, if it was in this frame.
    pub discarded: Option<String>,
    /// Whether the sets were exchanged in this frame.
    pub swapped: bool,
    /// What the build took on its thread, in milliseconds, if it came to its end in this frame.
    pub build_ms: Option<f64>,
    /// Leaves that joining equal neighbours saved, likewise.
    pub joined: Option<u64>,
    /// Time of this frame's thread for uploads and replay, in milliseconds.
    pub upload_ms: f64,
    /// Bytes that went to the staging set in this frame.
    pub upload_bytes: u64,
    /// Time of the exchange, in milliseconds, if there was one.
    pub swap_ms: Option<f64>,
    /// Boxes that changed since the snapshot and are to be replayed.
    pub backlog: u64,
    /// Boxes that were replayed in this frame.
    pub replayed: u64,
    /// Compactions that ended with a swap, so far.
    pub finished_total: u64,
    /// Compactions that were given up, so far.
    pub discarded_total: u64,
}

/// What one frame did to a world and with it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Diagnostics {
    /// Counted from 1.
    pub frame: u64,
    /// At the end of the frame.
    pub revisions: Revisions,
    /// Boxes whose content has changed and that wait.
    pub queue_length: u64,
    /// Boxes that show what they should, in more pieces than they need, and wait.
    pub untidy_length: u64,
    /// Boxes that needed no operation of their own since the frame before: others that waited covered them, or an operation
    /// brought more up to date than it was asked for.
    pub coalesced: u64,
    /// Patches since the frame before.
    pub patches: u64,
    /// Patches that wait for the time of a frame.
    pub patches_waiting: u64,
    /// Of those, patches that changed nothing.
    pub noop_patches: u64,
    /// Time of the world for these patches, in milliseconds.
    pub patch_ms: f64,
    /// Time of planning and applying, in milliseconds.
    pub edit_ms: f64,
    /// Bytes that went to the active set.
    pub upload_bytes: u64,
    /// Operations that were applied to the active set.
    pub edits_applied: u64,
    /// Boxes that the budget left for later frames.
    pub edits_deferred: u64,
    /// Boxes that were too large for one operation and were split.
    pub splits: u64,
    /// Operations that found nothing to write.
    pub noop_edits: u64,
    /// Writes to the active set.
    pub writes: ArenaCounts,
    /// Frees in the active set.
    pub frees: ArenaCounts,
    /// How full the arenas of the active set are.
    pub occupancy: Occupancies,
    /// Leaves of the active set.
    pub leaves: u64,
    /// Nodes above the deepest leaf.
    pub depth: u64,
    /// Cost of the active set by the surface area heuristic over that of the set when it was made.
    pub sah_growth: f64,
    /// The background rebuild.
    pub compaction: CompactionDiagnostics,
    /// Rebuilds because the active set could not follow, so far.
    pub rebuilds_total: u64,
    /// Why there was one in this frame.
    pub rebuild: Option<String>,
    /// Time of the whole frame, in milliseconds: set by whoever renders.
    pub frame_ms: f64,
    /// The part of it that went into patches, edits and compaction, in milliseconds.
    pub mutation_ms: f64,
    /// What the rays of the frame did: set by whoever renders.
    pub rays: WorldCounts,
}
