//! The choice among kinds of light, and among punctual lights.
//!
//! At every vertex one sample goes to the lights that rays can hit too: emissive triangles, the environment map or the
//! sun ([`LightKinds`] chooses, with the same probabilities everywhere, so that MIS knows the density of a direction).
//! Another goes to the punctual lights, which no ray can hit: it is chosen by resampling ([`PunctualDistribution`]). Where
//! lights are many, a [`LightTree`] says which are likely to matter at the vertex.

use crate::environment::Sun;
use crate::math::luminance;
use crate::rows::{LightKind, LightRow, NONE};
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
    /// Directional lights that shine.
    directional: RowSet,
    /// Others that shine.
    local: RowSet,
    /// The tree over the local ones by row; empty where they are so few that all are candidates.
    pub tree: LightTree,
    /// Rows of the light buffer.
    len: usize,
}

impl PunctualDistribution {
    /// Looks at all rows of the light buffer.
    pub fn build(lights: &[LightRow]) -> Self {
        let mut distribution = Self::default();
        distribution.update(lights, 0..lights.len() as u32);
        distribution
    }

    /// Follows changed rows of the light buffer, each named once; rows past the end of a shorter buffer need not be. O(log n)
    /// each.
    pub fn update(&mut self, lights: &[LightRow], changed: impl IntoIterator<Item = u32>) {
        let gone = lights.len()..std::mem::replace(&mut self.len, lights.len());
        let changed = changed.into_iter().filter(|&row| (row as usize) < lights.len());
        let bounds = |row: u32| lights.get(row as usize).and_then(LightBounds::of_light);
        let changes: Vec<_> = changed.chain(gone.map(|row| row as u32)).map(|row| (row, bounds(row))).collect();
        for &(row, bounds) in &changes {
            self.directional.put(row, lights.get(row as usize).is_some_and(is_sun));
            self.local.put(row, bounds.is_some());
        }
        if self.local.rows.len() <= PUNCTUAL_CANDIDATES - DIRECTIONAL_CANDIDATES {
            self.tree.clear();
        } else if self.tree.is_empty() {
            let all: Vec<_> = self.local.rows.iter().map(|&row| (row, bounds(row))).collect();
            self.tree.update(&all);
        } else {
            self.tree.update(&changes);
        }
    }

    /// Rows of the directional lights that shine; ascending where all are candidates.
    pub fn directional(&self) -> &[u32] {
        &self.directional.rows
    }

    /// Rows of the others that shine; ascending where all are candidates.
    pub fn local(&self) -> &[u32] {
        &self.local.rows
    }

    /// Whether no light shines.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.directional().is_empty() && self.local().is_empty()
    }

    /// Number of candidates at a vertex, at most [`PUNCTUAL_CANDIDATES`].
    #[inline]
    pub fn candidates(&self) -> usize {
        let local = if self.tree.is_empty() { self.local().len() } else { TREE_CANDIDATES };
        self.directional().len().min(DIRECTIONAL_CANDIDATES) + local
    }

    /// Candidate `j` of a surface at `from` with the normal `normal`, as for [`LightTree::sample`]: its row, and the inverse
    /// of the number of times that it is expected among the candidates. `seed` in 0..1 decides all of them, which are spread
    /// evenly over the lights, or over their shares in the tree. `None` where the tree leads to none.
    #[inline]
    pub fn candidate(&self, j: usize, seed: f32, from: Vec3, normal: Vec3) -> Option<(usize, f32)> {
        let even = |j: usize, n: usize| ((j as f32 + seed) / n as f32).min(1.0 - f32::EPSILON / 2.0);
        let directional = self.directional().len().min(DIRECTIONAL_CANDIDATES);
        if j < directional {
            let n = self.directional().len();
            if n <= DIRECTIONAL_CANDIDATES {
                return Some((self.directional()[j] as usize, 1.0));
            }
            let i = ((even(j, directional) * n as f32) as usize).min(n - 1);
            return Some((self.directional()[i] as usize, n as f32 / directional as f32));
        }
        let j = j - directional;
        if self.tree.is_empty() {
            return Some((*self.local().get(j)? as usize, 1.0));
        }
        let (row, probability) = self.tree.sample(from, normal, even(j, TREE_CANDIDATES))?;
        Some((row as usize, 1.0 / (TREE_CANDIDATES as f32 * probability)))
    }
}

/// Whether it is a directional light that shines.
fn is_sun(light: &LightRow) -> bool {
    let luminance = luminance(Vec3::from_array(light.color));
    light.kind == LightKind::Directional as u32 && luminance > 0.0 && luminance.is_finite()
}

/// A set of rows that can be counted through. Up to [`PUNCTUAL_CANDIDATES`] of them are in ascending order, so that the
/// candidates of a scene do not depend on how it came to be.
#[derive(Clone, Debug, Default, PartialEq)]
struct RowSet {
    rows: Vec<u32>,
    /// By row: where it is in `rows`, or [`NONE`].
    places: Vec<u32>,
}

impl RowSet {
    /// Takes a row in or out. O(1).
    fn put(&mut self, row: u32, is_member: bool) {
        let place = self.places.get(row as usize).copied().unwrap_or(NONE);
        if (place != NONE) == is_member {
            return;
        }
        if is_member {
            if row as usize >= self.places.len() {
                self.places.resize(row as usize + 1, NONE);
            }
            self.places[row as usize] = self.rows.len() as u32;
            self.rows.push(row);
        } else {
            self.places[row as usize] = NONE;
            self.rows.swap_remove(place as usize);
            if let Some(&moved) = self.rows.get(place as usize) {
                self.places[moved as usize] = place;
            }
        }
        if self.rows.len() <= PUNCTUAL_CANDIDATES {
            self.rows.sort_unstable();
            for (place, &row) in (0..).zip(&self.rows) {
                self.places[row as usize] = place;
            }
        }
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

    /// All candidates with their probabilities, and what the tree holds.
    fn choice(distribution: &PunctualDistribution) -> (Vec<Option<(usize, f32)>>, Vec<u32>) {
        let few = if distribution.tree.is_empty() { distribution.candidates() } else { 0 };
        let rows = (0..few).map(|j| distribution.candidate(j, 0.5, Vec3::ONE, Vec3::Y)).collect();
        let leads = |&row: &u32| distribution.tree.get(row).is_some();
        (rows, (0..distribution.len as u32).filter(leads).collect())
    }

    #[test]
    fn lights_that_come_and_go_are_followed_on_both_sides_of_every_limit() {
        let random = |step: u32, below: u32| crate::sampling::hash_mix(step) % below;
        let kinds = [LightKind::None, LightKind::Directional, LightKind::Point, LightKind::Spot];
        let mut lights: Vec<LightRow> = Vec::new();
        let mut followed = PunctualDistribution::default();
        let (mut crossings, mut most_suns) = (0, 0);
        for step in 0..6000 {
            // The buffer breathes, and so do the numbers of both kinds.
            let wanted = if step / 500 % 2 == 0 { 60 } else { 8 };
            let mut changed = Vec::new();
            if step % 20 == 0 {
                let len = random(step + 7, wanted) as usize;
                changed.extend(lights.len() as u32..len as u32);
                lights.resize(len, row(kinds[(step / 700) as usize % 4], 1.0));
            }
            for k in 0..random(step, 4).min(lights.len() as u32) {
                let at = random(step + 10_000 * (k + 1), lights.len() as u32);
                let kind = kinds[random(step + 20_000 * (k + 1), 4) as usize];
                let position = [random(step, 17) as f32, 1.0, random(step, 13) as f32];
                lights[at as usize] = LightRow { position, ..row(kind, (step % 5) as f32) };
                if !changed.contains(&at) {
                    changed.push(at);
                }
            }
            let had_tree = !followed.tree.is_empty();
            followed.update(&lights, changed);
            followed.tree.validate().unwrap();
            crossings += u32::from(had_tree == followed.tree.is_empty());
            most_suns = most_suns.max(followed.directional().len());
            let fresh = PunctualDistribution::build(&lights);
            assert_eq!(followed.candidates(), fresh.candidates());
            let sorted = |rows: &[u32]| {
                let mut rows = rows.to_vec();
                rows.sort_unstable();
                rows
            };
            if fresh.directional().len() <= PUNCTUAL_CANDIDATES {
                assert_eq!(choice(&followed), choice(&fresh));
                assert_eq!(followed.directional(), fresh.directional());
            }
            assert_eq!(sorted(followed.directional()), fresh.directional());
            assert_eq!(sorted(followed.local()), fresh.local());
        }
        assert!(crossings > 20 && most_suns > PUNCTUAL_CANDIDATES, "{crossings} {most_suns}");
    }

    #[test]
    fn one_light_of_many_costs_its_path() {
        for count in [1000, 100_000u32] {
            let place = |i: u32| {
                let random = crate::sampling::hash_mix(i);
                [(random % 500) as f32, 3.0, (random / 500 % 500) as f32]
            };
            let mut lights: Vec<LightRow> =
                (0..count).map(|i| LightRow { position: place(i), ..row(LightKind::Point, 1.0) }).collect();
            let mut distribution = PunctualDistribution::build(&lights);
            distribution.tree.take_counters();
            distribution.tree.take_writes();
            for step in 0..100 {
                let at = crate::sampling::hash_mix(step) % count;
                lights[at as usize].position = place(count + step);
                distribution.update(&lights, [at]);
                assert!(distribution.tree.take_counters().visited <= 9 * u64::from(count.ilog2()));
            }
        }
    }
}
