//! A BSDF on a surface whose shading normal is not the geometric one.
//!
//! Directions that the shading normal's hemisphere has below the geometric surface would be lost (or leak through it).
//! They are mirrored at the geometric surface instead: the BSDF is folded, `f'(wi) = f(wi) + f(mirror(wi))`, and its
//! density likewise. All energy is kept, whatever the normals are: a white surface with any normal map still reflects
//! all light.

use super::{BsdfParameters, BsdfValue, MetallicRoughness};
use glam::{Vec2, Vec3};
use orthant_resident::math::{OrthonormalFrame, safe_normalize};

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// World-space unit direction.
    pub direction: Vec3,
    /// BSDF times cosine, and density.
    pub value: BsdfValue,
}

/// The BSDF at a point in world space.
#[derive(Clone, Copy, Debug)]
pub struct ShadingBsdf {
    /// The BSDF in the frame of the shading normal.
    pub local: MetallicRoughness,
    frame: OrthonormalFrame,
    /// Geometric normal in the frame.
    geometric: Vec3,
}

/// The smallest cosine between view direction and shading normal: a normal that faces away is bent to it.
const MIN_VIEW_COSINE: f32 = 1e-3;

/// Bends the shading normal such that it lies on the geometric normal's side and the view direction above it.
#[inline]
pub fn valid_shading_normal(shading: Vec3, geometric: Vec3, wo: Vec3) -> Vec3 {
    let behind = shading.dot(geometric).min(0.0);
    let n = shading - geometric * (2.0 * behind);
    let cos = n.dot(wo);
    if cos >= MIN_VIEW_COSINE {
        return n;
    }
    safe_normalize(n + wo * (MIN_VIEW_COSINE * 1.01 - cos), geometric)
}

impl ShadingBsdf {
    /// The BSDF with a shading normal from [`valid_shading_normal`], seen from the unit direction `wo`.
    #[inline]
    pub fn new(parameters: &BsdfParameters, shading: Vec3, geometric: Vec3, wo: Vec3) -> Self {
        let frame = OrthonormalFrame::from_normal(shading);
        let mut wo = frame.to_local(wo);
        wo.z = wo.z.max(MIN_VIEW_COSINE * 0.5);
        Self { local: MetallicRoughness::new(parameters, wo.normalize()), frame, geometric: frame.to_local(geometric) }
    }

    /// Value and density for a world-space unit direction; zero below the geometric surface.
    #[inline]
    pub fn evaluate(&self, wi: Vec3) -> BsdfValue {
        self.evaluate_local(self.frame.to_local(wi))
    }

    #[inline]
    fn evaluate_local(&self, wi: Vec3) -> BsdfValue {
        let height = wi.dot(self.geometric);
        if height <= 0.0 {
            return BsdfValue::default();
        }
        let mut value = self.local.evaluate(wi);
        let mirrored = wi - self.geometric * (2.0 * height);
        if mirrored.z > 0.0 {
            let folded = self.local.evaluate(mirrored);
            value.f_cos += folded.f_cos;
            value.pdf += folded.pdf;
        }
        value
    }

    /// Samples a direction; `None` where the BSDF is zero.
    #[inline]
    pub fn sample(&self, u: Vec2, lobe: f32) -> Option<BsdfSample> {
        let mut wi = self.local.sample(u, lobe);
        if wi.z <= 0.0 {
            return None;
        }
        let height = wi.dot(self.geometric);
        if height < 0.0 {
            wi -= self.geometric * (2.0 * height);
        }
        let value = self.evaluate_local(wi);
        if value.pdf <= 0.0 {
            return None;
        }
        Some(BsdfSample { direction: self.frame.to_world(wi).normalize(), value })
    }
}
