//! [`LightTree`]: the choice among many lights by what they can bring to a surface (Conty Estevez and Kulla 2018,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting"; as a binary tree without splitting).
//!
//! A walk from the root chooses one of two groups at each node, in proportion to a bound-like estimate of their light at
//! the surface, down to one light. The probability of a light at a surface, which MIS asks for, is that of the walk to its
//! leaf.
//!
//! The tree is made whole ([`build`]) and follows single lights at the cost of their paths ([`edit`]); every node that is
//! written is logged ([`arena`]), so that a copy elsewhere follows by these writes alone.

mod arena;
mod bounds;
mod build;
mod edit;
mod validate;

pub use arena::LightTreeWrites;
pub use bounds::LightBounds;

use crate::rows::NONE;
use arena::RowLog;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The part of choices that is made by power alone. An estimate of what a group brings can be wrong by much, where its lights
/// are not spread as their box is; with this part the variance is never more than `1 / BY_POWER` times that of a choice by
/// power (Veach 1997, "Robust Monte Carlo Methods for Light Transport Simulation", section 9.2.2).
const BY_POWER: f32 = 0.5;

/// A group of lights or one. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LightNode {
    /// Of all lights below: exactly [`LightBounds::union`] of the two groups.
    pub bounds: LightBounds,
    /// Node of the first of the two groups, an odd number; the second one's is the next. 0 for one light.
    pub first: u32,
    /// The node above; the root's is 0.
    pub parent: u32,
    /// A light's number, of those that the tree is over; [`NONE`] for a group.
    pub light: u32,
    /// Zero.
    pub reserved: u32,
}

/// What a node has below it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Group {
    lights: u32,
    /// Nodes on the longest way down, less one.
    height: u32,
}

/// What following changes has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightTreeCounters {
    /// Nodes that were looked at or written, and lights that were sorted, level by level.
    pub visited: u64,
    /// Subtrees that were built anew since paths had become too deep.
    pub repairs: u64,
    /// Times that the whole tree was built anew, since most of its lights had changed.
    pub rebuilds: u64,
}

/// See the module. An empty tree has no nodes. It changes by its functions alone; the fields are public to be read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTree {
    /// Node 0 is the root; two groups of one node lie side by side. Those of free nodes are zero.
    pub nodes: Vec<LightNode>,
    /// The node of each light, or [`NONE`] for those that do not shine.
    pub leaves: Vec<u32>,
    /// By node.
    groups: Vec<Group>,
    /// First nodes of free pairs.
    free: Vec<u32>,
    node_log: RowLog,
    leaf_log: RowLog,
    counters: LightTreeCounters,
}

impl LightTree {
    /// How many lights shine.
    pub fn len(&self) -> usize {
        self.groups.first().map_or(0, |root| root.lights as usize)
    }

    /// Whether none shines.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The light of a number, if it shines.
    pub fn get(&self, light: u32) -> Option<&LightBounds> {
        let &leaf = self.leaves.get(light as usize)?;
        self.nodes.get(leaf as usize).map(|node| &node.bounds)
    }

    /// What changes have cost since it was asked last.
    pub fn take_counters(&mut self) -> LightTreeCounters {
        std::mem::take(&mut self.counters)
    }

    /// Chooses a light for a surface at `from` with the unit normal `normal` on the side from which light is taken (zero
    /// for both sides) by a random number in 0..1: its number, and the probability of the choice. `None` where none can
    /// bring light.
    #[inline]
    pub fn sample(&self, from: Vec3, normal: Vec3, u: f32) -> Option<(u32, f32)> {
        self.nodes.first()?;
        let below_one = |u: f32| u.min(1.0 - f32::EPSILON / 2.0);
        if u < BY_POWER {
            let at = self.walk(below_one(u / BY_POWER), |tree, pair| Some(tree.power_shares(pair)))?.0;
            let light = self.nodes[at].light;
            return Some((light, self.probability(light, from, normal)));
        }
        let u = below_one((u - BY_POWER) / (1.0 - BY_POWER));
        let (at, chosen) = self.walk(u, |tree, pair| tree.shares(pair, from, normal))?;
        Some((self.nodes[at].light, self.mixed(at, chosen)))
    }

    /// The probability with which [`Self::sample`] chooses a light.
    #[inline]
    pub fn probability(&self, light: u32, from: Vec3, normal: Vec3) -> f32 {
        let leaf = match self.leaves.get(light as usize) {
            Some(&leaf) if leaf != NONE => leaf as usize,
            _ => return 0.0,
        };
        let (mut at, mut chosen) = (leaf, 1.0);
        while at != 0 && chosen > 0.0 {
            let parent = self.nodes[at].parent as usize;
            let shares = self.shares(self.nodes[parent].first as usize, from, normal).unwrap_or([0.0; 2]);
            // First groups have odd numbers.
            chosen *= shares[1 - (at & 1)];
            at = parent;
        }
        self.mixed(leaf, chosen)
    }

    /// The probability of a leaf, of which `chosen` is that of the walk by importance.
    #[inline]
    fn mixed(&self, leaf: usize, chosen: f32) -> f32 {
        BY_POWER * (self.nodes[leaf].bounds.intensity / self.nodes[0].bounds.intensity) + (1.0 - BY_POWER) * chosen
    }

    /// Walks from the root to a leaf by the shares of the groups: the leaf, and the product of the shares.
    #[inline]
    fn walk(&self, mut u: f32, shares: impl Fn(&Self, usize) -> Option<[f32; 2]>) -> Option<(usize, f32)> {
        let (mut at, mut probability) = (0usize, 1.0f32);
        loop {
            let pair = self.nodes[at].first as usize;
            if pair == 0 {
                return Some((at, probability));
            }
            let [first, second] = shares(self, pair)?;
            // A share of 1 is chosen whatever the rounding of `u`.
            if u < first || second <= 0.0 {
                u = (u / first).min(1.0 - f32::EPSILON / 2.0);
                probability *= first;
                at = pair;
            } else {
                u = ((u - first) / second).clamp(0.0, 1.0 - f32::EPSILON / 2.0);
                probability *= second;
                at = pair + 1;
            }
        }
    }

    /// The parts of their power that two groups have, of which the first is at `pair`.
    #[inline]
    fn power_shares(&self, pair: usize) -> [f32; 2] {
        let [a, b] = [pair, pair + 1].map(|child| self.nodes[child].bounds.intensity);
        if a + b > 0.0 { [a / (a + b), b / (a + b)] } else { [0.5; 2] }
    }

    /// Probabilities of two groups, of which the first is at `pair`; `None` where neither can bring light.
    #[inline]
    fn shares(&self, pair: usize, from: Vec3, normal: Vec3) -> Option<[f32; 2]> {
        let [a, b] = [pair, pair + 1].map(|child| {
            let node = &self.nodes[child];
            node.bounds.importance(from, normal, node.first != 0)
        });
        let sum = a + b;
        (sum > 0.0).then(|| [a / sum, b / sum])
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        let rows = size_of_val(self.nodes.as_slice()) + size_of_val(self.leaves.as_slice());
        (rows + size_of_val(self.groups.as_slice())) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{safe_normalize, unit_float};
    use crate::sampling::hash_combine;

    fn random(i: u32, k: u32) -> f32 {
        unit_float(hash_combine(hash_combine(7, i), k))
    }

    /// Surfaces and points at random places; every seventh does not shine.
    fn lights(count: u32) -> Vec<Option<LightBounds>> {
        let light = |i: u32| {
            let at = Vec3::new(random(i, 0), random(i, 1), random(i, 2)) * 10.0;
            let axis = Vec3::new(random(i, 3), random(i, 4), random(i, 5)) - 0.5;
            let size = Vec3::splat(0.2 * random(i, 6));
            (i % 7 != 3).then_some(LightBounds {
                lower: at.to_array(),
                intensity: 0.1 + random(i, 7),
                upper: (at + size).to_array(),
                cos_spread: if i.is_multiple_of(2) { 1.0 } else { -1.0 },
                axis: safe_normalize(axis, Vec3::Z).to_array(),
                cos_end: 0.0,
            })
        };
        (0..count).map(light).collect()
    }

    #[test]
    fn every_light_is_in_one_leaf_and_groups_hold_their_parts() {
        for count in [0, 1, 2, 3, 10, 1000] {
            let lights = lights(count);
            let tree = LightTree::build(&lights);
            let shining = lights.iter().flatten().count();
            assert_eq!(tree.nodes.len(), (2 * shining).saturating_sub(1));
            tree.validate().unwrap();
            assert!((0..).zip(&lights).all(|(light, bounds)| tree.get(light) == bounds.as_ref()));
            for (i, node) in tree.nodes.iter().enumerate().filter(|(_, node)| node.first != 0) {
                let children = [0, 1].map(|k| node.first as usize + k);
                assert!(children.iter().all(|&c| c > i), "a fresh tree is in the order of a walk");
                let sum: f32 = children.iter().map(|&c| tree.nodes[c].bounds.intensity).sum();
                assert!((sum / node.bounds.intensity - 1.0).abs() < 1e-5);
                for c in children.map(|c| tree.nodes[c].bounds) {
                    assert!((0..3).all(|k| c.lower[k] >= node.bounds.lower[k] && c.upper[k] <= node.bounds.upper[k]));
                    assert!(c.cos_end >= node.bounds.cos_end);
                }
            }
        }
    }

    #[test]
    fn lights_in_one_place_and_extreme_ones_are_built_too() {
        let at = |p: [f32; 3], intensity| {
            Some(LightBounds { lower: p, upper: p, intensity, cos_spread: -1.0, cos_end: 1.0, ..LightBounds::NOTHING })
        };
        let same = vec![at([1.0, 2.0, 3.0], 5.0); 5000];
        let tree = LightTree::build(&same);
        let chosen = tree.sample(Vec3::ZERO, Vec3::ZERO, 0.7).unwrap();
        assert!((chosen.1 * 5000.0 - 1.0).abs() < 1e-3);
        let depth = |mut at: usize| {
            let mut depth = 0;
            while at != 0 {
                (at, depth) = (tree.nodes[at].parent as usize, depth + 1);
            }
            depth
        };
        assert!((0..tree.nodes.len()).map(depth).max().unwrap() <= 50);
        let extreme = [at([1e30; 3], 1e30), at([-1e30; 3], 1e-30), at([0.0; 3], 1e-38), at([1e-38; 3], 1.0)];
        let tree = LightTree::build(&extreme);
        for i in 0..100 {
            let (light, p) = tree.sample(Vec3::ZERO, Vec3::ZERO, random(i, 0)).unwrap();
            assert!(light < 4 && p > 0.0 && p <= 1.0);
        }
    }

    #[test]
    fn probabilities_sum_to_one_and_are_those_of_the_choices() {
        let lights = lights(200);
        let tree = LightTree::build(&lights);
        for i in 0..50 {
            let from = Vec3::new(random(i, 20), random(i, 21), random(i, 22)) * 14.0 - 2.0;
            let normal = safe_normalize(Vec3::new(random(i, 23), random(i, 24), random(i, 25)) - 0.5, Vec3::Y);
            let sum: f64 = (0..200).map(|l| f64::from(tree.probability(l, from, normal))).sum();
            // Less than 1 where a group seemed to bring light and none of its parts does.
            assert!(sum < 1.0 + 1e-4, "{sum}");
            let n = 20_000;
            let mut counts = [0u32; 200];
            for k in 0..n {
                if let Some((light, p)) = tree.sample(from, normal, (k as f32 + 0.5) / n as f32) {
                    counts[light as usize] += 1;
                    let again = tree.probability(light, from, normal);
                    assert!((p / again - 1.0).abs() < 1e-4, "{p} {again}");
                }
            }
            for (light, &count) in counts.iter().enumerate() {
                let expected = tree.probability(light as u32, from, normal) * n as f32;
                assert!((count as f32 - expected).abs() <= 2.0 + 2e-3 * expected, "{count} {expected}");
            }
        }
    }

    #[test]
    fn the_nearest_of_many_equal_lights_is_chosen_most() {
        let lights: Vec<_> = (0..1000u32)
            .map(|i| {
                let at = [(i % 32) as f32 * 10.0, 5.0, (i / 32) as f32 * 10.0];
                Some(LightBounds { lower: at, upper: at, intensity: 1.0, cos_spread: -1.0, ..LightBounds::NOTHING })
            })
            .collect();
        let tree = LightTree::build(&lights);
        // The second moment of one choice's estimate over the squared sum: 1 for the best choice, 1000 for lights at random.
        let mut moment = 0.0;
        for i in 0..200 {
            let from = Vec3::new(random(i, 0) * 320.0, 0.0, random(i, 1) * 320.0);
            let (mut sum, mut squares) = (0.0, 0.0);
            for (light, bounds) in (0..).zip(&lights) {
                let to = Vec3::from_array(bounds.unwrap().lower) - from;
                let irradiance = to.y / to.length().powi(3);
                sum += irradiance;
                squares += irradiance * irradiance / tree.probability(light, from, Vec3::Y);
            }
            moment += squares / (sum * sum) / 200.0;
        }
        assert!(moment < 3.2, "{moment}");
    }
}
