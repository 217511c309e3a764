//! From the unit square to shapes.

use crate::math::sin_cos_turns;
use glam::{Vec2, Vec3};

/// A uniform point on the unit disc (Shirley and Chiu 1997, "A Low Distortion Map Between Disk and Square").
#[inline]
pub fn sample_disc(u: Vec2) -> Vec2 {
    let (x, y) = (2.0 * u.x - 1.0, 2.0 * u.y - 1.0);
    if x == 0.0 && y == 0.0 {
        return Vec2::ZERO;
    }
    // Eighths of a turn: the angle is pi/4 times the ratio of the smaller to the larger coordinate.
    let (r, turns) = if x.abs() > y.abs() { (x, 0.125 * (y / x)) } else { (y, 0.25 - 0.125 * (x / y)) };
    let (s, c) = sin_cos_turns(turns);
    Vec2::new(r * c, r * s)
}

/// A direction about +z with density `cos(theta) / pi`.
#[inline]
pub fn sample_cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = sample_disc(u);
    Vec3::new(d.x, d.y, (1.0 - d.x * d.x - d.y * d.y).max(0.0).sqrt())
}

/// A uniform direction within the cone about +z whose cosine is at least `1 - one_minus_cos`; its density over solid
/// angle is `1 / (2 pi one_minus_cos)`.
#[inline]
pub fn sample_cone(u: Vec2, one_minus_cos: f32) -> Vec3 {
    let k = u.x * one_minus_cos;
    let (s, c) = sin_cos_turns(u.y);
    // sin^2 = 1 - cos^2 = k (2 - k), exact for narrow cones too.
    let sin_theta = (k * (2.0 - k)).max(0.0).sqrt();
    Vec3::new(sin_theta * c, sin_theta * s, 1.0 - k)
}

/// Uniform barycentric coordinates (b1, b2) on a triangle (Heitz 2019, "A Low-Distortion Map Between Triangle and
/// Square").
#[inline]
pub fn sample_triangle(u: Vec2) -> Vec2 {
    let (mut x, mut y) = (u.x, u.y);
    if y > x {
        x *= 0.5;
        y -= x;
    } else {
        y *= 0.5;
        x -= y;
    }
    Vec2::new(x, y)
}

/// An offset in -1..1 with the density of a tent of that half width.
#[inline]
pub fn sample_tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).max(0.0).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    fn grid() -> impl Iterator<Item = Vec2> {
        (0..256).flat_map(|i| (0..256).map(move |j| Vec2::new(i as f32 + 0.5, j as f32 + 0.5) / 256.0))
    }

    fn mean(f: impl Fn(Vec2) -> f32) -> f32 {
        (grid().map(|u| f(u) as f64).sum::<f64>() / 65_536.0) as f32
    }

    #[test]
    fn moments_of_the_warps_are_those_of_their_densities() {
        let near = |a: f32, b: f32| assert!((a - b).abs() < 2e-3, "{a} {b}");
        near(mean(|u| sample_disc(u).length_squared()), 0.5);
        near(mean(|u| sample_disc(u).x.powi(2)), 0.25);
        near(mean(|u| sample_cosine_hemisphere(u).z), 2.0 / 3.0);
        near(mean(|u| sample_cone(u, 0.3).z), 1.0 - 0.15);
        near(mean(|u| sample_cone(u, 2.0).x.powi(2)), 1.0 / 3.0);
        near(mean(|u| sample_triangle(u).x), 1.0 / 3.0);
        near(mean(|u| sample_triangle(u).x * sample_triangle(u).y), 1.0 / 12.0);
        near(mean(|u| sample_tent(u.x).powi(2)), 1.0 / 6.0);
        for u in grid() {
            assert!((sample_cone(u, 1e-5).length() - 1.0).abs() < 1e-6);
            let b = sample_triangle(u);
            assert!(b.x >= 0.0 && b.y >= 0.0 && b.x + b.y <= 1.0);
            assert!(sample_disc(u).length() <= 1.0 + 1e-6);
        }
    }

    #[test]
    fn a_narrow_cone_keeps_its_radius() {
        // The sun: 0.2666 degrees.
        let radius = 0.2666f32.to_radians();
        let one_minus_cos = 2.0 * (radius / 2.0).sin().powi(2);
        let edge = sample_cone(Vec2::new(0.999_999, 0.2), one_minus_cos);
        let angle = edge.x.hypot(edge.y).asin();
        assert!((angle / radius - 1.0).abs() < 1e-4, "{}", angle / PI);
    }
}
