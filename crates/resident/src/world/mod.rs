//! What crosses from a derived world to a backend, as plain data.
//!
//! * [`rows`]: nodes of the root BVH, leaves, materials of blocks;
//! * [`payload`]: how the 4,096 blocks of a dense chunk lie in the payload arena;
//! * [`batch`]: [`MutationBatch`], the writes and frees that bring resident arenas up to date;
//! * [`arenas`]: [`WorldArenas`], such arenas in memory: the CPU backend's, and the planner's mirror;
//! * [`compare`]: whether resident arenas are what the mirror says;
//! * [`ray`]: where a ray meets a plane, by the one formula that all leaf kinds share;
//! * [`view`]: what a frame shows of a world, and how.
//!
//! # Space
//! Coordinates are those of the world: four axes X, Y (up), Z, W in steps of 1/65,536 unit (*raw* coordinates, `i64`, below 2^61
//! in magnitude). Boxes are half-open. Node bounds are `f32` units relative to the origin of their set, rounded outwards; exact
//! bounds stand in the leaves.
//!
//! # Sets
//! A backend holds an *active set*, which frames see, and at most one *staging set*, which is filled in the background and
//! takes its place by a swap. A set starts empty ([`Root::EMPTY`], revision 0, no rows) and changes by [`MutationBatch`] alone,
//! its first filling included.

pub mod arenas;
pub mod batch;
pub mod compare;
pub mod payload;
pub mod ray;
pub mod rows;
pub mod view;

pub use arenas::{BatchRefused, WorldArenas};
pub use batch::{ArenaLens, MutationBatch, PayloadWrite};
pub use rows::{BlockRow, LeafRow, Root, WorldNode};
pub use view::{Combine, Layer, Shade, WorldView};

/// Which set of arenas a batch is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SetSlot {
    /// What frames see.
    Active,
    /// What is being filled, to be swapped in.
    Staging,
}

/// What an applied batch did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldApplied {
    /// Bytes that went to the device (or were written in memory).
    pub bytes: u64,
}

/// Work of rays in a world, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldCounts {
    /// Rays.
    pub rays: u64,
    /// Nodes of the root BVH that were read.
    pub node_visits: u64,
    /// Leaves whose exact bounds were tested.
    pub leaf_visits: u64,
    /// Steps from cell to cell in chunks.
    pub dda_steps: u64,
    /// Rays that ran out of their budget of steps. Their pixels show it; they are never taken for misses.
    pub exhausted: u64,
}

impl std::ops::AddAssign for WorldCounts {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.node_visits += other.node_visits;
        self.leaf_visits += other.leaf_visits;
        self.dda_steps += other.dda_steps;
        self.exhausted += other.exhausted;
    }
}

/// Bytes of a set of arenas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldBytes {
    /// Nodes of the root BVH.
    pub nodes: u64,
    /// Leaves.
    pub leaves: u64,
    /// Dense chunks and textures.
    pub payload: u64,
    /// Materials.
    pub palette: u64,
}
