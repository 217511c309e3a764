//! KTX 2.0: container, level index, data format descriptor and metadata (Khronos, "KTX File Format 2.0").

use super::basis::etc1s::BasisLz;
use super::encoding::Encoding;
use super::file::{Channel, Content, Supercompression, TextureFile, is_whole_chain};
use std::ops::Range;

/// The first bytes.
pub(super) const MAGIC: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// `KHR_DF_MODEL_ETC1S` and `KHR_DF_MODEL_UASTC`.
const MODEL_ETC1S: u8 = 163;
const MODEL_UASTC: u8 = 166;

struct File<'a>(&'a [u8]);

impl<'a> File<'a> {
    fn u32(&self, at: usize) -> Result<u32, String> {
        let bytes =
            self.0.get(at..at + 4).ok_or_else(|| format!("the KTX2 file is cut off at byte {}", self.0.len()))?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    fn u64(&self, at: usize) -> Result<u64, String> {
        Ok(u64::from(self.u32(at)?) | u64::from(self.u32(at + 4)?) << 32)
    }

    fn range(&self, offset: u64, length: u64, what: &str) -> Result<Range<usize>, String> {
        let end = offset.checked_add(length).filter(|&end| end <= self.0.len() as u64);
        match end {
            Some(end) => Ok(offset as usize..end as usize),
            None => {
                let n = self.0.len();
                Err(format!("{what} at byte {offset} with {length} bytes ends behind the KTX2 file, which has {n}"))
            }
        }
    }
}

/// Reads header, level index, descriptor and metadata. Nothing is decoded.
pub(super) fn open(data: &[u8]) -> Result<TextureFile<'_>, String> {
    let file = File(data);
    let (format, width, height) = (file.u32(12)?, file.u32(20)?, file.u32(24)?);
    let (depth, layers, faces, level_count) = (file.u32(28)?, file.u32(32)?, file.u32(36)?, file.u32(40)?);
    let scheme = file.u32(44)?;
    let one_image = |what: &str| Err(format!("the KTX2 file is {what}; a material's texture is one 2D image"));
    match (depth, layers, faces) {
        (1.., _, _) => return one_image("a volume"),
        (_, 1.., _) => return one_image("an array"),
        (_, _, 1) => {}
        (_, _, 6) => return one_image("a cube map"),
        (_, _, n) => return Err(format!("the KTX2 file has {n} faces; a texture has 1 and a cube map 6")),
    }
    if width == 0 || height == 0 {
        return Err("the image has no texels, or is one-dimensional".into());
    }
    if level_count > 32 {
        return Err(format!("the KTX2 file has {level_count} levels, more than any size can have"));
    }
    let count = level_count.max(1) as usize;
    let mut levels = Vec::with_capacity(count);
    for level in 0..count {
        let at = 80 + 24 * level;
        levels.push(file.range(file.u64(at)?, file.u64(at + 8)?, &format!("level {level}"))?);
    }
    let descriptor = file.range(file.u32(48)?.into(), file.u32(52)?.into(), "the data format descriptor")?;
    let descriptor = &data[descriptor];
    let metadata = &data[file.range(file.u32(56)?.into(), file.u32(60)?.into(), "the metadata")?];
    // Its total size and a basic block's head of 24 bytes stand before the samples of 16.
    let model = descriptor.get(12).copied().unwrap_or(0);
    let content = if scheme == 1 {
        if model != MODEL_ETC1S {
            return Err(format!("the KTX2 file has BasisLZ of colour model {model}; only ETC1S is supported"));
        }
        let global = &data[file.range(file.u64(64)?, file.u64(72)?, "the global data")?];
        let channels: Vec<u8> = descriptor.get(28..).unwrap_or(&[]).chunks_exact(16).map(|s| s[3] & 15).collect();
        Content::BasisLz(Box::new(BasisLz::new(global, count, &channels)?))
    } else {
        let supercompression = match scheme {
            0 => Supercompression::None,
            2 => Supercompression::Zstd,
            3 => Supercompression::Zlib,
            other => return Err(format!("the KTX2 file has supercompression {other}, which is not supported")),
        };
        let encoding = match (format, model) {
            (0, MODEL_UASTC) => Encoding::Uastc,
            (0, other) => return Err(format!("the KTX2 file has colour model {other}, which is not supported")),
            _ => of_vulkan(format)?,
        };
        Content::Texels { encoding, supercompression }
    };
    if !is_whole_chain(width, height, count) {
        levels.truncate(1);
    }
    let mut file = TextureFile { width, height, data, content, levels, swizzle: None, note: None };
    read_metadata(metadata, &mut file);
    Ok(file)
}

/// By the number of a VkFormat.
fn of_vulkan(format: u32) -> Result<Encoding, String> {
    let unorm = |channels, bytes, bgr| Ok(Encoding::Unorm { channels, bytes, bgr });
    let float = |channels, bytes| Ok(Encoding::Float { channels, bytes });
    match format {
        9 | 15 => unorm(1, 1, false),
        16 | 22 => unorm(2, 1, false),
        23 | 29 => unorm(3, 1, false),
        30 | 36 => unorm(3, 1, true),
        37 | 43 => unorm(4, 1, false),
        44 | 50 => unorm(4, 1, true),
        70 => unorm(1, 2, false),
        77 => unorm(2, 2, false),
        84 => unorm(3, 2, false),
        91 => unorm(4, 2, false),
        76 => float(1, 2),
        83 => float(2, 2),
        90 => float(3, 2),
        97 => float(4, 2),
        100 => float(1, 4),
        103 => float(2, 4),
        106 => float(3, 4),
        109 => float(4, 4),
        131 | 132 => Ok(Encoding::Bc1 { alpha: false }),
        133 | 134 => Ok(Encoding::Bc1 { alpha: true }),
        135 | 136 => Ok(Encoding::Bc2),
        137 | 138 => Ok(Encoding::Bc3),
        139 => Ok(Encoding::Bc4),
        141 => Ok(Encoding::Bc5),
        143 => Ok(Encoding::Bc6 { signed: false }),
        144 => Ok(Encoding::Bc6 { signed: true }),
        145 | 146 => Ok(Encoding::Bc7),
        147 | 148 => Ok(Encoding::Etc2Rgb),
        149 | 150 => Ok(Encoding::Etc2Rgba1),
        151 | 152 => Ok(Encoding::Etc2Rgba8),
        153 => Ok(Encoding::EacR),
        155 => Ok(Encoding::EacRg),
        157..=184 => {
            const FOOTPRINTS: [(u32, u32); 14] = [
                (4, 4),
                (5, 4),
                (5, 5),
                (6, 5),
                (6, 6),
                (8, 5),
                (8, 6),
                (8, 8),
                (10, 5),
                (10, 6),
                (10, 8),
                (10, 10),
                (12, 10),
                (12, 12),
            ];
            let (width, height) = FOOTPRINTS[(format as usize - 157) / 2];
            Ok(Encoding::Astc { width, height })
        }
        other => Err(format!("the KTX2 file has Vulkan format {other}, which is not supported")),
    }
}

/// Reads the two keys that change the picture: `KTXorientation` and `KTXswizzle`. Broken metadata is left unread.
fn read_metadata(mut entries: &[u8], file: &mut TextureFile<'_>) {
    while let Some((length, rest)) = entries.split_first_chunk::<4>() {
        let length = u32::from_le_bytes(*length) as usize;
        let Some(entry) = rest.get(..length) else { return };
        let mut parts = entry.splitn(2, |&b| b == 0);
        let (key, value) = (parts.next().unwrap_or(&[]), parts.next().unwrap_or(&[]));
        let value = value.strip_suffix(b"\0").unwrap_or(value);
        match key {
            b"KTXorientation" if value != b"rd" => {
                let value = value.escape_ascii();
                file.note = Some(format!("its KTXorientation is \"{value}\", and it is shown as if it were \"rd\""));
            }
            b"KTXswizzle" => file.swizzle = swizzle(value),
            _ => {}
        }
        entries = rest.get(length.next_multiple_of(4)..).unwrap_or(&[]);
    }
}

/// Four of `rgba01`; `None` for the identity and for anything else.
fn swizzle(value: &[u8]) -> Option<[Channel; 4]> {
    let value: &[u8; 4] = value.try_into().ok()?;
    if value == b"rgba" {
        return None;
    }
    let mut channels = [Channel::Zero; 4];
    for (channel, name) in channels.iter_mut().zip(value) {
        *channel = match name {
            b'0' => Channel::Zero,
            b'1' => Channel::One,
            _ => Channel::Of(b"rgba".iter().position(|c| c == name)?),
        };
    }
    Some(channels)
}
