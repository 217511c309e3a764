//! Random numbers of the generators: SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators",
//! 2014), the same on every machine.

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Uniform in low..high.
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0..count; `count` is not 0.
    pub fn below(&mut self, count: usize) -> usize {
        (((self.bits() >> 32) * count as u64) >> 32) as usize
    }
}

/// Smooth noise in 0..1 over the plane: values at integer points, blended by the smoothstep polynomial.
pub fn value_noise(seed: u64, x: f32, y: f32) -> f32 {
    let (fx, fy) = (x.floor(), y.floor());
    let corner = |dx: i64, dy: i64| {
        let (ix, iy) = (fx as i64 + dx, fy as i64 + dy);
        let key = (ix as u64).wrapping_mul(0x8da6_b343) ^ (iy as u64).wrapping_mul(0xd816_3841_9e37_79b9);
        Random::new(seed ^ key).unit()
    };
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (tx, ty) = (smooth(x - fx), smooth(y - fy));
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    mix(mix(corner(0, 0), corner(1, 0), tx), mix(corner(0, 1), corner(1, 1), tx), ty)
}

/// Four octaves of [`value_noise`], in 0..1.
pub fn fractal_noise(seed: u64, x: f32, y: f32) -> f32 {
    let mut sum = 0.0;
    for octave in 0..4u32 {
        let frequency = (1u32 << octave) as f32;
        sum += value_noise(seed.wrapping_add(u64::from(octave)), x * frequency, y * frequency) / frequency;
    }
    sum / 1.875
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_their_ranges_and_spread_over_them() {
        let mut random = Random::new(7);
        let mut counts = [0; 5];
        for _ in 0..10_000 {
            counts[random.below(5)] += 1;
            let v = random.range(-2.0, 3.0);
            assert!((-2.0..3.0).contains(&v));
        }
        assert!(counts.iter().all(|&c| (1850..2150).contains(&c)), "{counts:?}");
        assert_eq!(Random::new(0).bits(), 0xe220_a839_7b1d_cdaf, "the published first output of seed 0");
    }

    #[test]
    fn noise_is_continuous_across_cells() {
        for i in -50..50 {
            let (x, y) = (i as f32, i as f32 * 0.37);
            assert!((value_noise(1, x - 1e-4, y) - value_noise(1, x + 1e-4, y)).abs() < 1e-3);
        }
    }
}
