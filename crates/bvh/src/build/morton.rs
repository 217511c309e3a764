//! Boxes in the order of a Morton curve through their centres.

use crate::aabb::Aabb;
use crate::scalar::{Real, Scalar, greater, lesser};

/// Bits of the high part of a code, which is sorted by counting; runs of equal high parts are sorted by the low part.
const HIGH_BITS: u32 = 32;
/// Bits that one counting pass sorts by.
const DIGIT: u32 = 11;

/// The indices of the boxes, sorted by the Morton codes of their centres (63 bits), ties by index.
pub(crate) fn order<S: Scalar, const N: usize>(
    count: usize,
    bounds: impl Fn(usize) -> Aabb<S, N>,
) -> impl ExactSizeIterator<Item = usize> {
    let grid = Grid::new(count, &bounds);
    let high_half = |code: u64| code >> (63 - HIGH_BITS) << 32;
    let mut keys: Vec<u64> = (0..count).map(|i| high_half(grid.code(&bounds(i))) | i as u64).collect();
    sort_by_high_half(&mut keys);

    // Where centres crowd, the high parts are the same: sort such a run by the whole code.
    for run in keys.chunk_by_mut(|a, b| a >> 32 == b >> 32) {
        if run.len() > 1 {
            run.sort_by_cached_key(|&key| (grid.code(&bounds(index(key))), key));
        }
    }
    keys.into_iter().map(index)
}

/// The lower half of a key.
#[inline(always)]
fn index(key: u64) -> usize {
    (key & u64::from(u32::MAX)) as usize
}

/// A lattice over the centres of all boxes that are not unbounded; those are clipped to it.
struct Grid<S: Scalar, const N: usize> {
    clip: Aabb<S, N>,
    any_capped: bool,
    low: [S::Real; N],
    scale: [S::Real; N],
    spread: [u64; 256],
}

impl<S: Scalar, const N: usize> Grid<S, N> {
    const BITS: u32 = if 63 / N as u32 > 24 { 24 } else { 63 / N as u32 };

    fn new(count: usize, bounds: &impl Fn(usize) -> Aabb<S, N>) -> Self {
        let mut clip = Aabb::EMPTY;
        let mut any_capped = false;
        let mut low = [S::Real::INFINITY; N];
        let mut high = [S::Real::ZERO - S::Real::INFINITY; N];
        for i in 0..count {
            let b = bounds(i);
            if b.is_capped() {
                any_capped = true;
                continue;
            }
            clip = clip.union(&b);
            let centre = b.centre2();
            for a in 0..N {
                low[a] = lesser(low[a], centre[a]);
                high[a] = greater(high[a], centre[a]);
            }
        }
        let cells = S::Real::from_f64(f64::from((1u32 << Self::BITS) - 1));
        let mut scale = [S::Real::ZERO; N];
        for a in 0..N {
            let extent = high[a] - low[a];
            if extent > S::Real::ZERO && extent < S::Real::INFINITY {
                scale[a] = cells * extent.recip();
            }
        }
        Self { clip, any_capped, low, scale, spread: spread_table(N as u32) }
    }

    #[inline(always)]
    fn code(&self, b: &Aabb<S, N>) -> u64 {
        let centre = if self.any_capped && b.is_capped() { b.centre2_in(&self.clip) } else { b.centre2() };
        let mut code = 0;
        for a in 0..N {
            // Saturates, and is 0 for NaN, which an infinite product may give.
            let cell = ((centre[a] - self.low[a]) * self.scale[a]).to_u32().min((1 << Self::BITS) - 1);
            let low = self.spread[(cell & 255) as usize];
            let middle = self.spread[(cell >> 8 & 255) as usize];
            let top = self.spread[(cell >> 16) as usize];
            code |= (low | middle << (8 * N) | top.checked_shl(16 * N as u32).unwrap_or(0)) << a;
        }
        // The top bit of the code at bit 62, whatever the number of bits.
        code << (63 - Self::BITS * N as u32)
    }
}

/// The bits of a byte, `stride` apart.
fn spread_table(stride: u32) -> [u64; 256] {
    let mut table = [0; 256];
    for (byte, spread) in table.iter_mut().enumerate() {
        for bit in 0..8 {
            *spread |= ((byte >> bit & 1) as u64).checked_shl(bit * stride).unwrap_or(0);
        }
    }
    table
}

/// A stable counting sort by the upper 32 bits, least significant digit first.
fn sort_by_high_half(keys: &mut Vec<u64>) {
    const BUCKETS: usize = 1 << DIGIT;
    if keys.len() < BUCKETS {
        keys.sort_unstable();
        return;
    }
    let shifts = [32, 32 + DIGIT, 32 + 2 * DIGIT];
    let mut counts = [[0u32; BUCKETS]; 3];
    for &key in keys.iter() {
        for (count, shift) in counts.iter_mut().zip(shifts) {
            count[digit(key, shift)] += 1;
        }
    }
    let mut sorted = vec![0u64; keys.len()];
    for (count, shift) in counts.iter_mut().zip(shifts) {
        if count[digit(keys[0], shift)] as usize == keys.len() {
            continue;
        }
        let mut start = 0;
        for bucket in count.iter_mut() {
            start += core::mem::replace(bucket, start);
        }
        for &key in keys.iter() {
            let at = &mut count[digit(key, shift)];
            sorted[*at as usize] = key;
            *at += 1;
        }
        core::mem::swap(keys, &mut sorted);
    }
}

#[inline(always)]
fn digit(key: u64, shift: u32) -> usize {
    (key >> shift) as usize & ((1 << DIGIT) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point<const N: usize>(p: [f32; N]) -> Aabb<f32, N> {
        Aabb::new(p, p)
    }

    #[test]
    fn the_curve_visits_the_corners_of_a_cube_in_the_order_of_their_bits() {
        let corner = |i: usize| point([(i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32]);
        let shuffled = [5, 2, 7, 0, 3, 6, 1, 4];
        let order = order(8, |i| corner(shuffled[i]));
        assert_eq!(order.map(|i| shuffled[i]).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6, 7]);
    }

    #[test]
    fn counting_and_comparing_agree() {
        let mut state = 7u64;
        let mut keys: Vec<u64> = (0..5000)
            .map(|i| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (state >> 20) << 32 | i
            })
            .collect();
        let mut expected = keys.clone();
        expected.sort();
        sort_by_high_half(&mut keys);
        assert_eq!(keys, expected);
    }

    #[test]
    fn crowded_centres_are_told_apart_by_the_low_half() {
        // One box far away leaves the others a 500th of the curve's length.
        let boxes: Vec<_> =
            (0..500).rev().map(|i| point([i as f32 * 0.001, 0.0, 0.0])).chain([point([900.0; 3])]).collect();
        let sorted = order(boxes.len(), |i| boxes[i]);
        let xs: Vec<_> = sorted.map(|i| boxes[i].min[0]).collect();
        assert!(xs.windows(2).filter(|pair| pair[0] <= pair[1]).count() > 490);
    }

    #[test]
    fn unbounded_boxes_do_not_spoil_the_lattice() {
        let mut boxes: Vec<_> = (0..64).map(|i| point([i as f32, 0.0])).collect();
        boxes.push(Aabb::new([f32::NEG_INFINITY, 0.0], [f32::INFINITY, 1.0]));
        let sorted = order(boxes.len(), |i| boxes[i]);
        let xs: Vec<_> = sorted.filter(|&i| i < 64).collect();
        assert_eq!(xs, (0..64).collect::<Vec<_>>());
    }
}
