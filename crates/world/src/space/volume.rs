//! Volumes in four dimensions, exactly: up to 252 bits.

use super::aabb::Aabb4;

/// A volume in steps of 1/65,536 to the fourth power.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Volume {
    high: u128,
    low: u128,
}

impl Volume {
    pub fn of(bounds: &Aabb4) -> Self {
        let [x, y, z, w] = bounds.extent_raw().map(|extent| extent as u128);
        // Extents are below 2^64, so neither product overflows.
        Self::product(x * y, z * w)
    }

    /// Schoolbook multiplication by halves.
    fn product(a: u128, b: u128) -> Self {
        const HALF: u128 = u64::MAX as u128;
        let (a1, a0, b1, b0) = (a >> 64, a & HALF, b >> 64, b & HALF);
        let low = a0 * b0;
        let middle = a1 * b0 + (low >> 64);
        let (middle_high, middle_low) = (middle >> 64, middle & HALF);
        let cross = a0 * b1 + middle_low;
        Self { high: a1 * b1 + middle_high + (cross >> 64), low: (cross << 64) | (low & HALF) }
    }

    /// The sum. Disjoint boxes of one space never exceed the volume of that space.
    pub fn plus(self, other: Self) -> Self {
        let (low, carry) = self.low.overflowing_add(other.low);
        Self { high: self.high + other.high + u128::from(carry), low }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_beyond_128_bits_are_exact() {
        let whole = Volume::of(&Aabb4::SPACE);
        assert_eq!(whole, Volume { high: 1 << 120, low: 0 });
        let (left, right) = Aabb4::SPACE.split(0, 12_345);
        assert_eq!(Volume::of(&left).plus(Volume::of(&right)), whole);
        let (a, b) = right.split(2, -7);
        assert_eq!(Volume::of(&left).plus(Volume::of(&a)).plus(Volume::of(&b)), whole);
        assert_ne!(Volume::of(&left), Volume::of(&right));
    }
}
