//! A texture file that was understood but not decoded: sizes, encoding and where each level is.

use super::basis::etc1s::BasisLz;
use super::encoding::Encoding;
use orthant_resident::image::TexelFormat;
use std::borrow::Cow;
use std::io::Read;
use std::ops::Range;

/// KTX2's supercompression of whole levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Supercompression {
    None,
    Zstd,
    Zlib,
}

/// What a level is made of.
pub(super) enum Content {
    /// Texels or blocks, perhaps supercompressed.
    Texels { encoding: Encoding, supercompression: Supercompression },
    /// BasisLZ: slices that refer to codebooks of the whole file.
    BasisLz(Box<BasisLz>),
}

/// One output channel of a swizzle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// An input channel, 0..4.
    Of(usize),
    Zero,
    One,
}

/// A texture file: one image with its levels.
pub(super) struct TextureFile<'a> {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) data: &'a [u8],
    pub(super) content: Content,
    /// Byte range of each level in the file, largest first: either the whole chain to 1x1, or the first level.
    pub(super) levels: Vec<Range<usize>>,
    pub(super) swizzle: Option<[Channel; 4]>,
    /// What is shown otherwise than the file says.
    pub(super) note: Option<String>,
}

impl TextureFile<'_> {
    pub(super) fn texel_format(&self, srgb: bool) -> TexelFormat {
        match &self.content {
            Content::Texels { encoding, .. } => encoding.texel_format(srgb),
            Content::BasisLz(_) if srgb => TexelFormat::Rgba8Srgb,
            Content::BasisLz(_) => TexelFormat::Rgba8Linear,
        }
    }

    /// Size of a level.
    pub(super) fn size(&self, level: usize) -> (u32, u32) {
        let of = |n: u32| n.checked_shr(level as u32).unwrap_or(0).max(1);
        (of(self.width), of(self.height))
    }

    /// An upper bound of what decoding takes besides the levels: the stored form of the first one, inflated, and the second
    /// before it is appended.
    pub(super) fn working_bytes(&self) -> u64 {
        let texels = u64::from(self.width) * u64::from(self.height);
        let second = (texels / 4).saturating_mul(self.texel_format(false).bytes() as u64);
        let stored = match &self.content {
            Content::Texels { supercompression: Supercompression::None, .. } => 0,
            Content::Texels { encoding, .. } => {
                let bytes = encoding.level_bytes(self.width, self.height).unwrap_or(u64::MAX);
                bytes.saturating_mul(2).saturating_add(bytes.max(MAX_WINDOW))
            }
            // An endpoint and a selector a block, twice for two slices.
            Content::BasisLz(_) => texels.saturating_mul(2),
        };
        stored.saturating_add(second)
    }

    /// Decodes a level to RGBA of [`TextureFile::texel_format`]. The memory for the decoded level was found to be there.
    pub(super) fn decode(&self, level: usize) -> Result<Vec<u8>, String> {
        let (width, height) = self.size(level);
        let stored = &self.data[self.levels[level].clone()];
        let mut texels = match &self.content {
            Content::Texels { encoding, supercompression } => {
                let bytes = encoding.level_bytes(width, height).and_then(|n| usize::try_from(n).ok());
                let bytes = bytes.ok_or("the level is too large for this machine")?;
                let data = inflate(*supercompression, stored, bytes)?;
                if data.len() != bytes {
                    return Err(format!("level {level} has {} bytes where {bytes} are needed", data.len()));
                }
                encoding.decode(&data, width, height)
            }
            Content::BasisLz(basis) => basis.decode(level, stored, width, height)?,
        };
        if let Some(swizzle) = self.swizzle {
            apply(swizzle, self.texel_format(false), &mut texels);
        }
        Ok(texels)
    }
}

/// The window that a Zstandard frame may have in any case.
const MAX_WINDOW: u64 = 8 << 20;

/// The bytes of a level: not more than one over what it must have, whatever the stream holds.
fn inflate(supercompression: Supercompression, stored: &[u8], bytes: usize) -> Result<Cow<'_, [u8]>, String> {
    match supercompression {
        Supercompression::None => Ok(Cow::Borrowed(stored)),
        Supercompression::Zlib => {
            let inflated = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(stored, bytes)
                .map_err(|e| format!("the level cannot be inflated: {e}"))?;
            Ok(Cow::Owned(inflated))
        }
        Supercompression::Zstd => {
            // A window is taken whole before the first byte is known: none need be larger than the level itself.
            let window = (bytes as u64).max(MAX_WINDOW);
            let mut source = stored;
            let decoder = ruzstd::decoding::StreamingDecoder::new_with_max_window_size(&mut source, window)
                .map_err(|e| format!("the level is no Zstandard frame: {e}"))?;
            let mut inflated = Vec::new();
            decoder
                .take(bytes as u64 + 1)
                .read_to_end(&mut inflated)
                .map_err(|e| format!("the level cannot be inflated: {e}"))?;
            Ok(Cow::Owned(inflated))
        }
    }
}

fn apply(swizzle: [Channel; 4], format: TexelFormat, texels: &mut [u8]) {
    fn each<T: Copy + bytemuck::Pod>(texels: &mut [u8], swizzle: [Channel; 4], zero: T, one: T) {
        let n = size_of::<T>();
        for texel in texels.chunks_exact_mut(4 * n) {
            let of = |c: usize| bytemuck::pod_read_unaligned::<T>(&texel[c * n..(c + 1) * n]);
            let rgba = swizzle.map(|channel| match channel {
                Channel::Of(c) => of(c),
                Channel::Zero => zero,
                Channel::One => one,
            });
            texel.copy_from_slice(bytemuck::cast_slice(&rgba));
        }
    }
    match format {
        TexelFormat::Rgba8Linear | TexelFormat::Rgba8Srgb => each(texels, swizzle, 0u8, u8::MAX),
        TexelFormat::Rgba16Linear | TexelFormat::Rgba16Srgb => each(texels, swizzle, 0u16, u16::MAX),
        TexelFormat::Rgba32Float => each(texels, swizzle, 0f32, 1.0),
    }
}

/// Whether so many levels reach from a size down to 1x1.
pub(super) fn is_whole_chain(width: u32, height: u32, levels: usize) -> bool {
    levels == (32 - width.max(height).leading_zeros()) as usize
}
