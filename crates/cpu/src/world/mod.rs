//! Worlds: resident sets of arenas, and rays through them.
//!
//! * [`sets`]: the active set, and the staging set that takes its place;
//! * [`ray`]: a ray relative to the anchor of a view; [`walk`]: its way through the root BVH; [`leaf`], [`chunk`]: the runs of blocks
//!   that it meets in a leaf; [`trace`]: through media to a surface;
//! * [`surface`], [`pattern`]: from a hit to what is seen there;
//! * [`layers`]: the slices of a view as a frame traces them; [`preview`]: shading without further rays; [`combine`]: from layers to
//!   one colour; [`image`]: samples and centres of pixels.
//!
//! Functions here have twins of the same name in the shaders, with the same order of operations.

mod chunk;
pub mod combine;
pub mod image;
pub mod layers;
mod leaf;
pub mod pattern;
pub mod preview;
pub mod ray;
mod sets;
pub mod surface;
pub mod trace;
mod walk;

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use layers::{LayerView, WorldTracer};
pub use ray::{WorldRay, WorldScene};
pub(crate) use sets::WorldSets;
pub use trace::{RayEnd, Transit, WorldHit, trace_ray};
