//! Mip chains by an exact box filter in linear light.
//!
//! A texel of a level averages precisely the area that it covers: two texels each way where the size is even, three
//! with fractional weights where it is odd. sRGB images are averaged in linear light and encoded again.

use super::srgb::{LINEAR_FROM_BYTE, byte_from_linear, linear_from_srgb, srgb_from_linear};
use glam::{Vec3, Vec4};
use orthant_resident::image::{ImageData, MipLevel, TexelFormat};

/// Appends all smaller levels to an image that has level 0 only.
pub fn mip_chain(format: TexelFormat, width: u32, height: u32, mut texels: Vec<u8>) -> ImageData {
    let mut levels = vec![MipLevel { width, height, offset: 0 }];
    let chain: usize = level_sizes(width, height).map(|(w, h)| w as usize * h as usize * format.bytes()).sum();
    texels.reserve_exact(chain - texels.len());
    let (mut w, mut h) = (width as usize, height as usize);
    let mut current: Option<Vec<Vec4>> = None;
    while w > 1 || h > 1 {
        let (next_w, next_h) = ((w / 2).max(1), (h / 2).max(1));
        let next = match &current {
            Some(source) => halve((w, h), (next_w, next_h), |y, row| row.extend(&source[y * w..(y + 1) * w])),
            // Level 0 is decoded row by row: as floats it would be four times as large as the image.
            None => halve((w, h), (next_w, next_h), |y, row| {
                let bytes = w * format.bytes();
                decode(format, &texels[y * bytes..(y + 1) * bytes], row);
            }),
        };
        levels.push(MipLevel { width: next_w as u32, height: next_h as u32, offset: texels.len() });
        encode(format, &next, &mut texels);
        (w, h, current) = (next_w, next_h, Some(next));
    }
    ImageData { format, levels, texels }
}

/// Mean linear colour of an image.
pub fn mean_color(image: &ImageData) -> Vec3 {
    let level = image.levels[image.levels.len() - 1];
    let mut texels = Vec::new();
    decode(image.format, &image.texels[level.offset..], &mut texels);
    texels.iter().copied().sum::<Vec4>().truncate() / texels.len().max(1) as f32
}

/// Bytes of an image with all its levels.
pub(super) fn chain_bytes(format: TexelFormat, width: u32, height: u32) -> u64 {
    let texels = |(w, h)| u64::from(w) * u64::from(h);
    level_sizes(width, height).fold(0, |sum: u64, size| {
        // Declared sizes may be anything: what does not fit into the number fits into no budget either.
        sum.saturating_add(texels(size).saturating_mul(format.bytes() as u64))
    })
}

fn level_sizes(width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> {
    std::iter::successors(Some((width, height)), |&(w, h)| (w > 1 || h > 1).then(|| ((w / 2).max(1), (h / 2).max(1))))
}

/// The texels and weights that a texel of the next level averages along one axis.
fn taps(from: usize, to: usize, i: usize) -> [(usize, f32); 3] {
    if from == to {
        return [(i, 1.0), (i, 0.0), (i, 0.0)];
    }
    if from.is_multiple_of(2) {
        return [(2 * i, 0.5), (2 * i + 1, 0.5), (2 * i, 0.0)];
    }
    // from = 2 to + 1: the texel covers from/to = 2 + 1/to texels, beginning at i * from / to.
    let (n, i_f) = (to as f32, i as f32);
    let width = from as f32;
    [(2 * i, (n - i_f) / width), (2 * i + 1, n / width), (2 * i + 2, (i_f + 1.0) / width)]
}

/// Averages an image to the next size. `row(y, out)` appends a row of the source.
fn halve((w, h): (usize, usize), (next_w, next_h): (usize, usize), row: impl Fn(usize, &mut Vec<Vec4>)) -> Vec<Vec4> {
    let mut next = Vec::with_capacity(next_w * next_h);
    let columns: Vec<_> = (0..next_w).map(|x| taps(w, next_w, x)).collect();
    let mut sum = vec![Vec4::ZERO; w];
    let mut source = Vec::with_capacity(w);
    for y in 0..next_h {
        sum.fill(Vec4::ZERO);
        for (sy, weight) in taps(h, next_h, y).into_iter().filter(|t| t.1 > 0.0) {
            source.clear();
            row(sy, &mut source);
            for (sum, texel) in sum.iter_mut().zip(&source) {
                *sum += *texel * weight;
            }
        }
        next.extend(columns.iter().map(|[a, b, c]| sum[a.0] * a.1 + sum[b.0] * b.1 + sum[c.0] * c.1));
    }
    next
}

fn decode(format: TexelFormat, texels: &[u8], out: &mut Vec<Vec4>) {
    let u16_at = |t: &[u8], c: usize| f32::from(u16::from_ne_bytes([t[2 * c], t[2 * c + 1]])) / 65535.0;
    let f32_at = |t: &[u8], c: usize| f32::from_ne_bytes([t[4 * c], t[4 * c + 1], t[4 * c + 2], t[4 * c + 3]]);
    let unorm = |b: u8| f32::from(b) / 255.0;
    let table = &*LINEAR_FROM_BYTE;
    let linear = |b: u8| table[usize::from(b)];
    let texels = texels.chunks_exact(format.bytes());
    match format {
        TexelFormat::Rgba8Linear => {
            out.extend(texels.map(|t| Vec4::new(unorm(t[0]), unorm(t[1]), unorm(t[2]), unorm(t[3]))))
        }
        TexelFormat::Rgba8Srgb => {
            out.extend(texels.map(|t| Vec4::new(linear(t[0]), linear(t[1]), linear(t[2]), unorm(t[3]))));
        }
        TexelFormat::Rgba16Linear => {
            out.extend(texels.map(|t| Vec4::new(u16_at(t, 0), u16_at(t, 1), u16_at(t, 2), u16_at(t, 3))));
        }
        TexelFormat::Rgba16Srgb => out.extend(texels.map(|t| {
            let [r, g, b] = [0, 1, 2].map(|c| linear_from_srgb(u16_at(t, c)));
            Vec4::new(r, g, b, u16_at(t, 3))
        })),
        TexelFormat::Rgba32Float => {
            out.extend(texels.map(|t| Vec4::new(f32_at(t, 0), f32_at(t, 1), f32_at(t, 2), f32_at(t, 3))));
        }
    }
}

fn encode(format: TexelFormat, texels: &[Vec4], out: &mut Vec<u8>) {
    let unorm8 = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    let unorm16 = |v: f32| ((v.clamp(0.0, 1.0) * 65535.0).round() as u16).to_ne_bytes();
    for t in texels {
        match format {
            TexelFormat::Rgba8Linear => out.extend([unorm8(t.x), unorm8(t.y), unorm8(t.z), unorm8(t.w)]),
            TexelFormat::Rgba8Srgb => {
                out.extend([byte_from_linear(t.x), byte_from_linear(t.y), byte_from_linear(t.z), unorm8(t.w)]);
            }
            TexelFormat::Rgba16Linear => out.extend(t.to_array().map(unorm16).as_flattened()),
            TexelFormat::Rgba16Srgb => {
                let [r, g, b] = [t.x, t.y, t.z].map(|v| unorm16(srgb_from_linear(v.clamp(0.0, 1.0))));
                out.extend([r, g, b, unorm16(t.w)].as_flattened());
            }
            TexelFormat::Rgba32Float => out.extend(bytemuck::bytes_of(&t.to_array())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_checkerboard_is_half_the_light() {
        let texels = [[0, 0, 0, 255], [255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 255]].concat();
        let image = mip_chain(TexelFormat::Rgba8Srgb, 2, 2, texels);
        assert_eq!(image.levels.len(), 2);
        // Half of the light is 188 in sRGB, not 128.
        assert_eq!(&image.texels[image.levels[1].offset..], [188, 188, 188, 255]);
    }

    #[test]
    fn odd_sizes_keep_the_mean() {
        for (w, h) in [(5usize, 7usize), (1, 9), (3, 2), (17, 1), (255, 3)] {
            let texels: Vec<f32> = (0..w * h * 4).map(|i| ((i * 2_654_435_761) % 1000) as f32 / 1000.0).collect();
            let mean: Vec4 = texels.chunks(4).map(Vec4::from_slice).sum::<Vec4>() / (w * h) as f32;
            let image = mip_chain(TexelFormat::Rgba32Float, w as u32, h as u32, bytemuck::cast_slice(&texels).to_vec());
            let last = image.levels[image.levels.len() - 1];
            assert_eq!((last.width, last.height), (1, 1));
            assert!((mean_color(&image) - mean.truncate()).abs().max_element() < 1e-4, "{w}x{h}");
            assert_eq!(image.texels.len() as u64, chain_bytes(TexelFormat::Rgba32Float, w as u32, h as u32));
        }
    }
}
