//! Space: exact coordinates, half-open boxes, and the lattices of blocks and chunks.

mod aabb;
mod fixed;
mod lattice;
mod volume;

pub use aabb::{Aabb4, Aabb4Error, Cells, Point4, Slabs};
pub use fixed::{Fixed, FixedError};
pub use lattice::{CHUNK_BLOCKS, ChunkShape, Lattice, Scale, ScaleError};
pub(crate) use volume::Volume;
