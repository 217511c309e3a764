//! The binary tree that a wide one is made from. It is the only file that knows the builder: crate `obvhs`, with
//! PLOC (Meister and Bittner 2018, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction") and
//! parallel reinsertion (Meister and Bittner 2018, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization").

use super::bounds::Bounds;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// A binary tree over items, each in one leaf.
pub(super) struct BinaryTree {
    tree: Bvh2,
}

/// One node of it.
pub(super) enum BinaryNode {
    /// Has two children: this node and the next.
    Inner(u32),
    /// Items by their positions in [`BinaryTree::items`].
    Leaf {
        /// The first.
        first: u32,
        /// How many.
        count: u32,
    },
}

impl BinaryTree {
    /// Builds a tree over boxes, none of them empty; leaves hold at most `max_leaf` items.
    pub fn build(boxes: &[Bounds], max_leaf: u32) -> Self {
        let normalised = normalise(boxes);
        let items: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &normalised,
            items,
            SortPrecision::U64,
            3,
        );
        let mut optimizer = ReinsertionOptimizer::default();
        optimizer.run(&mut tree, REINSERTED, None);
        collapse(&mut tree, max_leaf, COLLAPSE_COST);
        Self { tree }
    }

    /// The root's index.
    pub fn root(&self) -> u32 {
        0
    }

    /// A node.
    pub fn node(&self, index: u32) -> BinaryNode {
        let node = &self.tree.nodes[index as usize];
        if node.is_leaf() {
            BinaryNode::Leaf { first: node.first_index, count: node.prim_count }
        } else {
            BinaryNode::Inner(node.first_index)
        }
    }

    /// Half the area of a node's box, in a unit of its own.
    pub fn area(&self, index: u32) -> f32 {
        self.tree.nodes[index as usize].aabb().half_area()
    }

    /// Item of each leaf position.
    pub fn items(&self) -> &[u32] {
        &self.tree.primitive_indices
    }
}

/// Share of the nodes that reinsertion considers.
const REINSERTED: f32 = 0.05;
/// Cost of visiting a node, in triangle tests, when leaves are merged.
const COLLAPSE_COST: f32 = 1.0;

/// Maps the boxes into the unit cube: areas of huge or tiny boxes would overflow or vanish in `f32`. The builder needs
/// their proportions only; the tree's own boxes are made from the exact ones.
fn normalise(boxes: &[Bounds]) -> Vec<Aabb> {
    let whole = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(b));
    let finite = |x: f32| f64::from(x.clamp(f32::MIN, f32::MAX));
    let extent = (0..3).map(|k| finite(whole.upper[k]) - finite(whole.lower[k])).fold(0.0, f64::max);
    let scale = if extent > 0.0 { 1.0 / extent } else { 1.0 };
    let map = |p: &[f32; 3]| {
        let q: [f32; 3] = std::array::from_fn(|k| ((finite(p[k]) - finite(whole.lower[k])) * scale) as f32);
        Vec3A::from_array(q)
    };
    boxes.iter().map(|b| Aabb::new(map(&b.lower), map(&b.upper))).collect()
}
