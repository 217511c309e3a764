//! Integer hashing.

/// Mixes 32 bits: a bijection in which every input bit flips every output bit with a probability near one half (two
/// rounds of xorshift and multiply, with the constants that Wellons' "hash-prospector" search found).
#[inline]
pub fn hash_mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= x >> 15;
    x = x.wrapping_mul(0xd35a_2d97);
    x ^ (x >> 15)
}

/// Folds `value` into the hash `h`.
#[inline]
pub fn hash_combine(h: u32, value: u32) -> u32 {
    hash_mix(h.rotate_left(5).wrapping_add(0x9e37_79b9) ^ value.wrapping_mul(0x85eb_ca6b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_input_bit_flips_half_of_the_output() {
        for bit in 0..32 {
            let flips: u32 = (0..4096u32)
                .map(|i| {
                    (hash_mix(i.wrapping_mul(77_773)) ^ hash_mix(i.wrapping_mul(77_773) ^ (1 << bit))).count_ones()
                })
                .sum();
            let mean = flips as f32 / 4096.0;
            assert!((mean - 16.0).abs() < 0.5, "bit {bit}: {mean}");
        }
    }

    #[test]
    fn neighbouring_keys_are_uncorrelated() {
        let mut sum = 0.0;
        for i in 0..100_000u32 {
            let a = (hash_combine(hash_combine(1, i), 5) >> 8) as f64 / 16_777_216.0 - 0.5;
            let b = (hash_combine(hash_combine(1, i + 1), 5) >> 8) as f64 / 16_777_216.0 - 0.5;
            sum += a * b;
        }
        assert!((sum / 100_000.0 * 12.0).abs() < 0.015, "{sum}");
    }
}
