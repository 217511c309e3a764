//! The tree: its state, its small accessors, and the links that every edit goes through.

use crate::aabb::Aabb;
use crate::arena::{Arena, NodeWrites};
use crate::edit::insert::SiblingSearch;
use crate::error::BvhError;
use crate::node::{Child, ChildKind, MAX_ITEM, NONE, Node, NodeId};
use crate::scalar::Scalar;

/// No leaf has more nodes above it than this, after any operation. A near-first traversal needs one stack entry per
/// node above, less one.
pub const MAX_DEPTH: u32 = 64;

/// The place of an item that is not in the tree.
pub(crate) const ABSENT: u32 = u32::MAX;

/// Work done since the counters were last taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Nodes read by searches, walks to the root and rotations.
    pub visited: u64,
    /// Children whose stored bounds or link were written.
    pub written: u64,
    /// Rotations applied.
    pub rotations: u64,
    /// Times that a path was restructured, or a subtree rebuilt, to hold [`MAX_DEPTH`].
    pub depth_repairs: u64,
}

/// A bounding volume hierarchy over boxes of `N` dimensions with coordinates `S`.
///
/// The tree keeps the map from item to leaf: 4 bytes for every id up to the highest, so ids are to be slots of a dense arena.
#[derive(Clone, Debug)]
pub struct Bvh<S: Scalar, const N: usize> {
    pub(crate) arena: Arena<S, N>,
    pub(crate) root: u32,
    /// By item: the node that holds the leaf, times two, plus the child slot.
    pub(crate) places: Vec<u32>,
    pub(crate) len: usize,
    pub(crate) search: SiblingSearch,
    pub(crate) counters: Counters,
    /// Every node comes before its children in the arena, and no slot is free: a sweep from the back refits all.
    pub(crate) parents_first: bool,
}

impl<S: Scalar, const N: usize> Default for Bvh<S, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// An empty tree.
    pub const fn new() -> Self {
        Self {
            arena: Arena::new(),
            root: NONE,
            places: Vec::new(),
            len: 0,
            search: SiblingSearch::fast(),
            counters: Counters { visited: 0, written: 0, rotations: 0, depth_repairs: 0 },
            parents_first: false,
        }
    }

    /// Sets how [`Self::insert`], [`Self::move_leaf`] and [`Self::graft`] look for a place.
    pub fn set_sibling_search(&mut self, search: SiblingSearch) {
        self.search = search;
    }

    /// Items in the tree.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether the tree holds no item.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The arena, free nodes ([`Node::FREE`]) included, indexed by [`NodeId`].
    pub fn nodes(&self) -> &[Node<S, N>] {
        self.arena.nodes()
    }

    /// Live nodes.
    pub fn node_count(&self) -> usize {
        self.arena.nodes().len() - self.arena.free_list().len()
    }

    /// The root; `None` if the tree is empty. A tree of one item has a root with an empty second child.
    pub fn root(&self) -> Option<NodeId> {
        (self.root != NONE).then_some(NodeId(self.root))
    }

    /// The bounds of everything, [`Aabb::EMPTY`] if there is nothing.
    pub fn bounds(&self) -> Aabb<S, N> {
        if self.root == NONE { Aabb::EMPTY } else { self.arena[self.root].union() }
    }

    /// The most nodes above any leaf; at most [`MAX_DEPTH`].
    ///
    /// The bound holds for any number of items. Builders split at the median where a surface-guided split would leave too
    /// little depth. An edit that makes the tree deeper than the bound restructures the deepest path: the subtrees that hang
    /// off a stretch of it are joined again so that the stretch is as shallow as it can be, which writes as many nodes as the
    /// stretch is long. Should that not do, because those subtrees are deep themselves, the smallest subtree on the path
    /// that is much deeper than its count of leaves demands is rebuilt. [`Counters::depth_repairs`] counts both.
    pub fn depth(&self) -> u32 {
        if self.root == NONE { 0 } else { u32::from(self.arena[self.root].own_height()) }
    }

    /// Whether the item is in the tree.
    #[inline]
    pub fn contains(&self, item: u32) -> bool {
        self.places.get(item as usize).is_some_and(|&place| place != ABSENT)
    }

    /// The item's box.
    pub fn bounds_of(&self, item: u32) -> Option<Aabb<S, N>> {
        let (node, slot) = self.place(item)?;
        Some(self.arena[node].bounds[slot])
    }

    /// The node that holds the item's leaf, and which of its children the leaf is. Rotations change it.
    pub fn leaf_of(&self, item: u32) -> Option<(NodeId, usize)> {
        self.place(item).map(|(node, slot)| (NodeId(node), slot))
    }

    /// The node's parent: `None` for the root, and for a node that is not in the tree.
    pub fn parent(&self, node: NodeId) -> Option<NodeId> {
        if !self.arena.is_live(node.0) {
            return None;
        }
        let parent = self.arena[node.0].parent;
        (parent != NONE).then_some(NodeId(parent))
    }

    /// Every item with its box, in the order of the arena.
    pub fn items(&self) -> impl Iterator<Item = (u32, Aabb<S, N>)> + '_ {
        self.arena.nodes().iter().flat_map(|node| {
            [0, 1].into_iter().filter_map(|slot| match node.child[slot].kind() {
                ChildKind::Leaf(item) => Some((item, node.bounds[slot])),
                ChildKind::Node(_) | ChildKind::Empty => None,
            })
        })
    }

    /// Makes room for this many more items.
    pub fn reserve(&mut self, additional: usize) {
        self.arena.reserve(additional);
        self.places.reserve(additional);
    }

    /// Removes every item. Capacity stays; every node is free.
    pub fn clear(&mut self) {
        self.arena.clear();
        self.root = NONE;
        self.places.clear();
        self.len = 0;
        self.parents_first = false;
    }

    /// The surface area heuristic: the expected node steps (each 1) and leaf tests (each 1) of a ray that hits the bounds.
    /// Lower is better. Walks the whole tree.
    pub fn sah_cost(&self) -> f64 {
        let total = self.bounds().half_area_f64();
        if self.root == NONE || total <= 0.0 {
            return self.len as f64;
        }
        let mut sum = total;
        for node in self.arena.nodes() {
            for slot in 0..2 {
                if node.child[slot] != Child::EMPTY {
                    sum += node.bounds[slot].half_area_f64();
                }
            }
        }
        sum / total
    }

    /// The node writes since the last batch. See [`NodeWrites`].
    pub fn take_writes(&mut self) -> NodeWrites {
        let mut writes = NodeWrites::default();
        self.take_writes_into(&mut writes);
        writes
    }

    /// [`Self::take_writes`] into buffers that are used again.
    pub fn take_writes_into(&mut self, writes: &mut NodeWrites) {
        self.arena.drain(self.root, writes);
    }

    /// Nodes that the open batch names so far.
    pub fn pending_writes(&self) -> usize {
        self.arena.log_len()
    }

    /// The counters since they were last taken.
    pub fn take_counters(&mut self) -> Counters {
        core::mem::take(&mut self.counters)
    }

    /// The node and slot of the item's leaf.
    #[inline]
    pub(crate) fn place(&self, item: u32) -> Option<(u32, usize)> {
        match self.places.get(item as usize) {
            Some(&place) if place != ABSENT => Some((place >> 1, (place & 1) as usize)),
            _ => None,
        }
    }

    /// Refuses an item that is there already, or that has no place in the map.
    pub(crate) fn check_new_item(&self, item: u32) -> Result<(), BvhError> {
        if item > MAX_ITEM {
            return Err(BvhError::ItemOutOfRange { item });
        }
        if self.contains(item) {
            return Err(BvhError::DuplicateItem { item });
        }
        Ok(())
    }

    /// Makes room in the item map.
    pub(crate) fn make_place(&mut self, item: u32) {
        let needed = item as usize + 1;
        if self.places.len() < needed {
            self.places.resize(needed, ABSENT);
        }
    }

    /// Tells a child where it hangs now: a node by its parent link, a leaf by the item map.
    #[inline(always)]
    pub(crate) fn set_link(&mut self, child: Child, node: u32, slot: usize) {
        match child.kind() {
            ChildKind::Node(id) => self.arena.links(id.0).parent = node,
            ChildKind::Leaf(item) => self.places[item as usize] = node << 1 | slot as u32,
            ChildKind::Empty => {}
        }
    }

    /// Hangs a child into a slot and links it.
    #[inline(always)]
    pub(crate) fn set_child(&mut self, node: u32, slot: usize, child: Child, bounds: Aabb<S, N>, height: u8) {
        let target = self.arena.write(node);
        target.child[slot] = child;
        target.bounds[slot] = bounds;
        target.height[slot] = height;
        self.counters.written += 1;
        self.set_link(child, node, slot);
    }
}
