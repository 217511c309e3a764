//! Owen-scrambled Sobol points in four dimensions by hashing (Burley 2020, "Practical Hash-based Owen Scrambling").

/// Bits of a sample's index; beyond them the sampler starts another, independently scrambled sequence.
pub const INDEX_BITS: u32 = 16;

/// Sobol points, bit-reversed, by dimension, byte of the index and value of the byte: linear over GF(2), a point is the
/// XOR of its two entries. The generator matrices are those of Joe and Kuo 2008, dimensions 1 to 4.
static REVERSED_SOBOL: [[[u32; 256]; 2]; 4] = reversed_sobol_table();

const fn direction_numbers(dimension: usize) -> [u32; 32] {
    let mut v = [0u32; 32];
    if dimension == 0 {
        let mut k = 0;
        while k < 32 {
            v[k] = 1 << (31 - k);
            k += 1;
        }
        return v;
    }
    // Degree, coefficients and initial values of the primitive polynomials.
    let (s, a, m) = match dimension {
        1 => (1usize, 0u32, [1u32, 0, 0]),
        2 => (2, 1, [1, 3, 0]),
        _ => (3, 1, [1, 3, 1]),
    };
    let mut k = 0;
    while k < 32 {
        if k < s {
            v[k] = m[k] << (31 - k);
        } else {
            v[k] = v[k - s] ^ (v[k - s] >> s);
            let mut j = 1;
            while j < s {
                if (a >> (s - 1 - j)) & 1 == 1 {
                    v[k] ^= v[k - j];
                }
                j += 1;
            }
        }
        k += 1;
    }
    v
}

const fn reversed_sobol_table() -> [[[u32; 256]; 2]; 4] {
    let mut table = [[[0u32; 256]; 2]; 4];
    let mut dimension = 0;
    while dimension < 4 {
        let v = direction_numbers(dimension);
        let mut byte = 0;
        while byte < 2 {
            let mut value = 0;
            while value < 256 {
                let mut x = 0;
                let mut bit = 0;
                while bit < 8 {
                    if (value >> bit) & 1 == 1 {
                        x ^= v[byte * 8 + bit].reverse_bits();
                    }
                    bit += 1;
                }
                table[dimension][byte][value] = x;
                value += 1;
            }
            byte += 1;
        }
        dimension += 1;
    }
    table
}

/// The bit-reversed Sobol point of a 16-bit index.
#[inline]
pub fn reversed_sobol(index: u32, dimension: usize) -> u32 {
    let table = &REVERSED_SOBOL[dimension];
    table[0][(index & 0xff) as usize] ^ table[1][((index >> 8) & 0xff) as usize]
}

/// Hashes such that bit `i` of the result depends on bits `0..=i` of `x` only: on bit-reversed numbers this is an Owen
/// scramble (Laine and Karras 2011, section 3.1; the constants are Vegdahl's, which avoid the correlations of the
/// original ones).
#[inline]
pub fn laine_karras_permutation(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Shuffles a 16-bit index within every aligned power-of-two block (Burley 2020, section 3).
#[inline]
pub fn shuffle_index(index: u32, seed: u32) -> u32 {
    laine_karras_permutation(index.reverse_bits(), seed).reverse_bits() & ((1 << INDEX_BITS) - 1)
}

/// Four coordinates of the shuffled and scrambled point `index` of the sequence `seed`, as 32-bit fractions.
#[inline]
pub fn owen_sobol(index: u32, seed: u32) -> [u32; 4] {
    let index = shuffle_index(index, seed);
    let mut point = [0; 4];
    for (dimension, x) in point.iter_mut().enumerate() {
        let key = super::hash_mix(seed ^ (0x9e37_79b9u32.wrapping_mul(dimension as u32 + 1)));
        *x = laine_karras_permutation(reversed_sobol(index, dimension), key).reverse_bits();
    }
    point
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_points_are_those_of_sobol() {
        let point = |i: u32| [0, 1, 2, 3].map(|d| reversed_sobol(i, d).reverse_bits() as f64 / 4_294_967_296.0);
        assert_eq!(point(0), [0.0; 4]);
        assert_eq!(point(1), [0.5; 4]);
        assert_eq!(point(2), [0.25, 0.75, 0.75, 0.75]);
        assert_eq!(point(3), [0.75, 0.25, 0.25, 0.25]);
        assert_eq!(point(4), [0.125, 0.625, 0.375, 0.125]);
    }

    #[test]
    fn every_power_of_two_is_stratified_in_each_dimension() {
        for seed in [1u32, 0x1234_5678, 0xffff_ffff] {
            for d in 0..4 {
                for log in [4, 6, 10] {
                    let n = 1u32 << log;
                    let mut seen = vec![false; n as usize];
                    for i in 0..n {
                        let cell = owen_sobol(i, seed)[d] >> (32 - log);
                        assert!(!std::mem::replace(&mut seen[cell as usize], true), "seed {seed} dimension {d}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_first_two_dimensions_form_a_net() {
        let n = 256u32;
        for seed in [3u32, 99, 0xdead_beef] {
            for split in 0..=8u32 {
                let mut seen = vec![false; n as usize];
                for i in 0..n {
                    let p = owen_sobol(i, seed);
                    let x = if split == 0 { 0 } else { p[0] >> (32 - split) };
                    let y = if split == 8 { 0 } else { p[1] >> (32 - (8 - split)) };
                    let cell = (x << (8 - split)) | y;
                    assert!(!std::mem::replace(&mut seen[cell as usize], true), "seed {seed} split {split}");
                }
            }
        }
    }

    #[test]
    fn sequences_of_different_seeds_are_uncorrelated() {
        let mut sum = 0.0;
        for seed in 0..4000u32 {
            let a = owen_sobol(5, crate::sampling::hash_mix(seed))[0] as f64 / 4_294_967_296.0 - 0.5;
            let b = owen_sobol(5, crate::sampling::hash_mix(seed + 1))[0] as f64 / 4_294_967_296.0 - 0.5;
            sum += a * b;
        }
        assert!((sum / 4000.0 * 12.0).abs() < 0.06, "{sum}");
    }
}
