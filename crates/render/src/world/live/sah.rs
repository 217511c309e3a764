//! [`SahMeter`]: the surface area heuristic of a resident tree, kept up to date by its batches.

use orthant_resident::world::arenas::slack;
use orthant_resident::world::{MutationBatch, Root, WorldArenas, WorldNode};

/// The cost of a tree by the surface area heuristic (node steps and leaf tests of a ray that hits the bounds, each 1), at a cost
/// by the nodes that are written: a walk over a million nodes has no place in a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct SahMeter {
    /// Half areas of the children of each node; 0 for one that is free.
    of_node: Vec<f64>,
    sum: f64,
    root: f64,
    /// The cost when the set was made.
    baseline: f64,
}

impl SahMeter {
    /// Reads a whole set that was just made, without free nodes.
    pub fn new(arenas: &WorldArenas) -> Self {
        let mut of_node = Vec::with_capacity(arenas.nodes.len() + slack(arenas.nodes.len()));
        of_node.extend(arenas.nodes.iter().map(half_areas));
        let sum = of_node.iter().sum();
        let mut meter = Self { of_node, sum, root: root_area(arenas.root, |slot| arenas.nodes[slot]), baseline: 0.0 };
        meter.baseline = meter.cost();
        meter
    }

    /// Follows a batch that was applied; `arenas` are those that it led to.
    pub fn follow(&mut self, batch: &MutationBatch, arenas: &WorldArenas) {
        self.of_node.resize(arenas.nodes.len(), 0.0);
        for &slot in &batch.freed_nodes {
            self.set(slot, 0.0);
        }
        for (slot, node) in &batch.node_writes {
            self.set(*slot, half_areas(node));
        }
        self.root = root_area(arenas.root, |slot| arenas.nodes[slot]);
    }

    fn set(&mut self, slot: u32, area: f64) {
        let old = std::mem::replace(&mut self.of_node[slot as usize], area);
        self.sum += area - old;
    }

    /// The cost; 1 for a tree without extent.
    pub fn cost(&self) -> f64 {
        if self.root > 0.0 { (1.0 + self.sum.max(0.0) / self.root).max(1.0) } else { 1.0 }
    }

    /// The cost over what it was when the set was made.
    pub fn growth(&self) -> f64 {
        if self.baseline > 0.0 { self.cost() / self.baseline } else { 1.0 }
    }
}

fn half_areas(node: &WorldNode) -> f64 {
    (0..2).filter(|&child| node.children[child] != Root::EMPTY).map(|child| half_area(node.bounds[child])).sum()
}

fn root_area(root: Root, node: impl Fn(usize) -> WorldNode) -> f64 {
    let Some(slot) = root.as_node() else { return 0.0 };
    let node = node(slot as usize);
    let mut about = node.bounds[0];
    if node.children[1] != Root::EMPTY {
        for a in 0..4 {
            about[0][a] = about[0][a].min(node.bounds[1][0][a]);
            about[1][a] = about[1][a].max(node.bounds[1][1][a]);
        }
    }
    half_area(about)
}

/// The sum, over the axes, of the product of the other extents.
fn half_area([min, max]: [[f32; 4]; 2]) -> f64 {
    let extent: [f64; 4] = std::array::from_fn(|a| (f64::from(max[a]) - f64::from(min[a])).max(0.0));
    (0..4).map(|a| (0..4).filter(|&b| b != a).map(|b| extent[b]).product::<f64>()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_resident::world::ArenaLens;

    fn unit_at(x: f32) -> [[f32; 4]; 2] {
        [[x, 0.0, 0.0, 0.0], [x + 1.0, 1.0, 1.0, 1.0]]
    }

    fn node(bounds: [[[f32; 4]; 2]; 2], children: [Root; 2]) -> WorldNode {
        WorldNode { bounds, children, reserved: [0; 2] }
    }

    #[test]
    fn the_cost_is_that_of_a_walk_over_the_whole_tree_after_each_batch() {
        let mut arenas = WorldArenas::new([0; 4]);
        arenas.nodes = vec![node([unit_at(0.0), unit_at(1.0)], [Root::leaf(0), Root::leaf(1)])];
        arenas.root = Root::node(0);
        let mut meter = SahMeter::new(&arenas);
        // Two unit boxes (half area 4 each) in a box of 2 x 1 x 1 x 1 (half area 7).
        assert_eq!(meter.cost(), 1.0 + 8.0 / 7.0);
        assert_eq!(meter.growth(), 1.0);
        let about = [[0.0; 4], [2.0, 1.0, 1.0, 1.0]];
        let batch = MutationBatch {
            new_root: Root::node(1),
            lens: ArenaLens { nodes: 2, ..ArenaLens::default() },
            node_writes: vec![(1, node([about, unit_at(4.0)], [Root::node(0), Root::leaf(2)]))],
            ..MutationBatch::default()
        };
        arenas.nodes.push(batch.node_writes[0].1);
        arenas.root = Root::node(1);
        meter.follow(&batch, &arenas);
        assert_eq!(meter.cost(), 1.0 + (8.0 + 7.0 + 4.0) / 16.0);
        let freed = MutationBatch { freed_nodes: vec![1], new_root: Root::node(0), ..MutationBatch::default() };
        arenas.root = Root::node(0);
        meter.follow(&freed, &arenas);
        assert_eq!(meter.growth(), 1.0);
    }
}
