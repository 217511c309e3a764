//! Better places for the subtrees that cost most.
//!
//! Every subtree with a large surface is taken out and put where the surface of the whole tree shrinks most, if it shrinks:
//! the search of Meister and Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", Computer Graphics
//! Forum 2018, section 3, here with each move applied before the next search, so that no two can conflict.

use core::cmp::Ordering;

use crate::edit::ascend::Rotations;
use crate::edit::insert::Site;
use crate::node::{Child, ChildKind, NONE, NodeId};
use crate::scalar::{Real, Scalar, greater};
use crate::tree::{Bvh, MAX_DEPTH};

/// What an optimisation did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Optimized {
    /// Subtrees for which a better place was looked for.
    pub searched: usize,
    /// Subtrees that were moved.
    pub moved: usize,
}

/// A child: its surface, the node that holds it, and where it leads.
#[derive(Clone, Copy)]
struct Candidate<R> {
    area: R,
    node: u32,
    child: Child,
}

impl<R: Real> Candidate<R> {
    /// Falling surface; surfaces are never NaN. Ties in a fixed order, so that runs are the same.
    fn order(&self, other: &Self) -> Ordering {
        let by_area = other.area.partial_cmp(&self.area).unwrap_or(Ordering::Equal);
        by_area.then(self.node.cmp(&other.node)).then(self.child.0.cmp(&other.child.0))
    }
}

/// The most nodes read in search of one better place.
const VISITS: u32 = 4096;
/// How far ahead memory is asked for.
const AHEAD: usize = 8;

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Looks for better places for at most `budget` subtrees, those with the largest surfaces. Call it again for more:
    /// the surfaces have changed then. The cost is proportional to the budget.
    pub fn optimize(&mut self, budget: usize) -> Optimized {
        let mut done = Optimized::default();
        let mut open = Vec::with_capacity(MAX_DEPTH as usize + 1);
        let candidates = self.largest_children(budget);
        for (i, &Candidate { node, child, .. }) in candidates.iter().enumerate() {
            if let Some(ahead) = candidates.get(i + AHEAD) {
                self.arena.prefetch(Child(ahead.node));
            }
            // Moves before this one may have moved the child, or freed the node.
            let n = &self.arena[node];
            let slot = n.slot_of(child);
            if !self.arena.is_live(node) || n.child[slot] != child || self.len < 3 {
                continue;
            }
            done.searched += 1;
            if let Some(site) = self.better_site(node, slot, &mut open) {
                self.reinsert(node, slot, site);
                done.moved += 1;
            }
        }
        done
    }

    /// The children with the largest surfaces, those of earlier rounds first. A child is never larger than its parent, so they
    /// are found from the top: in rounds, each of which goes down to half the largest surface that was left out before.
    fn largest_children(&self, count: usize) -> Vec<Candidate<S::Real>> {
        let mut found = Vec::new();
        if self.len < 2 || count == 0 {
            return found;
        }
        let mut left = self.children_of(self.root).to_vec();
        let mut open = Vec::new();
        while found.len() < count && !left.is_empty() {
            let largest = left.iter().fold(S::Real::ZERO, |largest, candidate| greater(candidate.area, largest));
            let least = largest * S::Real::HALF;
            left.retain(|candidate| {
                if candidate.area >= least {
                    open.push(*candidate);
                }
                candidate.area < least
            });
            let before = found.len();
            while let Some(candidate) = open.pop() {
                found.push(candidate);
                if let ChildKind::Node(node) = candidate.child.kind() {
                    for below in self.children_of(node.0) {
                        self.arena.prefetch(below.child);
                        if below.area >= least { &mut open } else { &mut left }.push(below);
                    }
                }
            }
            if found.len() > count {
                found[before..].select_nth_unstable_by(count - before, Candidate::order);
                found.truncate(count);
            }
        }
        found
    }

    fn children_of(&self, node: u32) -> [Candidate<S::Real>; 2] {
        let n = &self.arena[node];
        [0, 1].map(|slot| Candidate { area: n.bounds[slot].half_area(), node, child: n.child[slot] })
    }

    /// The place where the surface of the tree would be smallest, if that is smaller than now.
    ///
    /// Say the child X hangs in P0, beside B, and P1, P2, ... are the nodes above with the other children Q1, Q2, .... If X
    /// goes to somewhere below Qk, then P0 goes, which saves its surface, and every Pi between shrinks to B + Q1 + ... + Qi.
    /// Below Qk every node on the way grows, and the new pair has a surface: that is paid.
    ///
    /// `open` is room for nodes to look below, and what is saved on the way there.
    fn better_site(&mut self, node: u32, slot: usize, open: &mut Vec<(u32, S::Real)>) -> Option<Site> {
        let n = &self.arena[node];
        let bounds = n.bounds[slot];
        let area = bounds.half_area();
        let (mut best, mut site) = (S::Real::ZERO, None);
        let (mut rest, mut saved) = (n.bounds[1 - slot], n.union().half_area());
        let (mut pivot, mut other) = (node, 1 - slot);
        let mut visits = 0;
        loop {
            visits += 1;
            let p = &self.arena[pivot];
            let pair = p.bounds[other].union_half_area(&bounds);
            if pivot != node && saved - pair > best {
                (best, site) = (saved - pair, Some(Site::Beside(pivot, other)));
            }
            open.clear();
            if p.child[other].is_node() {
                open.push((p.child[other].0, saved - (pair - p.bounds[other].half_area())));
            }
            while let Some((at, saved)) = open.pop() {
                if saved - area <= best || visits >= VISITS {
                    continue;
                }
                visits += 1;
                let n = &self.arena[at];
                self.arena.prefetch(n.child[0]);
                self.arena.prefetch(n.child[1]);
                let mut below = [saved; 2];
                for slot in 0..2 {
                    let pair = n.bounds[slot].union_half_area(&bounds);
                    if saved - pair > best {
                        (best, site) = (saved - pair, Some(Site::Beside(at, slot)));
                    }
                    below[slot] = saved - (pair - n.bounds[slot].half_area());
                }
                // The more promising one last, so that it is looked at first.
                let better = usize::from(below[1] > below[0]);
                for slot in [1 - better, better] {
                    if n.child[slot].is_node() && below[slot] - area > best {
                        open.push((n.child[slot].0, below[slot]));
                    }
                }
            }

            let above = p.parent;
            if above == NONE || visits >= VISITS {
                self.counters.visited += u64::from(visits);
                return site;
            }
            let from = self.arena[above].slot_of(Child::node(NodeId(pivot)));
            if pivot != node {
                rest = rest.union(&p.bounds[other]);
                let whole = p.union().half_area();
                saved += whole - rest.half_area();
                if saved - whole > best {
                    (best, site) = (saved - whole, Some(Site::Beside(above, from)));
                }
            }
            (pivot, other) = (above, 1 - from);
        }
    }

    /// Moves a child to a site that [`Self::better_site`] found. The site is never a slot of `node`, which goes.
    fn reinsert(&mut self, node: u32, slot: usize, site: Site) {
        let n = &self.arena[node];
        let (child, bounds, height) = (n.child[slot], n.bounds[slot], n.height[slot]);
        let start = self.detach(node, slot);
        if start != NONE {
            self.ascend(start, Rotations::No);
        }
        self.attach(child, bounds, height, site);
    }
}

#[cfg(test)]
mod tests {
    use crate::{Aabb, Builder, Bvh};

    #[test]
    fn optimising_a_tree_of_random_inserts_lowers_its_cost_and_keeps_it_valid() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32 * 100.0
        };
        let mut bvh = Bvh::<f32, 3>::new();
        for item in 0..2000 {
            let at = [random(), random(), random()];
            bvh.insert(item, Aabb::new(at, at.map(|c| c + 1.0))).expect("a good box");
        }
        let before = bvh.sah_cost();
        let done = bvh.optimize(4000);
        assert!(done.moved > 0 && done.searched >= done.moved);
        assert!(bvh.sah_cost() < before);
        bvh.validate().expect("reinsertion keeps every invariant");
    }

    #[test]
    fn an_optimum_stays_as_it_is() {
        let boxes: Vec<_> = (0..4).map(|i| Aabb::new([i, 0, 0], [i + 1, 1, 1])).collect();
        let mut bvh = Bvh::build(&boxes, Builder::best()).expect("boxes are good");
        bvh.take_writes();
        assert_eq!(bvh.optimize(100).moved, 0);
        assert!(bvh.take_writes().written.is_empty());
    }
}
