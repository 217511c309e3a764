//! Items whose boxes share a point with a box, or hold a point.

use core::ops::ControlFlow;

use crate::aabb::Aabb;
use crate::node::{ChildKind, NONE};
use crate::scalar::Scalar;
use crate::tree::{Bvh, MAX_DEPTH};

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Visits every item whose closed box shares a point with `region` (touching counts), until the visitor breaks.
    pub fn overlap<B>(
        &self,
        region: &Aabb<S, N>,
        visit: impl FnMut(u32, &Aabb<S, N>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        self.walk(|bounds| bounds.overlaps(region), visit)
    }

    /// [`Self::overlap`], which adds the nodes that it reads to a count.
    pub fn overlap_counted<B>(
        &self,
        region: &Aabb<S, N>,
        nodes: &mut u64,
        visit: impl FnMut(u32, &Aabb<S, N>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let mut boxes = 0_u64;
        let enters = |bounds: &Aabb<S, N>| {
            boxes += 1;
            bounds.overlaps(region)
        };
        let flow = self.walk(enters, visit);
        // A node has two boxes; a walk that stops may have read one of the last.
        *nodes += boxes.div_ceil(2);
        flow
    }

    /// Visits every item whose closed box holds `point`, until the visitor breaks.
    pub fn point<B>(&self, point: &[S; N], visit: impl FnMut(u32, &Aabb<S, N>) -> ControlFlow<B>) -> ControlFlow<B> {
        self.walk(|bounds| bounds.contains_point(point), visit)
    }

    /// Visits every item to which the predicate leads: one that holds for a box holds for all that contain it.
    #[inline(always)]
    fn walk<B>(
        &self,
        mut enters: impl FnMut(&Aabb<S, N>) -> bool,
        mut visit: impl FnMut(u32, &Aabb<S, N>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if self.root == NONE {
            return ControlFlow::Continue(());
        }
        let mut stack = [0; MAX_DEPTH as usize];
        let mut waiting = 0;
        let mut node = self.root;
        loop {
            let n = &self.arena[node];
            let mut next = NONE;
            for slot in [1, 0] {
                if !enters(&n.bounds[slot]) {
                    continue;
                }
                match n.child[slot].kind() {
                    ChildKind::Node(child) => {
                        if next != NONE {
                            stack[waiting] = next;
                            waiting += 1;
                        }
                        next = child.0;
                    }
                    ChildKind::Leaf(item) => visit(item, &n.bounds[slot])?,
                    ChildKind::Empty => {}
                }
            }
            if next == NONE {
                if waiting == 0 {
                    return ControlFlow::Continue(());
                }
                waiting -= 1;
                next = stack[waiting];
            }
            node = next;
        }
    }
}
