//! The coordinates that a box may have, and the real numbers in which its surface is measured.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Mul, Sub};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
    impl Sealed for i32 {}
    impl Sealed for i64 {}
}

/// A coordinate: `f32`, `f64`, `i32` or `i64`.
///
/// Bounds are kept and united in this type, so they are exact. Surfaces, ray distances and centres are [`Real`]s.
pub trait Scalar: Copy + Debug + Default + PartialEq + PartialOrd + Send + Sync + sealed::Sealed + 'static {
    /// The type of surfaces, centres and ray distances: `f32` for `f32`, `f64` for the others.
    type Real: Real;

    /// The lowest coordinate, minus infinity where there is one: the neutral element of the maximum.
    const LOWEST: Self;
    /// The highest coordinate, infinity where there is one: the neutral element of the minimum.
    const HIGHEST: Self;

    /// `max - min`, never more than [`Real::EXTENT_CAP`]: an unbounded box has a large but finite surface, so that
    /// differences of surfaces stay numbers.
    fn extent(min: Self, max: Self) -> Self::Real;

    /// The nearest real number.
    fn to_real(self) -> Self::Real;

    /// The nearest `f64`.
    fn to_f64(self) -> f64;
}

/// A real number: `f32` or `f64`.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Send
    + Sync
    + sealed::Sealed
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 1/2.
    const HALF: Self;
    /// Positive infinity.
    const INFINITY: Self;
    /// The extent that stands for "unbounded". In up to four dimensions the surface of a box of this extent, summed over
    /// a path of the tree, is still finite.
    const EXTENT_CAP: Self;
    /// 1 + 2 gamma(3): the far distance of a slab test times this is never too near (Ize, "Robust BVH Ray Traversal",
    /// JCGT 2013, equation 6).
    const FAR_ROUNDING: Self;

    /// The value as an `f64`.
    fn to_f64(self) -> f64;
    /// The nearest value of this type.
    fn from_f64(value: f64) -> Self;
    /// 1 / self.
    fn recip(self) -> Self;
    /// The integer part, 0 for NaN and for negative values, saturated above.
    fn to_u32(self) -> u32;
}

macro_rules! real {
    ($t:ty, $cap:expr, $rounding:expr) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const HALF: Self = 0.5;
            const INFINITY: Self = <$t>::INFINITY;
            const EXTENT_CAP: Self = $cap;
            const FAR_ROUNDING: Self = $rounding;

            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as $t
            }
            #[inline(always)]
            fn recip(self) -> Self {
                1.0 / self
            }
            #[inline(always)]
            fn to_u32(self) -> u32 {
                self as u32
            }
        }
    };
}
real!(f32, 1.0e12, 1.0 + 6.0 * (f32::EPSILON * 0.5) * 1.01);
real!(f64, 1.0e60, 1.0 + 6.0 * (f64::EPSILON * 0.5) * 1.01);

macro_rules! float_scalar {
    ($t:ty) => {
        impl Scalar for $t {
            type Real = $t;
            const LOWEST: Self = <$t>::NEG_INFINITY;
            const HIGHEST: Self = <$t>::INFINITY;

            #[inline(always)]
            fn extent(min: Self, max: Self) -> $t {
                lesser(max - min, <$t as Real>::EXTENT_CAP)
            }
            #[inline(always)]
            fn to_real(self) -> $t {
                self
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
        }
    };
}
float_scalar!(f32);
float_scalar!(f64);

macro_rules! integer_scalar {
    ($t:ty) => {
        impl Scalar for $t {
            type Real = f64;
            const LOWEST: Self = <$t>::MIN;
            const HIGHEST: Self = <$t>::MAX;

            #[inline(always)]
            fn extent(min: Self, max: Self) -> f64 {
                max as f64 - min as f64
            }
            #[inline(always)]
            fn to_real(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
        }
    };
}
integer_scalar!(i32);
integer_scalar!(i64);

/// The lesser of two values; `b` where they cannot be compared. One instruction for floats, unlike `f32::min`.
#[inline(always)]
pub(crate) fn lesser<T: Copy + PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The greater of two values; `b` where they cannot be compared.
#[inline(always)]
pub(crate) fn greater<T: Copy + PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unbounded_extent_is_finite() {
        assert_eq!(f32::extent(f32::NEG_INFINITY, f32::INFINITY), <f32 as Real>::EXTENT_CAP);
        assert_eq!(f64::extent(0.0, f64::INFINITY), <f64 as Real>::EXTENT_CAP);
        assert_eq!(f32::extent(-f32::MAX, f32::MAX), <f32 as Real>::EXTENT_CAP);
    }

    #[test]
    fn integer_extents_do_not_overflow() {
        assert_eq!(i32::extent(i32::MIN, i32::MAX), 4_294_967_295.0);
        assert_eq!(i64::extent(i64::MIN, i64::MAX), 18_446_744_073_709_551_616.0);
    }
}
