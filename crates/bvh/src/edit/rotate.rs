//! Tree rotations: Kensler, "Tree Rotations for Improving Bounding Volume Hierarchies", IEEE Symposium on Interactive
//! Ray Tracing 2008.
//!
//! A rotation swaps a child of a node with a grandchild on the other side:
//!
//! ```text
//!      node              node
//!     /    \            /    \
//!    y      x    ->    a      x
//!          / \               / \
//!         a   b             y   b
//! ```
//!
//! Only the surface of `x` changes, to that of `y` united with `b`. That is at least the surface of `y`, so there is
//! nothing to gain unless `x` is the larger child: half of Kensler's rotations need not be looked at.

use crate::node::{Child, ChildKind, NodeId};
use crate::scalar::Scalar;
use crate::tree::Bvh;

/// Above this height a rotation may not make a node taller: depth is then worth more than surface.
const TALL: u8 = 40;

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Applies the best rotation about `node` if one makes the surface of its larger child smaller. The bounds of `node`
    /// stay, its height may change by one.
    #[inline]
    pub(crate) fn rotate(&mut self, node: u32) -> bool {
        let n = &self.arena[node];
        let areas = [n.bounds[0].half_area(), n.bounds[1].half_area()];
        let big = usize::from(areas[1] > areas[0]);
        let small = 1 - big;
        let ChildKind::Node(NodeId(x)) = n.child[big].kind() else { return false };

        self.counters.visited += 1;
        let below = &self.arena[x];
        let kept =
            [n.bounds[small].union_half_area(&below.bounds[1]), n.bounds[small].union_half_area(&below.bounds[0])];
        // `raised`: the grandchild that changes places with the small child.
        let raised = usize::from(kept[1] < kept[0]);
        if kept[raised] >= areas[big] {
            return false;
        }
        let x_height = 1 + n.height[small].max(below.height[1 - raised]);
        let node_height = 1 + x_height.max(below.height[raised]);
        if node_height > TALL && node_height > n.own_height() {
            return false;
        }

        let (y, y_bounds, y_height) = (n.child[small], n.bounds[small], n.height[small]);
        let (a, a_bounds, a_height) = (below.child[raised], below.bounds[raised], below.height[raised]);
        self.set_child(x, raised, y, y_bounds, y_height);
        let x_bounds = self.arena[x].union();
        self.set_child(node, small, a, a_bounds, a_height);
        self.set_child(node, big, Child::node(NodeId(x)), x_bounds, x_height);
        self.counters.rotations += 1;
        self.parents_first = false;
        true
    }
}
