//! Floating-point neighbours and rounding bounds (Pharr, Jakob, Humphreys: "Physically Based Rendering", 4th edition,
//! section 6.8).

/// Bounds the relative error of `n` roundings in a row: `n u / (1 - n u)` with `u = 2^-24`.
#[inline]
pub const fn gamma(n: u32) -> f32 {
    let e = n as f32 * (f32::EPSILON * 0.5);
    e / (1.0 - e)
}

/// The next larger float; infinity and NaN stay.
#[inline]
pub fn next_float_up(v: f32) -> f32 {
    if v.is_nan() || v == f32::INFINITY {
        return v;
    }
    // -0.0 is stepped over: its bits are those of a negative number.
    let bits = if v == 0.0 { 0 } else { v.to_bits() };
    f32::from_bits(if bits >> 31 == 0 { bits + 1 } else { bits - 1 })
}

/// The next smaller float; negative infinity and NaN stay.
#[inline]
pub fn next_float_down(v: f32) -> f32 {
    -next_float_up(-v)
}

/// Maps 32 random bits to `0 <= u < 1`, in steps of 2^-24.
#[inline]
pub fn unit_float(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_one_step_apart() {
        for v in [0.0f32, -0.0, 1.0, -1.0, 1e-40, -1e-40, 3e38, f32::MAX, -f32::MAX] {
            let up = next_float_up(v);
            assert!(up > v, "{v}");
            assert!(up == f32::INFINITY || next_float_down(up) == v, "{v}");
            assert!(next_float_down(v) < v, "{v}");
        }
        assert_eq!(next_float_up(f32::INFINITY), f32::INFINITY);
        assert_eq!(next_float_down(f32::NEG_INFINITY), f32::NEG_INFINITY);
        assert!(next_float_up(f32::NAN).is_nan());
    }

    #[test]
    fn unit_floats_stay_below_one() {
        assert_eq!(unit_float(0), 0.0);
        assert!(unit_float(u32::MAX) < 1.0);
    }
}
