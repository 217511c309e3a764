//! Acceleration structures: boxes over triangles (BLAS) and over instances (TLAS), as trees of eight-wide nodes.
//!
//! Geometry is not copied into them: a leaf names triangles, and a ray reads their corners from the resident streams.
//! How the binary tree comes about ([`binary`]) and how it is walked ([`crate::trace`]) know only [`wide`]. The TLAS is edited in
//! place: it keeps its binary tree, and [`collapse`] makes the wide nodes anew in which an edit wrote.

pub mod bounds;
pub mod wide;

mod binary;
pub(crate) mod blas;
mod collapse;
mod tlas;

pub use blas::Blas;
pub use bounds::Bounds;
pub use tlas::{Tlas, TlasWork};
