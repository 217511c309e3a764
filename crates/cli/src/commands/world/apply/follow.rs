//! What is derived follows the world, operation by operation.

use crate::failure::{Exit, Failure};
use crate::job::world_view::{build, world_failure};
use orthant_render::world::{DerivedWorld, LOAD_BATCH_BYTES, OpLimits, Plan};
use orthant_resident::world::{MutationBatch, Root, WorldArenas};
use orthant_world::{Aabb4, Applied, World};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// What followed a line of the script.
#[derive(Clone, Copy, Debug, Default)]
pub struct Planned {
    /// Time of planning.
    pub plan_time: Duration,
    /// Time in which the arenas and the mirror took the batches.
    pub commit_time: Duration,
    /// Operations of the planner, those that wrote nothing included.
    pub operations: usize,
    /// Batches.
    pub batches: usize,
    /// Before the first batch.
    pub expected_root: Root,
    /// After the last.
    pub new_root: Root,
    /// Before the first batch.
    pub expected_revision: u64,
    /// After the last.
    pub new_revision: u64,
    /// Rows and spans of all batches.
    pub node_writes: usize,
    /// See `node_writes`.
    pub leaf_writes: usize,
    /// See `node_writes`.
    pub payload_writes: usize,
    /// Words of these.
    pub payload_words: usize,
    /// See `node_writes`.
    pub palette_writes: usize,
    /// See `node_writes`.
    pub freed_nodes: usize,
    /// See `node_writes`.
    pub freed_leaves: usize,
    /// See `node_writes`.
    pub freed_payload_spans: usize,
    /// Leaves that came, went, and got another chunk.
    pub leaves_added: usize,
    /// See `leaves_added`.
    pub leaves_removed: usize,
    /// See `leaves_added`.
    pub leaves_changed: usize,
    /// Bytes that cross to a backend.
    pub upload_bytes: u64,
    /// Leaves afterwards.
    pub leaves: usize,
    /// Depth of the root BVH afterwards.
    pub depth: u32,
}

/// What is derived of a world, and the arenas that a backend would have.
#[derive(Debug)]
pub struct Follower {
    /// The planner.
    pub derived: DerivedWorld,
    /// What batches alone have made.
    pub arenas: WorldArenas,
}

impl Follower {
    /// Derives a world, and fills arenas by the batches that a backend would be loaded with.
    ///
    /// # Errors
    /// A world that takes too much memory (usage).
    pub fn new(world: &World, max_memory: u64) -> Result<Self, Failure> {
        let derived = build(world, Aabb4::SPACE, max_memory)?;
        let mut arenas = WorldArenas::new(derived.origin());
        for batch in derived.load_batches(LOAD_BATCH_BYTES) {
            arenas.apply(&batch).map_err(|e| Failure::new(Exit::Internal, e.to_string()))?;
        }
        Ok(Self { derived, arenas })
    }

    /// Follows what patches did, to the end.
    ///
    /// # Errors
    /// Arenas that take too much memory (usage); a batch that is refused is a fault of the program.
    pub fn follow(&mut self, world: &World, applied: &[Applied]) -> Result<Planned, Failure> {
        let (root, revision) = (self.arenas.root, self.arenas.revision);
        let mut planned = Planned {
            expected_root: root,
            new_root: root,
            expected_revision: revision,
            new_revision: revision,
            ..Planned::default()
        };
        let materials: Vec<_> = {
            let mut all: Vec<_> = applied.iter().flat_map(|a| a.palette.iter().copied()).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        if !materials.is_empty() {
            let start = Instant::now();
            let batch = self.derived.plan_palette(world, &materials).map_err(world_failure)?;
            planned.plan_time += start.elapsed();
            self.take(&batch, &mut planned)?;
        }
        let mut waiting = dirty(world, applied);
        // Boxes whose leaves were cut at their borders are joined with what is around them when all else is done.
        let mut untidy = VecDeque::new();
        let tidy_limits = OpLimits { chunks: 256, leaves: 1 << 14, focus: None };
        loop {
            let (bounds, limits) = match (waiting.pop_front(), untidy.front()) {
                (Some(bounds), _) => (bounds, OpLimits::default()),
                (None, Some(&bounds)) => {
                    untidy.pop_front();
                    (bounds, tidy_limits)
                }
                (None, None) => break,
            };
            let start = Instant::now();
            let Plan { batch, deferred, untidy: is_untidy, counts, .. } =
                self.derived.plan(world, &bounds, &limits).map_err(world_failure)?;
            planned.plan_time += start.elapsed();
            planned.operations += 1;
            planned.leaves_added += counts.leaves_added;
            planned.leaves_removed += counts.leaves_removed;
            planned.leaves_changed += counts.leaves_changed;
            // What stays untidy under the larger limits stays so: it is right, and has more leaves than it needs.
            if is_untidy && limits != tidy_limits {
                untidy.push_back(bounds);
            }
            for bounds in deferred.into_iter().rev() {
                waiting.push_front(bounds);
            }
            if !batch.is_empty() {
                self.take(&batch, &mut planned)?;
            }
        }
        planned.leaves = self.derived.leaf_count();
        planned.depth = self.derived.depth();
        Ok(planned)
    }

    /// The arenas take a batch, then the mirror.
    fn take(&mut self, batch: &MutationBatch, planned: &mut Planned) -> Result<(), Failure> {
        let refused = |e: orthant_resident::world::BatchRefused| Failure::new(Exit::Internal, e.to_string());
        let start = Instant::now();
        planned.upload_bytes += self.arenas.apply(batch).map_err(refused)?.bytes;
        self.derived.commit(batch).map_err(refused)?;
        planned.commit_time += start.elapsed();
        planned.batches += 1;
        planned.new_root = batch.new_root;
        planned.new_revision = batch.new_revision;
        planned.node_writes += batch.node_writes.len();
        planned.leaf_writes += batch.leaf_writes.len();
        planned.payload_writes += batch.payload_writes.len();
        planned.payload_words += batch.payload_writes.iter().map(|write| write.words.len()).sum::<usize>();
        planned.palette_writes += batch.palette_writes.len();
        planned.freed_nodes += batch.freed_nodes.len();
        planned.freed_leaves += batch.freed_leaves.len();
        planned.freed_payload_spans += batch.freed_payload_spans.len();
        Ok(())
    }
}

/// The boxes in which leaves may differ from the world: where blocks changed, and where regions came, went or were rewritten.
fn dirty(world: &World, applied: &[Applied]) -> VecDeque<Aabb4> {
    let mut boxes: Vec<Aabb4> = Vec::new();
    for applied in applied {
        boxes.extend(&applied.changed);
        boxes.extend(applied.removed.iter().chain(&applied.updated).map(|(_, region)| region.bounds));
        boxes.extend(applied.added.iter().filter_map(|&id| Some(world.region(id)?.bounds)));
    }
    // A box within another is brought up to date with it. Large ones first; there are few.
    boxes.sort_by(|a, b| volume(b).total_cmp(&volume(a)));
    let mut kept: Vec<Aabb4> = Vec::new();
    for bounds in boxes {
        // Patches of many regions would make this quadratic; a box that is planned again writes nothing.
        if !kept.iter().take(64).any(|about| about.contains(&bounds)) {
            kept.push(bounds);
        }
    }
    kept.into()
}

fn volume(bounds: &Aabb4) -> f64 {
    bounds.extent().iter().product()
}
