//! Uniform directions to a rectangle: Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical
//! Rectangles".
//!
//! The names are the paper's. Two things differ, for the sake of `f32`: angles come from arc tangents of lengths instead of
//! arc cosines of dot products, and the solid angle, whose sum of four angles would cancel for a small rectangle, from the
//! two triangles' formula of van Oosterom and Strackee 1983, "The Solid Angle of a Plane Triangle".

use crate::math::{atan2_turns, sin_cos_turns};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// Solid angle in steradians below which a rectangle is to be sampled by area: the rounding of the angles (4e-7) would
/// show, and the two are nearly the same there.
pub const MIN_SOLID_ANGLE: f32 = 1e-3;

/// How far from a right angle the sides may be, as the cosine between them.
const MAX_SIDES_COSINE: f32 = 1e-5;

/// How many radii away a rectangle is to be sampled by area as well: uniform points are nearly uniform directions there, and
/// cheaper.
const FAR: f32 = 8.0;

/// A rectangle in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    corner: Vec3,
    /// Unit vectors along the sides, and across both.
    axes: [Vec3; 3],
    size: [f32; 2],
}

impl Rectangle {
    /// The rectangle with a corner and the sides from there; `None` where they are not at right angles or have no length.
    pub fn new(corner: Vec3, sides: [Vec3; 2]) -> Option<Self> {
        let [w, h] = sides.map(Vec3::length);
        let [x, y] = [sides[0] / w, sides[1] / h];
        // Not a number fails the comparison.
        let is_right = x.dot(y).abs() <= MAX_SIDES_COSINE;
        is_right.then(|| Self { corner, axes: [x, y, x.cross(y)], size: [w, h] })
    }

    /// Its corner, the unit vectors along its sides and across both, and the lengths of the sides.
    pub fn parts(&self) -> (Vec3, [Vec3; 3], [f32; 2]) {
        (self.corner, self.axes, self.size)
    }

    /// How it is seen from a point. `None` where it is small: farther than [`FAR`] radii, or with a solid angle below
    /// [`MIN_SOLID_ANGLE`] (the plane through the point included).
    #[inline]
    pub fn seen_from(&self, from: Vec3) -> Option<SphericalRectangle> {
        let corner = self.corner - from;
        let [x, y, z] = self.axes.map(|axis| corner.dot(axis));
        let [w, h] = self.size;
        let (cx, cy) = (x + 0.5 * w, y + 0.5 * h);
        if cx * cx + cy * cy + z * z > (0.25 * FAR * FAR) * (w * w + h * h) {
            return None;
        }
        let z = z.abs();
        let scale = 1.0 / x.abs().max((x + w).abs()).max(y.abs()).max((y + h).abs()).max(z);
        if !(scale > 0.0 && scale < f32::INFINITY) {
            return None;
        }
        let (x, y, z) = ([x * scale, (x + w) * scale], [y * scale, (y + h) * scale], z * scale);
        let solid_angle = rectangle_solid_angle(x, y, z, w * scale * h * scale);
        (solid_angle >= MIN_SOLID_ANGLE).then_some(SphericalRectangle { x, y, z, solid_angle })
    }
}

/// A rectangle as seen from a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalRectangle {
    /// Range along the first side, in units of the largest coordinate.
    x: [f32; 2],
    /// Range along the second side.
    y: [f32; 2],
    /// Distance from the plane.
    z: f32,
    /// Steradians.
    solid_angle: f32,
}

impl SphericalRectangle {
    /// Its solid angle in steradians.
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle
    }

    /// The point of the rectangle, in 0..=1 along its sides, in a direction that is uniform in its solid angle.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec2 {
        let ([x0, x1], [y0, y1], z) = (self.x, self.y, self.z);
        let z2 = z * z;

        // A plane through the y axis cuts off the share u.x of the solid angle
        let edge = [y0, y1].map(|y| 1.0 / (y * y + z2).sqrt());
        let (b0, b1) = (-y0 * edge[0], y1 * edge[1]);
        let [l00, l01] = [y0, y1].map(|y| (x0 * x0 + y * y + z2).sqrt());
        let g2 = atan2_turns(z * l01, x0 * y1);
        let g3 = atan2_turns(z * l00, -x0 * y0);
        let (sin, cos) = sin_cos_turns(u.x * (self.solid_angle / TAU) + (1.0 - g2 - g3));
        let f = (cos * b0 - b1) / sin;
        // 1 / c^2 - 1, with 1 - b0^2 = (z edge)^2.
        let c = f * f - z2 * edge[0] * edge[0];
        let along = if c > 0.0 { z / c.sqrt() } else { f32::INFINITY };
        let x = (if f > 0.0 { along } else { -along }).clamp(x0, x1);

        // On the line at x, sines of the elevation are uniform: their distance from 1, on the side where they come near it
        let sign = if y0 + y1 < 0.0 { -1.0 } else { 1.0 };
        let (low, high, v) = if sign < 0.0 { (-y1, -y0, 1.0 - u.y) } else { (y0, y1, u.y) };
        let d2 = x * x + z2;
        let below_one = |y: f32| {
            let l = (d2 + y * y).sqrt();
            if y > 0.0 { d2 / (l * (l + y)) } else { 1.0 - y / l }
        };
        let (q0, q1) = (below_one(low), below_one(high));
        let q = q0 + v * (q1 - q0);
        let y = (sign * d2.sqrt() * (1.0 - q) / (q * (2.0 - q)).sqrt()).clamp(y0, y1);
        (Vec2::new(x - x0, y - y0) / Vec2::new(x1 - x0, y1 - y0)).clamp(Vec2::ZERO, Vec2::ONE)
    }
}

/// The solid angle of a rectangle in the plane at distance `z`.
#[inline]
fn rectangle_solid_angle([x0, x1]: [f32; 2], [y0, y1]: [f32; 2], z: f32, area: f32) -> f32 {
    let (xx0, xx1, yy0, yy1, zz) = (x0 * x0, x1 * x1, y0 * y0 + z * z, y1 * y1 + z * z, z * z);
    let [l00, l10, l11, l01] = [xx0 + yy0, xx1 + yy0, xx1 + yy1, xx0 + yy1].map(f32::sqrt);
    // Products of neighbouring corners, and of the two at the ends of the common side
    let (bottom, right, top, left) = (x0 * x1 + yy0, y0 * y1 + xx1 + zz, x0 * x1 + yy1, y0 * y1 + xx0 + zz);
    let across = x0 * x1 + y0 * y1 + zz;
    // The volume that a triangle spans with the point is its doubled area times the distance.
    let volume = z * area;
    let first = atan2_turns(volume, l00 * l10 * l11 + bottom * l11 + right * l00 + across * l10);
    let second = atan2_turns(volume, l00 * l11 * l01 + across * l01 + top * l00 + left * l11);
    2.0 * TAU * (first + second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::unit_float;
    use crate::sampling::hash_combine;
    use glam::{DVec2, DVec3, Quat};

    /// The solid angle of a rectangle in the plane at distance `z`: four times an arc tangent with signs.
    fn exact_solid_angle(x: [f64; 2], y: [f64; 2], z: f64) -> f64 {
        let corner = |x: f64, y: f64| (x * y / (z * (x * x + y * y + z * z).sqrt())).atan();
        corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0])
    }

    /// Rectangles by their ranges along x and y at distance 1: in front, at an angle, about the foot point, a strip, one
    /// that is nearly the whole half-space, one far to the side.
    const RANGES: [[[f32; 2]; 2]; 8] = [
        [[-0.5, 0.5], [-0.5, 0.5]],
        [[-0.3, 1.0], [-0.2, 0.4]],
        [[0.5, 2.0], [-3.0, -1.0]],
        [[-4.0, 9.0], [-0.01, 0.02]],
        [[-0.01, 0.02], [-4.0, 9.0]],
        [[-200.0, 300.0], [-400.0, 100.0]],
        [[5.0, 25.0], [4.0, 30.0]],
        [[-30.0, -6.0], [-0.5, 0.5]],
    ];

    fn rectangle([x, y]: [[f32; 2]; 2], turn: Quat) -> SphericalRectangle {
        let corner = turn * Vec3::new(x[0], y[0], 1.0);
        let sides = [turn * Vec3::X * (x[1] - x[0]), turn * Vec3::Y * (y[1] - y[0])];
        Rectangle::new(corner, sides).and_then(|r| r.seen_from(Vec3::ZERO)).expect("it is large enough")
    }

    fn turn() -> Quat {
        Quat::from_xyzw(0.3, -0.2, 0.5, 0.7).normalize()
    }

    #[test]
    fn the_solid_angle_is_exact_to_a_few_roundings() {
        for ranges in RANGES {
            let [x, y] = ranges.map(|r| r.map(f64::from));
            let exact = exact_solid_angle(x, y, 1.0);
            let value = f64::from(rectangle(ranges, turn()).solid_angle());
            assert!((value / exact - 1.0).abs() < 2e-5, "{ranges:?}: {value}, exactly {exact}");
        }
    }

    #[test]
    fn small_far_skew_or_flat_rectangles_are_left_to_sampling_by_area() {
        let seen = |corner: Vec3, sides| Rectangle::new(corner, sides).and_then(|r| r.seen_from(Vec3::ZERO));
        let corner = Vec3::new(-0.5, -0.5, 1.0);
        assert!(seen(corner, [Vec3::X, Vec3::Y]).is_some());
        assert!(seen(corner * 1e12, [Vec3::X * 1e12, Vec3::Y * 1e12]).is_some());
        assert!(seen(corner * 1e-12, [Vec3::X * 1e-12, Vec3::Y * 1e-12]).is_some());
        assert_eq!(seen(corner, [Vec3::X, Vec3::new(0.001, 1.0, 0.0)]), None);
        assert_eq!(seen(corner, [Vec3::X * 0.01, Vec3::Y * 0.01]), None);
        assert_eq!(seen(Vec3::new(2.0, 1.0, 6.0), [Vec3::X, Vec3::Y]), None);
        assert_eq!(seen(Vec3::new(1.0, 1.0, 0.0), [Vec3::X, Vec3::Y]), None);
        assert_eq!(seen(corner, [Vec3::ZERO, Vec3::Y]), None);
        assert_eq!(seen(Vec3::NAN, [Vec3::X, Vec3::Y]), None);
        assert_eq!(seen(corner, [Vec3::X * 3e38, Vec3::Y]), None);
    }

    #[test]
    fn the_map_preserves_areas() {
        // What lies before the image of (u, v) is the share u of the solid angle, and, at the image's column, v of the line.
        for ranges in RANGES {
            let rectangle = rectangle(ranges, turn());
            let [x, y] = ranges.map(|r| r.map(f64::from));
            let total = exact_solid_angle(x, y, 1.0);
            for i in 0..=16 {
                for j in 0..=16 {
                    let u = Vec2::new(i as f32, j as f32) / 16.0;
                    let at = rectangle.sample(u).as_dvec2();
                    let here = DVec2::new(x[0] + at.x * (x[1] - x[0]), y[0] + at.y * (y[1] - y[0]));
                    let column = exact_solid_angle([x[0], here.x], y, 1.0) / total;
                    let sine = |y: f64| y / DVec3::new(here.x, y, 1.0).length();
                    let line = (sine(here.y) - sine(y[0])) / (sine(y[1]) - sine(y[0]));
                    let off = (column - f64::from(u.x)).abs().max((line - f64::from(u.y)).abs());
                    assert!(off < 5e-4, "{ranges:?} {u}: {column} {line}");
                }
            }
        }
    }

    #[test]
    fn directions_pass_a_chi_squared_test_for_uniformity() {
        const CELLS: usize = 12;
        let n = 200_000u32;
        for ranges in RANGES {
            let rectangle = rectangle(ranges, turn());
            let mut observed = [[0.0f64; CELLS]; CELLS];
            for i in 0..n {
                let u = Vec2::new(unit_float(hash_combine(i, 1)), unit_float(hash_combine(i, 2)));
                let cell = (rectangle.sample(u) * CELLS as f32).as_usizevec2().min(glam::USizeVec2::splat(CELLS - 1));
                observed[cell.x][cell.y] += 1.0;
            }
            let [x, y] = ranges.map(|r| r.map(f64::from));
            let total = exact_solid_angle(x, y, 1.0);
            let part = |[a, b]: [f64; 2], i: usize| [i, i + 1].map(|i| a + (b - a) * i as f64 / CELLS as f64);
            let (mut statistic, mut degrees) = (0.0, -1.0);
            for (i, row) in observed.iter().enumerate() {
                for (j, count) in row.iter().enumerate() {
                    let expected = f64::from(n) * exact_solid_angle(part(x, i), part(y, j), 1.0) / total;
                    if expected >= 20.0 {
                        statistic += (count - expected) * (count - expected) / expected;
                        degrees += 1.0;
                    }
                }
            }
            // Wilson and Hilferty's approximation of the quantile at five standard deviations.
            let k: f64 = degrees;
            let limit = k * (1.0 - 2.0 / (9.0 * k) + 5.0 * (2.0 / (9.0 * k)).sqrt()).powi(3);
            assert!(k >= 8.0 && statistic < limit, "{ranges:?}: {statistic} with {degrees} degrees of freedom");
        }
    }
}
