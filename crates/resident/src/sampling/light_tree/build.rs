//! Builds a [`LightTree`] top-down: at each node the cheapest split among planes between equal bins of the centroids, by the
//! surface area orientation heuristic (Conty Estevez and Kulla 2018, section 4.4).

use super::edit::height_limit;
use super::{LightBounds, LightNode, LightTree};
use crate::rows::NONE;
use bytemuck::Zeroable;
use glam::Vec3;

/// Bins on each axis.
const BINS: usize = 12;

/// A light that is being sorted.
#[derive(Clone, Copy)]
pub(super) struct Item {
    bounds: LightBounds,
    /// Twice.
    centre: Vec3,
    light: u32,
}

impl Item {
    pub fn new(light: u32, bounds: LightBounds) -> Self {
        Self { bounds, centre: bounds.centre(), light }
    }
}

/// A group that has a node and no parts yet.
struct Work {
    at: usize,
    first: usize,
    count: usize,
    /// Most nodes below each other, less one.
    height: u32,
}

impl LightTree {
    /// Builds the tree over lights by number; `None` for those that do not shine. It takes O(n log n) time for any input.
    pub fn build(lights: &[Option<LightBounds>]) -> Self {
        let mut tree = Self::default();
        tree.make_room(lights.len());
        let shining = (0..).zip(lights).filter_map(|(light, bounds)| bounds.map(|bounds| Item::new(light, bounds)));
        tree.fill(&mut shining.collect::<Vec<_>>());
        tree
    }

    /// Builds an empty tree over items.
    pub(super) fn fill(&mut self, items: &mut [Item]) {
        if items.is_empty() {
            return;
        }
        self.nodes.reserve_exact(2 * items.len() - 1);
        self.groups.reserve_exact(2 * items.len() - 1);
        self.nodes.push(LightNode::zeroed());
        self.groups.push(Default::default());
        self.grow(0, items, height_limit(items.len() as u32));
    }

    /// Builds the group of a node out of items, at most `height` nodes high, into which they have to fit.
    pub(super) fn grow(&mut self, top: usize, items: &mut [Item], height: u32) {
        let mut groups = Vec::with_capacity(items.len() - 1);
        let mut work = vec![Work { at: top, first: 0, count: items.len(), height }];
        while let Some(Work { at, first, count, height }) = work.pop() {
            self.counters.visited += count as u64;
            let group = &mut items[first..first + count];
            if let [item] = group {
                self.put_leaf(at, item.light, item.bounds);
                continue;
            }
            let height = height - 1;
            let fits = |count: usize| height >= usize::BITS || count <= 1 << height;
            let mut left = split(group);
            if !fits(left) || !fits(count - left) {
                left = halve(group);
            }
            let pair = self.take_pair(at);
            let node = self.write(at);
            (node.first, node.light, node.reserved) = (pair as u32, NONE, 0);
            groups.push(at);
            // The first group is taken from the stack next, so that its parts follow.
            work.push(Work { at: pair + 1, first: first + left, count: count - left, height });
            work.push(Work { at: pair, first, count: left, height });
        }
        for at in groups.into_iter().rev() {
            self.refit(at);
        }
    }
}

/// Sorts the items into two groups of one size, along the longest axis; gives the size of the first.
fn halve(items: &mut [Item]) -> usize {
    let (lower, upper) = centres(items);
    let extent = upper - lower;
    let half = items.len() / 2;
    if let Some(axis) = (0..3).filter(|&k| extent[k] > 0.0).max_by(|&a, &b| extent[a].total_cmp(&extent[b])) {
        items.select_nth_unstable_by(half, |a, b| a.centre[axis].total_cmp(&b.centre[axis]));
    }
    half
}

/// Smallest and largest of the centres.
fn centres(items: &[Item]) -> (Vec3, Vec3) {
    let start = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    items.iter().fold(start, |(lower, upper), item| (lower.min(item.centre), upper.max(item.centre)))
}

/// Sorts the items into two groups and gives the size of the first; both have some.
fn split(items: &mut [Item]) -> usize {
    let (lower, upper) = centres(items);
    let extent = upper - lower;
    let longest = extent.max_element();
    let bin = |centre: Vec3, axis: usize| {
        let share = (centre[axis] - lower[axis]) / extent[axis];
        ((share * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| extent[axis] > 0.0 && extent[axis].is_finite()) {
        let mut bins = [LightBounds::NOTHING; BINS];
        for item in &*items {
            let bin = &mut bins[bin(item.centre, axis)];
            *bin = bin.union(&item.bounds);
        }
        let mut above = [0.0; BINS];
        let mut group = LightBounds::NOTHING;
        for i in (1..BINS).rev() {
            group = group.union(&bins[i]);
            above[i] = group.cost();
        }
        let mut group = LightBounds::NOTHING;
        // Thin slices are dear: they hardly tell lights apart.
        let thin = longest / extent[axis];
        for i in 1..BINS {
            group = group.union(&bins[i - 1]);
            let cost = thin * (group.cost() + above[i]);
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, i));
            }
        }
    }
    let Some((_, axis, plane)) = best else { return items.len() / 2 };
    let mut left = 0;
    for i in 0..items.len() {
        if bin(items[i].centre, axis) < plane {
            items.swap(i, left);
            left += 1;
        }
    }
    if left == 0 || left == items.len() { items.len() / 2 } else { left }
}
