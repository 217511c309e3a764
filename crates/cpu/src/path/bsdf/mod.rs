//! The metallic-roughness BSDF: glTF 2.0, appendix B, with energy compensation.
//!
//! Three terms in local coordinates (z is the shading normal):
//!
//! * a GGX reflection lobe with Schlick's Fresnel term, f0 mixed between the dielectric's and the base colour;
//! * for the metal, what the microfacets scatter more than once (Kulla and Conty 2017, "Revisiting Physically Based
//!   Shading at Imageworks", with the saturation of Hill 2018): `(1 - A(o)) (1 - A(i)) / (pi (1 - mean A))`;
//! * for the dielectric, a diffuse base that gets what its interface does not reflect:
//!   `(1 - E(o)) (1 - E(i)) / (pi (1 - mean E))` (Kelemen and Szirmay-Kalos 2001). It replaces the appendix's
//!   `1 - F(v.h)`, which is neither reciprocal in energy nor conserves it.
//!
//! A and E are directional albedos from [`orthant_resident::energy`]. All terms are reciprocal, and a white surface
//! reflects all light at any roughness. An interface whose f0 is below 2 % counts as index-matched and loses its
//! grazing reflection in proportion, so that an index of 1 is exactly Lambertian.

mod ggx;
mod shading;

pub use ggx::{ggx_d, sample_visible_normal, schlick_weight, smith_lambda};
pub use shading::{BsdfSample, ShadingBsdf, valid_shading_normal};

use glam::{Vec2, Vec3};
use orthant_resident::energy::{EnergyRow, roughness_to_alpha};
use orthant_resident::math::luminance;
use orthant_resident::sampling::warp::sample_cosine_hemisphere;
use std::f32::consts::{FRAC_1_PI, PI};

/// What the BSDF is made from, textures and vertex colours multiplied in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfParameters {
    /// Linear base colour, 0..=1.
    pub base_color: Vec3,
    /// 0..=1.
    pub metallic: f32,
    /// Perceptual roughness, 0..=1.
    pub roughness: f32,
    /// Index of refraction of the dielectric.
    pub ior: f32,
}

/// Value and density for one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BsdfValue {
    /// BSDF times the cosine of the incident direction.
    pub f_cos: Vec3,
    /// Density of sampling this direction, over solid angle.
    pub pdf: f32,
}

/// The BSDF as seen from one direction.
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness {
    wo: Vec3,
    alpha: f32,
    lambda_o: f32,
    f0: Vec3,
    f90: f32,
    dielectric_f0: f32,
    dielectric_f90: f32,
    energy: EnergyRow,
    /// Diffuse term without the factor of the incident direction.
    diffuse: Vec3,
    /// Multiple scattering of the metal, likewise.
    multiple: Vec3,
    /// Probability of sampling the reflection lobe; the cosine lobe takes the rest.
    p_specular: f32,
}

impl MetallicRoughness {
    /// The BSDF seen from the local unit direction `wo`, with `wo.z > 0`.
    pub fn new(p: &BsdfParameters, wo: Vec3) -> Self {
        let alpha = roughness_to_alpha(p.roughness);
        let dielectric_f0 = dielectric_f0(p.ior);
        let dielectric_f90 = (dielectric_f0 * 50.0).min(1.0);
        let m = p.metallic;
        let f0 = Vec3::splat(dielectric_f0) * (1.0 - m) + p.base_color * m;
        let f90 = dielectric_f90 * (1.0 - m) + m;

        let energy = EnergyRow::new(p.roughness);
        let (at_o, mean) = (energy.at(wo.z), energy.average());

        let lost = 1.0 - mean.albedo(dielectric_f0, dielectric_f90);
        let transmitted_o = (1.0 - at_o.albedo(dielectric_f0, dielectric_f90)).max(0.0);
        let diffuse_albedo = p.base_color * ((1.0 - m) * transmitted_o);
        let diffuse = if lost > 0.0 { diffuse_albedo * (FRAC_1_PI / lost) } else { Vec3::ZERO };

        let metal_lost = 1.0 - mean.a;
        let multiple_albedo = multiple_fresnel(p.base_color, mean.a) * (m * (1.0 - at_o.a).max(0.0));
        let multiple = if metal_lost > 0.0 { multiple_albedo * (FRAC_1_PI / metal_lost) } else { Vec3::ZERO };

        let specular_albedo = f0 * (at_o.a - at_o.b) + Vec3::splat(f90 * at_o.b);
        let (specular, cosine) = (luminance(specular_albedo), luminance(diffuse_albedo + multiple_albedo));
        let p_specular = if cosine <= 0.0 { 1.0 } else { specular / (specular + cosine) };
        Self {
            wo,
            alpha,
            lambda_o: smith_lambda(wo.z, alpha),
            f0,
            f90,
            dielectric_f0,
            dielectric_f90,
            energy,
            diffuse,
            multiple,
            p_specular,
        }
    }

    /// Value and density for the local unit direction `wi`; zero below the surface.
    #[inline]
    pub fn evaluate(&self, wi: Vec3) -> BsdfValue {
        if wi.z <= 0.0 {
            return BsdfValue::default();
        }
        let at_i = self.energy.at(wi.z);
        let transmitted_i = (1.0 - at_i.albedo(self.dielectric_f0, self.dielectric_f90)).max(0.0);
        let lost_i = (1.0 - at_i.a).max(0.0);
        let mut f_cos = (self.diffuse * transmitted_i + self.multiple * lost_i) * wi.z;
        let mut pdf = (1.0 - self.p_specular) * wi.z * FRAC_1_PI;

        let half = self.wo + wi;
        let length2 = half.length_squared();
        if self.p_specular > 0.0 && length2 > 0.0 {
            let h = half / length2.sqrt();
            let d = ggx_d(h, self.alpha);
            let fresnel = self.f0 + (Vec3::splat(self.f90) - self.f0) * schlick_weight(self.wo.dot(h));
            let scale = d / (4.0 * self.wo.z);
            f_cos += fresnel * (scale / (1.0 + self.lambda_o + smith_lambda(wi.z, self.alpha)));
            pdf += self.p_specular * scale / (1.0 + self.lambda_o);
        }
        BsdfValue { f_cos, pdf }
    }

    /// A local unit direction with the density that [`Self::evaluate`] gives: `lobe` picks the lobe, `u` the direction.
    /// It may lie below the surface, where the BSDF is zero.
    #[inline]
    pub fn sample(&self, u: Vec2, lobe: f32) -> Vec3 {
        if lobe < self.p_specular {
            let h = sample_visible_normal(self.wo, self.alpha, u);
            h * (2.0 * self.wo.dot(h)) - self.wo
        } else {
            sample_cosine_hemisphere(u)
        }
    }

    /// How far a ray that was sampled with density `pdf` may spread: the angle in radians, see [`crate::path::cone`].
    #[inline]
    pub fn spread(&self, pdf: f32) -> f32 {
        // The cone holds a fixed share of the lobe's probability: 0.2 radians for a diffuse bounce (pdf 1 / pi).
        (0.04 / (PI * pdf.max(1e-6))).sqrt().min(0.2)
    }

    /// Albedo seen from `wo` as the tables have it: of the reflection lobe, and of the cosine lobe.
    pub fn albedos(&self) -> (Vec3, Vec3) {
        let (at_o, mean) = (self.energy.at(self.wo.z), self.energy.average());
        let specular = self.f0 * (at_o.a - at_o.b) + Vec3::splat(self.f90 * at_o.b);
        let cosine = self.diffuse * (PI * (1.0 - mean.albedo(self.dielectric_f0, self.dielectric_f90)))
            + self.multiple * (PI * (1.0 - mean.a));
        (specular, cosine)
    }
}

/// Reflectance of a dielectric at normal incidence from vacuum; 0.04 for an index of 1.5. An index of 0 reflects all
/// (KHR_materials_ior).
#[inline]
pub fn dielectric_f0(ior: f32) -> f32 {
    let r = (ior - 1.0) / (ior + 1.0);
    r * r
}

/// Mean Fresnel factor of light that a metal's microfacets scatter two and more times: the geometric series of
/// `F (1 - E)`, with Schlick's mean `F = (20 f0 + 1) / 21`. It is 1 for a white metal.
#[inline]
fn multiple_fresnel(f0: Vec3, mean_albedo: f32) -> Vec3 {
    let f = (f0 * 20.0 + Vec3::ONE) / 21.0;
    f * f * mean_albedo / (Vec3::ONE - f * (1.0 - mean_albedo))
}

#[cfg(test)]
mod tests;
