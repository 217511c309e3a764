//! Moving one item: in place while that costs nothing, else out and in again nearby.

use crate::aabb::Aabb;
use crate::edit::ascend::Rotations;
use crate::error::BvhError;
use crate::node::{Child, NONE};
use crate::scalar::Scalar;
use crate::tree::Bvh;

/// How an item was moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moved {
    /// The box is the one it had.
    Unchanged,
    /// The leaf stayed where it is; bounds above were refitted.
    Refitted,
    /// The leaf was taken out and put beside another sibling.
    Reinserted,
}

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Gives an item another box. Reads and writes O(depth) nodes.
    ///
    /// If the pair that the leaf is in would not grow, the leaf stays. Otherwise it goes to the best place, which is looked
    /// for outwards from the lowest node above it that holds the new box; however many small moves add up, the tree follows.
    ///
    /// # Errors
    /// [`BvhError::BadBounds`], [`BvhError::UnknownItem`]; the tree is then unchanged.
    pub fn move_leaf(&mut self, item: u32, bounds: Aabb<S, N>) -> Result<Moved, BvhError> {
        bounds.check(item)?;
        let (node, slot) = self.place(item).ok_or(BvhError::UnknownItem { item })?;
        let n = &self.arena[node];
        if n.bounds[slot] == bounds {
            return Ok(Moved::Unchanged);
        }
        // With two leaves or one there is nowhere else to go.
        if self.len <= 2 || n.union().contains(&bounds) {
            self.arena.write(node).bounds[slot] = bounds;
            self.counters.written += 1;
            self.ascend(node, Rotations::Yes);
            self.limit_depth();
            return Ok(Moved::Refitted);
        }

        let mut start = self.detach(node, slot);
        if start == NONE {
            start = self.root;
        } else {
            self.ascend(start, Rotations::No);
            start = self.lowest_holder(start, &bounds);
        }
        let site = self.best_site(start, &bounds);
        self.attach(Child::leaf(item), bounds, 0, site);
        Ok(Moved::Reinserted)
    }

    /// The lowest node, from `node` upwards, that holds the box; the root if none does.
    fn lowest_holder(&mut self, mut node: u32, bounds: &Aabb<S, N>) -> u32 {
        loop {
            self.counters.visited += 1;
            let n = &self.arena[node];
            if n.parent == NONE || n.union().contains(bounds) {
                return node;
            }
            node = n.parent;
        }
    }
}
