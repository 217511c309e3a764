//! What builders make: which parts are joined with which. Nodes, bounds and heights follow when the draft is raised.

use crate::aabb::Aabb;
use crate::node::{Child, ChildKind, Node, NodeId};
use crate::prefetch::prefetch;
use crate::scalar::Scalar;
use crate::tree::{Bvh, MAX_DEPTH};

/// A subtree that is about to be joined: a leaf, whose number is its place in the list of leaves, or a join of a draft.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part<S, const N: usize> {
    pub(crate) bounds: Aabb<S, N>,
    pub(crate) child: Child,
}

impl<S: Scalar, const N: usize> Part<S, N> {
    /// The leaves of a list, one by one.
    pub(crate) fn leaves(leaves: &[(u32, Aabb<S, N>)]) -> Vec<Self> {
        (0..).zip(leaves).map(|(at, &(_, bounds))| Self { child: Child::leaf(at), bounds }).collect()
    }
}

/// The two children of every join: joins by index, leaves by their place in the list of leaves.
#[derive(Debug, Default)]
pub(crate) struct Draft {
    pub(crate) joins: Vec<[Child; 2]>,
}

impl Draft {
    /// Joins two parts.
    #[inline(always)]
    pub(crate) fn join(&mut self, a: Child, b: Child) -> Child {
        let id = self.joins.len() as u32;
        self.joins.push([a, b]);
        Child::node(NodeId(id))
    }

    /// How many leaves a part has.
    pub(crate) fn leaves_below(&self, part: Child) -> usize {
        let (mut count, mut open) = (0, vec![part]);
        while let Some(part) = open.pop() {
            match part.kind() {
                ChildKind::Node(join) => open.extend(self.joins[join.index()]),
                ChildKind::Leaf(_) => count += 1,
                ChildKind::Empty => {}
            }
        }
        count
    }
}

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Makes the nodes of a draft, parents first and first children next to their parents, and enters the items, for which
    /// the map has room. Returns the node of the join `top`; it is linked to `parent`, but `parent` not to it.
    pub(crate) fn raise(&mut self, draft: &Draft, top: u32, parent: u32, leaves: &[(u32, Aabb<S, N>)]) -> u32 {
        let mut ids = Vec::new();
        // Second children that wait, each with its parent.
        let mut stack = Vec::with_capacity(2 * MAX_DEPTH as usize);
        let mut next = Some((top, parent));
        while let Some((join, parent)) = next {
            let children = draft.joins[join as usize];
            let id = self.arena.alloc(parent);
            ids.push(id);
            if let ChildKind::Node(second) = children[1].kind() {
                prefetch(&draft.joins[second.index()]);
                stack.push((second.0, id));
            }
            for slot in 0..2 {
                if let ChildKind::Leaf(at) = children[slot].kind() {
                    let (item, bounds) = leaves[at as usize];
                    let node = self.arena.links(id);
                    node.child[slot] = Child::leaf(item);
                    node.bounds[slot] = bounds;
                    self.places[item as usize] = id << 1 | slot as u32;
                }
            }
            next = match children[0].kind() {
                ChildKind::Node(first) => Some((first.0, id)),
                ChildKind::Leaf(_) | ChildKind::Empty => stack.pop(),
            };
        }
        // From the back, what lies below is known when its parent is told.
        for (at, &id) in ids.iter().enumerate().skip(1).rev() {
            let node = &self.arena[id];
            let (bounds, height, parent) = (node.union(), node.own_height(), node.parent);
            // Only a first child follows its parent at once.
            let slot = usize::from(ids[at - 1] != parent || draft_has_leaf_first(&self.arena[parent]));
            let above = self.arena.links(parent);
            above.child[slot] = Child::node(NodeId(id));
            above.bounds[slot] = bounds;
            above.height[slot] = height;
        }
        ids[0]
    }
}

/// Whether the first child of a node that is being raised is a leaf.
#[inline(always)]
fn draft_has_leaf_first<S: Scalar, const N: usize>(node: &Node<S, N>) -> bool {
    matches!(node.child[0].kind(), ChildKind::Leaf(_))
}
