//! Texture filtering, written out: decode, wrap, nearest, bilinear, trilinear.

use crate::scene::ResidentScene;
use glam::{Vec2, Vec4};
use orthant_resident::image::{ImageData, MipLevel, MipMode, Sampling, TexelFormat, Wrap};
use orthant_resident::math::{SRGB8, log2, srgb_to_linear};
use orthant_resident::rows::TextureSlot;

/// Reads a material's texture at a point, in linear light; `None` where there is none. `footprint` is the area of the
/// pixel's (or ray's) footprint in squared units of the slot's UV set; 0 asks for the finest level.
#[inline]
pub fn sample_slot(scene: &ResidentScene, slot: &TextureSlot, uv: &[Vec2; 2], footprint: [f32; 2]) -> Option<Vec4> {
    let row = scene.textures.get(slot.texture as usize)?;
    let image = scene.images.get(row.image as usize)?.as_deref()?;
    let set = (slot.uv_set & 1) as usize;
    let uv = transform_uv(slot, uv[set]);
    let level = texture_level(slot, image, footprint[set]);
    Some(sample_image(image, Sampling::unpack(row.sampling), uv, level))
}

/// KHR_texture_transform.
#[inline]
pub fn transform_uv(slot: &TextureSlot, uv: Vec2) -> Vec2 {
    let [r0, r1] = slot.transform;
    Vec2::new(r0[0] * uv.x + r0[1] * uv.y + r0[2], r1[0] * uv.x + r1[1] * uv.y + r1[2])
}

/// The level at which the footprint covers one texel: half the logarithm of its area in texels of level 0.
#[inline]
pub fn texture_level(slot: &TextureSlot, image: &ImageData, footprint: f32) -> f32 {
    let [r0, r1] = slot.transform;
    let scale = (r0[0] * r1[1] - r0[1] * r1[0]).abs();
    let base = &image.levels[0];
    0.5 * log2(footprint * scale * (base.width as f32 * base.height as f32))
}

/// Reads an image at texture coordinates `uv` and level of detail `level` (levels up to 0 are magnified).
#[inline]
pub fn sample_image(image: &ImageData, sampling: Sampling, uv: Vec2, level: f32) -> Vec4 {
    if level <= 0.0 {
        return sample_level(image, 0, sampling, uv, sampling.mag_nearest);
    }
    let last = (image.levels.len() - 1) as f32;
    let level = level.min(last);
    match sampling.mip {
        MipMode::Base => sample_level(image, 0, sampling, uv, sampling.min_nearest),
        MipMode::Nearest => sample_level(image, (level + 0.5) as usize, sampling, uv, sampling.min_nearest),
        MipMode::Linear => {
            let lower = level as usize;
            let fraction = level - lower as f32;
            let fine = sample_level(image, lower, sampling, uv, sampling.min_nearest);
            if fraction == 0.0 {
                return fine;
            }
            let coarse = sample_level(image, lower + 1, sampling, uv, sampling.min_nearest);
            fine * (1.0 - fraction) + coarse * fraction
        }
    }
}

#[inline]
fn sample_level(image: &ImageData, level: usize, sampling: Sampling, uv: Vec2, nearest: bool) -> Vec4 {
    let level = &image.levels[level.min(image.levels.len() - 1)];
    let (w, h) = (level.width as i32, level.height as i32);
    let x = wrap_coordinate(sampling.wrap_s, uv.x) * w as f32;
    let y = wrap_coordinate(sampling.wrap_t, uv.y) * h as f32;
    if nearest {
        let (x, y) =
            (wrap_texel(sampling.wrap_s, x.floor() as i32, w), wrap_texel(sampling.wrap_t, y.floor() as i32, h));
        return fetch_texel(image, level, x, y);
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let (xf, yf) = (x.floor(), y.floor());
    let (fx, fy) = (x - xf, y - yf);
    let (xi, yi) = (xf as i32, yf as i32);
    let (x0, x1) = (wrap_texel(sampling.wrap_s, xi, w), wrap_texel(sampling.wrap_s, xi + 1, w));
    let (y0, y1) = (wrap_texel(sampling.wrap_t, yi, h), wrap_texel(sampling.wrap_t, yi + 1, h));
    let top = fetch_texel(image, level, x0, y0) * (1.0 - fx) + fetch_texel(image, level, x1, y0) * fx;
    let bottom = fetch_texel(image, level, x0, y1) * (1.0 - fx) + fetch_texel(image, level, x1, y1) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// Brings a coordinate near 0..1 before it is scaled, so that far-out coordinates keep their texel: 0..1 for repeat,
/// 0..2 for mirrored repeat. Non-finite ones count as 0.
#[inline]
fn wrap_coordinate(wrap: Wrap, u: f32) -> f32 {
    let u = if u.is_finite() { u } else { 0.0 };
    match wrap {
        Wrap::Repeat => u - u.floor(),
        Wrap::MirroredRepeat => u - 2.0 * (0.5 * u).floor(),
        Wrap::ClampToEdge => u.clamp(-1.0, 2.0),
    }
}

/// The texel that stands for index `i` (within -1..=2 n) of `n`.
#[inline]
fn wrap_texel(wrap: Wrap, i: i32, n: i32) -> u32 {
    let i = match wrap {
        Wrap::Repeat => {
            if i < 0 {
                i + n
            } else if i >= n {
                i - n
            } else {
                i
            }
        }
        Wrap::MirroredRepeat => {
            let i = if i < 0 { -1 - i } else { i };
            let i = if i >= 2 * n { i - 2 * n } else { i };
            if i >= n { 2 * n - 1 - i } else { i }
        }
        Wrap::ClampToEdge => i,
    };
    i.clamp(0, n - 1) as u32
}

/// One texel in linear light.
#[inline]
fn fetch_texel(image: &ImageData, level: &MipLevel, x: u32, y: u32) -> Vec4 {
    let i = y as usize * level.width as usize + x as usize;
    let unorm16 = |t: &[u8], k: usize| u16::from_le_bytes([t[2 * k], t[2 * k + 1]]) as f32 / 65535.0;
    match image.format {
        TexelFormat::Rgba8Linear => {
            let t = &image.texels[level.offset + 4 * i..][..4];
            Vec4::new(t[0] as f32, t[1] as f32, t[2] as f32, t[3] as f32) / 255.0
        }
        TexelFormat::Rgba8Srgb => {
            let t = &image.texels[level.offset + 4 * i..][..4];
            let c = |k: usize| SRGB8[t[k] as usize];
            Vec4::new(c(0), c(1), c(2), t[3] as f32 / 255.0)
        }
        TexelFormat::Rgba16Linear => {
            let t = &image.texels[level.offset + 8 * i..][..8];
            Vec4::new(unorm16(t, 0), unorm16(t, 1), unorm16(t, 2), unorm16(t, 3))
        }
        TexelFormat::Rgba16Srgb => {
            let t = &image.texels[level.offset + 8 * i..][..8];
            let c = |k: usize| srgb_to_linear(unorm16(t, k));
            Vec4::new(c(0), c(1), c(2), unorm16(t, 3))
        }
        TexelFormat::Rgba32Float => {
            let t = &image.texels[level.offset + 16 * i..][..16];
            let f = |k: usize| f32::from_le_bytes([t[4 * k], t[4 * k + 1], t[4 * k + 2], t[4 * k + 3]]);
            Vec4::new(f(0), f(1), f(2), f(3))
        }
    }
}
#[cfg(test)]
mod tests;
