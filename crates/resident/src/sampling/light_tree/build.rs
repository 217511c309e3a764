//! Builds a [`LightTree`] top-down: at each node the cheapest split among planes between equal bins of the centroids, by the
//! surface area orientation heuristic (Conty Estevez and Kulla 2018, section 4.4).

use super::{LightBounds, LightNode, LightTree};
use glam::Vec3;

/// Bins on each axis.
const BINS: usize = 12;

/// A light that is being sorted.
#[derive(Clone, Copy)]
struct Item {
    bounds: LightBounds,
    /// Twice.
    centre: Vec3,
    light: u32,
}

impl LightTree {
    /// Builds the tree over lights by number; `None` for those that do not shine. It takes O(n log n) time for any input.
    pub fn build(lights: &[Option<LightBounds>]) -> Self {
        let mut items: Vec<Item> = (0..)
            .zip(lights)
            .filter_map(|(light, bounds)| bounds.map(|bounds| Item { bounds, centre: bounds.centre(), light }))
            .collect();
        let mut tree = Self { nodes: Vec::new(), leaves: vec![0; lights.len()] };
        if items.is_empty() {
            return tree;
        }
        tree.nodes.reserve_exact(2 * items.len() - 1);
        // Below this depth groups are halved by number.
        let levels = 2 * items.len().ilog2() + 16;
        let mut work = vec![Work { first: 0, count: items.len(), parent: 0, is_second: false, levels }];
        while let Some(Work { first, count, parent, is_second, levels }) = work.pop() {
            let at = tree.nodes.len() as u32;
            if is_second {
                tree.nodes[parent as usize].second = at;
            }
            let group = &mut items[first..first + count];
            let bounds = group.iter().fold(LightBounds::NOTHING, |b, item| b.union(&item.bounds));
            tree.nodes.push(LightNode { bounds, second: 0, parent, light: group[0].light, reserved: 0 });
            if count == 1 {
                tree.leaves[group[0].light as usize] = at;
                continue;
            }
            let left = if levels > 0 { split(group) } else { count / 2 };
            let below = |first, count, is_second| Work {
                first,
                count,
                parent: at,
                is_second,
                levels: levels.saturating_sub(1),
            };
            // The first group is taken from the stack next, so that its node follows.
            work.push(below(first + left, count - left, true));
            work.push(below(first, left, false));
        }
        tree
    }
}

/// A group that has no node yet.
struct Work {
    first: usize,
    count: usize,
    parent: u32,
    is_second: bool,
    levels: u32,
}

/// Sorts the items into two groups and gives the size of the first; both have some.
fn split(items: &mut [Item]) -> usize {
    let (lower, upper) = items
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), item| (lo.min(item.centre), hi.max(item.centre)));
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
