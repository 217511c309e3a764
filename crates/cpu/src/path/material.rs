//! From a point of a surface to what it emits and reflects.

use super::bsdf::BsdfParameters;
use super::surface::SurfacePoint;
use super::texture::sample_slot;
use crate::scene::ResidentScene;
use glam::{Vec2, Vec3};
use orthant_resident::math::safe_normalize;
use orthant_resident::rows::{MaterialFlags, NONE};

/// Texture coordinates of a point and what the ray's footprint covers of them.
#[derive(Clone, Copy, Debug)]
pub struct TextureFrame {
    /// By UV set.
    pub uv: [Vec2; 2],
    /// Area in squared texture units, by UV set.
    pub footprint: [f32; 2],
}

impl TextureFrame {
    /// At a point, for a footprint of `area` square metres; zeros where the material has no texture to read.
    #[inline]
    pub fn new(scene: &ResidentScene, point: &SurfacePoint, area: f32) -> Self {
        let m = point.material;
        let slots = [&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture, &m.emissive_texture];
        if slots.iter().all(|slot| slot.texture == NONE) {
            return Self { uv: [Vec2::ZERO; 2], footprint: [0.0; 2] };
        }
        Self { uv: point.uv(scene), footprint: point.uv_footprint(scene, area) }
    }
}

/// Whether the surface has no reflection, only its own colour (KHR_materials_unlit).
#[inline]
pub fn is_unlit(point: &SurfacePoint) -> bool {
    point.material.flags & MaterialFlags::UNLIT != 0
}

/// Base colour: factor times texture times vertex colour.
#[inline]
pub fn base_color(scene: &ResidentScene, point: &SurfacePoint, frame: &TextureFrame) -> Vec3 {
    let m = point.material;
    let mut color = Vec3::new(m.base_color[0], m.base_color[1], m.base_color[2]) * point.color(scene).truncate();
    if m.base_color_texture.texture != NONE
        && let Some(texel) = sample_slot(scene, &m.base_color_texture, &frame.uv, frame.footprint)
    {
        color *= texel.truncate();
    }
    color
}

/// Emitted radiance of a face that emits: emission, or for an unlit surface its colour.
#[inline]
pub fn emitted_radiance(scene: &ResidentScene, point: &SurfacePoint, frame: &TextureFrame) -> Vec3 {
    if is_unlit(point) {
        return base_color(scene, point, frame);
    }
    let m = point.material;
    let mut radiance = Vec3::from_array(m.emissive);
    if m.emissive_texture.texture != NONE
        && let Some(texel) = sample_slot(scene, &m.emissive_texture, &frame.uv, frame.footprint)
    {
        radiance *= texel.truncate();
    }
    radiance
}

/// Parameters of the BSDF.
#[inline]
pub fn bsdf_parameters(scene: &ResidentScene, point: &SurfacePoint, frame: &TextureFrame) -> BsdfParameters {
    let m = point.material;
    let (mut metallic, mut roughness) = (m.metallic, m.roughness);
    if m.metallic_roughness_texture.texture != NONE
        && let Some(texel) = sample_slot(scene, &m.metallic_roughness_texture, &frame.uv, frame.footprint)
    {
        roughness *= texel.y;
        metallic *= texel.z;
    }
    BsdfParameters {
        base_color: base_color(scene, point, frame).clamp(Vec3::ZERO, Vec3::ONE),
        metallic: metallic.clamp(0.0, 1.0),
        roughness: roughness.clamp(0.0, 1.0),
        ior: m.ior.max(0.0),
    }
}

/// Unit shading normal of the front face: interpolated, then perturbed by the normal map.
#[inline]
pub fn shading_normal(scene: &ResidentScene, point: &SurfacePoint, frame: &TextureFrame) -> Vec3 {
    let n = point.vertex_normal(scene);
    let slot = &point.material.normal_texture;
    if slot.texture == NONE {
        return n;
    }
    let Some(texel) = sample_slot(scene, slot, &frame.uv, frame.footprint) else { return n };
    let Some([t, b]) = point.tangents(scene, n, slot.uv_set) else { return n };
    let scale = point.material.normal_scale;
    let local = texel.truncate() * 2.0 - 1.0;
    safe_normalize(t * (local.x * scale) + b * (local.y * scale) + n * local.z, n)
}
