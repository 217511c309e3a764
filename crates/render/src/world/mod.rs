//! Derived worlds: the leaf set with its root BVH, and the planner that turns patches into mutation batches.
//!
//! A [`DerivedWorld`] follows an [`orthant_world::World`]: [`DerivedWorld::build`] derives all of it, and
//! [`DerivedWorld::plan`] brings one box of it to what the world says now, as a [`MutationBatch`] of explicit writes and frees. The order is
//! always the same: plan, apply to the resident arenas, [`commit`](DerivedWorld::commit), which lets the mirror follow.
//!
//! * `leaves`: the leaf set and its snapshots;
//! * `build`: everything at once, also from explicit leaves ([`Leaf`]);
//! * `plan`, `closure`, `carve`: which leaves are to go and to come for a box;
//! * `splice`: what that writes;
//! * `payload`, `palette`: dense chunks, materials and texels;
//! * `load`: filling an empty set of a backend;
//! * `stats`, `validate`: counts, and every invariant;
//! * [`live`]: a world that is edited while it is shown: queue, budgets, compaction in the background;
//! * [`view`], [`light`]: cameras in worlds, and the preview's light.
//!
//! # Leaves
//! Every region of the world is one leaf: a region of one block a uniform leaf, a part of a chunk a chunk array whose box is the tight
//! one about what is solid. Only while a box is brought up to date whose surroundings are too many for one operation are leaves cut
//! at its borders; they are joined again later ([`Plan::untidy`]).

mod build;
mod carve;
mod closure;
mod leaves;
pub mod light;
pub mod live;
mod load;
mod palette;
mod payload;
mod plan;
mod space;
mod splice;
mod stats;
mod validate;
pub mod view;

pub use build::{BuildOptions, Quality};
pub use leaves::{Leaf, LeafContent, LeafSnapshot};
pub use load::{LOAD_BATCH_BYTES, LoadBatches, load};
pub use plan::{OpLimits, Plan, PlanCounts};
pub use stats::{ArenaUse, WorldSetStats};

use leaves::LeafSet;
use orthant_bvh::{Bvh, NodeWrites};
use orthant_resident::world::{ArenaLens, BatchRefused, MutationBatch, Root, WorldArenas};
use orthant_world::Aabb4;
use palette::PaletteStore;
use payload::PayloadStore;

/// Why a world cannot be derived, or a change of it not be planned. The derived world is then as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// An arena would be too large.
    #[error(
        "the {arena} of the world would need {needed} rows (of the payload: words), and {limit} are allowed; show a smaller part of \
         the world, or compact it"
    )]
    ArenaFull {
        /// Which arena.
        arena: &'static str,
        /// What would be needed.
        needed: u64,
        /// What there may be.
        limit: u32,
    },
    /// A leaf that no set has.
    #[error("leaf {index} is wrong: {fault}")]
    Leaf {
        /// Its place in the list.
        index: usize,
        /// What is wrong.
        fault: &'static str,
    },
}

fn full(arena: &'static str, needed: u64, limit: u32) -> Result<(), WorldError> {
    if needed > u64::from(limit) { Err(WorldError::ArenaFull { arena, needed, limit }) } else { Ok(()) }
}

/// What a set is at, with every batch that was planned so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Head {
    root: Root,
    revision: u64,
    lens: ArenaLens,
}

/// A set of leaves with its root BVH, payload and palette, and the mirror of the resident arenas.
///
/// Several batches may be planned before the first is committed; each starts where the one before it ends. A batch that a backend
/// refuses leaves the derived world ahead of it: build again.
#[derive(Clone, Debug)]
pub struct DerivedWorld {
    origin: [i64; 4],
    clip: Aabb4,
    /// The most rows that arenas may have.
    max: ArenaLens,
    leaves: LeafSet,
    /// Items are slots of `leaves`.
    tree: Bvh<f32, 4>,
    payloads: PayloadStore,
    palette: PaletteStore,
    head: Head,
    mirror: WorldArenas,
    /// Used again from batch to batch.
    writes: NodeWrites,
}

impl DerivedWorld {
    /// What node bounds are relative to, raw.
    pub const fn origin(&self) -> [i64; 4] {
        self.origin
    }

    /// The box to which content is clipped.
    pub const fn clip(&self) -> &Aabb4 {
        &self.clip
    }

    /// The arenas as the resident ones are after every batch that was committed.
    pub const fn mirror(&self) -> &WorldArenas {
        &self.mirror
    }

    /// The revision that the set has after every batch that was planned.
    pub const fn revision(&self) -> u64 {
        self.head.revision
    }

    /// Leaves.
    pub fn leaf_count(&self) -> usize {
        self.leaves.len()
    }

    /// The most nodes above any leaf.
    pub fn depth(&self) -> u32 {
        self.tree.depth()
    }

    /// The surface area heuristic of the root BVH, see [`Bvh::sah_cost`]. Walks the whole tree.
    pub fn sah_cost(&self) -> f64 {
        self.tree.sah_cost()
    }

    /// Every leaf, in the order of slots.
    pub fn leaves(&self) -> impl Iterator<Item = Leaf> + '_ {
        self.leaves.iter().map(|(_, record)| record.leaf())
    }

    /// The leaves as they are now, for work on another thread.
    pub fn snapshot(&self) -> LeafSnapshot {
        LeafSnapshot {
            pages: self.leaves.pages(),
            len: self.leaves.len(),
            origin: self.origin,
            clip: self.clip,
            revision: self.head.revision,
        }
    }

    /// Lets the mirror follow a batch that the backend took.
    ///
    /// # Errors
    /// [`BatchRefused`] for a batch that is not the next one; the mirror is then unchanged.
    pub fn commit(&mut self, batch: &MutationBatch) -> Result<(), BatchRefused> {
        self.mirror.apply(batch).map(|_| ())
    }

    /// A batch without writes that starts where the last one ended.
    fn begin_batch(&self) -> MutationBatch {
        MutationBatch {
            expected_root: self.head.root,
            new_root: self.head.root,
            expected_revision: self.head.revision,
            new_revision: self.head.revision,
            lens: self.head.lens,
            ..MutationBatch::default()
        }
    }
}
