//! Where rays start: far enough from a surface that rounding cannot put them behind it (Pharr, Jakob, Humphreys:
//! "Physically Based Rendering", 4th edition, section 6.8).
//!
//! A hit point is known up to the rounding of the barycentric interpolation and of the transform to the world; the ray
//! that starts there is taken back to object space by another rounded matrix. All three are bounded per axis, and the
//! origin is moved along the geometric normal by the bound. No fixed epsilon: the offset scales with the scene.

use glam::Vec3;
use orthant_resident::math::{gamma, next_float_down, next_float_up};
use orthant_resident::rows::RenderNodeRow;

/// Where a ray to a point ends, as a share of the way: the bound of the rounding of the direction itself.
pub const SHADOW_END: f32 = 1.0 - 4.0 * f32::EPSILON;

/// Bounds the absolute error, per world axis, of the point `world = node.world (b0 p0 + b1 p1 + b2 p2)`, and of taking it
/// back to the object space of `node`; `magnitude` is `|b0 p0| + |b1 p1| + |b2 p2|` in object space, and `extent` the largest
/// side of the triangle's box there: a device's own test of a ray against the triangle's plane is off by roundings of the way
/// to its corners, however near to the origin the point is.
#[inline]
pub fn position_error(node: &RenderNodeRow, magnitude: Vec3, extent: f32, world: Vec3) -> Vec3 {
    // Rounded entries count one more rounding than the book's transform of an exact matrix.
    let transform = gamma(4);
    let interpolation = gamma(7);
    let there = absolute_transform(&node.world.rows, magnitude, 1.0);
    let plane = Vec3::splat(extent * gamma(3));
    let interpolated = absolute_transform(&node.world.rows, magnitude * interpolation + plane, 0.0);
    let back = absolute_transform(&node.inverse.rows, world.abs(), 1.0) * gamma(5);
    let returned = absolute_transform(&node.world.rows, back, 0.0);
    interpolated * (1.0 + transform) + there * transform + returned
}

/// The transform with all signs dropped; `w` weighs the translation.
#[inline]
fn absolute_transform(rows: &[[f32; 4]; 3], v: Vec3, w: f32) -> Vec3 {
    let row = |r: &[f32; 4]| r[0].abs() * v.x + r[1].abs() * v.y + r[2].abs() * v.z + r[3].abs() * w;
    Vec3::new(row(&rows[0]), row(&rows[1]), row(&rows[2]))
}

/// Moves a point with the given error bounds off its surface, to the side to which the geometric normal `n` points.
#[inline]
pub fn offset_ray_origin(p: Vec3, error: Vec3, n: Vec3) -> Vec3 {
    let offset = n * n.abs().dot(error);
    let moved = p + offset;
    let away = |v: f32, o: f32| {
        if o > 0.0 {
            next_float_up(v)
        } else if o < 0.0 {
            next_float_down(v)
        } else {
            v
        }
    };
    Vec3::new(away(moved.x, offset.x), away(moved.y, offset.y), away(moved.z, offset.z))
}
