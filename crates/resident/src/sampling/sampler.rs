//! [`Sampler`]: random numbers keyed by what they decide.

use super::hash::hash_combine;
use super::sobol::{INDEX_BITS, owen_sobol};
use crate::math::unit_float;

/// What a set of four dimensions decides. The numbers are part of the contract between backends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum DimensionSet {
    /// 0, 1: the point within the pixel filter; 2, 3: the point on the lens. Bounce 0 only.
    Camera = 0,
    /// 0, 1: the direction; 2: the lobe; 3: Russian roulette.
    Bsdf = 1,
    /// 0, 1: the point on the emitter, in the map or in the sun; 2: the kind of light and the emitter; 3: the triangle.
    Light = 2,
    /// 0: the seed of the candidates; 1: the choice among them.
    Punctual = 3,
}

/// The random numbers of one sample of one pixel. Any number can be asked for in any order.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    key: u32,
    index: u32,
}

impl Sampler {
    /// The numbers of sample `sample` of pixel (x, y) of the image with the given seed.
    #[inline]
    pub fn new(seed: u32, x: u32, y: u32, sample: u32) -> Self {
        let key = hash_combine(hash_combine(hash_combine(seed, x), y), sample >> INDEX_BITS);
        Self { key, index: sample & ((1 << INDEX_BITS) - 1) }
    }

    /// Four numbers in 0..1 of one decision.
    #[inline]
    pub fn set(&self, bounce: u32, set: DimensionSet) -> [f32; 4] {
        owen_sobol(self.index, hash_combine(self.key, bounce * 4 + set as u32)).map(unit_float)
    }

    /// The key of alpha decisions along one ray: `ray` counts the rays of the path (a vertex has an even one that goes on
    /// and an odd one to a light).
    #[inline]
    pub fn alpha_key(&self, ray: u32) -> u32 {
        hash_combine(hash_combine(hash_combine(self.key, 0xa1fa), self.index), ray)
    }
}

/// A number in 0..1 for the alpha decision at one triangle: it depends on what is decided, not on the order in which
/// candidates are visited.
#[inline]
pub fn alpha_number(alpha_key: u32, render_node: u32, primitive: u32, triangle: u32) -> f32 {
    unit_float(hash_combine(hash_combine(hash_combine(alpha_key, render_node), primitive), triangle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_depend_on_every_part_of_their_key() {
        let base = Sampler::new(1, 2, 3, 4).set(5, DimensionSet::Bsdf);
        for other in [
            Sampler::new(9, 2, 3, 4).set(5, DimensionSet::Bsdf),
            Sampler::new(1, 9, 3, 4).set(5, DimensionSet::Bsdf),
            Sampler::new(1, 2, 9, 4).set(5, DimensionSet::Bsdf),
            Sampler::new(1, 2, 3, 9).set(5, DimensionSet::Bsdf),
            Sampler::new(1, 2, 3, 4 + 65_536).set(5, DimensionSet::Bsdf),
            Sampler::new(1, 2, 3, 4).set(6, DimensionSet::Bsdf),
            Sampler::new(1, 2, 3, 4).set(5, DimensionSet::Light),
        ] {
            assert_ne!(base, other);
        }
        assert_eq!(base, Sampler::new(1, 2, 3, 4).set(5, DimensionSet::Bsdf));
    }

    #[test]
    fn a_smooth_integral_converges_faster_than_with_random_numbers() {
        let mut squared = 0.0;
        for pixel in 0..64 {
            let mut sum = 0.0;
            for s in 0..256 {
                let [x, y, _, _] = Sampler::new(0, pixel, 0, s).set(1, DimensionSet::Bsdf);
                sum += (x * y) as f64;
            }
            squared += (sum / 256.0 - 0.25).powi(2);
        }
        // The standard deviation of one sample is 0.22: random numbers would give 0.0138.
        assert!((squared / 64.0).sqrt() < 0.001, "{}", (squared / 64.0).sqrt());
    }

    #[test]
    fn alpha_numbers_are_uniform_over_triangles_and_samples() {
        let mut counts = [0u32; 10];
        for sample in 0..100 {
            let key = Sampler::new(0, 7, 7, sample).alpha_key(0);
            for triangle in 0..1000 {
                counts[(alpha_number(key, 3, 1, triangle) * 10.0) as usize] += 1;
            }
        }
        assert!(counts.iter().all(|&c| c.abs_diff(10_000) < 450), "{counts:?}");
    }
}
