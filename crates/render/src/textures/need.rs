//! What an image takes, from its header alone.

use super::decode::{Broken, Levels, open_file, open_image, texel_format};
use super::mips;
use image::{ImageDecoder, ImageFormat};

/// Bytes that an image takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Need {
    /// For ever: its levels.
    pub kept: u64,
    /// While it is decoded, besides.
    pub working: u64,
}

/// An image that does not fit with those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OverLimit {
    /// Which one.
    pub index: usize,
    /// Bytes that it needs.
    pub needed: u64,
}

/// Whether images fit into a number of bytes when as many threads decode them in any order: all that is kept, and what as
/// many as there are threads have in hand at once.
pub(super) fn check<E>(needs: &[Result<Need, E>], max_bytes: u64, threads: usize) -> Result<(), OverLimit> {
    let (mut kept, mut working) = (0u64, Vec::new());
    for (index, need) in needs.iter().enumerate() {
        let Ok(need) = need else { continue };
        kept = kept.saturating_add(need.kept);
        working.push((need.working, index));
        if kept > max_bytes {
            return Err(OverLimit { index, needed: need.kept });
        }
    }
    working.sort_unstable();
    let at_once = working.iter().rev().take(threads).fold(0, |sum: u64, &(bytes, _)| sum.saturating_add(bytes));
    match working.last() {
        Some(&(bytes, index)) if kept.saturating_add(at_once) > max_bytes => Err(OverLimit { index, needed: bytes }),
        _ => Ok(()),
    }
}

impl Need {
    /// Of an image, whatever the document says that it is.
    pub fn of(data: &[u8], srgb: bool, levels: Levels) -> Result<Self, Broken> {
        let (format, width, height, decoder) = match open_file(data) {
            Some(file) => {
                let file = file?;
                (file.texel_format(srgb), file.width, file.height, file.working_bytes())
            }
            None => {
                let decoder = open_image(data)?;
                let (width, height) = decoder.dimensions();
                (texel_format(&decoder, srgb), width, height, working_bytes(data, &decoder))
            }
        };
        let first = (u64::from(width) * u64::from(height)).saturating_mul(format.bytes() as u64);
        Ok(match levels {
            Levels::First => Self { kept: first, working: decoder },
            Levels::All => {
                let kept = mips::chain_bytes(format, width, height);
                // Levels are made when the decoder is gone.
                Self { kept, working: decoder.max(mips::working_bytes(width, height)) }
            }
        })
    }
}

/// An upper bound of what a decoder of the crate `image` has in hand.
fn working_bytes(data: &[u8], decoder: &impl ImageDecoder) -> u64 {
    let (width, height) = decoder.dimensions();
    // Codecs work on blocks of up to 16 texels each way.
    let padded = u64::from(width.next_multiple_of(16)).saturating_mul(height.next_multiple_of(16).into());
    let row = u64::from(width) * 16;
    let samples = match image::guess_format(data) {
        // It copies the file. Scans of a progressive one add up in coefficients of two bytes, of up to four components.
        Ok(ImageFormat::Jpeg) if is_progressive(data) => (data.len() as u64).saturating_add(padded.saturating_mul(8)),
        Ok(ImageFormat::Jpeg) => (data.len() as u64).saturating_add(32 * row),
        // A frame of YUV or ARGB, and its transforms.
        Ok(ImageFormat::WebP) => padded.saturating_mul(8),
        _ => 16 * row,
    };
    // What is not of a byte per channel is converted: the samples as they are, and twice as RGBA.
    let color = decoder.color_type();
    let converted = match color.bytes_per_pixel() / color.channel_count() {
        1 => 0,
        2 => padded.saturating_mul(16),
        _ => padded.saturating_mul(32),
    };
    samples.saturating_add(converted).saturating_add(1 << 18)
}

/// Whether a JPEG file has a frame header that says progressive (ITU-T T.81, section B.1.1.3).
fn is_progressive(data: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    let mut at = 2;
    while let Some(&[0xff, marker, high, low]) = data.get(at..at + 4) {
        match marker {
            // Frames 2, 6, 10 and 14 are progressive.
            0xc2 | 0xc6 | 0xca | 0xce => return true,
            START_OF_SCAN => return false,
            _ => at += 2 + usize::from(u16::from_be_bytes([high, low])),
        }
    }
    // Fill bytes or damage: the larger need is taken.
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn need(kept: u64, working: u64) -> Result<Need, ()> {
        Ok(Need { kept, working })
    }

    #[test]
    fn what_is_kept_and_what_the_threads_have_in_hand_must_fit() {
        let needs = [need(10, 5), Err(()), need(20, 1), need(5, 7)];
        assert_eq!(check(&needs, 35 + 12, 2), Ok(()));
        assert_eq!(check(&needs, 35 + 11, 2), Err(OverLimit { index: 3, needed: 7 }));
        assert_eq!(check(&needs, 35 + 7, 1), Ok(()));
        assert_eq!(check(&needs, 29, 1), Err(OverLimit { index: 2, needed: 20 }));
        assert_eq!(
            check(&[need(1, 1), need(u64::MAX, 0)], u64::MAX - 1, 1),
            Err(OverLimit { index: 1, needed: u64::MAX })
        );
        assert_eq!(check::<()>(&[], 0, 1), Ok(()));
    }

    #[test]
    fn a_progressive_jpeg_is_told_by_its_frame_header() {
        let file = |marker: u8| [0xff, 0xd8, 0xff, 0xe0, 0, 4, 1, 2, 0xff, marker, 0, 2, 0xff, 0xda, 0, 2];
        assert!(is_progressive(&file(0xc2)));
        assert!(!is_progressive(&file(0xc0)));
    }
}
