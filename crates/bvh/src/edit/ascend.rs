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
    /// Carries a change of `node`'s children upwards, and stops where nothing changes any more: at once without rotations,
    /// after two quiet levels with them, since a rotation looks at children and grandchildren.
    pub(crate) fn ascend(&mut self, mut node: u32, rotations: Rotations) {
        let mut quiet = 0;
        loop {
            self.counters.visited += 1;
            let rotated = rotations == Rotations::Yes && self.rotate(node);
            let (parent, bounds, height) = {
                let n = &self.arena[node];
                (n.parent, n.union(), n.own_height())
            };
            if parent == NONE {
                return;
            }
            let above = &self.arena[parent];
            let slot = above.slot_of(Child::node(NodeId(node)));
            if above.bounds[slot] == bounds {
                if above.height[slot] != height {
                    self.arena.links(parent).height[slot] = height;
                    quiet = 0;
                } else if rotated {
                    quiet = 0;
                } else {
                    quiet += 1;
                    if quiet == 2 || rotations == Rotations::No {
                        return;
                    }
                }
            } else {
                let above = self.arena.write(parent);
                above.bounds[slot] = bounds;
                above.height[slot] = height;
                self.counters.written += 1;
                quiet = 0;
            }
            node = parent;
        }
    }
}
