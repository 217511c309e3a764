//! Pictures in files: PNG (display-encoded, 8 or 16 bits), OpenEXR and Radiance HDR (linear).
//!
//! Everything that can go wrong is an [`ImageError`] that names the file; sizes that a header claims are checked against
//! the length of the file and a limit before memory is taken.

mod exr_file;
mod hdr_file;
mod png_file;

pub use exr_file::{Channel, write_channels};

use crate::failure::Failure;
use orthant_resident::tonemap::ToneMapper;
use std::path::{Path, PathBuf};

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Portable network graphics: display-encoded.
    Png,
    /// OpenEXR: linear.
    Exr,
    /// Radiance RGBE: linear.
    Hdr,
}

/// What is wrong with an image file.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// It cannot be read.
    #[error("{path}: cannot read the file: {source}: check the path and the permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Its name does not end in a known extension.
    #[error("{path}: not an image that this command knows: use .png, .exr or .hdr")]
    Extension {
        /// The file.
        path: PathBuf,
    },
    /// Its first bytes are not those of the format that its name states.
    #[error("{path}: byte 0: the content is not {expected}: give the file the extension of its format")]
    Content {
        /// The file.
        path: PathBuf,
        /// The format by its name.
        expected: &'static str,
    },
    /// It is damaged, or uses what is not supported.
    #[error("{path}: {what}: write the file again with another program")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// It claims more pixels than its bytes or the memory limit allow.
    #[error("{path}: claims {width} x {height} pixels, {why}")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Claimed width.
        width: u64,
        /// Claimed height.
        height: u64,
        /// Which limit, and what to do.
        why: String,
    },
}

impl From<ImageError> for Failure {
    fn from(error: ImageError) -> Self {
        // The message has the file in it already.
        Failure::new(crate::failure::Exit::BadInput, error.to_string())
    }
}

/// An RGB picture in memory, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// `width * height` colours: linear radiance, or sRGB-encoded values in 0..=1, as `encoding` says.
    pub pixels: Vec<[f32; 3]>,
    /// What the values mean.
    pub encoding: Encoding,
}

/// What the values of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Proportional to light.
    Linear,
    /// sRGB-encoded, 0..=1.
    Srgb,
}

impl Picture {
    /// The same picture with linear values.
    #[must_use]
    pub fn into_linear(mut self) -> Self {
        if self.encoding == Encoding::Srgb {
            for pixel in &mut self.pixels {
                *pixel = pixel.map(orthant_resident::tonemap::srgb_decode);
            }
            self.encoding = Encoding::Linear;
        }
        self
    }
}

impl Format {
    /// By the extension, whatever its case.
    ///
    /// # Errors
    /// [`ImageError::Extension`].
    pub fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            "hdr" => Ok(Self::Hdr),
            _ => Err(ImageError::Extension { path: path.to_owned() }),
        }
    }
}

/// Reads a picture of any of the formats. Alpha, if there is one, is dropped.
///
/// `max_memory` bounds the bytes that decoding may take.
///
/// # Errors
/// Every [`ImageError`].
pub fn read(path: &Path, max_memory: u64) -> Result<Picture, ImageError> {
    let format = Format::of(path)?;
    let read_error = |source| ImageError::Read { path: path.to_owned(), source };
    let length = std::fs::metadata(path).map_err(read_error)?.len();
    if length > max_memory {
        let what = format!("the file has {length} bytes, more than the memory limit of {max_memory}");
        return Err(ImageError::Damaged { path: path.to_owned(), what });
    }
    let bytes = std::fs::read(path).map_err(read_error)?;
    let (magic, name): (&[&[u8]], _) = match format {
        Format::Png => (&[b"\x89PNG\r\n\x1a\n"], "a PNG"),
        Format::Exr => (&[b"\x76\x2f\x31\x01"], "an OpenEXR image"),
        Format::Hdr => (&[b"#?RADIANCE", b"#?RGBE"], "a Radiance HDR image"),
    };
    if !magic.iter().any(|m| bytes.starts_with(m)) {
        return Err(ImageError::Content { path: path.to_owned(), expected: name });
    }
    match format {
        Format::Png => png_file::read(path, &bytes, max_memory),
        Format::Exr => exr_file::read(path, &bytes, max_memory),
        Format::Hdr => hdr_file::read(path, &bytes, max_memory),
    }
}

/// How linear radiance becomes a PNG. EXR and HDR files stay linear and ignore it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// The operator.
    pub tonemap: ToneMapper,
    /// Stops by which radiance is multiplied first.
    pub exposure: f32,
}

/// Writes linear radiance in the format that the extension names, whole or not at all.
///
/// # Errors
/// Another extension, or an I/O error.
///
/// # Panics
/// If `pixels` are not `width * height`.
pub fn write(path: &Path, width: u32, height: u32, pixels: &[[f32; 3]], display: Display) -> Result<(), Failure> {
    assert_eq!(pixels.len() as u64, u64::from(width) * u64::from(height), "one colour a pixel");
    match Format::of(path)? {
        Format::Png => png_file::write(path, width, height, pixels, display),
        Format::Exr => exr_file::write(path, width, height, pixels),
        Format::Hdr => hdr_file::write(path, width, height, pixels),
    }
}

/// Refuses a claimed size before memory is taken: each pixel takes `bytes_per_pixel` decoded, and the best compression
/// of the format packs no more than `pixels_per_byte` pixels into a byte of the file.
fn check_size(
    path: &Path,
    (width, height): (u64, u64),
    file_length: usize,
    bytes_per_pixel: u64,
    pixels_per_byte: u64,
    max_memory: u64,
) -> Result<(), ImageError> {
    let refuse = |why: String| Err(ImageError::TooLarge { path: path.to_owned(), width, height, why });
    if width == 0 || height == 0 {
        return refuse("which is none: write the file again".into());
    }
    let pixels = u128::from(width) * u128::from(height);
    if pixels > u128::from(pixels_per_byte) * file_length as u128 {
        return refuse(format!("but the file has only {file_length} bytes: it is damaged"));
    }
    let needed = pixels * u128::from(bytes_per_pixel);
    if needed > u128::from(max_memory) {
        return refuse(format!("{needed} bytes, more than the limit of {max_memory}: raise --max-memory"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const DISPLAY: Display = Display { tonemap: ToneMapper::None, exposure: 0.0 };
    const LIMIT: u64 = 1 << 24;

    fn sample() -> Vec<[f32; 3]> {
        (0..35).map(|i| [i as f32 / 34.0, (i * i) as f32 * 0.125, 1.0 / (i + 1) as f32]).collect()
    }

    #[test]
    fn exr_keeps_every_bit_of_every_float() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.EXR");
        let mut pixels = sample();
        pixels[3] = [f32::INFINITY, 1.0e-40, -2.5];
        write(&path, 7, 5, &pixels, DISPLAY).expect("write");
        let back = read(&path, LIMIT).expect("read");
        assert_eq!((back.width, back.height, back.encoding), (7, 5, Encoding::Linear));
        assert_eq!(back.pixels, pixels);
    }

    #[test]
    fn hdr_keeps_eight_bits_of_the_largest_channel() {
        let folder = tempfile::tempdir().expect("folder");
        for (width, height) in [(7, 5), (35, 1)] {
            let path = folder.path().join("a.hdr");
            write(&path, width, height, &sample(), DISPLAY).expect("write");
            let back = read(&path, LIMIT).expect("read");
            for (a, b) in back.pixels.iter().zip(sample()) {
                let step = b[0].max(b[1]).max(b[2]) / 128.0;
                assert!((0..3).all(|c| (a[c] - b[c]).abs() <= step), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn png_is_srgb_encoded_and_rounded() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.png");
        write(&path, 3, 1, &[[0.0, 0.5, 1.0], [9.0, -1.0, 0.215_861], [0.001; 3]], DISPLAY).expect("write");
        let back = read(&path, LIMIT).expect("read");
        let bytes: Vec<_> = back.pixels.iter().map(|p| p.map(|c| (c * 255.0).round() as u8)).collect();
        assert_eq!(bytes, [[0, 188, 255], [255, 0, 128], [3, 3, 3]]);
    }

    #[test]
    fn a_file_with_the_wrong_content_is_refused_by_name() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.png");
        std::fs::write(&path, b"GIF89a").expect("write");
        assert!(matches!(read(&path, LIMIT), Err(ImageError::Content { .. })));
        assert!(matches!(read(Path::new("a.gif"), LIMIT), Err(ImageError::Extension { .. })));
        assert!(matches!(read(Path::new("/nonexistent.png"), LIMIT), Err(ImageError::Read { .. })));
    }

    #[test]
    fn truncated_and_flipped_files_are_errors_or_pictures_but_never_panics() {
        let folder = tempfile::tempdir().expect("folder");
        for name in ["a.png", "a.exr", "a.hdr"] {
            let path = folder.path().join(name);
            write(&path, 7, 5, &sample(), DISPLAY).expect("write");
            let bytes = std::fs::read(&path).expect("bytes");
            for cut in 0..bytes.len() {
                std::fs::write(&path, &bytes[..cut]).expect("write");
                let truncated = read(&path, LIMIT);
                // The last bytes of a PNG are the empty IEND chunk: all pixels are there without it.
                assert!(truncated.is_err() || (name == "a.png" && cut + 12 >= bytes.len()), "{name} cut at {cut}");
            }
            for at in 0..bytes.len() {
                for flip in [0xff, 1, 0x80] {
                    let mut bad = bytes.clone();
                    bad[at] ^= flip;
                    std::fs::write(&path, &bad).expect("write");
                    let _may_be_either = read(&path, LIMIT);
                }
            }
        }
    }

    #[test]
    fn a_header_that_claims_more_than_the_file_can_hold_takes_no_memory() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("bomb.hdr");
        std::fs::write(&path, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2000000 +X 2000000\n\0\0\0\0").expect("write");
        let error = read(&path, u64::MAX).expect_err("four terapixels in sixty bytes");
        assert!(matches!(error, ImageError::TooLarge { .. }), "{error}");
        let path = folder.path().join("large.exr");
        write(&path, 100, 100, &vec![[1.0; 3]; 10_000], DISPLAY).expect("write");
        let error = read(&path, 5000).expect_err("120,000 bytes of pixels");
        assert!(error.to_string().contains("--max-memory") || error.to_string().contains("memory limit"), "{error}");
    }
}
