//! The choice among kinds of light, and among punctual lights.
//!
//! At every vertex one sample goes to the lights that rays can hit too: emissive triangles, the environment map or the
//! sun ([`LightKinds`] chooses, with the same probabilities everywhere, so that MIS knows the density of a direction).
//! Another goes to the punctual lights, which no ray can hit: it is chosen by resampling ([`PunctualDistribution`]). Where
//! lights are many, a [`LightTree`] says which are likely to matter at the vertex.

use crate::environment::Sun;
use crate::math::luminance;
use crate::rows::{LightKind, LightRow};
use crate::sampling::light_tree::{LightBounds, LightTree};
use glam::Vec3;
use std::f32::consts::PI;

/// Most candidates among punctual lights that are weighed at a vertex.
pub const PUNCTUAL_CANDIDATES: usize = 16;

/// Candidates among directional lights where they are more.
const DIRECTIONAL_CANDIDATES: usize = 4;

/// Candidates that are taken from the tree where there are more lights than candidates.
const TREE_CANDIDATES: usize = 4;

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

/// The choice of candidates among the punctual lights.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PunctualDistribution {
    /// Rows of the directional lights that shine.
    pub directional: Vec<u32>,
    /// Rows of the others that shine.
    pub local: Vec<u32>,
    /// The tree over all rows, for the local ones; empty where they are so few that all are candidates.
    pub tree: LightTree,
}

impl PunctualDistribution {
    /// Looks at the rows of the light buffer.
    pub fn build(lights: &[LightRow]) -> Self {
        let shines = |light: &LightRow| {
            let luminance = luminance(Vec3::from_array(light.color));
            luminance > 0.0 && luminance.is_finite()
        };
        let bounds: Vec<Option<LightBounds>> = lights.iter().map(LightBounds::of_light).collect();
        let rows =
            |is_one: &dyn Fn(usize) -> bool| (0..lights.len()).filter(|&i| is_one(i)).map(|i| i as u32).collect();
        let is_directional = |i: usize| lights[i].kind == LightKind::Directional as u32 && shines(&lights[i]);
        let mut distribution = Self {
            directional: rows(&is_directional),
            local: rows(&|i| bounds[i].is_some()),
            tree: LightTree::default(),
        };
        if distribution.local.len() > PUNCTUAL_CANDIDATES - DIRECTIONAL_CANDIDATES {
            distribution.tree = LightTree::build(&bounds);
        }
        distribution
    }

    /// Whether no light shines.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.directional.is_empty() && self.local.is_empty()
    }

    /// Number of candidates at a vertex, at most [`PUNCTUAL_CANDIDATES`].
    #[inline]
    pub fn candidates(&self) -> usize {
        let local = if self.tree.nodes.is_empty() { self.local.len() } else { TREE_CANDIDATES };
        self.directional.len().min(DIRECTIONAL_CANDIDATES) + local
    }

    /// Candidate `j` of a surface at `from` with the normal `normal`, as for [`LightTree::sample`]: its row, and the inverse
    /// of the number of times that it is expected among the candidates. `seed` in 0..1 decides all of them, which are spread
    /// evenly over the lights, or over their shares in the tree. `None` where the tree leads to none.
    #[inline]
    pub fn candidate(&self, j: usize, seed: f32, from: Vec3, normal: Vec3) -> Option<(usize, f32)> {
        let even = |j: usize, n: usize| ((j as f32 + seed) / n as f32).min(1.0 - f32::EPSILON / 2.0);
        let directional = self.directional.len().min(DIRECTIONAL_CANDIDATES);
        if j < directional {
            let n = self.directional.len();
            if n <= DIRECTIONAL_CANDIDATES {
                return Some((self.directional[j] as usize, 1.0));
            }
            let i = ((even(j, directional) * n as f32) as usize).min(n - 1);
            return Some((self.directional[i] as usize, n as f32 / directional as f32));
        }
        let j = j - directional;
        if self.tree.nodes.is_empty() {
            return Some((*self.local.get(j)? as usize, 1.0));
        }
        let (row, probability) = self.tree.sample(from, normal, even(j, TREE_CANDIDATES))?;
        Some((row as usize, 1.0 / (TREE_CANDIDATES as f32 * probability)))
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

    fn row(kind: LightKind, color: f32) -> LightRow {
        LightRow {
            kind: kind as u32,
            color: [color; 3],
            direction: [0.0, -1.0, 0.0],
            angle_scale: 2.0,
            angle_offset: -1.0,
            ..bytemuck::Zeroable::zeroed()
        }
    }

    #[test]
    fn few_punctual_lights_are_all_candidates_and_holes_are_none() {
        let lights = [
            row(LightKind::None, 5.0),
            row(LightKind::Point, 1.0),
            row(LightKind::Directional, 1.0),
            row(LightKind::Spot, 1.0),
            row(LightKind::Point, 0.0),
        ];
        let distribution = PunctualDistribution::build(&lights);
        let rows: Vec<_> = (0..distribution.candidates())
            .map(|j| distribution.candidate(j, 0.5, Vec3::ONE, Vec3::Y).unwrap())
            .collect();
        assert_eq!(rows, [(2, 1.0), (1, 1.0), (3, 1.0)]);
        assert!(PunctualDistribution::build(&lights[..1]).is_empty());
    }

    #[test]
    fn many_punctual_lights_are_expected_once_each() {
        let mut lights = vec![row(LightKind::Directional, 1.0); 7];
        for i in 0..100 {
            let position = [(i % 10) as f32, 3.0 + (i % 3) as f32, (i / 10) as f32];
            lights.push(LightRow { position, ..row(LightKind::Point, 1.0 + (i % 4) as f32) });
        }
        let distribution = PunctualDistribution::build(&lights);
        assert!(distribution.candidates() <= PUNCTUAL_CANDIDATES);
        let mut expected = vec![0.0f64; lights.len()];
        let n = 50_000;
        for k in 0..n {
            for j in 0..distribution.candidates() {
                let from = Vec3::new(4.2, 0.0, 6.1);
                let (row, weight) = distribution.candidate(j, (k as f32 + 0.5) / n as f32, from, Vec3::Y).unwrap();
                expected[row] += f64::from(weight) / f64::from(n);
            }
        }
        assert!(expected.iter().all(|e| (e - 1.0).abs() < 0.05), "{expected:?}");
    }
}
