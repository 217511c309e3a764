//! Mip chains by an exact box filter in linear light.
//!
//! A texel of a level averages precisely the area that it covers: two texels each way where the size is even, three
//! with fractional weights where it is odd. sRGB images are averaged in linear light and encoded again. Each level is made
//! from the floats of the one before it, not from its rounded texels.
//!
//! As long as heights are even, bands of rows are independent: each makes its rows of several levels at once, with two rows
//! in hand at each level, so that the floats of a level never lie in memory.

use super::texels::{decode_row, encode_row};
use glam::{Vec3, Vec4};
use orthant_resident::image::{ImageData, MipLevel, TexelFormat};
use rayon::prelude::*;

/// Levels that a band makes, at most: it has two to this power rows.
const BAND_LEVELS: u32 = 6;
/// Bands of an image, at least: below that a level more is made the other way.
const MIN_BANDS: u32 = 16;

/// Appends all smaller levels to an image that has level 0 only.
pub fn mip_chain(format: TexelFormat, width: u32, height: u32, mut texels: Vec<u8>) -> ImageData {
    let mut levels = Vec::new();
    let mut offset = 0;
    for (width, height) in level_sizes(width, height) {
        levels.push(MipLevel { width, height, offset });
        offset += level_bytes(format, &levels[levels.len() - 1]);
    }
    texels.reserve_exact(offset - texels.len());
    texels.resize(offset, 0);
    let (first, mut rest) = texels.split_at_mut(level_bytes(format, &levels[0]));

    let (made, to_make) = levels.split_at(band_levels(height) as usize + 1);
    let mut current = None;
    if made.len() > 1 {
        let (out, behind) = rest.split_at_mut(made[1..].iter().map(|level| level_bytes(format, level)).sum());
        (current, rest) = (Some(make_bands(format, made, first, out)), behind);
    }
    let size = |level: &MipLevel| (level.width as usize, level.height as usize);
    let mut from = size(&made[made.len() - 1]);
    for level in to_make {
        let next = match &current {
            Some(source) => halve(from, size(level), |y, row| row.extend(&source[y * from.0..(y + 1) * from.0])),
            // Level 0 is decoded row by row: as floats it would be four times as large as the image.
            None => halve(from, size(level), |y, row| {
                let bytes = from.0 * format.bytes();
                decode_row(format, &first[y * bytes..(y + 1) * bytes], row);
            }),
        };
        let (out, behind) = rest.split_at_mut(level_bytes(format, level));
        encode_row(format, &next, out);
        (from, current, rest) = (size(level), Some(next), behind);
    }
    ImageData { format, levels, texels }
}

/// Levels that bands of an image of a height make.
fn band_levels(height: u32) -> u32 {
    (1..=BAND_LEVELS.min(height.trailing_zeros())).rev().find(|&k| height >> k >= MIN_BANDS).unwrap_or(0)
}

/// Bytes that [`mip_chain`] has in hand: the floats of two levels behind those that bands make.
pub(crate) fn working_bytes(width: u32, height: u32) -> u64 {
    let first = u64::from(width) * u64::from(height);
    let level = first >> (2 * band_levels(height).max(1));
    // A level and the quarter of it, and rows of all levels.
    (level + level / 4 + 4 * u64::from(width)).saturating_mul(size_of::<Vec4>() as u64)
}

/// Mean linear colour of an image.
pub fn mean_color(image: &ImageData) -> Vec3 {
    mean_texel(image).truncate()
}

/// Mean linear texel of an image.
pub(crate) fn mean_texel(image: &ImageData) -> Vec4 {
    let level = image.levels[image.levels.len() - 1];
    let mut texels = Vec::new();
    decode_row(image.format, &image.texels[level.offset..], &mut texels);
    texels.iter().copied().sum::<Vec4>() / texels.len().max(1) as f32
}

/// The linear texels of a row of level 0.
pub(crate) fn first_level_row(image: &ImageData, y: usize) -> Vec<Vec4> {
    let bytes = image.levels[0].width as usize * image.format.bytes();
    let mut texels = Vec::with_capacity(image.levels[0].width as usize);
    decode_row(image.format, &image.texels[y * bytes..(y + 1) * bytes], &mut texels);
    texels
}

/// Bytes of an image with all its levels.
pub(crate) fn chain_bytes(format: TexelFormat, width: u32, height: u32) -> u64 {
    let texels = |(w, h)| u64::from(w) * u64::from(h);
    level_sizes(width, height).fold(0, |sum: u64, size| {
        // Declared sizes may be anything: what does not fit into the number fits into no budget either.
        sum.saturating_add(texels(size).saturating_mul(format.bytes() as u64))
    })
}

fn level_sizes(width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> {
    std::iter::successors(Some((width, height)), |&(w, h)| (w > 1 || h > 1).then(|| ((w / 2).max(1), (h / 2).max(1))))
}

fn level_bytes(format: TexelFormat, level: &MipLevel) -> usize {
    level.width as usize * level.height as usize * format.bytes()
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
fn halve(
    (w, h): (usize, usize),
    (next_w, next_h): (usize, usize),
    row: impl Fn(usize, &mut Vec<Vec4>) + Sync,
) -> Vec<Vec4> {
    let mut next = vec![Vec4::ZERO; next_w * next_h];
    let columns: Vec<_> = (0..next_w).map(|x| taps(w, next_w, x)).collect();
    let rows = next.par_chunks_mut(next_w).with_min_len((1 << 12) / next_w.min(1 << 12)).enumerate();
    rows.for_each_init(
        || (vec![Vec4::ZERO; w], Vec::with_capacity(w)),
        |(sum, source), (y, out)| {
            sum.fill(Vec4::ZERO);
            for (sy, weight) in taps(h, next_h, y).into_iter().filter(|t| t.1 > 0.0) {
                source.clear();
                row(sy, source);
                for (sum, texel) in sum.iter_mut().zip(&*source) {
                    *sum += *texel * weight;
                }
            }
            for (out, [a, b, c]) in out.iter_mut().zip(&columns) {
                *out = sum[a.0] * a.1 + sum[b.0] * b.1 + sum[c.0] * c.1;
            }
        },
    );
    next
}

/// Makes all further levels from level 0, whose height is a multiple of two to the power of their number. `out` is for them,
/// one behind the other. Gives the texels of the last one as floats.
fn make_bands(format: TexelFormat, levels: &[MipLevel], first: &[u8], mut out: &mut [u8]) -> Vec<Vec4> {
    let last = levels[levels.len() - 1];
    let bands = last.height as usize;
    // The rows of each level that a band makes.
    let mut rows_of_band: Vec<Vec<&mut [u8]>> = (0..bands).map(|_| Vec::new()).collect();
    for level in &levels[1..] {
        let (rows, behind) = out.split_at_mut(level_bytes(format, level));
        let band_bytes = rows.len() / bands;
        rows_of_band.iter_mut().zip(rows.chunks_exact_mut(band_bytes)).for_each(|(band, rows)| band.push(rows));
        out = behind;
    }
    let mut floats = vec![Vec4::ZERO; last.width as usize * bands];
    let sources = first.par_chunks_exact(first.len() / bands);
    let tasks = rows_of_band.into_par_iter().zip(sources).zip(floats.par_chunks_exact_mut(last.width as usize));
    tasks.for_each_init(
        || Band::new(format, levels),
        |band, ((mut rows, source), floats)| floats.copy_from_slice(band.make(source, &mut rows)),
    );
    floats
}

/// What a thread has in hand while it makes a band.
struct Band {
    format: TexelFormat,
    /// By level: an even row and the odd one behind it.
    pairs: Vec<[Vec<Vec4>; 2]>,
}

impl Band {
    fn new(format: TexelFormat, levels: &[MipLevel]) -> Self {
        let rows = |level: &MipLevel| [0, 1].map(|_| vec![Vec4::ZERO; level.width as usize]);
        Self { format, pairs: levels.iter().map(rows).collect() }
    }

    /// Writes the rows of levels 1 and up; gives the one row of the last level.
    fn make(&mut self, source: &[u8], rows: &mut [&mut [u8]]) -> &[Vec4] {
        let source_row = self.pairs[0][0].len() * self.format.bytes();
        for (y, source) in source.chunks_exact(2 * source_row).enumerate() {
            for (pair, source) in self.pairs[0].iter_mut().zip(source.chunks_exact(source_row)) {
                pair.clear();
                decode_row(self.format, source, pair);
            }
            // The second row of a pair makes a row of the next level, which may be the second of its pair.
            let (mut level, mut row) = (0, y);
            loop {
                let (from, to) = self.pairs.split_at_mut(level + 1);
                let next = &mut to[0][row & 1];
                halve_pair(&from[level], next);
                let bytes = next.len() * self.format.bytes();
                encode_row(self.format, next, &mut rows[level][row * bytes..(row + 1) * bytes]);
                level += 1;
                if row & 1 == 0 || level == rows.len() {
                    break;
                }
                row >>= 1;
            }
        }
        &self.pairs[rows.len()][0]
    }
}

/// Averages two rows to one of the next level: what [`halve`] does where the height is even.
fn halve_pair([above, below]: &[Vec<Vec4>; 2], next: &mut [Vec4]) {
    let mean = |x: usize| above[x] * 0.5 + below[x] * 0.5;
    let (w, next_w) = (above.len(), next.len());
    if w == 2 * next_w {
        let (above, below) = (above.as_chunks::<2>().0, below.as_chunks::<2>().0);
        for ((out, a), b) in next.iter_mut().zip(above).zip(below) {
            *out = (a[0] * 0.5 + b[0] * 0.5) * 0.5 + (a[1] * 0.5 + b[1] * 0.5) * 0.5;
        }
        return;
    }
    for (x, out) in next.iter_mut().enumerate() {
        let [a, b, c] = taps(w, next_w, x);
        *out = mean(a.0) * a.1 + mean(b.0) * b.1 + mean(c.0) * c.1;
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
        for (w, h) in [(5usize, 7usize), (1, 9), (3, 2), (17, 1), (255, 3), (5, 64), (1, 128), (33, 96)] {
            let texels: Vec<f32> = (0..w * h * 4).map(|i| ((i * 2_654_435_761) % 1000) as f32 / 1000.0).collect();
            let mean: Vec4 = texels.chunks(4).map(Vec4::from_slice).sum::<Vec4>() / (w * h) as f32;
            let image = mip_chain(TexelFormat::Rgba32Float, w as u32, h as u32, bytemuck::cast_slice(&texels).to_vec());
            let last = image.levels[image.levels.len() - 1];
            assert_eq!((last.width, last.height), (1, 1));
            assert!((mean_color(&image) - mean.truncate()).abs().max_element() < 1e-4, "{w}x{h}");
            assert_eq!(image.texels.len() as u64, chain_bytes(TexelFormat::Rgba32Float, w as u32, h as u32));
        }
    }

    /// Every level from the floats of the one before it, as a whole.
    fn level_by_level(format: TexelFormat, width: u32, height: u32, texels: &[u8]) -> Vec<u8> {
        let mut out = texels.to_vec();
        let mut floats = Vec::new();
        decode_row(format, texels, &mut floats);
        let mut from = (width as usize, height as usize);
        for (w, h) in level_sizes(width, height).skip(1) {
            let to = (w as usize, h as usize);
            floats = halve(from, to, |y, row| row.extend(&floats[y * from.0..(y + 1) * from.0]));
            let start = out.len();
            out.resize(start + floats.len() * format.bytes(), 0);
            encode_row(format, &floats, &mut out[start..]);
            from = to;
        }
        out
    }

    #[test]
    fn bands_make_the_texels_that_whole_levels_make() {
        use TexelFormat::*;
        for format in [Rgba8Srgb, Rgba8Linear, Rgba16Srgb, Rgba16Linear, Rgba32Float] {
            for (w, h) in [(64, 32), (37, 64), (1, 1024), (96, 160), (128, 48)] {
                let texels: Vec<u8> = match format {
                    Rgba32Float => (0..w * h * 4).flat_map(|i| ((i % 977) as f32 / 976.0).to_ne_bytes()).collect(),
                    _ => (0..w * h * format.bytes() as u32)
                        .map(|i| (i.wrapping_mul(2_654_435_761) >> 23) as u8)
                        .collect(),
                };
                let image = mip_chain(format, w, h, texels.clone());
                assert_eq!(image.texels, level_by_level(format, w, h, &texels), "{format:?} {w} x {h}");
            }
        }
    }
}
