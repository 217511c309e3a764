//! Acceleration structures: boxes over triangles (BLAS) and over instances (TLAS), as trees of eight-wide nodes.
//!
//! Geometry is not copied into them: a leaf names triangles, and a ray reads their corners from the resident streams.
//! How the binary tree comes about ([`binary`]) and how it is walked ([`crate::trace`]) know only [`wide`].

pub mod bounds;
pub mod wide;

mod binary;
pub(crate) mod blas;
mod tlas;

pub use blas::Blas;
pub use bounds::Bounds;
pub use tlas::Tlas;
