//! Parallel locally-ordered clustering, on one thread: Meister and Bittner, "Parallel Locally-Ordered Clustering for
//! Bounding Volume Hierarchy Construction", IEEE TVCG 2018.
//!
//! Clusters lie in the order of a Morton curve. In every pass each finds the neighbour with which it has the smallest
//! surface; two that found each other are joined. Clusters are stored axis by axis, and the surfaces of all pairs at one
//! distance are computed in one sweep over short blocks, so that the compiler makes vector instructions of it.

use super::draft::{Draft, Part};
use super::sah;
use crate::aabb::Aabb;
use crate::node::Child;
use crate::scalar::{Real, Scalar, greater, lesser};
use crate::tree::MAX_DEPTH;

/// Clusters that are looked at together; their surfaces stay in the first-level cache.
const BLOCK: usize = 256;
/// The largest radius.
const MAX_RADIUS: usize = 32;
/// A pass that joins fewer than one in this many clusters is the last. Where surfaces rise along the curve only one pair
/// in a pass finds each other: the rest is then built top down.
const FEW: usize = 8;

/// Builds over leaves in the order of the curve, at least two.
pub(crate) fn build<S: Scalar, const N: usize>(
    draft: &mut Draft,
    leaves: &[(u32, Aabb<S, N>)],
    radius: usize,
    coarse_passes: usize,
) -> Child {
    let radius = radius.clamp(1, MAX_RADIUS);
    let mut clusters = Clusters::of(leaves);
    let mut count = leaves.len();
    draft.joins.reserve(count - 1);
    let mut partner = vec![0i32; count];
    let mut pass = 0;
    while count > 1 {
        let reach = if pass < coarse_passes { 1 } else { radius };
        clusters.find_partners(count, reach, &mut partner[..count]);
        let left = clusters.join_partners(draft, &partner[..count]);
        if left > 1 && (count - left) * FEW < count {
            let mut parts: Vec<_> = (0..left).map(|i| clusters.get(i)).collect();
            return sah::build(draft, &mut parts, MAX_DEPTH, usize::MAX);
        }
        count = left;
        pass += 1;
    }
    clusters.child[0]
}

/// The clusters of a pass, axis by axis.
struct Clusters<S, const N: usize> {
    min: [Vec<S>; N],
    max: [Vec<S>; N],
    child: Vec<Child>,
}

impl<S: Scalar, const N: usize> Clusters<S, N> {
    fn of(leaves: &[(u32, Aabb<S, N>)]) -> Self {
        Self {
            min: core::array::from_fn(|a| leaves.iter().map(|(_, bounds)| bounds.min[a]).collect()),
            max: core::array::from_fn(|a| leaves.iter().map(|(_, bounds)| bounds.max[a]).collect()),
            child: (0..leaves.len() as u32).map(Child::leaf).collect(),
        }
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Part<S, N> {
        let mut bounds = Aabb::EMPTY;
        for a in 0..N {
            bounds.min[a] = self.min[a][i];
            bounds.max[a] = self.max[a][i];
        }
        Part { bounds, child: self.child[i] }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, part: Part<S, N>) {
        for a in 0..N {
            self.min[a][i] = part.bounds.min[a];
            self.max[a][i] = part.bounds.max[a];
        }
        self.child[i] = part.child;
    }

    /// For each of the first `count` clusters, how far on the curve its partner is: the neighbour within `radius` with which
    /// it has the smallest surface. Among equals the nearest, and of two equally near the one that shares its pair
    /// (2k, 2k + 1): so that a run of equal boxes is joined two by two.
    fn find_partners(&self, count: usize, radius: usize, partner: &mut [i32]) {
        let mut area = [S::Real::ZERO; BLOCK + MAX_RADIUS];
        let mut best = [S::Real::ZERO; BLOCK];
        let mut pair = [S::Real::ZERO; BLOCK];
        for start in (0..count).step_by(BLOCK) {
            let end = (start + BLOCK).min(count);
            let len = end - start;
            let (best, pair, partner) = (&mut best[..len], &mut pair[..len], &mut partner[start..end]);
            best.fill(S::Real::INFINITY);
            pair.fill(S::Real::INFINITY);
            partner.fill(0);
            for distance in 1..=radius.min(count - 1) {
                // Pairs (i, i + distance) of which at least one lies in the block.
                let first = start.saturating_sub(distance);
                let last = end.min(count - distance);
                if first >= last {
                    continue;
                }
                self.pair_areas(first, distance, &mut area[..last - first]);
                let forward = last.saturating_sub(start);
                if forward > 0 {
                    let area = &area[start - first..][..forward];
                    keep_smaller(&mut best[..forward], &mut partner[..forward], area, distance as i32);
                }
                let skipped = first + distance - start;
                let backward = len - skipped;
                let behind = &area[..backward];
                keep_smaller(&mut best[skipped..], &mut partner[skipped..], behind, -(distance as i32));
                if distance == 1 {
                    for k in 0..len {
                        // The lower cluster of the pair (2k, 2k + 1).
                        let lower = (start + k) & !1;
                        if lower >= first && lower < last {
                            pair[k] = area[lower - first];
                        }
                    }
                }
            }
            for k in 0..len {
                if pair[k] == best[k] {
                    partner[k] = if (start + k).is_multiple_of(2) { 1 } else { -1 };
                }
            }
        }
    }

    /// The surfaces of the pairs `(first + k, first + k + distance)`.
    #[inline(always)]
    fn pair_areas(&self, first: usize, distance: usize, area: &mut [S::Real]) {
        let mut product = [S::Real::ZERO; BLOCK + MAX_RADIUS];
        let len = area.len();
        let product = &mut product[..len];
        for a in 0..N {
            let (min, max) = (&self.min[a][first..][..len], &self.max[a][first..][..len]);
            let (far_min, far_max) = (&self.min[a][first + distance..][..len], &self.max[a][first + distance..][..len]);
            if a == 0 {
                for k in 0..len {
                    product[k] = S::extent(lesser(min[k], far_min[k]), greater(max[k], far_max[k]));
                    area[k] = S::Real::ONE;
                }
            } else {
                for k in 0..len {
                    let extent = S::extent(lesser(min[k], far_min[k]), greater(max[k], far_max[k]));
                    area[k] = area[k] * extent + product[k];
                    product[k] = product[k] * extent;
                }
            }
        }
    }

    /// Joins every two that chose each other; a joined cluster takes the place of the first. Returns how many are left,
    /// which now lie in front.
    fn join_partners(&mut self, draft: &mut Draft, partner: &[i32]) -> usize {
        let mut left = 0;
        for i in 0..partner.len() {
            let offset = partner[i];
            let other = (i as isize + offset as isize) as usize;
            let mutual = offset != 0 && partner[other] == -offset;
            if mutual && offset < 0 {
                continue;
            }
            let mut part = self.get(i);
            if mutual {
                let other = self.get(other);
                part = Part { bounds: part.bounds.union(&other.bounds), child: draft.join(part.child, other.child) };
            }
            self.set(left, part);
            left += 1;
        }
        left
    }
}

/// Where `area` is smaller than the best so far, it is the best, and `offset` leads to the partner. Without branches: which
/// way they go is chance.
#[inline(always)]
fn keep_smaller<R: Real>(best: &mut [R], partner: &mut [i32], area: &[R], offset: i32) {
    let len = best.len();
    let (partner, area) = (&mut partner[..len], &area[..len]);
    for k in 0..len {
        let smaller = -i32::from(area[k] < best[k]);
        best[k] = lesser(area[k], best[k]);
        partner[k] = (offset & smaller) | (partner[k] & !smaller);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clusters(boxes: &[Aabb<f32, 3>]) -> Clusters<f32, 3> {
        Clusters::of(&(0..).zip(boxes.iter().copied()).collect::<Vec<_>>())
    }

    #[test]
    fn partners_are_those_of_a_plain_search() {
        let mut state = 3u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f32
        };
        let boxes: Vec<_> = (0..700)
            .map(|_| {
                let at = [random(), random(), random()];
                Aabb::new(at, at.map(|c| c + random()))
            })
            .collect();
        let c = clusters(&boxes);
        for radius in [1, 2, 6, 32] {
            let mut partner = vec![0; boxes.len()];
            c.find_partners(boxes.len(), radius, &mut partner);
            for i in 0..boxes.len() {
                let around = (i.saturating_sub(radius)..(i + radius + 1).min(boxes.len())).filter(|&j| j != i);
                let area = |j: usize| boxes[i].union(&boxes[j]).half_area();
                let least = around.map(area).fold(f32::INFINITY, f32::min);
                assert_eq!(area((i as i32 + partner[i]) as usize), least, "cluster {i}, radius {radius}");
            }
        }
    }

    #[test]
    fn equal_boxes_are_joined_two_by_two() {
        let c = clusters(&[Aabb::new([0.0; 3], [1.0; 3]); 301]);
        let mut partner = vec![0; 301];
        c.find_partners(301, 6, &mut partner);
        assert!((0..300).all(|i| partner[i] == if i % 2 == 0 { 1 } else { -1 }));
    }
}
