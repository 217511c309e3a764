//! Derived worlds: the leaf set with its root BVH, and the planner that turns patches into mutation batches.

pub mod light;
pub mod view;
