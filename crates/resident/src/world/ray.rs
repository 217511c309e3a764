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

/// `1 / d`, with |d| at least 1e-18 (under its sign): so that the slab test has neither infinities nor NaN. A component below
/// that is as good as parallel: planes of its axis are then met beyond any distance that a frame may have.
#[inline]
pub fn inverse_direction(d: f32) -> f32 {
    const LEAST: f32 = 1e-18;
    1.0 / if d.abs() < LEAST { LEAST.copysign(d) } else { d }
}
