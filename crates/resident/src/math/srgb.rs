/// Decodes an sRGB-encoded value in 0..=1 to linear light (IEC 61966-2-1).
#[inline]
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { super::pow((v + 0.055) / 1.055, 2.4) }
}

/// Linear light by 8-bit sRGB value.
pub static SRGB8: [f32; 256] = srgb8_table();

const fn srgb8_table() -> [f32; 256] {
    let mut table = [0.0; 256];
    let mut i = 0;
    while i < 256 {
        let v = i as f64 / 255.0;
        table[i] = if v <= 0.04045 {
            (v / 12.92) as f32
        } else {
            // x^2.4 = x^2 y with y^5 = x^2, by Newton's method: powers are not constant functions.
            let x = (v + 0.055) / 1.055;
            let x2 = x * x;
            let mut y = 1.0;
            let mut step = 0;
            while step < 60 {
                let y4 = y * y * y * y;
                y -= (y4 * y - x2) / (5.0 * y4);
                step += 1;
            }
            (x2 * y) as f32
        };
        i += 1;
    }
    table
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
