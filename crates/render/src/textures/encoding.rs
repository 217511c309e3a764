//! How texture files (KTX2, DDS) store texels, and how they become the RGBA that renderers read.

use super::basis::uastc;
use orthant_resident::image::TexelFormat;
use rayon::prelude::*;

/// How the texels of a level are stored. Rows run from the top without padding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    /// One to four unsigned normalized channels of 1 or 2 bytes: R, G, B, A, or B, G, R, A.
    Unorm { channels: usize, bytes: usize, bgr: bool },
    /// One to four channels of half or single floats.
    Float { channels: usize, bytes: usize },
    /// Packed into `bytes` bytes, each channel under a mask of bits (R, G, B, A); an empty mask of alpha is opaque.
    Masked { bytes: usize, masks: [u32; 4] },
    /// One byte for R, G and B, and perhaps one for A.
    Luminance { alpha: bool },
    /// BC1 (DXT1), with or without its transparent texels.
    Bc1 { alpha: bool },
    /// BC2 (DXT3).
    Bc2,
    /// BC3 (DXT5).
    Bc3,
    /// BC4 (ATI1): R.
    Bc4,
    /// BC5 (ATI2): R and G.
    Bc5,
    /// BC6H: RGB of half floats.
    Bc6 { signed: bool },
    /// BC7.
    Bc7,
    /// ETC2 RGB.
    Etc2Rgb,
    /// ETC2 RGB with one bit of alpha.
    Etc2Rgba1,
    /// ETC2 RGB with EAC alpha.
    Etc2Rgba8,
    /// EAC: R.
    EacR,
    /// EAC: R and G.
    EacRg,
    /// ASTC LDR in blocks of so many texels.
    Astc { width: u32, height: u32 },
    /// UASTC LDR 4x4.
    Uastc,
}

impl Encoding {
    /// Width and height in texels, and bytes, of what is stored as one: a block, or a texel.
    fn block(self) -> (u32, u32, usize) {
        match self {
            Self::Unorm { channels, bytes, .. } | Self::Float { channels, bytes } => (1, 1, channels * bytes),
            Self::Masked { bytes, .. } => (1, 1, bytes),
            Self::Luminance { alpha } => (1, 1, 1 + usize::from(alpha)),
            Self::Bc1 { .. } | Self::Bc4 | Self::Etc2Rgb | Self::Etc2Rgba1 | Self::EacR => (4, 4, 8),
            Self::Astc { width, height } => (width, height, 16),
            _ => (4, 4, 16),
        }
    }

    /// Bytes of a level; `None` over 2^64.
    pub(super) fn level_bytes(self, width: u32, height: u32) -> Option<u64> {
        let (w, h, bytes) = self.block();
        let blocks = u64::from(width.div_ceil(w)).checked_mul(u64::from(height.div_ceil(h)))?;
        blocks.checked_mul(bytes as u64)
    }

    /// What it is decoded to. Floats are linear whatever they are used for.
    pub(super) fn texel_format(self, srgb: bool) -> TexelFormat {
        match (self, srgb) {
            (Self::Float { .. } | Self::Bc6 { .. }, _) => TexelFormat::Rgba32Float,
            (Self::Unorm { bytes: 2, .. }, true) => TexelFormat::Rgba16Srgb,
            (Self::Unorm { bytes: 2, .. }, false) => TexelFormat::Rgba16Linear,
            (_, true) => TexelFormat::Rgba8Srgb,
            (_, false) => TexelFormat::Rgba8Linear,
        }
    }

    /// Decodes a level to RGBA of [`Encoding::texel_format`]. Channels that are not stored are 0, and alpha 1.
    ///
    /// `data` has [`Encoding::level_bytes`] bytes.
    pub(super) fn decode(self, data: &[u8], width: u32, height: u32) -> Vec<u8> {
        let (w, h) = (width as usize, height as usize);
        match self {
            Self::Unorm { channels, bytes: 1, bgr } => {
                texels(data, channels, |t| order([byte(t, 0), byte(t, 1), byte(t, 2), alpha(t)], bgr))
            }
            Self::Unorm { channels, bgr, .. } => texels(data, 2 * channels, |t| {
                let channel = |c: usize| t.get(2 * c..2 * c + 2).map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
                let a = if channels == 4 { channel(3) } else { u16::MAX };
                words(order([channel(0), channel(1), channel(2), a], bgr))
            }),
            Self::Float { channels, bytes } => texels(data, bytes * channels, |t| {
                let channel = |c: usize| match t.get(bytes * c..bytes * (c + 1)) {
                    None if c == 3 => 1.0,
                    None => 0.0,
                    Some(&[a, b]) => half::f16::from_le_bytes([a, b]).to_f32(),
                    Some(b) => f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
                };
                floats([0, 1, 2, 3].map(channel))
            }),
            Self::Masked { bytes, masks } => texels(data, bytes, |t| {
                let value = t.iter().rev().fold(0, |v, &b| v << 8 | u32::from(b));
                let mut rgba = masks.map(|mask| masked(value, mask));
                if masks[3] == 0 {
                    rgba[3] = 255;
                }
                rgba
            }),
            Self::Luminance { alpha } => {
                texels(data, 1 + usize::from(alpha), |t| [t[0], t[0], t[0], if alpha { t[1] } else { 255 }])
            }
            Self::Bc1 { alpha } => blocks4(data, 8, w, h, |block, out| {
                bcdec_rs::bc1(block, out.as_flattened_mut(), 16);
                if !alpha {
                    out.iter_mut().for_each(|t| t[3] = 255);
                }
            }),
            Self::Bc2 => blocks4(data, 16, w, h, |block, out| bcdec_rs::bc2(block, out.as_flattened_mut(), 16)),
            Self::Bc3 => blocks4(data, 16, w, h, |block, out| bcdec_rs::bc3(block, out.as_flattened_mut(), 16)),
            Self::Bc4 => blocks4(data, 8, w, h, |block, out| {
                let mut r = [0; 16];
                bcdec_rs::bc4(block, &mut r, 4, false);
                out.iter_mut().zip(r).for_each(|(t, r)| *t = [r, 0, 0, 255]);
            }),
            Self::Bc5 => blocks4(data, 16, w, h, |block, out| {
                let mut rg = [[0; 2]; 16];
                bcdec_rs::bc5(block, rg.as_flattened_mut(), 8, false);
                out.iter_mut().zip(rg).for_each(|(t, [r, g])| *t = [r, g, 0, 255]);
            }),
            Self::Bc6 { signed } => blocks::<16>(data, (4, 4, 16), w, h, |block, out| {
                let mut rgb = [[0.0; 3]; 16];
                bcdec_rs::bc6h_float(block, rgb.as_flattened_mut(), 12, signed);
                out.iter_mut().zip(rgb).for_each(|(t, [r, g, b])| *t = floats([r, g, b, 1.0]));
            }),
            Self::Bc7 => blocks4(data, 16, w, h, |block, out| bcdec_rs::bc7(block, out.as_flattened_mut(), 16)),
            Self::Etc2Rgb => etc2(data, 8, w, h, texture2ddecoder::decode_etc2_rgb),
            Self::Etc2Rgba1 => etc2(data, 8, w, h, texture2ddecoder::decode_etc2_rgba1),
            Self::Etc2Rgba8 => etc2(data, 16, w, h, texture2ddecoder::decode_etc2_rgba8),
            Self::EacR => etc2(data, 8, w, h, texture2ddecoder::decode_eacr),
            Self::EacRg => etc2(data, 16, w, h, texture2ddecoder::decode_eacrg),
            Self::Astc { width: bw, height: bh } => {
                let footprint = astc_decode::Footprint::new(bw, bh);
                blocks::<4>(data, (bw as usize, bh as usize, 16), w, h, |block, out| {
                    let block = block.try_into().expect("blocks are cut to 16 bytes");
                    // A block that is none decodes to magenta, as the specification has it.
                    astc_decode::astc_decode_block(block, footprint, |x, y, rgba| out[(y * bw + x) as usize] = rgba);
                })
            }
            Self::Uastc => blocks4(data, 16, w, h, |block, out| {
                let block = block.try_into().expect("blocks are cut to 16 bytes");
                *out = uastc::decode_block(block);
            }),
        }
    }
}

fn byte(texel: &[u8], channel: usize) -> u8 {
    texel.get(channel).copied().unwrap_or(0)
}

fn alpha(texel: &[u8]) -> u8 {
    texel.get(3).copied().unwrap_or(255)
}

fn order<T>([r, g, b, a]: [T; 4], bgr: bool) -> [T; 4] {
    if bgr { [b, g, r, a] } else { [r, g, b, a] }
}

/// Texels of 16 bits are stored as the machine has them.
fn words(rgba: [u16; 4]) -> [u8; 8] {
    bytemuck::cast(rgba)
}

fn floats(rgba: [f32; 4]) -> [u8; 16] {
    bytemuck::cast(rgba)
}

/// The bits under a mask, as 0..=255.
fn masked(value: u32, mask: u32) -> u8 {
    if mask == 0 {
        return 0;
    }
    let shift = mask.trailing_zeros();
    let (value, most) = (u64::from((value & mask) >> shift), u64::from(mask >> shift));
    ((value * 255 + most / 2) / most) as u8
}

/// Decodes texel by texel.
fn texels<const N: usize>(data: &[u8], bytes: usize, decode: impl Fn(&[u8]) -> [u8; N]) -> Vec<u8> {
    let mut out = Vec::with_capacity(data.len() / bytes * N);
    for texel in data.chunks_exact(bytes) {
        out.extend_from_slice(&decode(texel));
    }
    out
}

/// Decodes blocks of 4 x 4 texels of four bytes.
fn blocks4(
    data: &[u8],
    bytes: usize,
    width: usize,
    height: usize,
    decode: impl Fn(&[u8], &mut [[u8; 4]; 16]) + Sync,
) -> Vec<u8> {
    blocks::<4>(data, (4, 4, bytes), width, height, |block, out| {
        decode(block, out.first_chunk_mut().expect("a block has 16 texels"));
    })
}

/// Decodes blocks of texels of N bytes, rows of blocks in parallel; what lies over the edge of the level is cut off.
fn blocks<const N: usize>(
    data: &[u8],
    (block_w, block_h, bytes): (usize, usize, usize),
    width: usize,
    height: usize,
    decode: impl Fn(&[u8], &mut [[u8; N]]) + Sync,
) -> Vec<u8> {
    let mut out = vec![0; width * height * N];
    let row_bytes = width.div_ceil(block_w) * bytes;
    out.par_chunks_mut(width * block_h * N).zip(data.par_chunks_exact(row_bytes)).for_each(|(rows, blocks)| {
        let mut texels = vec![[0; N]; block_w * block_h];
        for (bx, block) in blocks.chunks_exact(bytes).enumerate() {
            decode(block, &mut texels);
            let columns = block_w.min(width - bx * block_w);
            for (row, texels) in rows.chunks_exact_mut(width * N).zip(texels.chunks_exact(block_w)) {
                let start = bx * block_w * N;
                row[start..start + columns * N].copy_from_slice(texels[..columns].as_flattened());
            }
        }
    });
    out
}

/// Data, width, height and texels of `texture2ddecoder`.
type BlockDecoder = fn(&[u8], usize, usize, &mut [u32]) -> Result<(), &'static str>;

/// Decodes ETC2 and EAC, row of blocks by row; the decoder gives words of B, G, R, A from the low byte.
fn etc2(data: &[u8], bytes: usize, width: usize, height: usize, decode: BlockDecoder) -> Vec<u8> {
    blocks4(data, bytes, width, height, |block, out| {
        let mut bgra = [0; 16];
        decode(block, 4, 4, &mut bgra).expect("one block and its 16 texels");
        out.iter_mut().zip(bgra).for_each(|(t, v)| {
            let [b, g, r, a] = v.to_le_bytes();
            *t = [r, g, b, a];
        });
    })
}
