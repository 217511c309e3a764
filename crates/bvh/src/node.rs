//! One node of the tree: two children with their bounds.
//!
//! Bounds are stored with the parent, not with the child: a traversal step reads one node, and in 3D with 32-bit
//! coordinates that is one cache line. A leaf needs no node of its own.

use core::fmt;

use crate::aabb::Aabb;
use crate::scalar::Scalar;

/// The highest item id.
pub const MAX_ITEM: u32 = LEAF - 2;

/// "No node": the parent of the root, the root of an empty tree.
pub(crate) const NONE: u32 = u32::MAX;
/// The parent link of a free node.
pub(crate) const FREE: u32 = u32::MAX - 1;
/// The bit that tells a leaf from a node.
const LEAF: u32 = 1 << 31;

/// The id of a node: its place in the arena. It stays the same until the node is freed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct NodeId(pub u32);

impl NodeId {
    /// The place in the arena.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// What a child slot leads to, in 32 bits: a node's id; a leaf's item id with the highest bit set; or all ones, empty.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
#[repr(transparent)]
pub struct Child(pub u32);

/// A [`Child`] taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChildKind {
    /// Nothing: the second child of the root of a tree with one leaf.
    Empty,
    /// An inner node.
    Node(NodeId),
    /// A leaf, and the item that it carries.
    Leaf(u32),
}

impl Child {
    /// Leads to nothing.
    pub const EMPTY: Self = Self(u32::MAX);

    /// Leads to an inner node.
    #[inline(always)]
    pub const fn node(id: NodeId) -> Self {
        Self(id.0)
    }

    /// Leads to a leaf with this item, which is at most [`MAX_ITEM`].
    #[inline(always)]
    pub const fn leaf(item: u32) -> Self {
        Self(LEAF | item)
    }

    /// Whether this leads to an inner node.
    #[inline(always)]
    pub const fn is_node(self) -> bool {
        self.0 & LEAF == 0
    }

    /// The item that a leaf carries; of no meaning for what is no leaf.
    #[inline(always)]
    pub(crate) const fn item_bits(self) -> u32 {
        self.0 & !LEAF
    }

    /// What this leads to.
    #[inline(always)]
    pub const fn kind(self) -> ChildKind {
        if self.is_node() {
            ChildKind::Node(NodeId(self.0))
        } else if self.0 == u32::MAX {
            ChildKind::Empty
        } else {
            ChildKind::Leaf(self.0 & !LEAF)
        }
    }
}

impl fmt::Debug for Child {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.kind().fmt(f)
    }
}

/// An inner node. `bounds` and `child` are its record: what a ray needs, and what a resident copy holds. The links that
/// only edits need (the parent, the children's heights) ride in what would be padding, and are no part of the record:
/// two nodes are equal if their records are.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Node<S, const N: usize> {
    /// The exact bounds of the children. An empty child has [`Aabb::EMPTY`].
    pub bounds: [Aabb<S, N>; 2],
    /// The children.
    pub child: [Child; 2],
    pub(crate) parent: u32,
    /// Heights of the children: 0 for a leaf, 1 for a node over two leaves.
    pub(crate) height: [u8; 2],
}

impl<S: Scalar, const N: usize> Node<S, N> {
    /// The record of a node on the free list.
    pub const FREE: Self = Self { bounds: [Aabb::EMPTY; 2], child: [Child::EMPTY; 2], parent: FREE, height: [0; 2] };

    /// The bounds of the node.
    #[inline(always)]
    pub fn union(&self) -> Aabb<S, N> {
        self.bounds[0].union(&self.bounds[1])
    }

    /// Inner nodes on the longest way down, this one included.
    #[inline(always)]
    pub(crate) fn own_height(&self) -> u8 {
        1 + self.height[0].max(self.height[1])
    }

    /// Which child leads to `child`; 1 if the first does not.
    #[inline(always)]
    pub(crate) fn slot_of(&self, child: Child) -> usize {
        usize::from(self.child[0] != child)
    }
}

impl<S: Scalar, const N: usize> PartialEq for Node<S, N> {
    fn eq(&self, other: &Self) -> bool {
        self.child == other.child && self.bounds == other.bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_3d_node_with_32_bit_coordinates_is_one_cache_line() {
        assert_eq!(size_of::<Node<f32, 3>>(), 64);
        assert_eq!(size_of::<Node<i32, 3>>(), 64);
    }

    #[test]
    fn children_survive_packing() {
        assert_eq!(Child::node(NodeId(7)).kind(), ChildKind::Node(NodeId(7)));
        assert_eq!(Child::leaf(MAX_ITEM).kind(), ChildKind::Leaf(MAX_ITEM));
        assert_eq!(Child::EMPTY.kind(), ChildKind::Empty);
    }
}
