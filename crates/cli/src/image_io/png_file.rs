//! PNG.

use super::{Display, Encoding, ImageError, Picture, check_size};
use crate::failure::Failure;
use crate::output::write_atomically;
use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, Limits};
use std::io::Cursor;
use std::path::Path;

pub(super) fn read(path: &Path, bytes: &[u8], max_memory: u64) -> Result<Picture, ImageError> {
    let damaged = |e: image::ImageError| ImageError::Damaged { path: path.to_owned(), what: e.to_string() };
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(max_memory);
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    // Deflate packs at most 1032 bytes into one, and a byte holds up to 8 pixels; decoding holds the pixels twice.
    check_size(path, (width.into(), height.into()), bytes.len(), 28, 8 * 1032, max_memory)?;
    let image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    let pixels = image.into_rgb32f().as_raw().as_chunks::<3>().0.to_vec();
    Ok(Picture { width, height, pixels, encoding: Encoding::Srgb })
}

pub(super) fn write(
    path: &Path,
    width: u32,
    height: u32,
    pixels: &[[f32; 3]],
    display: Display,
) -> Result<(), Failure> {
    let bytes: Vec<u8> = pixels.iter().flat_map(|&p| display.tonemap.display(p, display.exposure)).collect();
    write_atomically(path, |file| {
        PngEncoder::new_with_quality(file, CompressionType::Default, FilterType::Adaptive)
            .write_image(&bytes, width, height, ExtendedColorType::Rgb8)
            .map_err(|e| Failure::bad_input(path, format!("cannot write the PNG: {e}")))
    })
}
