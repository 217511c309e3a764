//! Eight-wide trees: what rays walk.

use super::binary::{BinaryNode, BinaryTree};
use super::bounds::Bounds;
use orthant_bvh::Aabb;

/// Children of a node.
pub const WIDTH: usize = 8;

/// Levels of a [`WideTree`], at most: [`MAX_GROWN_DEPTH`] as the builder made them, below them at most 11 levels that
/// split up to 2^32 items into eight equal parts each.
pub const MAX_DEPTH: usize = MAX_GROWN_DEPTH + 11;

/// Levels that follow the binary tree. What lies deeper (long chains of nested boxes) is split by
/// number instead.
const MAX_GROWN_DEPTH: usize = 24;

/// Levels of any tree that is walked: of a [`WideTree`], or of the wide copy of a tree of crate `orthant-bvh`.
const MAX_LEVELS: usize = if MAX_DEPTH > TLAS_DEPTH { MAX_DEPTH } else { TLAS_DEPTH };
const TLAS_DEPTH: usize = orthant_bvh::MAX_DEPTH as usize;

/// Entries of a stack that a walk never overflows: each level leaves at most seven siblings behind, and one node is
/// being visited.
pub const MAX_STACK: usize = (WIDTH - 1) * MAX_LEVELS + 1;

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
    pub(super) const UNUSED: Self = Self {
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

    pub(super) fn set_bounds(&mut self, slot: usize, bounds: &Bounds) {
        for k in 0..3 {
            self.planes[2 * k][slot] = bounds.lower[k];
            self.planes[2 * k + 1][slot] = bounds.upper[k];
        }
    }

    pub(super) fn set_child(&mut self, slot: usize, child: u32, count: u8) {
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
                        BinaryNode::Inner(..) => None,
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

    /// Nodes that a ray through the bounds of everything is expected to visit.
    pub fn expected_nodes(&self) -> f64 {
        expected_nodes(&self.nodes, self.bounds())
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

/// Nodes that a ray through `bounds` is expected to visit: the sum of the nodes' surfaces over that of the bounds (the surface
/// area heuristic). Unused nodes do not count.
pub(super) fn expected_nodes(nodes: &[WideNode], bounds: Bounds) -> f64 {
    let half_area = |bounds: Bounds| Aabb::new(bounds.lower, bounds.upper).half_area_f64();
    let whole = half_area(bounds);
    let used = nodes.iter().filter(|node| node.used != 0);
    if whole > 0.0 { used.map(|node| half_area(node.total_bounds())).sum::<f64>() / whole } else { used.count() as f64 }
}

/// Opens the inner child with the largest box (of equal ones, with the most items) until there are eight children or only leaves.
fn widest_children(binary: &BinaryTree, root: u32) -> Vec<Pending> {
    let BinaryNode::Inner(first, second) = binary.node(root) else { return vec![Pending::Grown(root)] };
    let mut children = vec![first, second];
    while children.len() < WIDTH {
        let widest = (0..children.len())
            .filter_map(|i| match binary.node(children[i]) {
                BinaryNode::Inner(first, second) => Some((i, first, second)),
                BinaryNode::Leaf { .. } => None,
            })
            .max_by(|a, b| {
                let (a, b) = (children[a.0], children[b.0]);
                binary.area(a).total_cmp(&binary.area(b)).then(binary.count(a).cmp(&binary.count(b)))
            });
        let Some((i, first, second)) = widest else { break };
        children[i] = first;
        children.push(second);
    }
    children.into_iter().map(Pending::Grown).collect()
}

fn append_items(binary: &BinaryTree, root: u32, items: &mut Vec<u32>) {
    let mut work = vec![root];
    while let Some(index) = work.pop() {
        match binary.node(index) {
            BinaryNode::Inner(first, second) => work.extend([second, first]),
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Walks the whole tree: every item is in one leaf, boxes hold what is below them, and the depth keeps to its bound.
    /// Returns the depth.
    fn validate(tree: &WideTree, boxes: &[Bounds], max_leaf: u8) -> usize {
        let mut seen = vec![false; boxes.len()];
        let mut deepest = 0;
        let mut work = if tree.nodes.is_empty() { vec![] } else { vec![(0usize, 1usize, tree.bounds())] };
        let mut visited = 0;
        while let Some((index, depth, around)) = work.pop() {
            visited += 1;
            deepest = deepest.max(depth);
            let node = &tree.nodes[index];
            assert!(node.used != 0 && node.used & node.used.wrapping_add(1) == 0, "slots fill from the first");
            for slot in 0..WIDTH {
                let (bounds, child, count) = (node.bounds(slot), node.child[slot] as usize, node.count[slot] as usize);
                if node.used & (1 << slot) == 0 {
                    assert!(bounds.is_empty());
                    continue;
                }
                assert!(around.contains(&bounds));
                assert_eq!(node.inner & (1 << slot) != 0, count == 0);
                if count == 0 {
                    assert!(child > index);
                    work.push((child, depth + 1, bounds));
                } else {
                    assert!(count <= usize::from(max_leaf));
                    for &item in &tree.items[child..child + count] {
                        assert!(bounds.contains(&boxes[item as usize]));
                        assert!(!std::mem::replace(&mut seen[item as usize], true), "item {item} is in two leaves");
                    }
                }
            }
        }
        assert_eq!(visited, tree.nodes.len());
        assert!(seen.iter().all(|&s| s));
        assert!(deepest <= MAX_DEPTH);
        deepest
    }

    fn cube(center: [f32; 3], half: f32) -> Bounds {
        Bounds { lower: center.map(|c| c - half), upper: center.map(|c| c + half) }
    }

    #[test]
    fn equal_boxes_make_a_balanced_tree() {
        let boxes = vec![cube([1.0, 2.0, 3.0], 0.5); 100_000];
        let depth = validate(&WideTree::build(&boxes, 4), &boxes, 4);
        assert!(depth <= 7, "{depth}");
    }

    #[test]
    fn nested_boxes_keep_to_the_depth_bound() {
        // Each is within the next; sizes double, or grow evenly.
        let doubling: Vec<Bounds> = (0..250).map(|i| cube([0.0; 3], (f64::from(i - 125).exp2()) as f32)).collect();
        validate(&WideTree::build(&doubling, 1), &doubling, 1);
        let even: Vec<Bounds> = (0..50_000).map(|i| cube([0.0; 3], i as f32)).collect();
        validate(&WideTree::build(&even, 4), &even, 4);
        // Off centre, so that each split cuts off a few.
        let corner: Vec<Bounds> = (0..120)
            .flat_map(|i| [Bounds { lower: [0.0; 3], upper: [(f64::from(i - 60).exp2()) as f32; 3] }; 40])
            .collect();
        validate(&WideTree::build(&corner, 1), &corner, 1);
    }

    #[test]
    fn extreme_boxes_are_built_as_well() {
        let all = Bounds { lower: [f32::NEG_INFINITY; 3], upper: [f32::INFINITY; 3] };
        let boxes = [cube([0.0; 3], 0.0), cube([1e-40; 3], 1e-45), cube([3e38; 3], 1e37), all, cube([-3e38; 3], 0.0)];
        for n in 0..=boxes.len() {
            validate(&WideTree::build(&boxes[..n], 1), &boxes[..n], 1);
        }
    }

    proptest! {
        #[test]
        fn every_tree_is_valid(
            boxes in prop::collection::vec((prop::array::uniform3(-8i8..8), 0u8..4), 0..600),
            max_leaf in 1u8..9,
        ) {
            let boxes: Vec<Bounds> = boxes.iter().map(|&(c, h)| cube(c.map(f32::from), f32::from(h))).collect();
            validate(&WideTree::build(&boxes, max_leaf), &boxes, max_leaf);
        }
    }
}
