//! Texels as stored and as linear floats, row by row.

use super::srgb::{ENCODER, LINEAR_FROM_BYTE, linear_from_srgb, srgb_from_linear};
use glam::Vec4;
use orthant_resident::image::TexelFormat;
use std::sync::LazyLock;

/// What a byte stands for where it is not sRGB.
static UNORM_FROM_BYTE: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|i| i as f32 / 255.0));

/// Appends texels as linear RGBA.
pub(super) fn decode_row(format: TexelFormat, texels: &[u8], out: &mut Vec<Vec4>) {
    let u16_at = |t: &[u8], c: usize| f32::from(u16::from_ne_bytes([t[2 * c], t[2 * c + 1]])) / 65535.0;
    let f32_at = |t: &[u8], c: usize| f32::from_ne_bytes([t[4 * c], t[4 * c + 1], t[4 * c + 2], t[4 * c + 3]]);
    let unorm = &*UNORM_FROM_BYTE;
    let bytes = |color: &[f32; 256], out: &mut Vec<Vec4>| {
        out.extend(texels.as_chunks::<4>().0.iter().map(|t| {
            let [r, g, b, a] = t.map(usize::from);
            Vec4::new(color[r], color[g], color[b], unorm[a])
        }));
    };
    let wide = texels.chunks_exact(format.bytes());
    match format {
        TexelFormat::Rgba8Linear => bytes(unorm, out),
        TexelFormat::Rgba8Srgb => bytes(&LINEAR_FROM_BYTE, out),
        TexelFormat::Rgba16Linear => {
            out.extend(wide.map(|t| Vec4::new(u16_at(t, 0), u16_at(t, 1), u16_at(t, 2), u16_at(t, 3))));
        }
        TexelFormat::Rgba16Srgb => out.extend(wide.map(|t| {
            let [r, g, b] = [0, 1, 2].map(|c| linear_from_srgb(u16_at(t, c)));
            Vec4::new(r, g, b, u16_at(t, 3))
        })),
        TexelFormat::Rgba32Float => {
            out.extend(wide.map(|t| Vec4::new(f32_at(t, 0), f32_at(t, 1), f32_at(t, 2), f32_at(t, 3))));
        }
    }
}

/// Writes linear RGBA as texels, of which `out` has as many.
pub(super) fn encode_row(format: TexelFormat, texels: &[Vec4], out: &mut [u8]) {
    let unorm16 = |v: f32| ((v.clamp(0.0, 1.0) * 65535.0).round() as u16).to_ne_bytes();
    match format {
        TexelFormat::Rgba8Linear => {
            for (out, t) in out.as_chunks_mut::<4>().0.iter_mut().zip(texels) {
                *out = t.to_array().map(unorm8);
            }
        }
        TexelFormat::Rgba8Srgb => {
            let encoder = &*ENCODER;
            for (out, t) in out.as_chunks_mut::<4>().0.iter_mut().zip(texels) {
                *out = [encoder.byte(t.x), encoder.byte(t.y), encoder.byte(t.z), unorm8(t.w)];
            }
        }
        TexelFormat::Rgba16Linear => {
            for (out, t) in out.chunks_exact_mut(8).zip(texels) {
                out.copy_from_slice(t.to_array().map(unorm16).as_flattened());
            }
        }
        TexelFormat::Rgba16Srgb => {
            for (out, t) in out.chunks_exact_mut(8).zip(texels) {
                let [r, g, b] = [t.x, t.y, t.z].map(|v| unorm16(srgb_from_linear(v.clamp(0.0, 1.0))));
                out.copy_from_slice([r, g, b, unorm16(t.w)].as_flattened());
            }
        }
        TexelFormat::Rgba32Float => {
            for (out, t) in out.chunks_exact_mut(16).zip(texels) {
                out.copy_from_slice(bytemuck::bytes_of(&t.to_array()));
            }
        }
    }
}

/// 255 times a value, rounded (halves up).
fn unorm8(v: f32) -> u8 {
    let scaled = v.clamp(0.0, 1.0) * 255.0;
    // `f32::round` is a call where the processor has no instruction for it.
    let floor = scaled as u8;
    floor + u8::from(scaled - f32::from(floor) >= 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_rounded_as_round_does() {
        for i in 0..=1_000_000u32 {
            let v = i as f32 / 1_000_000.0;
            assert_eq!(unorm8(v), (v * 255.0).round() as u8, "{v}");
        }
        assert_eq!([-1.0, 2.0, f32::NAN].map(unorm8), [0, 255, 0]);
        for b in 0..255u8 {
            let half = (f32::from(b) + 0.5) / 255.0;
            for v in [half.next_down(), half, half.next_up()] {
                assert_eq!(unorm8(v), (v * 255.0).round() as u8, "{v}");
            }
        }
    }
}
