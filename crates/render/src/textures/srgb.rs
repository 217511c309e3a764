//! The sRGB transfer functions (IEC 61966-2-1).

use std::sync::LazyLock;

/// Linear value of an encoded one, both 0..=1.
pub fn linear_from_srgb(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Encoded value of a linear one, both 0..=1.
pub fn srgb_from_linear(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// [`linear_from_srgb`] of every byte.
pub(super) static LINEAR_FROM_BYTE: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// Bytes by linear value in steps of 1/4095: exact to within one code, which [`byte_from_linear`] then corrects.
static BYTE_FROM_STEP: LazyLock<[u8; 4096]> =
    LazyLock::new(|| std::array::from_fn(|i| (srgb_from_linear(i as f32 / 4095.0) * 255.0).round() as u8));

/// The byte whose value is nearest in encoded space, as `round(255 * srgb_from_linear(v))` gives it.
pub(super) fn byte_from_linear(v: f32) -> u8 {
    let v = v.clamp(0.0, 1.0);
    let mut byte = BYTE_FROM_STEP[(v * 4095.0) as usize];
    // The table is one step of 1/4095 coarse, which is up to four codes near black.
    while byte < 255 && v >= THRESHOLDS[usize::from(byte)] {
        byte += 1;
    }
    while byte > 0 && v < THRESHOLDS[usize::from(byte) - 1] {
        byte -= 1;
    }
    byte
}

/// `THRESHOLDS[b]`: the linear value from which on the byte is larger than `b`.
static THRESHOLDS: LazyLock<[f32; 255]> =
    LazyLock::new(|| std::array::from_fn(|b| linear_from_srgb((b as f32 + 0.5) / 255.0)));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_round_trip() {
        for b in 0..=255u8 {
            assert_eq!(byte_from_linear(LINEAR_FROM_BYTE[usize::from(b)]), b);
        }
    }

    #[test]
    fn the_table_is_the_formula() {
        for i in 0..=100_000 {
            let v = i as f32 / 100_000.0;
            let exact = srgb_from_linear(v) * 255.0;
            assert!((f32::from(byte_from_linear(v)) - exact).abs() <= 0.5001, "{v}");
        }
    }
}
