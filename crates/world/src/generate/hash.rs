//! Hashes and noise in integers: the same on every machine.

/// The finaliser of SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
fn mix(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// 64 bits that depend on all of the numbers and their order.
pub fn hash<const N: usize>(seed: u64, numbers: [i64; N]) -> u64 {
    numbers.into_iter().fold(mix(seed ^ 0x9e37_79b9_7f4a_7c15), |state, number| {
        mix(state.wrapping_add(0x9e37_79b9_7f4a_7c15) ^ (number as u64))
    })
}

/// A number from `0` to `end`, excluded, of 32 of the bits.
pub fn below(bits: u32, end: u64) -> i64 {
    ((u64::from(bits) * end) >> 32) as i64
}

/// Weights have 16 binary digits.
const ONE: i64 = 1 << 16;

/// `3 t^2 - 2 t^3`, for t from 0 to 1 in 16 binary digits.
fn smooth(t: i64) -> i64 {
    let square = (t * t) >> 16;
    (square * (3 * ONE - 2 * t)) >> 16
}

fn mixed(a: i64, b: i64, t: i64) -> i64 {
    a + (((b - a) * t) >> 16)
}

/// Where a coordinate lies in the noise lattice of a period of `2^log2`: the cell, and the smoothed weight of the next.
fn place(at: i64, log2: u32) -> (i64, i64) {
    let within = at & ((1 << log2) - 1);
    (at >> log2, smooth(within << (16 - log2)))
}

/// Value noise in two dimensions, 0 to 65,535, of a period of `2^log2` units, `log2` at most 16.
pub fn noise2(seed: u64, at: [i64; 2], log2: u32) -> i64 {
    let [(x, tx), (z, tz)] = at.map(|c| place(c, log2));
    let corner = |dx: i64, dz: i64| (hash(seed, [x + dx, z + dz]) >> 48) as i64;
    mixed(mixed(corner(0, 0), corner(1, 0), tx), mixed(corner(0, 1), corner(1, 1), tx), tz)
}

/// Value noise in three dimensions over a brick of 16 x 16 x 16 places, x fastest, whose corner is at a multiple of 16.
/// The values of the lattice are hashed once for the brick.
pub struct Noise3 {
    log2: u32,
    side: usize,
    corners: Vec<i64>,
}

impl Noise3 {
    /// Of a period of `2^log2` units, `log2` at most 16.
    pub fn new(seed: u64, brick: [i64; 3], log2: u32) -> Self {
        let side = (16_usize >> log2.min(4)) + 1;
        let first = brick.map(|c| c >> log2);
        let corners = (0..side * side * side)
            .map(|i| {
                let at = [i % side, i / side % side, i / (side * side)];
                (hash(seed, std::array::from_fn::<_, 3, _>(|a| first[a] + at[a] as i64)) >> 48) as i64
            })
            .collect();
        Self { log2, side, corners }
    }

    /// The value, 0 to 65,535, at a place of the brick, given in units of the world.
    pub fn at(&self, brick: [i64; 3], place_in_brick: [usize; 3]) -> i64 {
        let axes: [(usize, i64); 3] = std::array::from_fn(|a| {
            let (cell, t) = place(brick[a] + place_in_brick[a] as i64, self.log2);
            ((cell - (brick[a] >> self.log2)) as usize, t)
        });
        let [(x, tx), (y, ty), (z, tz)] = axes;
        let corner = |dx, dy, dz| self.corners[(x + dx) + self.side * ((y + dy) + self.side * (z + dz))];
        let edge = |dy, dz| mixed(corner(0, dy, dz), corner(1, dy, dz), tx);
        mixed(mixed(edge(0, 0), edge(1, 0), ty), mixed(edge(0, 1), edge(1, 1), ty), tz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_every_machine() {
        // Written down once: a change would make every saved seed another world.
        assert_eq!(hash(0, [0, 0]), 2_558_736_989_570_252_433);
        assert_ne!(hash(1, [1, 2]), hash(1, [2, 1]));
    }

    #[test]
    fn noise_is_continuous_across_cells_and_bricks() {
        for log2 in [3, 5] {
            for x in -40..40 {
                let step = (noise2(7, [x, 3], log2) - noise2(7, [x + 1, 3], log2)).abs();
                assert!(step <= 65_536 * 3 / 2 / (1 << log2) + 2, "{step} at {x}");
            }
            let (left, right) = ([-16, 0, 32], [0, 0, 32]);
            let a = Noise3::new(9, left, log2).at(left, [15, 4, 5]);
            let b = Noise3::new(9, right, log2).at(right, [0, 4, 5]);
            assert!((a - b).abs() <= 65_536 * 3 / 2 / (1 << log2) + 2);
        }
    }
}
