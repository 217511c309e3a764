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

/// Steps of linear values that [`Encoder`] tells apart by a table. Codes are at least 1/(255 * 12.92) apart, which is more
/// than a step, so that a step has one threshold at most.
const STEPS: usize = 4096;

/// From linear values to bytes.
pub(super) struct Encoder {
    /// The byte of the beginning of each step.
    of_step: [u8; STEPS],
    /// By byte: the linear value from which on it is larger.
    thresholds: [f32; 256],
}

/// The one encoder.
pub(super) static ENCODER: LazyLock<Encoder> = LazyLock::new(|| {
    let threshold = |b: usize| if b < 255 { linear_from_srgb((b as f32 + 0.5) / 255.0) } else { f32::INFINITY };
    let thresholds: [f32; 256] = std::array::from_fn(threshold);
    let of_step = |i: usize| {
        // A product that is rounded up to the next step is one that is nearly there.
        let begin = i as f32 / (STEPS - 1) as f32 * (1.0 - 1e-6);
        thresholds.partition_point(|&t| t <= begin) as u8
    };
    Encoder { of_step: std::array::from_fn(of_step), thresholds }
});

impl Encoder {
    /// The byte whose value is nearest in encoded space, as `round(255 * srgb_from_linear(v))` gives it.
    #[inline]
    pub fn byte(&self, v: f32) -> u8 {
        let v = v.clamp(0.0, 1.0);
        let byte = self.of_step[(v * (STEPS - 1) as f32) as usize];
        byte + u8::from(v >= self.thresholds[usize::from(byte)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_round_trip() {
        for b in 0..=255u8 {
            assert_eq!(ENCODER.byte(LINEAR_FROM_BYTE[usize::from(b)]), b);
        }
    }

    #[test]
    fn the_table_is_the_formula() {
        for i in 0..=100_000 {
            let v = i as f32 / 100_000.0;
            let exact = srgb_from_linear(v) * 255.0;
            assert!((f32::from(ENCODER.byte(v)) - exact).abs() <= 0.5001, "{v}");
        }
    }

    #[test]
    fn a_byte_changes_at_its_threshold() {
        for b in 0..255u8 {
            let threshold = ENCODER.thresholds[usize::from(b)];
            assert_eq!([threshold.next_down(), threshold].map(|v| ENCODER.byte(v)), [b, b + 1]);
        }
        for i in 0..STEPS {
            // Around every step of the table.
            let v = i as f32 / (STEPS - 1) as f32;
            for v in [v.next_down().max(0.0), v, v.next_up()] {
                let byte = ENCODER.thresholds.partition_point(|&t| t <= v.min(1.0)) as u8;
                assert_eq!(ENCODER.byte(v), byte, "{v}");
            }
        }
        assert_eq!([-1.0, 2.0, f32::NAN].map(|v| ENCODER.byte(v)), [0, 255, 0]);
    }
}
