//! What a tree refuses, and what its validation may find.

use thiserror::Error;

/// A refused operation. The tree is as it was before.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum BvhError {
    /// The box has `min > max`, a NaN, or an end at the wrong infinity.
    #[error(
        "item {item}: axis {axis} of its box runs from {min} to {max}; give finite or unbounded ends with min <= max"
    )]
    BadBounds {
        /// The item that was to have the box.
        item: u32,
        /// The first axis that is wrong.
        axis: usize,
        /// The lower end on that axis.
        min: f64,
        /// The upper end on that axis.
        max: f64,
    },
    /// The item is in the tree already.
    #[error("item {item} is in the tree already; move it, or remove it first")]
    DuplicateItem {
        /// The item.
        item: u32,
    },
    /// The item is not in the tree.
    #[error("item {item} is not in the tree; insert it first")]
    UnknownItem {
        /// The item.
        item: u32,
    },
    /// The item's id is above [`crate::MAX_ITEM`].
    #[error("item {item} is above the highest id, {}; use the slots of an arena as ids", crate::MAX_ITEM)]
    ItemOutOfRange {
        /// The item.
        item: u32,
    },
    /// The node is not in the tree.
    #[error("node {node} is not in the tree")]
    UnknownNode {
        /// The node's id.
        node: u32,
    },
    /// The joins of another builder are not one tree over all items.
    #[error("the joins are not one tree that starts at the first and leads to every item once")]
    NoTree,
}

/// An invariant that does not hold, and where.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum ValidateError {
    /// A child's stored bounds are not the union of what the child holds.
    #[error("node {node}, child {slot}: the bounds are not the union of what lies below")]
    BoundsNotExact {
        /// The node that stores the bounds.
        node: u32,
        /// Which of its two children.
        slot: usize,
    },
    /// A leaf's bounds are no box.
    #[error("node {node}, child {slot}: the leaf's bounds are no box on axis {axis}")]
    BadLeafBounds {
        /// The node that stores the bounds.
        node: u32,
        /// Which of its two children.
        slot: usize,
        /// The first axis that is wrong.
        axis: usize,
    },
    /// A child's stored height is not the height of what lies below.
    #[error("node {node}, child {slot}: stored height {stored}, actual height {actual}")]
    HeightWrong {
        /// The node that stores the height.
        node: u32,
        /// Which of its two children.
        slot: usize,
        /// The height that the node stores.
        stored: u32,
        /// The height of the child.
        actual: u32,
    },
    /// A node's parent link does not lead to the node that has it as a child.
    #[error("node {node}: the parent link says {stored}, its parent is {actual}")]
    ParentWrong {
        /// The node.
        node: u32,
        /// What its link says; `u32::MAX` is "none".
        stored: u32,
        /// The node that has it as a child; `u32::MAX` is "none".
        actual: u32,
    },
    /// A child leads outside the arena, or to a free node.
    #[error("node {node}, child {slot}: leads to {child}, which is not a live node")]
    DanglingChild {
        /// The node.
        node: u32,
        /// Which of its two children.
        slot: usize,
        /// Where it leads.
        child: u32,
    },
    /// Only the root of a tree with one leaf has an empty child.
    #[error("node {node}: child {slot} is empty")]
    EmptyChild {
        /// The node.
        node: u32,
        /// Which of its two children.
        slot: usize,
    },
    /// A node is reached twice.
    #[error("node {node} is reached twice")]
    ReachedTwice {
        /// The node.
        node: u32,
    },
    /// A live node is not reached from the root.
    #[error("node {node} is neither free nor reached from the root")]
    Unreachable {
        /// The node.
        node: u32,
    },
    /// The free list holds a live node, one outside the arena, or one twice.
    #[error("node {node} is on the free list, but live, outside the arena, or there twice")]
    FreeListWrong {
        /// The node.
        node: u32,
    },
    /// The item map does not lead to the item's leaf.
    #[error("node {node}, child {slot}: the item map does not lead here for item {item}")]
    ItemMapWrong {
        /// The node that holds the leaf.
        node: u32,
        /// Which of its two children.
        slot: usize,
        /// The item.
        item: u32,
    },
    /// The count of items, of the map's entries and of the leaves differ.
    #[error("the tree counts {counted} items, its map holds {mapped}, its leaves are {leaves}")]
    CountWrong {
        /// What the tree says.
        counted: usize,
        /// Entries of the item map.
        mapped: usize,
        /// Leaves reached from the root.
        leaves: usize,
    },
    /// A leaf lies deeper than traversal stacks allow for.
    #[error("node {node} is deeper than {}", crate::MAX_DEPTH)]
    TooDeep {
        /// The first node that is too deep.
        node: u32,
    },
}
