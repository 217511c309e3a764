/// Decodes an sRGB-encoded value in 0..=1 to linear light (IEC 61966-2-1).
#[inline]
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { super::pow((v + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_decodes_to_the_standards_curve() {
        for i in 0..=65535u32 {
            let v = i as f64 / 65535.0;
            let reference = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
            let error = (srgb_to_linear(v as f32) as f64 - reference).abs();
            assert!(error <= 3e-6 * reference, "{i}: {error}");
        }
        assert_eq!(srgb_to_linear(1.0), 1.0);
    }
}
