//! Bounding volume hierarchies over boxes of any dimension, edited in place.
//!
//! A [`Bvh`] holds items, each a `u32` id (a slot of an arena of the caller) with a box. It is built in one go or item by
//! item; items are inserted, removed, moved and refitted at a cost of the order of the depth, and whole subtrees go in and
//! out. Node ids never change while a node lives, and every change is logged as node writes, so that a copy elsewhere
//! (on a device, on another thread) follows by those writes alone.
//!
//! ```
//! use orthant_bvh::{Aabb, Builder, Bvh, Ray};
//!
//! let unit_cube_at = |x: f32| Aabb::new([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]);
//! let boxes: Vec<_> = (0..100).map(|i| unit_cube_at(2.0 * i as f32)).collect();
//! let mut bvh = Bvh::build(&boxes, Builder::fast())?;
//! let mut copy = bvh.nodes().to_vec();
//! bvh.take_writes();
//!
//! // Edit: what is written does not depend on how much else there is.
//! bvh.remove(3)?;
//! bvh.insert(100, unit_cube_at(-2.0))?;
//! bvh.move_leaf(50, unit_cube_at(100.25))?;
//! let writes = bvh.take_writes();
//! assert!(writes.written.len() < 20);
//!
//! // A copy follows.
//! copy.resize(writes.arena_len, orthant_bvh::Node::FREE);
//! writes.written.iter().for_each(|&id| copy[id.index()] = bvh.nodes()[id.index()]);
//! writes.freed.iter().for_each(|&id| copy[id.index()] = orthant_bvh::Node::FREE);
//! assert_eq!(copy, bvh.nodes());
//!
//! // The nearest box along a ray: the visitor returns how far the ray still reaches.
//! let mut nearest = None;
//! bvh.ray(&Ray::new([-10.0, 0.5, 0.5], [1.0, 0.0, 0.0], 0.0, f32::INFINITY), |hit| {
//!     nearest = Some((hit.item, hit.t));
//!     hit.t
//! });
//! assert_eq!(nearest, Some((100, 8.0)));
//! bvh.validate().expect("every invariant holds");
//! # Ok::<(), orthant_bvh::BvhError>(())
//! ```
//!
//! # How it is laid out
//!
//! A [`Node`] is inner and stores the bounds of both children; a leaf is a tagged reference in its parent and has no node.
//! A tree of `n > 1` items has `n - 1` nodes; a tree of one has one node, whose second child is empty.
//!
//! # Depth
//!
//! No leaf ever has more than [`MAX_DEPTH`] nodes above it, so traversals use fixed stacks. See [`Bvh::depth`].

mod aabb;
mod arena;
mod build;
mod edit;
mod error;
#[cfg(feature = "measure")]
pub mod measure;
mod node;
mod prefetch;
mod query;
mod scalar;
mod tree;
mod validate;

pub use aabb::Aabb;
pub use arena::NodeWrites;
pub use build::Builder;
pub use edit::insert::SiblingSearch;
pub use edit::move_leaf::Moved;
pub use edit::optimize::Optimized;
pub use error::{BvhError, ValidateError};
pub use node::{Child, ChildKind, MAX_ITEM, Node, NodeId};
pub use query::ray::{Ray, RayHit};
pub use scalar::{Real, Scalar};
pub use tree::{Bvh, Counters, MAX_DEPTH};
