//! The GGX microfacet distribution in local coordinates (z is the normal): Walter et al. 2007, with the
//! height-correlated Smith term of Heitz 2014.

use glam::{Vec2, Vec3};
use orthant_resident::math::sin_cos_turns;
use std::f32::consts::PI;

/// Density of microfacet normals `D(h)`. The sine comes from x and y, which keeps its precision for narrow lobes.
#[inline]
pub fn ggx_d(h: Vec3, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let t = a2 * h.z * h.z + h.x * h.x + h.y * h.y;
    a2 / (PI * t * t)
}

/// Smith's auxiliary function of a direction with cosine `mu > 0`.
#[inline]
pub fn smith_lambda(mu: f32, alpha: f32) -> f32 {
    let tan2 = ((1.0 - mu) * (1.0 + mu)).max(0.0) / (mu * mu);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// Schlick's weight `(1 - cos)^5`.
#[inline]
pub fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// A visible normal of the view direction `wo` (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
/// Caps"); its density is `D(h) G1(wo) max(0, wo.h) / wo.z`.
#[inline]
pub fn sample_visible_normal(wo: Vec3, alpha: f32, u: Vec2) -> Vec3 {
    let stretched = Vec3::new(wo.x * alpha, wo.y * alpha, wo.z).normalize();
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let sin_theta = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let (s, c) = sin_cos_turns(u.x);
    let h = Vec3::new(sin_theta * c, sin_theta * s, z) + stretched;
    Vec3::new(h.x * alpha, h.y * alpha, h.z.max(1e-8)).normalize()
}
