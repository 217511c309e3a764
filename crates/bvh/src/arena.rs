//! The nodes, their free list, and the log of what was written since the last batch was taken.

use core::ops::Index;

use crate::node::{Child, FREE, NONE, Node, NodeId};
use crate::prefetch::prefetch;
use crate::scalar::Scalar;

/// The explicit writes that bring a copy of the arena up to date.
///
/// A copy that had every earlier batch grows to `arena_len` with [`Node::FREE`], copies the record of every `written` node from
/// the tree, and sets every `freed` one to [`Node::FREE`]. No node is named twice.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeWrites {
    /// Live nodes whose record changed.
    pub written: Vec<NodeId>,
    /// Nodes that were live when the batch began and are not now.
    pub freed: Vec<NodeId>,
    /// The root, `None` for the empty tree.
    pub new_root: Option<NodeId>,
    /// Nodes in the arena, free ones included.
    pub arena_len: usize,
}

/// A log entry of a node that was free when the batch began.
const FRESH: u32 = 1 << 31;

#[derive(Clone, Debug)]
pub(crate) struct Arena<S, const N: usize> {
    nodes: Vec<Node<S, N>>,
    free: Vec<u32>,
    /// One bit per node: in the log already.
    logged: Vec<u64>,
    log: Vec<u32>,
    /// All nodes below this one are in the log besides, none of them with a bit or an entry.
    all_below: u32,
}

impl<S: Scalar, const N: usize> Arena<S, N> {
    pub(crate) const fn new() -> Self {
        Self { nodes: Vec::new(), free: Vec::new(), logged: Vec::new(), log: Vec::new(), all_below: 0 }
    }

    pub(crate) fn nodes(&self) -> &[Node<S, N>] {
        &self.nodes
    }

    pub(crate) fn free_list(&self) -> &[u32] {
        &self.free
    }

    #[inline(always)]
    pub(crate) fn is_live(&self, id: u32) -> bool {
        self.nodes.get(id as usize).is_some_and(|n| n.parent != FREE)
    }

    pub(crate) fn reserve(&mut self, additional: usize) {
        let fresh = additional.saturating_sub(self.free.len());
        self.nodes.reserve(fresh);
        self.logged.reserve(fresh / 64 + 1);
    }

    /// Asks for a child that will be looked at soon; leaves have no node.
    #[inline(always)]
    pub(crate) fn prefetch(&self, child: Child) {
        if let Some(node) = self.nodes.get(child.0 as usize) {
            prefetch(node);
        }
    }

    /// Asks for what lies some places behind a node. Builders put the first child of a node right behind it, so that these are
    /// what is below, and come before it is known that they are needed.
    #[inline(always)]
    pub(crate) fn prefetch_behind(&self, node: u32, places: u32) {
        self.prefetch(Child(node.wrapping_add(places)));
    }

    /// Takes a free slot, or the end. Freed slots are used again last in, first out. The node has no children yet: they are
    /// written where they are to lie, since a node that is put together elsewhere and copied at once stalls the processor.
    #[inline(always)]
    pub(crate) fn alloc(&mut self, parent: u32) -> u32 {
        let id = match self.free.pop() {
            Some(id) => id,
            None => {
                let id = self.nodes.len() as u32;
                assert!(id < FRESH, "2^31 nodes hold more items than there are ids");
                self.nodes.push(Node::FREE);
                if id.is_multiple_of(64) {
                    self.logged.push(0);
                }
                id
            }
        };
        self.nodes[id as usize].parent = parent;
        self.note(id, FRESH);
        id
    }

    pub(crate) fn release(&mut self, id: u32) {
        self.note(id, 0);
        self.nodes[id as usize] = Node::FREE;
        self.free.push(id);
    }

    pub(crate) fn clear(&mut self) {
        for id in 0..self.nodes.len() as u32 {
            if self.is_live(id) {
                self.note(id, 0);
                self.nodes[id as usize] = Node::FREE;
            }
        }
        // Lowest ids first, so that what is built next lies in order.
        self.free.clear();
        self.free.extend((0..self.nodes.len() as u32).rev());
    }

    /// The node, to change its record: it goes into the next batch.
    #[inline(always)]
    pub(crate) fn write(&mut self, id: u32) -> &mut Node<S, N> {
        self.note(id, 0);
        &mut self.nodes[id as usize]
    }

    /// The node, to change its links alone.
    #[inline(always)]
    pub(crate) fn links(&mut self, id: u32) -> &mut Node<S, N> {
        &mut self.nodes[id as usize]
    }

    /// All nodes, to change every record: they go into the next batch. No slot is free.
    pub(crate) fn rewrite(&mut self) -> &mut [Node<S, N>] {
        debug_assert!(self.free.is_empty());
        let count = self.nodes.len() as u32;
        if self.log.is_empty() {
            self.all_below = count;
        } else {
            (self.all_below..count).for_each(|id| self.note(id, 0));
        }
        &mut self.nodes
    }

    #[inline(always)]
    fn note(&mut self, id: u32, flag: u32) {
        if id < self.all_below {
            return;
        }
        let (word, bit) = (id as usize / 64, 1u64 << (id % 64));
        if self.logged[word] & bit == 0 {
            self.logged[word] |= bit;
            self.log.push(id | flag);
        }
    }

    /// Moves the log into `writes` and begins the next batch.
    pub(crate) fn drain(&mut self, root: u32, writes: &mut NodeWrites) {
        writes.written.clear();
        writes.freed.clear();
        for id in 0..std::mem::take(&mut self.all_below) {
            let is_live = self.nodes[id as usize].parent != FREE;
            if is_live { &mut writes.written } else { &mut writes.freed }.push(NodeId(id));
        }
        for &entry in &self.log {
            let id = entry & !FRESH;
            self.logged[id as usize / 64] &= !(1u64 << (id % 64));
            if self.nodes[id as usize].parent != FREE {
                writes.written.push(NodeId(id));
            } else if entry & FRESH == 0 {
                writes.freed.push(NodeId(id));
            }
        }
        self.log.clear();
        writes.new_root = (root != NONE).then_some(NodeId(root));
        writes.arena_len = self.nodes.len();
    }

    /// Nodes in the log of the open batch.
    pub(crate) fn log_len(&self) -> usize {
        self.all_below as usize + self.log.len()
    }
}

impl<S: Scalar, const N: usize> Index<u32> for Arena<S, N> {
    type Output = Node<S, N>;

    #[inline(always)]
    fn index(&self, id: u32) -> &Node<S, N> {
        &self.nodes[id as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arena_with(count: usize) -> Arena<f32, 3> {
        let mut arena = Arena::new();
        for _ in 0..count {
            arena.alloc(NONE);
        }
        arena.drain(NONE, &mut NodeWrites::default());
        arena
    }

    #[test]
    fn a_node_is_in_a_batch_once_however_often_it_is_written() {
        let mut arena = arena_with(3);
        arena.write(1);
        arena.write(1);
        let mut writes = NodeWrites::default();
        arena.drain(0, &mut writes);
        assert_eq!(writes.written, [NodeId(1)]);
        assert!(writes.freed.is_empty());
    }

    #[test]
    fn writing_all_leaves_room_in_the_log_for_nodes_to_come() {
        let mut arena = arena_with(70);
        arena.rewrite();
        arena.write(69);
        assert_eq!(arena.alloc(NONE), 70);
        let mut writes = NodeWrites::default();
        arena.drain(0, &mut writes);
        assert_eq!(writes.written, (0..71).map(NodeId).collect::<Vec<_>>());
    }

    #[test]
    fn a_node_that_was_taken_and_given_back_in_one_batch_is_not_mentioned() {
        let mut arena = arena_with(1);
        let id = arena.alloc(NONE);
        arena.release(id);
        let mut writes = NodeWrites::default();
        arena.drain(0, &mut writes);
        assert!(writes.written.is_empty() && writes.freed.is_empty());
        assert_eq!(writes.arena_len, 2);
    }

    #[test]
    fn a_freed_slot_that_is_taken_again_in_the_same_batch_is_a_write() {
        let mut arena = arena_with(2);
        arena.release(0);
        assert_eq!(arena.alloc(NONE), 0);
        let mut writes = NodeWrites::default();
        arena.drain(0, &mut writes);
        assert_eq!((writes.written, writes.freed), (vec![NodeId(0)], vec![]));
    }
}
