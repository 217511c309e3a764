//! Lights that come, go, change or move: the paths from their leaves to the root are written, and little else.
//!
//! A light goes where it makes the groups above it the least larger by the measure of [`super::build`], and the groups on
//! its path are regrouped where that makes one smaller (rotations, Kensler 2008, "Tree Rotations for Improving Bounding
//! Volume Hierarchies"). What a group has is always made of its two parts, never added to or taken from: sums do not drift.
//!
//! Paths are bounded as in a scapegoat tree (Galperin and Rivest 1993): where one becomes too long, the lowest group on it
//! that is too high for its number of lights is built anew. Such a group has become so by changes of a part of its lights,
//! so that a change costs O(log n) nodes, and amortised O(log n) for these.

use super::arena::sibling;
use super::build::Item;
use super::{Group, LightBounds, LightTree};
use crate::rows::NONE;
use std::collections::BTreeMap;

/// Groups are regrouped where one becomes smaller by this part.
const ROTATION_GAIN: f32 = 0.02;

/// Most nodes below each other, less one, over this many lights.
pub(super) fn height_limit(lights: u32) -> u32 {
    2 * ceil_log2(lights) + 16
}

/// How high a group may be that was built anew for its height.
fn repaired_height(lights: u32) -> u32 {
    ceil_log2(lights) + 8
}

fn ceil_log2(n: u32) -> u32 {
    n.max(1).next_power_of_two().trailing_zeros()
}

impl LightTree {
    /// Follows changes of lights by number; `None` for one that does not shine any more. Where they are more than half of
    /// all lights, the tree becomes what [`Self::build`] makes. No light is to be named twice.
    pub fn update(&mut self, changes: &[(u32, Option<LightBounds>)]) {
        let changed = changes.iter().filter(|&&(light, bounds)| self.get(light) != bounds.as_ref()).count();
        if 2 * changed <= self.len() {
            changes.iter().for_each(|&(light, bounds)| self.set(light, bounds));
            return;
        }
        let mut lights: BTreeMap<u32, LightBounds> = self.lights_below(0).into_iter().collect();
        for &(light, bounds) in changes {
            match bounds {
                Some(bounds) => lights.insert(light, bounds),
                None => lights.remove(&light),
            };
        }
        self.counters.rebuilds += 1;
        self.clear();
        let mut items: Vec<Item> = lights.into_iter().map(|(light, bounds)| Item::new(light, bounds)).collect();
        self.fill(&mut items);
    }

    /// Takes all lights out.
    pub fn clear(&mut self) {
        for (light, _) in self.lights_below(0) {
            self.set_leaf(light, NONE);
        }
        self.forget_nodes();
    }

    /// Changes one light; `None` if it does not shine any more.
    pub fn set(&mut self, light: u32, bounds: Option<LightBounds>) {
        let Some(bounds) = bounds else { return self.remove(light) };
        match self.get(light).copied() {
            None => self.insert(light, bounds),
            Some(before) if before == bounds => {}
            // Another power alone: the groups are as good as they were.
            Some(before) if (LightBounds { intensity: bounds.intensity, ..before }) == bounds => {
                let leaf = self.leaves[light as usize] as usize;
                self.write(leaf).bounds = bounds;
                self.ascend(leaf, false);
            }
            Some(_) => {
                self.remove(light);
                self.insert(light, bounds);
            }
        }
    }

    /// Adds a light that is not there.
    fn insert(&mut self, light: u32, bounds: LightBounds) {
        if self.nodes.is_empty() {
            return self.fill(&mut [Item::new(light, bounds)]);
        }
        let at = self.best_place(&bounds);
        let pair = self.take_pair(at);
        self.relocate(at, pair);
        self.put_leaf(pair + 1, light, bounds);
        let group = self.write(at);
        (group.first, group.light) = (pair as u32, NONE);
        self.ascend(pair, true);
        self.limit_height();
    }

    /// Takes a light out, if it is there.
    pub fn remove(&mut self, light: u32) {
        let leaf = match self.leaves.get(light as usize) {
            Some(&leaf) if leaf != NONE => leaf as usize,
            _ => return,
        };
        self.set_leaf(light, NONE);
        if leaf == 0 {
            return self.forget_nodes();
        }
        let (parent, other) = (self.nodes[leaf].parent as usize, sibling(leaf));
        self.relocate(other, parent);
        self.free_pair(leaf.min(other));
        self.ascend(parent, true);
        self.limit_height();
    }

    /// The node beside which a light makes the groups above the least larger: a walk down the better one of two groups, which
    /// ends where no group below is better.
    fn best_place(&mut self, bounds: &LightBounds) -> usize {
        let mut at = 0;
        loop {
            self.counters.visited += 1;
            let node = &self.nodes[at];
            let pair = node.first as usize;
            if pair == 0 {
                return at;
            }
            // Beside this node a group of all of it comes into being; below, this node itself grows to that.
            let here = node.bounds.union(bounds).cost();
            let grown = here - node.bounds.cost();
            let below = [pair, pair + 1].map(|child| {
                let node = &self.nodes[child];
                let own = if node.first == 0 { 0.0 } else { node.bounds.cost() };
                grown + (node.bounds.union(bounds).cost() - own)
            });
            if here < below[0] && here < below[1] {
                return at;
            }
            // Of equally good ones the smaller, so that lights in one place make no chain.
            let is_smaller = self.groups[pair].lights <= self.groups[pair + 1].lights;
            let takes_first = below[0]
                .partial_cmp(&below[1])
                .map_or(is_smaller, |order| order.is_lt() || order.is_eq() && is_smaller);
            at = if takes_first { pair } else { pair + 1 };
        }
    }

    /// Makes the groups above a node anew, and regroups them where it is said. Without that it ends where nothing changes.
    fn ascend(&mut self, from: usize, regroups: bool) {
        let mut at = from;
        while at != 0 {
            at = self.nodes[at].parent as usize;
            self.counters.visited += 1;
            if regroups {
                self.rotate(at);
            }
            if !self.refit(at) && !regroups {
                break;
            }
        }
    }

    /// Makes what a group has of its two parts; whether it is another.
    pub(super) fn refit(&mut self, at: usize) -> bool {
        let pair = self.nodes[at].first as usize;
        let bounds = self.nodes[pair].bounds.union(&self.nodes[pair + 1].bounds);
        let [a, b] = [self.groups[pair], self.groups[pair + 1]];
        let group = Group { lights: a.lights + b.lights, height: 1 + a.height.max(b.height) };
        let changed = self.nodes[at].bounds != bounds;
        if changed {
            self.write(at).bounds = bounds;
        }
        std::mem::replace(&mut self.groups[at], group) != group || changed
    }

    /// Exchanges one of two groups with a part of the other, where that makes the other smaller.
    fn rotate(&mut self, at: usize) {
        let pair = self.nodes[at].first as usize;
        let mut best: Option<(f32, usize, usize)> = None;
        for [stays, goes] in [[pair, pair + 1], [pair + 1, pair]] {
            let parts = self.nodes[stays].first as usize;
            if parts == 0 {
                continue;
            }
            let cost = self.nodes[stays].bounds.cost();
            for part in [parts, parts + 1] {
                let other = &self.nodes[sibling(part)].bounds;
                let gain = cost - self.nodes[goes].bounds.union(other).cost();
                if gain > ROTATION_GAIN * cost && best.is_none_or(|(most, ..)| gain > most) {
                    best = Some((gain, goes, part));
                }
            }
        }
        let Some((_, goes, part)) = best else { return };
        self.counters.visited += 2;
        let (a, b) = (self.nodes[goes], self.nodes[part]);
        *self.write(goes) = super::LightNode { parent: a.parent, ..b };
        *self.write(part) = super::LightNode { parent: b.parent, ..a };
        self.groups.swap(goes, part);
        self.lead_here(goes);
        self.lead_here(part);
        self.refit(sibling(goes));
    }

    /// Builds groups anew until no path is longer than [`height_limit`] allows.
    fn limit_height(&mut self) {
        while let Some(root) = self.groups.first()
            && root.height > height_limit(root.lights)
        {
            let limit = height_limit(root.lights);
            let mut path = vec![0];
            let mut at = 0;
            while self.nodes[at].first != 0 {
                let pair = self.nodes[at].first as usize;
                at = if self.groups[pair + 1].height > self.groups[pair].height { pair + 1 } else { pair };
                path.push(at);
            }
            // The lowest that is too high by itself, and whose repair ends the excess of this path: the root is one.
            let scapegoat = path.iter().enumerate().rev().find(|&(depth, &at)| {
                let Group { lights, height } = self.groups[at];
                height > height_limit(lights) && depth as u32 + repaired_height(lights) <= limit
            });
            let at = scapegoat.map_or(0, |(_, &at)| at);
            self.counters.repairs += 1;
            self.counters.visited += path.len() as u64;
            self.rebuild_below(at);
        }
    }

    /// Builds a group anew, as low as a repair asks for.
    fn rebuild_below(&mut self, top: usize) {
        let mut items: Vec<Item> =
            self.lights_below(top).into_iter().map(|(light, bounds)| Item::new(light, bounds)).collect();
        self.free_below(top);
        let height = repaired_height(items.len() as u32);
        self.grow(top, &mut items, height);
        self.ascend(top, false);
    }

    /// The lights of a group; none of an empty tree.
    fn lights_below(&self, top: usize) -> Vec<(u32, LightBounds)> {
        let mut lights = Vec::new();
        let mut open = vec![top];
        while let Some(node) = open.pop().and_then(|at| self.nodes.get(at)) {
            match node.first as usize {
                0 => lights.push((node.light, node.bounds)),
                pair => open.extend([pair + 1, pair]),
            }
        }
        lights
    }

    fn free_below(&mut self, top: usize) {
        let mut open = vec![self.nodes[top].first as usize];
        while let Some(pair) = open.pop() {
            if pair != 0 {
                open.extend([pair + 1, pair].map(|at| self.nodes[at].first as usize));
                self.free_pair(pair);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::LightTreeCounters;
    use super::*;

    fn point(x: f32) -> LightBounds {
        let at = [x, 0.0, 0.0];
        LightBounds { lower: at, upper: at, intensity: 1.0, cos_spread: -1.0, ..LightBounds::NOTHING }
    }

    #[test]
    fn a_chain_is_built_anew_before_it_is_too_long() {
        let mut tree = LightTree::build(&[Some(point(0.0)), Some(point(1.0))]);
        // Each beside the deepest leaf, as no measure would have it.
        for light in 2..2000u32 {
            let mut at = 0;
            while tree.nodes[at].first != 0 {
                let pair = tree.nodes[at].first as usize;
                at = if tree.groups[pair].height >= tree.groups[pair + 1].height { pair } else { pair + 1 };
            }
            let pair = tree.take_pair(at);
            tree.relocate(at, pair);
            tree.put_leaf(pair + 1, light, point(light as f32));
            let group = tree.write(at);
            (group.first, group.light) = (pair as u32, NONE);
            tree.ascend(pair, false);
            tree.limit_height();
            assert!(tree.groups[0].height <= height_limit(light + 1));
        }
        tree.validate().unwrap();
        assert_eq!(tree.len(), 2000);
        let LightTreeCounters { visited, repairs, rebuilds } = tree.take_counters();
        assert!(repairs > 0 && rebuilds == 0);
        assert!(visited < 2000 * 400, "{visited} nodes for 2000 lights: repairs are paid for by what they mend");
    }
}
