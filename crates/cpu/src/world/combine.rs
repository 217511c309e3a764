//! From layers to one colour.

use glam::Vec3;
use orthant_resident::math::log2;
use orthant_resident::world::Combine;

/// Below this constant the mixture is linear: within `mix / 2` of the logarithm's.
const LEAST_MIX: f32 = 1e-3;

/// Sums up the layers of one sample, in their order.
#[derive(Clone, Copy, Debug)]
pub struct LayerSum {
    combine: Combine,
    layers: f32,
    /// Of all layers, or of those that hit something, by weight.
    hits: Vec3,
    weight: f32,
    sky: Vec3,
    sky_layers: f32,
}

impl LayerSum {
    /// Nothing yet.
    #[inline]
    pub fn new(combine: Combine) -> Self {
        Self { combine, layers: 0.0, hits: Vec3::ZERO, weight: 0.0, sky: Vec3::ZERO, sky_layers: 0.0 }
    }

    /// Adds the radiance of a layer: of a hit with the weight of its material, or with `None` of the sky.
    #[inline]
    pub fn add(&mut self, radiance: Vec3, weight: Option<f32>) {
        self.layers += 1.0;
        match (self.combine, weight) {
            (Combine::Mean, _) => self.hits += radiance,
            (Combine::Integral { .. }, Some(weight)) => {
                self.hits += radiance * weight;
                self.weight += weight;
            }
            (Combine::Integral { .. }, None) => {
                self.sky += radiance;
                self.sky_layers += 1.0;
            }
        }
    }

    /// The colour. `integral`: hits and sky are averaged separately, and mixed by `log(1 + k p) / log(1 + k)`, `p` being the share of
    /// the hits in all weight.
    #[inline]
    pub fn color(&self) -> Vec3 {
        let Combine::Integral { mix } = self.combine else { return self.hits / self.layers };
        let all = self.weight + self.sky_layers;
        if all <= 0.0 {
            return Vec3::ZERO;
        }
        let share = self.weight / all;
        // Towards 0 the quotient is lost in rounding, and its limit is the share.
        let mixed = if mix < LEAST_MIX { share } else { log2(1.0 + mix * share) / log2(1.0 + mix) };
        let mut color = Vec3::ZERO;
        if self.weight > 0.0 {
            color += self.hits / self.weight * mixed;
        }
        if self.sky_layers > 0.0 {
            color += self.sky / self.sky_layers * (1.0 - mixed);
        }
        color
    }
}
