//! From raw coordinates to the `f32` boxes of the root BVH.

use orthant_bvh::Aabb;
use orthant_resident::world::ray::UNITS_PER_RAW;
use orthant_world::Aabb4;

/// The greatest `f32` that is not above the integer.
fn round_down(value: i64) -> f32 {
    let nearest = value as f32;
    // Differences of coordinates are below 2^63, where a float that was rounded up is an integer still.
    if nearest as i128 > i128::from(value) { nearest.next_down() } else { nearest }
}

/// The least `f32` that is not below the integer.
fn round_up(value: i64) -> f32 {
    let nearest = value as f32;
    if (nearest as i128) < i128::from(value) { nearest.next_up() } else { nearest }
}

/// A box in units relative to the origin, rounded outwards. Coordinates are below 2^61 in magnitude, so that no difference
/// overflows; scaling by a power of two rounds nothing.
pub(super) fn outward(bounds: &Aabb4, origin: [i64; 4]) -> Aabb<f32, 4> {
    let (min, max) = (bounds.min_raw(), bounds.max_raw());
    Aabb::new(
        std::array::from_fn(|a| round_down(min[a] - origin[a]) * UNITS_PER_RAW),
        std::array::from_fn(|a| round_up(max[a] - origin[a]) * UNITS_PER_RAW),
    )
}

/// The box in raw coordinates of bounds of nodes, which hold it: rounded outwards. `None` for the empty box.
pub(super) fn raw_about(bounds: &Aabb<f32, 4>, origin: [i64; 4]) -> Option<Aabb4> {
    let raw = |units: f32, a: usize| (f64::from(units) * 65_536.0) as i128 + i128::from(origin[a]);
    let clamp = |raw: i128, a: usize| {
        let (low, high) = (Aabb4::SPACE.min_raw()[a], Aabb4::SPACE.max_raw()[a]);
        raw.clamp(i128::from(low), i128::from(high)) as i64
    };
    if (0..4).any(|a| bounds.min[a] > bounds.max[a]) {
        return None;
    }
    let min = std::array::from_fn(|a| clamp(raw(bounds.min[a], a) - 1, a));
    Aabb4::from_raw(min, std::array::from_fn(|a| clamp(raw(bounds.max[a], a) + 1, a))).ok()
}

/// The middle of a box, in whole units.
pub(super) fn middle(bounds: &Aabb4) -> [i64; 4] {
    let (min, max) = (bounds.min_raw(), bounds.max_raw());
    std::array::from_fn(|a| ((min[a] >> 1) + (max[a] >> 1)) >> 16 << 16)
}

/// Two halves of a box, the lower first, cut across its longest axis near the middle, at the coordinate that is a multiple of
/// the greatest power of two: there chunks and blocks begin. `None` for the smallest box there is.
pub(super) fn halves(bounds: &Aabb4) -> Option<[Aabb4; 2]> {
    let extent = bounds.extent_raw();
    let axis = (0..4).max_by_key(|&a| extent[a]).unwrap_or(0);
    let (mut low, mut high) = (bounds.min_raw(), bounds.max_raw());
    if extent[axis] < 2 {
        return None;
    }
    let quarter = (extent[axis] / 4).max(1);
    let (first, last) = (low[axis] + quarter, high[axis] - quarter);
    let at = most_aligned(first, last);
    (high[axis], low[axis]) = (at, at);
    let halves = [Aabb4::from_raw(bounds.min_raw(), high), Aabb4::from_raw(low, bounds.max_raw())];
    let [Ok(lower), Ok(upper)] = halves else { unreachable!("the cut is strictly within the box") };
    Some([lower, upper])
}

/// The multiple of the greatest power of two from `first` to `last`, both included.
fn most_aligned(first: i64, last: i64) -> i64 {
    let differ = (first - 1) ^ last;
    let log2 = 63 - differ.leading_zeros();
    last >> log2 << log2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_rounded_outwards_however_far_they_are() {
        for at in [0, 1, -1, (1 << 24) + 1, -(1 << 24) - 1, (1 << 61) - 1, -(1 << 61), (1 << 40) + 12_345] {
            let raw = [at.min((1 << 61) - 1); 4];
            let bounds = Aabb4::from_raw(raw, raw.map(|c| c + 1)).unwrap();
            for origin in [[0; 4], [-(1 << 60); 4], [1 << 60; 4]] {
                let out = outward(&bounds, origin);
                let exact = |c: i64, o: i64| i128::from(c) - i128::from(o);
                let lower = f64::from(out.min[0]) * 65_536.0;
                let upper = f64::from(out.max[0]) * 65_536.0;
                assert!(lower as i128 <= exact(raw[0], origin[0]), "{at} {origin:?}");
                assert!(upper as i128 >= exact(raw[0] + 1, origin[0]), "{at} {origin:?}");
            }
        }
    }

    #[test]
    fn what_a_float_can_say_is_not_widened() {
        let bounds = Aabb4::from_ints([-3, 0, 1, 2], [1, 2, 3, 4]).unwrap();
        let out = outward(&bounds, [1 << 16; 4]);
        assert_eq!((out.min, out.max), ([-4.0, -1.0, 0.0, 1.0], [0.0, 1.0, 2.0, 3.0]));
    }

    #[test]
    fn boxes_are_cut_where_large_cells_begin() {
        let bounds = Aabb4::from_ints([-100, 0, 0, 0], [-3, 1, 1, 1]).unwrap();
        let [lower, upper] = halves(&bounds).unwrap();
        assert_eq!(lower.max_raw()[0], -64 << 16);
        assert_eq!((upper.min_raw()[0], upper.max_raw()[0]), (-64 << 16, -3 << 16));
        let mut smallest = Aabb4::SPACE;
        let mut cuts = 0;
        while let Some([_, upper]) = halves(&smallest) {
            smallest = upper;
            cuts += 1;
        }
        assert_eq!(smallest.extent_raw(), [1; 4]);
        assert!(cuts < 700);
    }
}
