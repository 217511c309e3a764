//! The choice among kinds of light, and among punctual lights.
//!
//! At every vertex one sample goes to the lights that rays can hit too: emissive triangles, the environment map or the
//! sun ([`LightKinds`] chooses, with the same probabilities everywhere, so that MIS knows the density of a direction).
//! Another goes to the punctual lights, which no ray can hit: it is chosen by resampling ([`PunctualDistribution`]).

use crate::environment::Sun;
use crate::math::luminance;
use crate::rows::{LightKind, LightRow, MeshDesc, NodeFlags, RenderNodeRow};
use glam::Vec3;
use std::f32::consts::PI;

/// Most punctual lights that are weighed at a vertex: all of them where there are no more, else a sample by power.
pub const PUNCTUAL_CANDIDATES: usize = 16;

/// Probabilities of the kinds of light that have a size; they sum to 1, or are all 0 without such lights.
///
/// Half of the probability is shared equally by the kinds that are there and half in proportion to their power, so that
/// neither a lamp in a closed room under a bright sky nor a window beside a weak lamp is starved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightKinds {
    /// Emissive triangles.
    pub emitters: f32,
    /// The environment map.
    pub environment: f32,
    /// The sun.
    pub sun: f32,
}

impl LightKinds {
    /// Probabilities from powers in watts; a kind without power is never chosen.
    pub fn from_powers(emitters: f32, environment: f32, sun: f32) -> Self {
        let powers = [emitters, environment, sun].map(|p| if p > 0.0 { p.min(1e30) } else { 0.0 });
        let count = powers.iter().filter(|&&p| p > 0.0).count();
        if count == 0 {
            return Self::default();
        }
        let total: f32 = powers.iter().sum();
        let [emitters, environment, sun] =
            powers.map(|p| if p > 0.0 { 0.5 / count as f32 + 0.5 * p / total } else { 0.0 });
        Self { emitters, environment, sun }
    }

    /// Whether there is nothing to choose.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.emitters + self.environment + self.sun == 0.0
    }
}

/// Power in watts that radiance from infinity with the given integral over the sphere brings into a sphere of `radius`
/// metres.
pub fn distant_power(integral: f32, radius: f32) -> f32 {
    PI * radius * radius * integral
}

/// Irradiance in W/m^2 that the sun's disc gives to a surface that faces it, as luminance.
pub fn sun_integral(sun: &Sun) -> f32 {
    luminance(Vec3::from_array(sun.radiance)) * 2.0 * PI * (1.0 - sun.cos_radius)
}

/// Radius in metres of a sphere about everything that is seen, from the bounds of the MeshDescs; 1 for an empty scene. It
/// weighs lights at infinity, so that its precision does not matter, but every backend has to compute it alike.
pub fn scene_radius(render_nodes: &[RenderNodeRow], mesh_descs: &[MeshDesc]) -> f32 {
    let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for node in render_nodes.iter().filter(|n| n.flags & NodeFlags::VISIBLE != 0) {
        let Some(desc) = mesh_descs.get(node.primitive as usize) else { continue };
        let (a, b) = (Vec3::from(desc.bounds_min), Vec3::from(desc.bounds_max));
        let center = node.world.transform_point((a + b) * 0.5);
        let half = (b - a) * 0.5;
        let r = &node.world.rows;
        let extent = |i: usize| r[i][0].abs() * half.x + r[i][1].abs() * half.y + r[i][2].abs() * half.z;
        let half = Vec3::new(extent(0), extent(1), extent(2));
        if (center + half).is_finite() && (center - half).is_finite() {
            lo = lo.min(center - half);
            hi = hi.max(center + half);
        }
    }
    let radius = 0.5 * (hi - lo).length();
    if radius > 0.0 && radius.is_finite() { radius } else { 1.0 }
}

/// Cumulative power of the punctual lights.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PunctualDistribution {
    /// Normalised cumulative power by row of the light buffer; the last is 1. Empty when no light shines.
    pub cumulative: Vec<f32>,
}

impl PunctualDistribution {
    /// Builds the table; `radius` bounds the scene, in metres, and gives directional lights a power.
    pub fn build(lights: &[LightRow], radius: f32) -> Self {
        let mut sum = 0.0f64;
        let mut cumulative: Vec<f32> = lights
            .iter()
            .map(|light| {
                let power = punctual_power(light, radius);
                sum += if power > 0.0 && power.is_finite() { power as f64 } else { 0.0 };
                sum as f32
            })
            .collect();
        let total = sum as f32;
        if !(total > 0.0 && total.is_finite()) {
            return Self::default();
        }
        for c in &mut cumulative {
            *c /= total;
        }
        Self { cumulative }
    }
}

fn punctual_power(light: &LightRow, radius: f32) -> f32 {
    let intensity = luminance(Vec3::from_array(light.color));
    match light.kind {
        k if k == LightKind::Directional as u32 => PI * radius * radius * intensity,
        k if k == LightKind::Point as u32 => 4.0 * PI * intensity,
        k if k == LightKind::Spot as u32 => {
            let cos_outer = -light.angle_offset / light.angle_scale;
            2.0 * PI * (1.0 - cos_outer).max(1e-6) * intensity
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_that_shines_is_chosen_at_least_one_time_in_six() {
        let kinds = LightKinds::from_powers(1e-6, 1e6, 10.0);
        assert!((kinds.emitters + kinds.environment + kinds.sun - 1.0).abs() < 1e-6);
        assert!(kinds.emitters >= 1.0 / 6.0 && kinds.sun >= 1.0 / 6.0 && kinds.environment > 0.6);
        assert_eq!(LightKinds::from_powers(0.0, 3.0, f32::NAN).environment, 1.0);
        assert!(LightKinds::from_powers(0.0, 0.0, 0.0).is_empty());
        assert!(!LightKinds::from_powers(f32::INFINITY, 1.0, 0.0).environment.is_nan());
    }

    #[test]
    fn the_radius_is_that_of_what_is_seen() {
        let desc = MeshDesc { bounds_min: [-1.0; 3], bounds_max: [1.0; 3], ..bytemuck::Zeroable::zeroed() };
        let mut near = RenderNodeRow { primitive: 0, flags: NodeFlags::VISIBLE, ..RenderNodeRow::HOLE };
        near.world.rows[0][3] = 4.0;
        let hidden = RenderNodeRow { flags: 0, ..near };
        let radius = scene_radius(&[near, RenderNodeRow::HOLE, hidden], &[desc]);
        assert!((radius - 3f32.sqrt()).abs() < 1e-6);
        assert_eq!(scene_radius(&[], &[desc]), 1.0);
    }

    #[test]
    fn punctual_lights_are_weighed_by_power_and_holes_not_at_all() {
        let row = |kind: LightKind, color: f32| LightRow {
            kind: kind as u32,
            color: [color; 3],
            angle_scale: 2.0,
            angle_offset: -1.0,
            ..bytemuck::Zeroable::zeroed()
        };
        let lights = [
            row(LightKind::None, 5.0),
            row(LightKind::Point, 1.0),
            row(LightKind::Spot, 1.0),
            row(LightKind::Directional, 1.0),
        ];
        let c = PunctualDistribution::build(&lights, 2.0).cumulative;
        assert_eq!(c[0], 0.0);
        // 4 pi, 2 pi (1 - 1/2) and pi 2^2.
        assert!((c[1] - 4.0 / 9.0).abs() < 1e-6 && (c[2] - 5.0 / 9.0).abs() < 1e-6 && c[3] == 1.0);
        assert!(PunctualDistribution::build(&lights[..1], 2.0).cumulative.is_empty());
    }
}
