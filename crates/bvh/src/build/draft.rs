//! What builders make: nodes by index, not yet in an arena, with items already in the leaves.

use crate::aabb::Aabb;
use crate::node::{Child, NONE, Node, NodeId};
use crate::scalar::Scalar;

/// A subtree that is about to be joined: a leaf, or a node of a draft.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part<S, const N: usize> {
    pub(crate) bounds: Aabb<S, N>,
    pub(crate) child: Child,
    pub(crate) height: u8,
}

/// Nodes whose children are leaves or indices into the same list. Parent links are set on installation.
#[derive(Debug)]
pub(crate) struct Draft<S, const N: usize> {
    pub(crate) nodes: Vec<Node<S, N>>,
}

impl<S, const N: usize> Default for Draft<S, N> {
    fn default() -> Self {
        Self { nodes: Vec::new() }
    }
}

impl<S: Scalar, const N: usize> Draft<S, N> {
    /// Joins two parts under a new node.
    #[inline(always)]
    pub(crate) fn join(&mut self, a: Part<S, N>, b: Part<S, N>) -> Part<S, N> {
        let node = Node {
            bounds: [a.bounds, b.bounds],
            child: [a.child, b.child],
            parent: NONE,
            height: [a.height, b.height],
        };
        let id = self.nodes.len() as u32;
        self.nodes.push(node);
        Part { bounds: a.bounds.union(&b.bounds), child: Child::node(NodeId(id)), height: node.own_height() }
    }
}
