//! Worlds from the model to the image: what is derived and edited in place is seen as it is, by a walk that knows neither leaves nor
//! trees.

mod convergence;
mod encodings;
mod images;
mod patches;
mod walk;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    /// From `low` to `high`, both included.
    fn between(&mut self, low: i64, high: i64) -> i64 {
        low + self.below((high - low + 1) as u64) as i64
    }

    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    /// A unit vector in four dimensions.
    fn direction(&mut self) -> [f32; 4] {
        loop {
            let v: [f32; 4] = std::array::from_fn(|_| 2.0 * self.unit() - 1.0);
            let l2: f32 = v.iter().map(|c| c * c).sum();
            if l2 > 0.01 && l2 <= 1.0 {
                return v.map(|c| c / l2.sqrt());
            }
        }
    }
}
