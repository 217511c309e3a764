//! Where a ray meets a plane.
//!
//! Rays are traced relative to an anchor, a point of the world in raw coordinates near the camera: origins are `f32` units from
//! there, and a plane's distance from it is taken in integers before it is rounded. So an image does not depend on where in the
//! world it is taken. Every leaf kind finds its planes by [`plane_offset`] and [`plane_t`], so that two leaves that touch have
//! the very same `t` at the plane between them.

/// Units in a raw step.
pub const UNITS_PER_RAW: f32 = 1.0 / 65_536.0;

/// Coordinate of a plane relative to the anchor, in units: the exact difference, rounded once to nearest.
#[inline]
pub fn plane_offset(plane: i64, anchor: i64) -> f32 {
    (plane - anchor) as f32 * UNITS_PER_RAW
}

/// Parameter at which a ray meets a plane: `(offset - origin) * inverse`, in this order, with `inverse` as
/// [`inverse_direction`] has it.
#[inline]
pub fn plane_t(offset: f32, origin: f32, inverse: f32) -> f32 {
    (offset - origin) * inverse
}

/// `1 / d`, or `1 / 1e-18` where |d| is below that: so that the slab test has neither infinities nor NaN. Such a component is as
/// good as parallel: planes of its axis are then met beyond any distance that a frame may have. Its sign does not count (a sum of
/// products may well be -0), and the ray runs upwards: what begins at the coordinate of the ray is met and what ends there is not, since
/// boxes are half-open.
#[inline]
pub fn inverse_direction(d: f32) -> f32 {
    const LEAST: f32 = 1e-18;
    1.0 / if d.abs() < LEAST { LEAST } else { d }
}

/// Where a ray meets a model scene too, the world is looked at up to this part of the way: surfaces of both in one plane are the
/// scene's, on every device, and not of whose arithmetic is nearer by a few ulp.
pub const BEFORE_SCENE: f32 = 1.0 - 1.0 / 65_536.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_along_a_plane_sees_what_begins_there_and_not_what_ends_there() {
        for parallel in [0.0, -0.0, 1e-30, -1e-30] {
            let inverse = inverse_direction(parallel);
            let interval = |min: i64, max: i64| [min, max].map(|plane| plane_t(plane_offset(plane, 7), 0.0, inverse));
            let [enter, leave] = interval(7, 7 + 65_536);
            assert!(enter <= 0.0 && leave > 1e9, "{parallel}: {enter} {leave}");
            let [enter, leave] = interval(7 - 65_536, 7);
            assert!(enter < -1e9 && leave <= 0.0, "{parallel}: {enter} {leave}");
        }
    }
}
