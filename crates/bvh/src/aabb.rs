//! Axis-aligned boxes of any dimension.

use crate::error::BvhError;
use crate::scalar::{Real, Scalar, greater, lesser};

/// A closed axis-aligned box: the points `p` with `min[a] <= p[a] <= max[a]` on every axis `a`.
///
/// A box may have no extent on any number of axes. Float boxes may be unbounded: `min` minus infinity, `max` infinity.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb<S, const N: usize> {
    /// The lower corner.
    pub min: [S; N],
    /// The upper corner.
    pub max: [S; N],
}

impl<S: Scalar, const N: usize> Aabb<S, N> {
    /// The box that holds nothing: neutral in [`Self::union`].
    pub const EMPTY: Self = Self { min: [S::HIGHEST; N], max: [S::LOWEST; N] };

    /// The box between two corners. Whether `min <= max` is checked by the tree that takes the box.
    #[inline]
    pub const fn new(min: [S; N], max: [S; N]) -> Self {
        Self { min, max }
    }

    /// The first axis on which this is no box: `min > max`, a NaN, or an end at the wrong infinity.
    #[inline]
    pub fn bad_axis(&self) -> Option<usize> {
        let mut good = true;
        for a in 0..N {
            good &= axis_is_good(self.min[a], self.max[a]);
        }
        if good {
            return None;
        }
        (0..N).find(|&a| !axis_is_good(self.min[a], self.max[a]))
    }

    /// The error of a box that a tree does not take.
    pub(crate) fn check(&self, item: u32) -> Result<(), BvhError> {
        match self.bad_axis() {
            None => Ok(()),
            Some(axis) => {
                Err(BvhError::BadBounds { item, axis, min: self.min[axis].to_f64(), max: self.max[axis].to_f64() })
            }
        }
    }

    /// The smallest box that holds both.
    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        let mut both = *self;
        for a in 0..N {
            both.min[a] = lesser(self.min[a], other.min[a]);
            both.max[a] = greater(self.max[a], other.max[a]);
        }
        both
    }

    /// Whether every point of `other` lies in this box.
    #[inline(always)]
    pub fn contains(&self, other: &Self) -> bool {
        let mut inside = true;
        for a in 0..N {
            inside &= self.min[a] <= other.min[a] && other.max[a] <= self.max[a];
        }
        inside
    }

    /// Whether the point lies in the closed box.
    #[inline(always)]
    pub fn contains_point(&self, point: &[S; N]) -> bool {
        let mut inside = true;
        for a in 0..N {
            inside &= self.min[a] <= point[a] && point[a] <= self.max[a];
        }
        inside
    }

    /// Whether the closed boxes share a point; touching counts.
    #[inline(always)]
    pub fn overlaps(&self, other: &Self) -> bool {
        let mut overlap = true;
        for a in 0..N {
            overlap &= self.min[a] <= other.max[a] && other.min[a] <= self.max[a];
        }
        overlap
    }

    /// Half of the surface: the sum, over the axes, of the product of the other extents. In 3D half the area, in 4D half
    /// the volume of the bounding cells. A ray hits a convex body with a probability in proportion to it.
    #[inline(always)]
    pub fn half_area(&self) -> S::Real {
        let mut extent = [S::Real::ZERO; N];
        for a in 0..N {
            extent[a] = S::extent(self.min[a], self.max[a]);
        }
        half_area(&extent)
    }

    /// [`Self::half_area`] of the union, without making the union.
    #[inline(always)]
    pub fn union_half_area(&self, other: &Self) -> S::Real {
        let mut extent = [S::Real::ZERO; N];
        for a in 0..N {
            extent[a] = S::extent(lesser(self.min[a], other.min[a]), greater(self.max[a], other.max[a]));
        }
        half_area(&extent)
    }

    /// [`Self::half_area`] in `f64`, for sums over a whole tree.
    pub fn half_area_f64(&self) -> f64 {
        let mut extent = [0.0; N];
        for a in 0..N {
            extent[a] = lesser(self.max[a].to_f64() - self.min[a].to_f64(), S::Real::EXTENT_CAP.to_f64());
        }
        half_area(&extent)
    }

    /// Whether the box has an extent that was capped: it is unbounded, or as good as.
    #[inline(always)]
    pub(crate) fn is_capped(&self) -> bool {
        (0..N).any(|a| S::extent(self.min[a], self.max[a]) >= S::Real::EXTENT_CAP)
    }

    /// Twice the centre, with the box clipped to `clip` first.
    #[inline(always)]
    pub(crate) fn centre2_in(&self, clip: &Self) -> [S::Real; N] {
        let mut centre = [S::Real::ZERO; N];
        for a in 0..N {
            let min = lesser(greater(self.min[a], clip.min[a]), clip.max[a]);
            let max = greater(lesser(self.max[a], clip.max[a]), clip.min[a]);
            centre[a] = min.to_real() + max.to_real();
        }
        centre
    }

    /// Twice the centre.
    #[inline(always)]
    pub(crate) fn centre2(&self) -> [S::Real; N] {
        let mut centre = [S::Real::ZERO; N];
        for a in 0..N {
            centre[a] = self.min[a].to_real() + self.max[a].to_real();
        }
        centre
    }
}

/// NaN fails the first comparison; an end at the wrong infinity would make extents and distances NaN.
#[inline(always)]
fn axis_is_good<S: Scalar>(min: S, max: S) -> bool {
    let float_infinity = S::extent(S::LOWEST, S::HIGHEST) >= S::Real::EXTENT_CAP;
    (min <= max) & !(float_infinity & ((min == S::HIGHEST) | (max == S::LOWEST)))
}

/// The elementary symmetric polynomial of degree N - 1: `sum` holds the products that miss one extent, `product` all.
#[inline(always)]
fn half_area<R: Real, const N: usize>(extent: &[R; N]) -> R {
    const { assert!(N >= 2, "a box on a line has no surface to weigh") };
    let (mut sum, mut product) = (R::ONE, extent[0]);
    for a in 1..N {
        sum = sum * extent[a] + product;
        product = product * extent[a];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_area_sums_the_products_of_the_other_extents() {
        assert_eq!(Aabb::new([0, 0], [2, 3]).half_area(), 5.0);
        assert_eq!(Aabb::new([0.0f32; 3], [2.0, 3.0, 5.0]).half_area(), 6.0 + 15.0 + 10.0);
        assert_eq!(Aabb::new([0i64; 4], [2, 3, 5, 7]).half_area(), 105.0 + 70.0 + 42.0 + 30.0);
    }

    #[test]
    fn inverted_nan_and_misplaced_infinities_are_no_boxes() {
        assert_eq!(Aabb::new([0.0f32, 1.0], [1.0, 0.0]).bad_axis(), Some(1));
        assert_eq!(Aabb::new([f64::NAN, 1.0], [1.0, 2.0]).bad_axis(), Some(0));
        assert_eq!(Aabb::new([0.0, 1.0], [1.0, f64::NAN]).bad_axis(), Some(1));
        assert_eq!(Aabb::new([f32::INFINITY, 0.0], [f32::INFINITY, 0.0]).bad_axis(), Some(0));
        assert_eq!(Aabb::new([f32::NEG_INFINITY, 0.0], [f32::INFINITY, 0.0]).bad_axis(), None);
        assert_eq!(Aabb::new([i32::MAX, 0], [i32::MAX, 0]).bad_axis(), None);
    }

    #[test]
    fn the_empty_box_is_neutral_in_a_union() {
        let cube = Aabb::new([-1i32; 3], [4; 3]);
        assert_eq!(cube.union(&Aabb::EMPTY), cube);
        assert_eq!(Aabb::EMPTY.union(&cube), cube);
    }

    #[test]
    fn the_surface_of_an_unbounded_slab_is_finite() {
        let slab = Aabb::new(
            [f32::NEG_INFINITY, -8.0, f32::NEG_INFINITY, f32::NEG_INFINITY],
            [f32::INFINITY, 0.0, f32::INFINITY, f32::INFINITY],
        );
        assert!(slab.half_area().is_finite());
        assert!(slab.half_area_f64().is_finite());
    }
}
