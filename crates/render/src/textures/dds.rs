//! DDS: the header of DirectDraw surfaces and its DX10 extension (Microsoft, "Programming Guide for DDS").

use super::encoding::Encoding;
use super::file::{Content, Supercompression, TextureFile, is_whole_chain};

/// The first bytes.
pub(super) const MAGIC: &[u8] = b"DDS ";

const HEADER_END: usize = 128;
const PIXELS_ALPHA: u32 = 0x1;
const PIXELS_ALPHA_ONLY: u32 = 0x2;
const PIXELS_FOURCC: u32 = 0x4;
const PIXELS_RGB: u32 = 0x40;
const PIXELS_LUMINANCE: u32 = 0x2_0000;
const CAPS2_CUBEMAP: u32 = 0x200;
const CAPS2_VOLUME: u32 = 0x20_0000;

/// Reads the header and finds the levels. Nothing is decoded.
pub(super) fn open(data: &[u8]) -> Result<TextureFile<'_>, String> {
    let word = |at: usize| -> Result<u32, String> {
        let bytes = data.get(at..at + 4).ok_or("the DDS header is cut off")?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    };
    if word(4)? != 124 || word(76)? != 32 {
        return Err("the DDS header has another size than 124 and 32 bytes".into());
    }
    let (height, width, mips) = (word(12)?, word(16)?, word(28)?.max(1));
    let caps2 = word(112)?;
    if caps2 & CAPS2_CUBEMAP != 0 {
        return Err("the DDS file is a cube map; a material's texture is one 2D image".into());
    }
    if caps2 & CAPS2_VOLUME != 0 {
        return Err("the DDS file is a volume; a material's texture is one 2D image".into());
    }
    if width == 0 || height == 0 {
        return Err("the image has no texels".into());
    }
    let flags = word(80)?;
    let is_dx10 = flags & PIXELS_FOURCC != 0 && data.get(84..88) == Some(b"DX10");
    let (encoding, start) = if is_dx10 {
        if word(132)? != 3 || word(136)? & 4 != 0 || word(140)? > 1 {
            return Err("the DDS file is not one 2D image; a material's texture is".into());
        }
        (of_dxgi(word(128)?)?, HEADER_END + 20)
    } else if flags & PIXELS_FOURCC != 0 {
        (of_fourcc(word(84)?)?, HEADER_END)
    } else {
        let masks = [word(92)?, word(96)?, word(100)?, if flags & PIXELS_ALPHA != 0 { word(104)? } else { 0 }];
        (of_masks(flags, word(88)?, masks)?, HEADER_END)
    };
    let mut levels = Vec::new();
    let mut at = start;
    let wanted = if is_whole_chain(width, height, mips as usize) { mips } else { 1 };
    for level in 0..wanted {
        let size = |n: u32| (n >> level).max(1);
        let bytes = encoding.level_bytes(size(width), size(height)).and_then(|n| usize::try_from(n).ok());
        let end = bytes.and_then(|n| at.checked_add(n)).filter(|&end| end <= data.len());
        let end = end.ok_or_else(|| format!("level {level} ends behind the file, which has {} bytes", data.len()))?;
        levels.push(at..end);
        at = end;
    }
    let content = Content::Texels { encoding, supercompression: Supercompression::None };
    Ok(TextureFile { width, height, data, content, levels, swizzle: None, note: None })
}

fn unorm(channels: usize, bytes: usize) -> Encoding {
    Encoding::Unorm { channels, bytes, bgr: false }
}

/// By the number of a DXGI_FORMAT.
fn of_dxgi(format: u32) -> Result<Encoding, String> {
    Ok(match format {
        2 => Encoding::Float { channels: 4, bytes: 4 },
        6 => Encoding::Float { channels: 3, bytes: 4 },
        10 => Encoding::Float { channels: 4, bytes: 2 },
        11 => unorm(4, 2),
        16 => Encoding::Float { channels: 2, bytes: 4 },
        28 | 29 => unorm(4, 1),
        34 => Encoding::Float { channels: 2, bytes: 2 },
        35 => unorm(2, 2),
        41 => Encoding::Float { channels: 1, bytes: 4 },
        49 => unorm(2, 1),
        54 => Encoding::Float { channels: 1, bytes: 2 },
        56 => unorm(1, 2),
        61 => unorm(1, 1),
        71 | 72 => Encoding::Bc1 { alpha: true },
        74 | 75 => Encoding::Bc2,
        77 | 78 => Encoding::Bc3,
        80 => Encoding::Bc4,
        83 => Encoding::Bc5,
        85 => Encoding::Masked { bytes: 2, masks: [0xf800, 0x07e0, 0x001f, 0] },
        86 => Encoding::Masked { bytes: 2, masks: [0x7c00, 0x03e0, 0x001f, 0x8000] },
        87 | 91 => Encoding::Unorm { channels: 4, bytes: 1, bgr: true },
        88 | 93 => Encoding::Masked { bytes: 4, masks: [0xff_0000, 0xff00, 0xff, 0] },
        95 => Encoding::Bc6 { signed: false },
        96 => Encoding::Bc6 { signed: true },
        98 | 99 => Encoding::Bc7,
        other => return Err(format!("the DDS file has DXGI format {other}, which is not supported")),
    })
}

/// By a FourCC, which may be the number of a D3DFORMAT too.
fn of_fourcc(code: u32) -> Result<Encoding, String> {
    Ok(match &code.to_le_bytes() {
        b"DXT1" => Encoding::Bc1 { alpha: true },
        b"DXT2" | b"DXT3" => Encoding::Bc2,
        b"DXT4" | b"DXT5" => Encoding::Bc3,
        b"ATI1" | b"BC4U" => Encoding::Bc4,
        b"ATI2" | b"BC5U" => Encoding::Bc5,
        name => match code {
            36 => unorm(4, 2),
            111 => Encoding::Float { channels: 1, bytes: 2 },
            112 => Encoding::Float { channels: 2, bytes: 2 },
            113 => Encoding::Float { channels: 4, bytes: 2 },
            114 => Encoding::Float { channels: 1, bytes: 4 },
            115 => Encoding::Float { channels: 2, bytes: 4 },
            116 => Encoding::Float { channels: 4, bytes: 4 },
            _ => return Err(format!("the DDS file has format \"{}\", which is not supported", name.escape_ascii())),
        },
    })
}

fn of_masks(flags: u32, bits: u32, masks: [u32; 4]) -> Result<Encoding, String> {
    let bytes = (bits / 8) as usize;
    if !bits.is_multiple_of(8) || !(1..=4).contains(&bytes) {
        return Err(format!("the DDS file has {bits} bits a texel, which is not supported"));
    }
    if flags & PIXELS_LUMINANCE != 0 {
        return match (bits, masks[3]) {
            (8, 0) => Ok(Encoding::Luminance { alpha: false }),
            (16, 0xff00) => Ok(Encoding::Luminance { alpha: true }),
            _ => Err("the DDS file has a luminance of other than 8 bits, which is not supported".into()),
        };
    }
    if flags & PIXELS_RGB == 0 || flags & PIXELS_ALPHA_ONLY != 0 {
        return Err("the DDS file has neither RGB nor luminance nor a compressed format".into());
    }
    Ok(Encoding::Masked { bytes, masks })
}
