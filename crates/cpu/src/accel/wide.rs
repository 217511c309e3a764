//! Eight-wide trees: what rays walk.

use super::binary::{BinaryNode, BinaryTree};
use super::bounds::Bounds;

/// Children of a node.
pub const WIDTH: usize = 8;

/// Levels of a [`WideTree`], at most: [`MAX_GROWN_DEPTH`] as the builder made them, below them at most 11 levels that
/// split up to 2^32 items into eight equal parts each.
pub const MAX_DEPTH: usize = MAX_GROWN_DEPTH + 11;

/// Levels that follow the binary tree. What lies deeper (a chain, from boxes that no split tells apart) is split by
/// number instead.
const MAX_GROWN_DEPTH: usize = 24;

/// Entries of a stack that a walk never overflows: each level leaves at most seven siblings behind, and one node is
/// being visited.
pub const MAX_STACK: usize = (WIDTH - 1) * MAX_DEPTH + 1;

/// Eight boxes, structure of arrays, and what is in them. 256 bytes.
///
/// Children fill the slots from the first; an unused slot has the empty box, which no ray hits.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct WideNode {
    /// Planes of the eight boxes: lower x, upper x, lower y, upper y, lower z, upper z.
    pub planes: [[f32; WIDTH]; 6],
    /// An inner child's node index, or a leaf's first item.
    pub child: [u32; WIDTH],
    /// A leaf's number of items; 0 for an inner child.
    pub count: [u8; WIDTH],
    /// Bit i: slot i is in use.
    pub used: u8,
    /// Bit i: slot i is an inner child.
    pub inner: u8,
}

impl WideNode {
    const UNUSED: Self = Self {
        planes: [
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        child: [0; WIDTH],
        count: [0; WIDTH],
        used: 0,
        inner: 0,
    };

    /// The box of a slot.
    pub fn bounds(&self, slot: usize) -> Bounds {
        Bounds {
            lower: std::array::from_fn(|k| self.planes[2 * k][slot]),
            upper: std::array::from_fn(|k| self.planes[2 * k + 1][slot]),
        }
    }

    /// The box of all slots.
    pub fn total_bounds(&self) -> Bounds {
        (0..WIDTH).fold(Bounds::EMPTY, |b, slot| b.union(&self.bounds(slot)))
    }

    fn set_bounds(&mut self, slot: usize, bounds: &Bounds) {
        for k in 0..3 {
            self.planes[2 * k][slot] = bounds.lower[k];
            self.planes[2 * k + 1][slot] = bounds.upper[k];
        }
    }

    fn set_child(&mut self, slot: usize, child: u32, count: u8) {
        self.child[slot] = child;
        self.count[slot] = count;
        self.used |= 1 << slot;
        self.inner |= u8::from(count == 0) << slot;
    }
}

/// A tree of [`WideNode`]s over items. Node 0 is the root; children follow their parents; every item is in one leaf.
#[derive(Clone, Debug, Default)]
pub struct WideTree {
    /// The nodes; none for no items.
    pub nodes: Vec<WideNode>,
    /// Items in leaf order.
    pub items: Vec<u32>,
}

/// Part of a tree that is still to be made.
enum Pending {
    /// A subtree of the binary tree.
    Grown(u32),
    /// Positions in the items, to be split by number.
    Counted { first: u32, count: u32 },
}

impl WideTree {
    /// Builds a tree over boxes, none of them empty; leaves hold at most `max_leaf` items (1 to 255).
    pub fn build(boxes: &[Bounds], max_leaf: u8) -> Self {
        if boxes.is_empty() {
            return Self::default();
        }
        let binary = BinaryTree::build(boxes, u32::from(max_leaf));
        let mut tree = Self { nodes: vec![WideNode::UNUSED], items: Vec::with_capacity(boxes.len()) };
        let mut work = vec![(Pending::Grown(binary.root()), 0usize, 1usize)];
        while let Some((pending, node, depth)) = work.pop() {
            let children = match pending {
                Pending::Grown(root) if depth <= MAX_GROWN_DEPTH => widest_children(&binary, root),
                Pending::Grown(root) => {
                    let first = tree.items.len() as u32;
                    append_items(&binary, root, &mut tree.items);
                    split_evenly(first, tree.items.len() as u32 - first, max_leaf)
                }
                Pending::Counted { first, count } => split_evenly(first, count, max_leaf),
            };
            for (slot, child) in children.into_iter().enumerate() {
                let leaf = match child {
                    Pending::Grown(index) => match binary.node(index) {
                        BinaryNode::Leaf { first, count } => {
                            let at = tree.items.len() as u32;
                            let range = first as usize..(first + count) as usize;
                            tree.items.extend_from_slice(&binary.items()[range]);
                            Some((at, count as u8))
                        }
                        BinaryNode::Inner(_) => None,
                    },
                    Pending::Counted { first, count } if count <= u32::from(max_leaf) => Some((first, count as u8)),
                    Pending::Counted { .. } => None,
                };
                if let Some((first, count)) = leaf {
                    tree.nodes[node].set_child(slot, first, count);
                } else {
                    let index = tree.nodes.len();
                    tree.nodes.push(WideNode::UNUSED);
                    tree.nodes[node].set_child(slot, index as u32, 0);
                    work.push((child, index, depth + 1));
                }
            }
        }
        tree.refit(|items| items.iter().fold(Bounds::EMPTY, |b, &i| b.union(&boxes[i as usize])));
        tree
    }

    /// Recomputes every box from those of the leaves.
    pub fn refit(&mut self, leaf_bounds: impl Fn(&[u32]) -> Bounds) {
        for index in (0..self.nodes.len()).rev() {
            for slot in 0..WIDTH {
                let node = &self.nodes[index];
                if node.used & (1 << slot) == 0 {
                    continue;
                }
                let (child, count) = (node.child[slot] as usize, node.count[slot] as usize);
                let bounds = if count == 0 {
                    self.nodes[child].total_bounds()
                } else {
                    leaf_bounds(&self.items[child..child + count])
                };
                self.nodes[index].set_bounds(slot, &bounds);
            }
        }
    }

    /// The box of everything.
    pub fn bounds(&self) -> Bounds {
        self.nodes.first().map_or(Bounds::EMPTY, WideNode::total_bounds)
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        (size_of_val(self.nodes.as_slice()) + size_of_val(self.items.as_slice())) as u64
    }
}

/// Opens the inner child with the largest box until there are eight children or only leaves.
fn widest_children(binary: &BinaryTree, root: u32) -> Vec<Pending> {
    let BinaryNode::Inner(first) = binary.node(root) else { return vec![Pending::Grown(root)] };
    let mut children = vec![first, first + 1];
    while children.len() < WIDTH {
        let widest = (0..children.len())
            .filter_map(|i| match binary.node(children[i]) {
                BinaryNode::Inner(grandchild) => Some((i, grandchild)),
                BinaryNode::Leaf { .. } => None,
            })
            .max_by(|a, b| binary.area(children[a.0]).total_cmp(&binary.area(children[b.0])));
        let Some((i, grandchild)) = widest else { break };
        children[i] = grandchild;
        children.push(grandchild + 1);
    }
    children.into_iter().map(Pending::Grown).collect()
}

fn append_items(binary: &BinaryTree, root: u32, items: &mut Vec<u32>) {
    let mut work = vec![root];
    while let Some(index) = work.pop() {
        match binary.node(index) {
            BinaryNode::Inner(first) => work.extend([first + 1, first]),
            BinaryNode::Leaf { first, count } => {
                items.extend_from_slice(&binary.items()[first as usize..(first + count) as usize]);
            }
        }
    }
}

/// Splits a range into eight that differ by at most one item, or into leaves where that takes fewer.
fn split_evenly(first: u32, count: u32, max_leaf: u8) -> Vec<Pending> {
    let parts = count.div_ceil(u32::from(max_leaf)).min(WIDTH as u32);
    let at = |i: u32| first + (u64::from(count) * u64::from(i) / u64::from(parts)) as u32;
    (0..parts).map(|i| Pending::Counted { first: at(i), count: at(i + 1) - at(i) }).collect()
}
