//! The nodes of a [`LightTree`]: which are in use, and which were written.

use super::{Group, LightNode, LightTree};
use crate::rows::NONE;
use bytemuck::Zeroable;

/// The writes that bring a copy of a tree's rows up to date.
///
/// A copy that had every earlier batch of writes takes `node_count` nodes and `leaf_count` leaves and copies those that are
/// named from [`LightTree::nodes`] and [`LightTree::leaves`]. Rows that are new to it are all named.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightTreeWrites {
    /// Written nodes, ascending.
    pub nodes: Vec<u32>,
    /// Nodes, free ones included.
    pub node_count: usize,
    /// Lights whose leaf is another, ascending.
    pub leaves: Vec<u32>,
    /// Lights by number, those that do not shine included.
    pub leaf_count: usize,
}

/// Rows that were written, each once.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RowLog {
    bits: Vec<u64>,
    rows: Vec<u32>,
}

impl RowLog {
    #[inline]
    fn mark(&mut self, row: u32) {
        let (word, bit) = (row as usize / 64, 1 << (row % 64));
        if word >= self.bits.len() {
            self.bits.resize(word + 1, 0);
        }
        if self.bits[word] & bit == 0 {
            self.bits[word] |= bit;
            self.rows.push(row);
        }
    }

    fn take(&mut self, len: usize) -> Vec<u32> {
        let mut rows = std::mem::take(&mut self.rows);
        rows.iter().for_each(|&row| self.bits[row as usize / 64] = 0);
        rows.retain(|&row| (row as usize) < len);
        rows.sort_unstable();
        rows
    }
}

impl LightTree {
    /// What was written since the last call; at first, everything.
    pub fn take_writes(&mut self) -> LightTreeWrites {
        let (node_count, leaf_count) = (self.nodes.len(), self.leaves.len());
        LightTreeWrites {
            nodes: self.node_log.take(node_count),
            node_count,
            leaves: self.leaf_log.take(leaf_count),
            leaf_count,
        }
    }

    /// The node, to be written.
    #[inline]
    pub(super) fn write(&mut self, at: usize) -> &mut LightNode {
        self.node_log.mark(at as u32);
        &mut self.nodes[at]
    }

    /// Says where the leaf of a light is.
    pub(super) fn set_leaf(&mut self, light: u32, leaf: u32) {
        self.make_room(light as usize + 1);
        self.leaf_log.mark(light);
        self.leaves[light as usize] = leaf;
    }

    /// Makes room for lights of these many numbers.
    pub(super) fn make_room(&mut self, lights: usize) {
        for light in self.leaves.len()..lights {
            self.leaf_log.mark(light as u32);
            self.leaves.push(NONE);
        }
    }

    /// Takes two nodes side by side, of which `parent` is above: the first of them.
    pub(super) fn take_pair(&mut self, parent: usize) -> usize {
        let pair = self.free.pop().map_or(self.nodes.len(), |pair| pair as usize);
        if pair == self.nodes.len() {
            self.nodes.extend([LightNode::zeroed(); 2]);
            self.groups.extend([Group::default(); 2]);
        }
        for at in [pair, pair + 1] {
            self.write(at).parent = parent as u32;
        }
        pair
    }

    /// Gives two nodes back.
    pub(super) fn free_pair(&mut self, pair: usize) {
        for at in [pair, pair + 1] {
            *self.write(at) = LightNode::zeroed();
            self.groups[at] = Group::default();
        }
        self.free.push(pair as u32);
    }

    /// Makes a node a leaf; what is above it stays.
    pub(super) fn put_leaf(&mut self, at: usize, light: u32, bounds: super::LightBounds) {
        let parent = self.nodes[at].parent;
        *self.write(at) = LightNode { bounds, first: 0, parent, light, reserved: 0 };
        self.groups[at] = Group { lights: 1, height: 0 };
        self.set_leaf(light, at as u32);
    }

    /// Gives a node what another holds, whose place is to be written or freed then.
    pub(super) fn relocate(&mut self, from: usize, to: usize) {
        let node = self.nodes[from];
        let parent = self.nodes[to].parent;
        *self.write(to) = LightNode { parent, ..node };
        self.groups[to] = self.groups[from];
        self.lead_here(to);
    }

    /// Lets what is below a node, or the light of a leaf, know where it is.
    pub(super) fn lead_here(&mut self, at: usize) {
        let LightNode { first, light, .. } = self.nodes[at];
        match first as usize {
            0 => self.set_leaf(light, at as u32),
            pair => [pair, pair + 1].iter().for_each(|&child| self.write(child).parent = at as u32),
        }
    }

    /// Forgets all nodes; no light is to lead to one any more.
    pub(super) fn forget_nodes(&mut self) {
        self.nodes.clear();
        self.groups.clear();
        self.free.clear();
    }
}

/// The other one of two nodes side by side.
#[inline]
pub(super) fn sibling(at: usize) -> usize {
    ((at - 1) ^ 1) + 1
}
