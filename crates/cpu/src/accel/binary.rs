//! The binary tree that a wide one is made from, and its builder: top-down, at each node the split of least
//! surface-area cost among planes between equal bins of the centroids (Wald 2007, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies").
//!
//! It takes O(n log n) time for any input: a node that no plane tells apart, or that lies too deep, is split by number.
//! The result does not depend on the number of threads.

use super::bounds::Bounds;
use glam::Vec3A;
use rayon::prelude::*;

/// A binary tree over items, each in one leaf.
pub(super) struct BinaryTree {
    nodes: Vec<Slot>,
    items: Vec<u32>,
}

/// One node of it.
pub(super) enum BinaryNode {
    /// Has two children.
    Inner(u32, u32),
    /// Items by their positions in [`BinaryTree::items`].
    Leaf {
        /// The first.
        first: u32,
        /// How many.
        count: u32,
    },
}

/// A subtree over k items has the 2k - 1 slots from its root's on, whether it needs them or not, so that both halves can
/// be built at once.
#[derive(Clone, Copy, Default)]
struct Slot {
    /// Half the area of the box, in a unit of the builder's.
    area: f32,
    first: u32,
    count: u32,
    /// Slot of the second child, counted from this one; the first is the next slot. 0 for a leaf.
    second: u32,
}

/// What the builder moves about: a normalised box and its number.
#[derive(Clone, Copy)]
struct Item {
    lower: Vec3A,
    upper: Vec3A,
    index: u32,
}

/// Bins on each axis.
const BINS: usize = 16;
/// Cost of visiting a node, in item tests.
const VISIT_COST: f32 = 1.0;
/// Items from which on work is shared between threads.
const PARALLEL: usize = 4096;
/// Items from which on the binning of one node is, too.
const PARALLEL_BINNING: usize = 65_536;

impl BinaryTree {
    /// Builds a tree over boxes, at least one and none of them empty; leaves hold at most `max_leaf` items.
    pub fn build(boxes: &[Bounds], max_leaf: u32) -> Self {
        let mut items = normalise(boxes);
        let mut nodes = vec![Slot::default(); 2 * items.len() - 1];
        let levels = 2 * items.len().ilog2() + 16;
        grow(&mut nodes, &mut items, 0, max_leaf, levels);
        Self { nodes, items: items.into_iter().map(|item| item.index).collect() }
    }

    /// The root's index.
    pub fn root(&self) -> u32 {
        0
    }

    /// A node.
    pub fn node(&self, index: u32) -> BinaryNode {
        let node = &self.nodes[index as usize];
        if node.second == 0 {
            BinaryNode::Leaf { first: node.first, count: node.count }
        } else {
            BinaryNode::Inner(index + 1, index + node.second)
        }
    }

    /// Half the area of a node's box, in a unit of the tree's own.
    pub fn area(&self, index: u32) -> f32 {
        self.nodes[index as usize].area
    }

    /// Items below a node.
    pub fn count(&self, index: u32) -> u32 {
        self.nodes[index as usize].count
    }

    /// Item of each leaf position.
    pub fn items(&self) -> &[u32] {
        &self.items
    }
}

impl Item {
    const NOTHING: Self = Self { lower: Vec3A::INFINITY, upper: Vec3A::NEG_INFINITY, index: 0 };

    #[inline(always)]
    fn union(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper), index: self.index }
    }

    /// Twice the centre.
    #[inline(always)]
    fn center(self) -> Vec3A {
        self.lower + self.upper
    }

    #[inline(always)]
    fn half_area(self) -> f32 {
        let d = self.upper - self.lower;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// Maps the boxes into the unit cube: areas of huge or tiny boxes would overflow or vanish in `f32`. The builder needs
/// their proportions only; the boxes of the wide tree are made from the exact ones.
fn normalise(boxes: &[Bounds]) -> Vec<Item> {
    let finite = |x: f32| f64::from(x.clamp(f32::MIN, f32::MAX));
    let whole = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(b));
    let extent = (0..3).map(|k| finite(whole.upper[k]) - finite(whole.lower[k])).fold(0.0, f64::max);
    let scale = if extent > 0.0 { 1.0 / extent } else { 1.0 };
    let map = |p: &[f32; 3]| {
        let at = |k: usize| ((finite(p[k]) - finite(whole.lower[k])) * scale) as f32;
        Vec3A::new(at(0), at(1), at(2))
    };
    let item = |(i, b): (usize, &Bounds)| Item { lower: map(&b.lower), upper: map(&b.upper), index: i as u32 };
    boxes.par_iter().with_min_len(PARALLEL).enumerate().map(item).collect()
}

/// Builds the subtree over `items`, which begin at position `first`, into `nodes`.
fn grow(nodes: &mut [Slot], items: &mut [Item], first: u32, max_leaf: u32, levels: u32) {
    let count = items.len();
    let bounds = reduce(items, Item::NOTHING, |b, i| *b = b.union(*i), |a, b| *a = a.union(*b));
    nodes[0] = Slot { area: bounds.half_area(), first, count: count as u32, second: 0 };
    let Some(left) = split(items, bounds.half_area(), max_leaf, levels) else { return };
    nodes[0].second = 2 * left as u32;
    let (left_items, right_items) = items.split_at_mut(left);
    let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * left - 1);
    let levels = levels.saturating_sub(1);
    let mut grow_left = || grow(left_nodes, left_items, first, max_leaf, levels);
    let mut grow_right = || grow(right_nodes, right_items, first + left as u32, max_leaf, levels);
    if count >= PARALLEL {
        rayon::join(grow_left, grow_right);
    } else {
        grow_left();
        grow_right();
    }
}

/// Folds over items, on all threads where they are many. The operations are exact, so the order does not matter.
#[inline(always)]
fn reduce<T: Copy + Send + Sync>(
    items: &[Item],
    start: T,
    fold: impl Fn(&mut T, &Item) + Sync,
    join: impl Fn(&mut T, &T) + Sync + Send,
) -> T {
    let part = |items: &[Item]| {
        let mut total = start;
        for item in items {
            fold(&mut total, item);
        }
        total
    };
    if items.len() < PARALLEL_BINNING {
        return part(items);
    }
    let join = |mut a: T, b: T| {
        join(&mut a, &b);
        a
    };
    items.par_chunks(PARALLEL_BINNING / 4).map(part).reduce(|| start, join)
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Item,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Item::NOTHING, count: 0 };

    #[inline(always)]
    fn add(&mut self, bounds: Item, count: u32) {
        self.bounds = self.bounds.union(bounds);
        self.count += count;
    }

    /// Cost of testing its items; none of nothing.
    fn cost(&self) -> f32 {
        if self.count == 0 { f32::INFINITY } else { self.bounds.half_area() * self.count as f32 }
    }
}

/// Maps centroids to bins. A flat axis has all in bin 0.
struct Binning {
    origin: Vec3A,
    scale: Vec3A,
}

impl Binning {
    #[inline(always)]
    fn bins(&self, item: &Item) -> [usize; 3] {
        let b = (item.center() - self.origin) * self.scale;
        // Casts of negative values and of what is not a number give 0.
        [b.x, b.y, b.z].map(|b| (b as usize).min(BINS - 1))
    }
}

/// Reorders the items into two parts and returns the size of the first; `None` where a leaf is better.
fn split(items: &mut [Item], half_area: f32, max_leaf: u32, levels: u32) -> Option<usize> {
    let count = items.len();
    if count == 1 {
        return None;
    }
    if levels > 0 {
        // Count items and unite boxes by bins
        let point = |i: &Item| Item { lower: i.center(), upper: i.center(), index: 0 };
        let centers = reduce(items, Item::NOTHING, |b, i| *b = b.union(point(i)), |a, b| *a = a.union(*b));
        let extent = centers.upper - centers.lower;
        let scale = |e: f32| if e > 0.0 { BINS as f32 / e } else { 0.0 };
        let binning =
            Binning { origin: centers.lower, scale: Vec3A::new(scale(extent.x), scale(extent.y), scale(extent.z)) };
        let fill = |bins: &mut [[Bin; BINS]; 3], item: &Item| {
            for (axis, bin) in binning.bins(item).into_iter().enumerate() {
                bins[axis][bin].add(*item, 1);
            }
        };
        let merge = |a: &mut [[Bin; BINS]; 3], b: &[[Bin; BINS]; 3]| {
            for (a, b) in a.as_flattened_mut().iter_mut().zip(b.as_flattened()) {
                a.add(b.bounds, b.count);
            }
        };
        let bins = reduce(items, [[Bin::EMPTY; BINS]; 3], fill, merge);

        // Sweep the planes between bins from both sides
        let mut best = (f32::INFINITY, 0, 0);
        for (axis, bins) in bins.iter().enumerate() {
            let mut right = [0.0; BINS];
            let mut sweep = Bin::EMPTY;
            for plane in (1..BINS).rev() {
                sweep.add(bins[plane].bounds, bins[plane].count);
                right[plane] = sweep.cost();
            }
            let mut sweep = Bin::EMPTY;
            for plane in 1..BINS {
                sweep.add(bins[plane - 1].bounds, bins[plane - 1].count);
                let cost = sweep.cost() + right[plane];
                if cost < best.0 {
                    best = (cost, axis, plane);
                }
            }
        }
        let (cost, axis, plane) = best;
        if count <= max_leaf as usize && cost >= half_area * (count as f32 - VISIT_COST) {
            return None;
        }
        if cost < f32::INFINITY {
            let mut left = 0;
            for i in 0..count {
                if binning.bins(&items[i])[axis] < plane {
                    items.swap(i, left);
                    left += 1;
                }
            }
            return Some(left);
        }
    }
    (count > max_leaf as usize).then_some(count / 2)
}
