//! Removal: the sibling takes the place of the parent.

use crate::aabb::Aabb;
use crate::edit::ascend::Rotations;
use crate::error::BvhError;
use crate::node::{Child, ChildKind, NONE, NodeId};
use crate::scalar::Scalar;
use crate::tree::{ABSENT, Bvh};

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Removes an item and returns its box. Reads and writes O(depth) nodes, frees one.
    ///
    /// # Errors
    /// [`BvhError::UnknownItem`].
    pub fn remove(&mut self, item: u32) -> Result<Aabb<S, N>, BvhError> {
        let (node, slot) = self.place(item).ok_or(BvhError::UnknownItem { item })?;
        let bounds = self.arena[node].bounds[slot];
        self.places[item as usize] = ABSENT;
        self.len -= 1;
        let start = self.detach(node, slot);
        if start != NONE {
            self.ascend(start, Rotations::No);
        }
        Ok(bounds)
    }

    /// Takes a child out and frees the node that held it. Returns the node whose children changed, from where bounds are
    /// to be mended; [`NONE`] if nothing above is left.
    pub(crate) fn detach(&mut self, node: u32, slot: usize) -> u32 {
        self.parents_first = false;
        self.counters.visited += 1;
        let n = &self.arena[node];
        let (parent, other) = (n.parent, 1 - slot);
        let (sibling, bounds, height) = (n.child[other], n.bounds[other], n.height[other]);
        if parent != NONE {
            let above = self.arena[parent].slot_of(Child::node(NodeId(node)));
            self.arena.release(node);
            self.set_child(parent, above, sibling, bounds, height);
            return parent;
        }
        match sibling.kind() {
            ChildKind::Node(id) => {
                self.arena.release(node);
                self.root = id.0;
                self.arena.links(id.0).parent = NONE;
            }
            ChildKind::Leaf(_) => {
                self.set_child(node, 0, sibling, bounds, height);
                self.set_child(node, 1, Child::EMPTY, Aabb::EMPTY, 0);
            }
            ChildKind::Empty => {
                self.arena.release(node);
                self.root = NONE;
            }
        }
        NONE
    }
}
