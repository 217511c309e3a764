//! What is there at all: alpha cutoff and stochastic transparency.
//!
//! Alpha is read at the finest level of its texture, for every ray alike: a cutoff on a blurred level would change how
//! much of a surface is there.

use super::surface::SurfacePoint;
use super::texture::sample_slot;
use crate::scene::ResidentScene;
use crate::trace::Hit;
use orthant_resident::rows::{AlphaMode, NONE};
use orthant_resident::sampling::sampler::alpha_number;

/// Alpha at a point: factor times texture times vertex colour.
#[inline]
pub fn surface_alpha(scene: &ResidentScene, point: &SurfacePoint) -> f32 {
    let mut alpha = point.material.base_color[3] * point.color(scene).w;
    let slot = &point.material.base_color_texture;
    if slot.texture != NONE
        && let Some(texel) = sample_slot(scene, slot, &point.uv(scene), [0.0; 2])
    {
        alpha *= texel.w;
    }
    alpha
}

/// The probability that a surface is there, by its alpha mode.
#[inline]
pub fn surface_presence(scene: &ResidentScene, point: &SurfacePoint) -> f32 {
    match point.material.alpha_mode() {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Mask if surface_alpha(scene, point) >= point.material.alpha_cutoff => 1.0,
        AlphaMode::Mask => 0.0,
        AlphaMode::Blend => surface_alpha(scene, point).clamp(0.0, 1.0),
    }
}

/// Whether a ray with the given key takes a hit: the any-hit function.
#[inline]
pub fn accept_hit(scene: &ResidentScene, hit: &Hit, alpha_key: u32) -> bool {
    let point = SurfacePoint::new(scene, hit.render_node, hit.triangle, hit.b1, hit.b2);
    let presence = surface_presence(scene, &point);
    presence >= 1.0
        || (presence > 0.0 && alpha_number(alpha_key, hit.render_node, point.node.primitive, hit.triangle) < presence)
}
