//! Top-down splits by the surface area heuristic in bins: Wald, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies", IEEE Symposium on Interactive Ray Tracing 2007, on every axis.

use super::draft::{Draft, Part};
use crate::aabb::Aabb;
use crate::node::{Child, NONE};
use crate::scalar::{Real, Scalar, greater, lesser};

/// Bins on each axis.
const BINS: usize = 16;

/// A range of the parts that becomes a child of a join.
struct Task {
    start: usize,
    end: usize,
    /// The join, and which of its children; [`NONE`] for the top.
    parent: u32,
    slot: usize,
    /// Nodes that may still lie above a part.
    levels: u32,
}

/// Builds over at least one part. Splits of more than `sample` parts are found from about that many of them, evenly spread. At most `levels` nodes lie above any part, which has to be at least the logarithm of
/// their count: where a split would leave one side too few levels, the halves are made equal.
pub(crate) fn build<S: Scalar, const N: usize>(
    draft: &mut Draft,
    parts: &mut [Part<S, N>],
    levels: u32,
    sample: usize,
) -> Child {
    draft.joins.reserve(parts.len().saturating_sub(1));
    let mut top = Child::EMPTY;
    let mut tasks = vec![Task { start: 0, end: parts.len(), parent: NONE, slot: 0, levels }];
    while let Some(Task { start, end, parent, slot, levels }) = tasks.pop() {
        let range = &mut parts[start..end];
        let child = if let [part] = range {
            part.child
        } else {
            let join = draft.join(Child::EMPTY, Child::EMPTY);
            let levels = levels.saturating_sub(1);
            let middle = start + split(range, levels, sample);
            tasks.push(Task { start: middle, end, parent: join.0, slot: 1, levels });
            tasks.push(Task { start, end: middle, parent: join.0, slot: 0, levels });
            join
        };
        if parent == NONE {
            top = child;
        } else {
            draft.joins[parent as usize][slot] = child;
        }
    }
    top
}

/// Orders the parts so that those of the first child come first, and returns their count.
fn split<S: Scalar, const N: usize>(parts: &mut [Part<S, N>], levels: u32, sample: usize) -> usize {
    if parts.len() == 2 {
        return 1;
    }
    // Odd, as what lies in rows has powers of two in them.
    let stride = parts.len().div_ceil(sample.max(2)) | 1;
    let centres = Centres::of(parts, stride);
    if let Some(plane) = best_plane(parts, &centres, stride) {
        let left = partition(parts, |part| centres.bin(part, plane.axis) < plane.bin);
        let fits = |count: usize| count.next_power_of_two().trailing_zeros() <= levels;
        if fits(left) && fits(parts.len() - left) {
            return left;
        }
    }
    let left = parts.len() / 2;
    if let Some(axis) = centres.longest_axis() {
        parts.select_nth_unstable_by(left, |a, b| {
            let key = |part: &Part<S, N>| centres.centre(part)[axis];
            key(a).partial_cmp(&key(b)).unwrap_or(core::cmp::Ordering::Equal)
        });
    }
    left
}

/// Where the centres lie, unbounded boxes clipped to the others.
struct Centres<S: Scalar, const N: usize> {
    clip: Aabb<S, N>,
    low: [S::Real; N],
    extent: [S::Real; N],
    /// Bins per unit.
    scale: [S::Real; N],
}

impl<S: Scalar, const N: usize> Centres<S, N> {
    /// Of every `stride`-th part. Those of other parts may lie outside; they are in the bins at the ends.
    fn of(parts: &[Part<S, N>], stride: usize) -> Self {
        let mut clip = Aabb::EMPTY;
        let mut capped = false;
        let mut low = [S::Real::INFINITY; N];
        let mut high = [S::Real::ZERO - S::Real::INFINITY; N];
        let mut include = |centre: [S::Real; N]| {
            for a in 0..N {
                low[a] = lesser(low[a], centre[a]);
                high[a] = greater(high[a], centre[a]);
            }
        };
        for part in parts.iter().step_by(stride) {
            if part.bounds.is_capped() {
                capped = true;
            } else {
                clip = clip.union(&part.bounds);
                include(part.bounds.centre2());
            }
        }
        if capped && clip != Aabb::EMPTY {
            for part in parts.iter().step_by(stride).filter(|part| part.bounds.is_capped()) {
                include(part.bounds.centre2_in(&clip));
            }
        }
        let bins = S::Real::from_f64(BINS as f64 * 0.999_999);
        let mut centres = Self { clip, low, extent: [S::Real::ZERO; N], scale: [S::Real::ZERO; N] };
        for a in 0..N {
            let extent = high[a] - low[a];
            if extent > S::Real::ZERO && extent < S::Real::INFINITY {
                centres.extent[a] = extent;
                centres.scale[a] = bins * extent.recip();
            }
        }
        centres
    }

    #[inline(always)]
    fn centre(&self, part: &Part<S, N>) -> [S::Real; N] {
        if part.bounds.is_capped() { part.bounds.centre2_in(&self.clip) } else { part.bounds.centre2() }
    }

    #[inline(always)]
    fn bin(&self, part: &Part<S, N>, axis: usize) -> usize {
        let at = (self.centre(part)[axis] - self.low[axis]) * self.scale[axis];
        (at.to_u32() as usize).min(BINS - 1)
    }

    /// `None` if all centres are the same.
    fn longest_axis(&self) -> Option<usize> {
        let mut longest = 0;
        for a in 1..N {
            if self.extent[a] > self.extent[longest] {
                longest = a;
            }
        }
        (self.extent[longest] > S::Real::ZERO).then_some(longest)
    }
}

/// Parts in bins below `bin` go to the first child.
struct Plane {
    axis: usize,
    bin: usize,
}

/// The plane between bins with the least sum of surface times count, by every `stride`-th part; `None` if all of their centres are
/// the same.
fn best_plane<S: Scalar, const N: usize>(
    parts: &[Part<S, N>],
    centres: &Centres<S, N>,
    stride: usize,
) -> Option<Plane> {
    let mut bounds = [[Aabb::EMPTY; BINS]; N];
    let mut counts = [[0u32; BINS]; N];
    let looked_at = parts.len().div_ceil(stride) as u32;
    for part in parts.iter().step_by(stride) {
        let centre = centres.centre(part);
        for a in 0..N {
            let at = (centre[a] - centres.low[a]) * centres.scale[a];
            let bin = (at.to_u32() as usize).min(BINS - 1);
            bounds[a][bin] = bounds[a][bin].union(&part.bounds);
            counts[a][bin] += 1;
        }
    }
    let mut best_cost = S::Real::INFINITY;
    let mut best = None;
    for axis in (0..N).filter(|&a| centres.extent[a] > S::Real::ZERO) {
        // `right[bin]`: surface times count of this bin and those above.
        let mut right = [S::Real::ZERO; BINS];
        let (mut all, mut count) = (Aabb::EMPTY, 0);
        for bin in (1..BINS).rev() {
            all = all.union(&bounds[axis][bin]);
            count += counts[axis][bin];
            right[bin] = weight::<S, N>(&all, count);
        }
        let (mut all, mut count) = (Aabb::EMPTY, 0);
        for bin in 1..BINS {
            all = all.union(&bounds[axis][bin - 1]);
            count += counts[axis][bin - 1];
            let cost = weight::<S, N>(&all, count) + right[bin];
            if count > 0 && count < looked_at && cost < best_cost {
                best_cost = cost;
                best = Some(Plane { axis, bin });
            }
        }
    }
    best
}

#[inline(always)]
fn weight<S: Scalar, const N: usize>(bounds: &Aabb<S, N>, count: u32) -> S::Real {
    if count == 0 { S::Real::ZERO } else { bounds.half_area() * S::Real::from_f64(f64::from(count)) }
}

/// Parts for which the predicate holds to the front. Returns their count.
fn partition<T>(parts: &mut [T], first: impl Fn(&T) -> bool) -> usize {
    let (mut left, mut right) = (0, parts.len());
    while left < right {
        if first(&parts[left]) {
            left += 1;
        } else {
            right -= 1;
            parts.swap(left, right);
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(item: u32, at: f64) -> Part<f64, 3> {
        Part { bounds: Aabb::new([at, 0.0, 0.0], [at + 1.0, 1.0, 1.0]), child: Child::leaf(item) }
    }

    #[test]
    fn two_heaps_are_split_between_them() {
        let mut parts: Vec<_> = (0..10).map(|i| leaf(i, f64::from(i % 2) * 100.0 + f64::from(i))).collect();
        let left = split(&mut parts, 64, usize::MAX);
        assert_eq!(left, 5);
        assert!(parts[..left].iter().all(|part| part.bounds.max[0] < 50.0));
    }

    /// Joins on the longest way down.
    fn height(draft: &Draft, top: Child) -> u32 {
        if top.is_node() {
            1 + draft.joins[top.0 as usize].map(|child| height(draft, child)).into_iter().max().unwrap_or(0)
        } else {
            0
        }
    }

    #[test]
    fn no_leaf_is_deeper_than_the_levels_given() {
        // Every split by surface takes one part off.
        let mut parts: Vec<_> = (0..64).map(|i| leaf(i, 4f64.powi(i as i32))).collect();
        let mut draft = Draft::default();
        let top = build(&mut draft, &mut parts.clone(), 64, usize::MAX);
        assert!(height(&draft, top) > 20);
        draft.joins.clear();
        let top = build(&mut draft, &mut parts, 7, usize::MAX);
        assert!(height(&draft, top) <= 7);
        assert_eq!(draft.joins.len(), 63);
    }

    #[test]
    fn equal_boxes_make_a_balanced_tree() {
        let mut parts: Vec<_> = (0..1024).map(|i| leaf(i, 0.0)).collect();
        let mut draft = Draft::default();
        let top = build(&mut draft, &mut parts, 64, usize::MAX);
        assert_eq!(height(&draft, top), 10);
    }

    #[test]
    fn a_split_by_a_sample_still_tells_heaps_apart_and_keeps_every_part() {
        let mut parts: Vec<_> = (0..1000).map(|i| leaf(i, f64::from(i % 2) * 5000.0 + f64::from(i))).collect();
        let left = split(&mut parts, 64, 64);
        assert_eq!(left, 500);
        let mut draft = Draft::default();
        build(&mut draft, &mut parts, 64, 16);
        assert_eq!(draft.joins.len(), 999);
        let mut leaves: Vec<u32> =
            draft.joins.iter().flatten().filter(|c| !c.is_node()).map(|c| c.item_bits()).collect();
        leaves.sort_unstable();
        assert_eq!(leaves, (0..1000).collect::<Vec<_>>());
    }
}
