//! Points and half-open boxes, with the algebra that splicing needs.

use super::fixed::Fixed;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A point: x, y (up), z, w.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
#[repr(transparent)]
pub struct Point4(pub [Fixed; 4]);

impl Point4 {
    /// The point with whole coordinates.
    pub const fn from_ints(at: [i32; 4]) -> Self {
        Self([Fixed::from_int(at[0]), Fixed::from_int(at[1]), Fixed::from_int(at[2]), Fixed::from_int(at[3])])
    }

    /// The coordinates in steps of 1/65,536.
    pub const fn raw(self) -> [i64; 4] {
        [self.0[0].raw(), self.0[1].raw(), self.0[2].raw(), self.0[3].raw()]
    }

    /// From coordinates in steps of 1/65,536.
    pub const fn from_raw(raw: [i64; 4]) -> Self {
        Self([Fixed::from_raw(raw[0]), Fixed::from_raw(raw[1]), Fixed::from_raw(raw[2]), Fixed::from_raw(raw[3])])
    }
}

impl From<[Fixed; 4]> for Point4 {
    fn from(at: [Fixed; 4]) -> Self {
        Self(at)
    }
}

/// A box: the points with `min <= p < max` on every axis. It holds at least one point and lies in [`Aabb4::SPACE`].
///
/// As space reaches to 2^45 units from the origin, every extent is a coordinate too, and every lattice has a whole number
/// of cells in it: within a box no arithmetic overflows.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Aabb4 {
    min: [i64; 4],
    max: [i64; 4],
}

/// Corners that are those of no box.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Aabb4Error {
    /// `min >= max`.
    #[error("axis {}: the box runs from {min} to {max}; give min < max", axis_name(*.axis))]
    Empty {
        /// 0 to 3 for x, y, z, w.
        axis: usize,
        /// The lower end.
        min: Fixed,
        /// The upper end.
        max: Fixed,
    },
    /// Beyond the space that a world has.
    #[error("axis {}: the box runs from {min} to {max}; a world reaches from -2^45 to 2^45 units", axis_name(*.axis))]
    OutsideSpace {
        /// 0 to 3 for x, y, z, w.
        axis: usize,
        /// The lower end.
        min: Fixed,
        /// The upper end.
        max: Fixed,
    },
}

fn axis_name(axis: usize) -> &'static str {
    ["x", "y", "z", "w"][axis]
}

impl Aabb4 {
    /// All there is: from -2^45 to 2^45 units on every axis. What is called unbounded ends here.
    pub const SPACE: Self = Self { min: [-(1 << 61); 4], max: [1 << 61; 4] };

    /// The box between two corners.
    ///
    /// # Errors
    /// [`Aabb4Error`] if it would hold no point or leave space.
    pub fn new(min: Point4, max: Point4) -> Result<Self, Aabb4Error> {
        Self::from_raw(min.raw(), max.raw())
    }

    /// The box between two corners in steps of 1/65,536.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn from_raw(min: [i64; 4], max: [i64; 4]) -> Result<Self, Aabb4Error> {
        for axis in 0..4 {
            let (low, high) = (Fixed::from_raw(min[axis]), Fixed::from_raw(max[axis]));
            if low >= high {
                return Err(Aabb4Error::Empty { axis, min: low, max: high });
            }
            if min[axis] < Self::SPACE.min[axis] || max[axis] > Self::SPACE.max[axis] {
                return Err(Aabb4Error::OutsideSpace { axis, min: low, max: high });
            }
        }
        Ok(Self { min, max })
    }

    /// The box between two corners with whole coordinates.
    ///
    /// # Errors
    /// [`Aabb4Error::Empty`].
    pub fn from_ints(min: [i32; 4], max: [i32; 4]) -> Result<Self, Aabb4Error> {
        Self::new(Point4::from_ints(min), Point4::from_ints(max))
    }

    /// For callers whose corners are those of a box by construction.
    pub(crate) fn from_raw_unchecked(min: [i64; 4], max: [i64; 4]) -> Self {
        debug_assert!(Self::from_raw(min, max).is_ok(), "{min:?} to {max:?} is no box");
        Self { min, max }
    }

    /// The lower corner, which belongs to the box.
    pub const fn min(&self) -> Point4 {
        Point4::from_raw(self.min)
    }

    /// The upper corner, which does not.
    pub const fn max(&self) -> Point4 {
        Point4::from_raw(self.max)
    }

    /// The lower corner in steps of 1/65,536.
    pub const fn min_raw(&self) -> [i64; 4] {
        self.min
    }

    /// The upper corner in steps of 1/65,536.
    pub const fn max_raw(&self) -> [i64; 4] {
        self.max
    }

    /// The extents in steps of 1/65,536.
    pub fn extent_raw(&self) -> [i64; 4] {
        std::array::from_fn(|a| self.max[a] - self.min[a])
    }

    /// The extents in units, rounded to the nearest `f64`.
    pub fn extent(&self) -> [f64; 4] {
        self.extent_raw().map(|e| Fixed::from_raw(e).to_f64())
    }

    /// Whether the point lies in the box.
    pub fn contains_point(&self, point: Point4) -> bool {
        let at = point.raw();
        (0..4).all(|a| self.min[a] <= at[a] && at[a] < self.max[a])
    }

    /// Whether all of `other` lies in the box.
    pub fn contains(&self, other: &Self) -> bool {
        (0..4).all(|a| self.min[a] <= other.min[a] && other.max[a] <= self.max[a])
    }

    /// Whether the boxes share a point. Boxes that only touch do not.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..4).all(|a| self.min[a] < other.max[a] && other.min[a] < self.max[a])
    }

    /// What both boxes hold.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let min = std::array::from_fn(|a| self.min[a].max(other.min[a]));
        let max: [i64; 4] = std::array::from_fn(|a| self.max[a].min(other.max[a]));
        (0..4).all(|a| min[a] < max[a]).then_some(Self { min, max })
    }

    /// The smallest box that holds both.
    pub fn hull(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|a| self.min[a].min(other.min[a])),
            max: std::array::from_fn(|a| self.max[a].max(other.max[a])),
        }
    }

    /// What is left without `hole`: at most 8 disjoint boxes, two for every axis, first y, then x, z and w. A box that the
    /// hole misses is left whole.
    ///
    /// The vertical axis comes first: worlds are layered, so the large slabs are those above and below.
    pub fn subtract(&self, hole: &Self) -> Slabs {
        let mut slabs = Slabs { boxes: [*self; 8], len: 0 };
        let Some(hole) = self.intersection(hole) else {
            slabs.len = 1;
            return slabs;
        };
        let mut rest = *self;
        for a in [1, 0, 2, 3] {
            if rest.min[a] < hole.min[a] {
                let mut slab = rest;
                slab.max[a] = hole.min[a];
                slabs.push(slab);
                rest.min[a] = hole.min[a];
            }
            if hole.max[a] < rest.max[a] {
                let mut slab = rest;
                slab.min[a] = hole.max[a];
                slabs.push(slab);
                rest.max[a] = hole.max[a];
            }
        }
        slabs
    }

    /// Cuts the box in two at a coordinate, in steps of 1/65,536, strictly inside it.
    pub(crate) fn split(&self, axis: usize, at: i64) -> (Self, Self) {
        debug_assert!(self.min[axis] < at && at < self.max[axis]);
        let (mut low, mut high) = (*self, *self);
        low.max[axis] = at;
        high.min[axis] = at;
        (low, high)
    }

    /// The box moved by a vector.
    ///
    /// # Errors
    /// [`Aabb4Error::OutsideSpace`].
    pub fn translated(&self, by: Point4) -> Result<Self, Aabb4Error> {
        let by = by.raw();
        // Saturated corners lie outside space, and are refused there.
        Self::from_raw(
            std::array::from_fn(|a| self.min[a].saturating_add(by[a])),
            std::array::from_fn(|a| self.max[a].saturating_add(by[a])),
        )
    }

    /// The axis on which two boxes touch with equal faces, so that they form a box together.
    pub(crate) fn forms_a_box_with(&self, other: &Self) -> bool {
        let same = |a: usize| self.min[a] == other.min[a] && self.max[a] == other.max[a];
        let touch = |a: usize| self.max[a] == other.min[a] || other.max[a] == self.min[a];
        (0..4).any(|a| touch(a) && (0..4).all(|b| b == a || same(b)))
    }

    /// Rounded outwards to multiples of `2^log2` steps by axis. Space is a multiple of every such cell.
    pub(crate) fn snapped_out(&self, log2: [u32; 4]) -> Self {
        Self {
            min: std::array::from_fn(|a| self.min[a] >> log2[a] << log2[a]),
            max: std::array::from_fn(|a| (self.max[a] + (1 << log2[a]) - 1) >> log2[a] << log2[a]),
        }
    }

    /// Whether all corners are multiples of `2^log2` steps by axis.
    pub(crate) fn is_aligned(&self, log2: [u32; 4]) -> bool {
        (0..4).all(|a| (self.min[a] | self.max[a]) & ((1 << log2[a]) - 1) == 0)
    }

    /// The cells of a lattice that share points with the box, x fastest, w slowest. `log2` is the logarithm of the cell's
    /// extent in steps of 1/65,536, by axis. Nothing is allocated.
    pub(crate) fn cells(&self, log2: [u32; 4]) -> Cells {
        let first: [i64; 4] = std::array::from_fn(|a| self.min[a] >> log2[a]);
        let last: [i64; 4] = std::array::from_fn(|a| (self.max[a] - 1) >> log2[a]);
        Cells { first, last, next: Some(first), log2 }
    }

    /// How many cells [`Self::cells`] gives; saturated.
    pub(crate) fn cell_count(&self, log2: [u32; 4]) -> u64 {
        (0..4).fold(1_u64, |count, a| {
            let along = ((self.max[a] - 1) >> log2[a]) - (self.min[a] >> log2[a]) + 1;
            count.saturating_mul(along as u64)
        })
    }

    /// The coordinates or-ed together, for [`super::Scale::of_alignment`]; without w if that is not asked for.
    pub(crate) fn alignment_bits(&self, with_w: bool) -> i64 {
        let axes = if with_w { 4 } else { 3 };
        (0..axes).fold(0, |bits, a| bits | self.min[a] | self.max[a])
    }

    /// The box as the index of regions takes it: closed, so that boxes that only touch do not overlap.
    pub(crate) fn closed(&self) -> orthant_bvh::Aabb<i64, 4> {
        orthant_bvh::Aabb::new(self.min, self.max.map(|max| max - 1))
    }
}

impl fmt::Debug for Aabb4 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}..{:?}", self.min().0, self.max().0)
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Corners {
    min: Point4,
    max: Point4,
}

impl Serialize for Aabb4 {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Corners { min: self.min(), max: self.max() }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Aabb4 {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let corners = Corners::deserialize(deserializer)?;
        Self::new(corners.min, corners.max).map_err(serde::de::Error::custom)
    }
}

/// At most 8 disjoint boxes: what [`Aabb4::subtract`] leaves.
#[derive(Clone, Copy, Debug)]
pub struct Slabs {
    boxes: [Aabb4; 8],
    len: usize,
}

impl Slabs {
    fn push(&mut self, slab: Aabb4) {
        self.boxes[self.len] = slab;
        self.len += 1;
    }
}

impl std::ops::Deref for Slabs {
    type Target = [Aabb4];
    fn deref(&self) -> &[Aabb4] {
        &self.boxes[..self.len]
    }
}

/// The cells of a lattice under a box.
#[derive(Clone, Debug)]
pub struct Cells {
    first: [i64; 4],
    last: [i64; 4],
    next: Option<[i64; 4]>,
    log2: [u32; 4],
}

impl Iterator for Cells {
    type Item = Aabb4;

    fn next(&mut self) -> Option<Aabb4> {
        let at = self.next?;
        let mut after = at;
        self.next = None;
        for a in 0..4 {
            if after[a] < self.last[a] {
                after[a] += 1;
                self.next = Some(after);
                break;
            }
            after[a] = self.first[a];
        }
        let min: [i64; 4] = std::array::from_fn(|a| at[a] << self.log2[a]);
        Some(Aabb4::from_raw_unchecked(min, std::array::from_fn(|a| min[a] + (1 << self.log2[a]))))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Lattice, Scale, Volume};
    use super::*;
    use proptest::prelude::*;

    fn ints(min: [i32; 4], max: [i32; 4]) -> Aabb4 {
        Aabb4::from_ints(min, max).unwrap()
    }

    fn any_box() -> impl Strategy<Value = Aabb4> {
        prop::array::uniform4((-20i32..20, 1i32..12))
            .prop_map(|axes| ints(axes.map(|(min, _)| min), axes.map(|(min, extent)| min + extent)))
    }

    #[test]
    fn a_hole_in_the_middle_leaves_eight_slabs_and_one_in_a_corner_four() {
        let all = ints([0; 4], [10; 4]);
        assert_eq!(all.subtract(&ints([4; 4], [5; 4])).len(), 8);
        assert_eq!(all.subtract(&ints([-1; 4], [5; 4])).len(), 4);
        assert_eq!(all.subtract(&all).len(), 0);
        assert_eq!(*all.subtract(&ints([10; 4], [11; 4])), [all]);
    }

    #[test]
    fn boxes_that_touch_do_not_overlap() {
        let (left, right) = (ints([0; 4], [1; 4]), ints([1, 0, 0, 0], [2, 1, 1, 1]));
        assert!(!left.overlaps(&right));
        assert!(left.forms_a_box_with(&right));
        assert!(!left.forms_a_box_with(&ints([1, 0, 0, 0], [2, 2, 1, 1])));
    }

    #[test]
    fn empty_boxes_and_boxes_beyond_space_are_refused() {
        let p = Point4::from_ints;
        assert!(matches!(Aabb4::new(p([0; 4]), p([1, 1, 0, 1])), Err(Aabb4Error::Empty { axis: 2, .. })));
        let beyond = Aabb4::from_raw([0; 4], [(1 << 61) + 1, 1, 1, 1]);
        assert!(matches!(beyond, Err(Aabb4Error::OutsideSpace { axis: 0, .. })));
        let far = Point4::from_raw([i64::MAX; 4]);
        assert!(Aabb4::SPACE.translated(far).is_err());
    }

    #[test]
    fn snapping_is_outwards_on_both_sides_of_the_origin() {
        let lattice = Lattice::cube(Scale::UNIT);
        let about = lattice.chunks_about(&ints([-1, 0, 7, 8], [1, 8, 9, 9]));
        assert_eq!(about, ints([-8, 0, 0, 8], [8, 8, 16, 16]));
        assert!(lattice.has_chunk_corners(&about));
        let coarse = Lattice::cube(Scale::MAX);
        assert_eq!(coarse.chunks_about(&Aabb4::SPACE), Aabb4::SPACE);
    }

    #[test]
    fn cells_cover_the_box_in_linear_order() {
        let bounds = ints([-1, 0, 0, 0], [2, 1, 2, 1]);
        let cells: Vec<_> = bounds.cells(Lattice::cube(Scale::UNIT).block_log2()).collect();
        assert_eq!(cells.len() as u64, bounds.cell_count(Lattice::cube(Scale::UNIT).block_log2()));
        assert_eq!(cells.len(), 6);
        assert_eq!(cells[0], ints([-1, 0, 0, 0], [0, 1, 1, 1]));
        assert_eq!(cells[1], ints([0, 0, 0, 0], [1, 1, 1, 1]));
        assert_eq!(cells[3], ints([-1, 0, 1, 0], [0, 1, 2, 1]));
    }

    #[test]
    fn boxes_travel_as_json() {
        let bounds = Aabb4::from_raw([-(1 << 60) + 1, 0, 32_768, 0], [0, 65_536, 65_536, 65_536]).unwrap();
        let json = serde_json::to_string(&bounds).unwrap();
        assert_eq!(json, r#"{"min":["-17592186044415.9999847412109375",0,0.5,0],"max":[0,1,1,1]}"#);
        assert_eq!(serde_json::from_str::<Aabb4>(&json).unwrap(), bounds);
        assert!(serde_json::from_str::<Aabb4>(r#"{"min":[0,0,0,0],"max":[1,1,1,0]}"#).is_err());
    }

    proptest! {
        #[test]
        fn subtraction_and_intersection_tile_the_box(a in any_box(), b in any_box()) {
            let slabs = a.subtract(&b);
            let mut parts: Vec<_> = slabs.to_vec();
            parts.extend(a.intersection(&b));
            for (i, part) in parts.iter().enumerate() {
                prop_assert!(a.contains(part));
                prop_assert!(parts[i + 1..].iter().all(|other| !part.overlaps(other)));
            }
            let sum = parts.iter().fold(Volume::default(), |sum, part| sum.plus(Volume::of(part)));
            prop_assert_eq!(sum, Volume::of(&a));
            prop_assert!(slabs.iter().all(|slab| !slab.overlaps(&b)));
        }
    }
}
