//! Whole subtrees, in and out.

use crate::aabb::Aabb;
use crate::edit::ascend::Rotations;
use crate::error::BvhError;
use crate::node::{Child, ChildKind, NONE, Node, NodeId};
use crate::scalar::Scalar;
use crate::tree::{ABSENT, Bvh, MAX_DEPTH};

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Puts a whole tree in as one subtree: its structure is kept, its items keep their ids, and of this tree only O(depth)
    /// nodes are touched. Returns the node that is the subtree's root, `None` if it has at most one item and so no root of
    /// its own. Later edits may rotate other items into that subtree, and its own out of it.
    ///
    /// # Errors
    /// [`BvhError::DuplicateItem`] if both trees hold an item; this tree is then unchanged.
    pub fn graft(&mut self, subtree: &Self) -> Result<Option<NodeId>, BvhError> {
        for (item, _) in subtree.items() {
            self.check_new_item(item)?;
        }
        if subtree.is_empty() {
            return Ok(None);
        }
        if subtree.len == 1 {
            let root = &subtree.arena[subtree.root];
            let ChildKind::Leaf(item) = root.child[0].kind() else {
                unreachable!("the root of one item holds its leaf")
            };
            self.insert(item, root.bounds[0])?;
            return Ok(None);
        }
        if let Some(highest) = subtree.places.iter().rposition(|&place| place != ABSENT) {
            self.make_place(highest as u32);
        }
        self.arena.reserve(subtree.node_count());
        self.parents_first = false;
        self.len += subtree.len;
        let id = self.install(subtree.nodes(), subtree.root, NONE);
        let root = &self.arena[id];
        let (bounds, height) = (root.union(), root.own_height());
        self.hang(Child::node(NodeId(id)), bounds, height);
        Ok(Some(NodeId(id)))
    }

    /// Takes a node out with all that is below it, and returns that as a tree of its own, with the same items. Of what
    /// stays only O(depth) nodes are touched.
    ///
    /// # Errors
    /// [`BvhError::UnknownNode`].
    pub fn prune(&mut self, node: NodeId) -> Result<Self, BvhError> {
        if !self.arena.is_live(node.0) {
            return Err(BvhError::UnknownNode { node: node.0 });
        }
        let mut out = Self { search: self.search, ..Self::new() };
        let mut stack = vec![node.0];
        while let Some(id) = stack.pop() {
            for child in self.arena[id].child {
                match child.kind() {
                    ChildKind::Node(id) => stack.push(id.0),
                    ChildKind::Leaf(item) => {
                        out.make_place(item);
                        out.len += 1;
                    }
                    ChildKind::Empty => {}
                }
            }
        }
        out.root = out.install(self.nodes(), node.0, NONE);
        out.parents_first = true;

        let parent = self.arena[node.0].parent;
        let start = if parent == NONE {
            self.root = NONE;
            NONE
        } else {
            let slot = self.arena[parent].slot_of(Child::node(node));
            self.detach(parent, slot)
        };
        let mut leaves = Vec::new();
        self.release_below(node.0, &mut leaves);
        for &(item, _) in &leaves {
            self.places[item as usize] = ABSENT;
        }
        self.len -= leaves.len();
        if start != NONE {
            self.ascend(start, Rotations::No);
        }
        Ok(out)
    }

    /// Copies the nodes below `root` of another arena into this one, parents first, and enters their items into the map,
    /// which has room for them. Returns the copy of the root; it is linked to `parent`, but `parent` not to it.
    pub(crate) fn install(&mut self, nodes: &[Node<S, N>], root: u32, parent: u32) -> u32 {
        let mut top = NONE;
        let mut stack = Vec::with_capacity(MAX_DEPTH as usize + 1);
        stack.push((root, parent, 0));
        while let Some((from, parent, slot)) = stack.pop() {
            let node = &nodes[from as usize];
            let id = self.arena.alloc(parent);
            *self.arena.links(id) = Node { parent, ..*node };
            if top == NONE {
                top = id;
            } else {
                self.arena.links(parent).child[slot] = Child::node(NodeId(id));
            }
            for slot in [1, 0] {
                match node.child[slot].kind() {
                    ChildKind::Node(child) => stack.push((child.0, id, slot)),
                    ChildKind::Leaf(item) => self.places[item as usize] = id << 1 | slot as u32,
                    ChildKind::Empty => {}
                }
            }
        }
        top
    }

    /// Every item with its box, leaf by leaf from the first child on.
    pub(crate) fn leaves_in_order(&self) -> Vec<(u32, Aabb<S, N>)> {
        let mut leaves = Vec::with_capacity(self.len);
        let mut open = Vec::new();
        if self.root != NONE {
            open.push((Child::node(NodeId(self.root)), Aabb::EMPTY));
        }
        while let Some((child, bounds)) = open.pop() {
            match child.kind() {
                ChildKind::Node(id) => {
                    let n = &self.arena[id.0];
                    open.extend([(n.child[1], n.bounds[1]), (n.child[0], n.bounds[0])]);
                }
                ChildKind::Leaf(item) => leaves.push((item, bounds)),
                ChildKind::Empty => {}
            }
        }
        leaves
    }
}
