//! Logarithm, exponential and power to the base 2 (Chebyshev fits).

/// Base-2 logarithm of a positive normal number; the absolute error is below 2e-7 for results in -1..1, relative 2e-7
/// beyond. Zero, negative and subnormal numbers give -126.
#[inline]
pub fn log2(x: f32) -> f32 {
    let x = x.max(f32::MIN_POSITIVE);
    let bits = x.to_bits();
    // Mantissa to sqrt(1/2)..sqrt(2), so that the result near x = 1 keeps its relative precision.
    let e = (bits.wrapping_sub(0x3f35_04f3) as i32) >> 23;
    let f = f32::from_bits(bits.wrapping_sub((e as u32) << 23)) - 1.0;
    let p = std::f32::consts::LOG2_E
        + f * (-0.721_347_35
            + f * (0.480_898_52
                + f * (-0.360_696_54
                    + f * (0.288_552_56
                        + f * (-0.239_608_12
                            + f * (0.204_857_65 + f * (-0.191_388_38 + f * (0.184_760_33 - f * 0.107_497_89))))))));
    e as f32 + f * p
}

/// 2 to the power of `x`; the relative error is below 3e-7 for |x| <= 126. Smaller arguments count as -126, larger ones
/// as 127.
#[inline]
pub fn exp2(x: f32) -> f32 {
    let x = x.clamp(-126.0, 127.0);
    let n = (x + 0.5).floor();
    let f = x - n;
    let p = 1.0
        + f * (std::f32::consts::LN_2
            + f * (0.240_226_5
                + f * (0.055_503_27 + f * (0.009_618_057 + f * (0.001_340_042_8 + f * 0.000_154_614_45)))));
    // n is -126..=127, so that the exponent field is 1..=254.
    p * f32::from_bits(((n as i32 + 127) as u32) << 23)
}

/// `x` to the power of `y` for x >= 0; 0 for x = 0. The relative error is about `2e-7 (1 + |y log2 x|)`.
#[inline]
pub fn pow(x: f32, y: f32) -> f32 {
    if x <= 0.0 { 0.0 } else { exp2(y * log2(x)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithm_is_within_its_error() {
        for i in 0..400_000 {
            let x = 2f64.powf(-40.0 + 80.0 * i as f64 / 400_000.0) as f32;
            let reference = (x as f64).log2();
            let error = (log2(x) as f64 - reference).abs();
            assert!(error <= 2e-7 * reference.abs().max(1.0), "{x} {error}");
        }
        assert_eq!(log2(1.0), 0.0);
        assert_eq!(log2(8.0), 3.0);
        assert_eq!(log2(0.0), -126.0);
    }

    #[test]
    fn exponential_is_within_its_error() {
        for i in 0..400_000 {
            let x = (-126.0 + 252.0 * i as f64 / 400_000.0) as f32;
            let reference = (x as f64).exp2();
            assert!(((exp2(x) as f64) / reference - 1.0).abs() < 3e-7, "{x}");
        }
        assert_eq!(exp2(0.0), 1.0);
        assert_eq!(exp2(5.0), 32.0);
        assert!(exp2(1000.0).is_finite() && exp2(-1000.0) > 0.0);
    }

    #[test]
    fn power_agrees_with_the_reference() {
        for i in 1..=1000 {
            let x = i as f32 / 1000.0;
            assert!((pow(x, 2.4) as f64 / (x as f64).powf(2.4) - 1.0).abs() < 6e-6, "{x}");
        }
        assert_eq!(pow(0.0, 2.4), 0.0);
    }
}
