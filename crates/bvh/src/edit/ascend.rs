//! The walk from a changed node to the root that makes bounds and heights exact again.

use crate::node::{Child, NONE, NodeId};
use crate::scalar::Scalar;
use crate::tree::Bvh;

/// Whether the walk rotates the nodes that it passes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rotations {
    Yes,
    No,
}

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Carries a change of `node`'s children upwards, and stops where nothing changes any more.
    pub(crate) fn ascend(&mut self, mut node: u32, rotations: Rotations) {
        loop {
            self.counters.visited += 1;
            let rotated = rotations == Rotations::Yes && self.rotate(node);
            let n = &self.arena[node];
            let (parent, bounds, height) = (n.parent, n.union(), n.own_height());
            if parent == NONE {
                return;
            }
            let above = &self.arena[parent];
            let slot = above.slot_of(Child::node(NodeId(node)));
            if above.bounds[slot] != bounds {
                let above = self.arena.write(parent);
                above.bounds[slot] = bounds;
                above.height[slot] = height;
                self.counters.written += 1;
            } else if above.height[slot] != height {
                self.arena.links(parent).height[slot] = height;
            } else if !rotated {
                return;
            }
            node = parent;
        }
    }
}
