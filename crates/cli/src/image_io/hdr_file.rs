//! Radiance HDR (RGBE): flat, old and new run lengths are read; new run lengths are written.

use super::{Encoding, ImageError, Picture, check_size};
use crate::failure::Failure;
use crate::output::write_atomically;
use image::codecs::hdr::{HdrDecoder, HdrEncoder};
use image::{DynamicImage, ImageDecoder, Rgb};
use std::io::Cursor;
use std::path::Path;

/// An old run repeats a pixel up to 255 times per 4 bytes, and such runs can be chained by powers of 256; real files
/// stay far below this.
const PIXELS_PER_BYTE: u64 = 1 << 14;

pub(super) fn read(path: &Path, bytes: &[u8], max_memory: u64) -> Result<Picture, ImageError> {
    let damaged = |e: image::ImageError| ImageError::Damaged { path: path.to_owned(), what: e.to_string() };
    // Not strict: many writers omit the FORMAT line or state the `#?RGBE` signature.
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    check_size(path, (width.into(), height.into()), bytes.len(), 24, PIXELS_PER_BYTE, max_memory)?;
    let image = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    let pixels = image.into_rgb32f().as_raw().as_chunks::<3>().0.to_vec();
    Ok(Picture { width, height, pixels, encoding: Encoding::Linear })
}

pub(super) fn write(path: &Path, width: u32, height: u32, pixels: &[[f32; 3]]) -> Result<(), Failure> {
    // RGBE has no sign and no infinity: its largest value is 255/256 * 2^127.
    let finite = |c: f32| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.69e38) };
    let pixels: Vec<Rgb<f32>> = pixels.iter().map(|p| Rgb(p.map(finite))).collect();
    write_atomically(path, |file| {
        HdrEncoder::new(file)
            .encode(&pixels, width as usize, height as usize)
            .map_err(|e| Failure::bad_input(path, format!("cannot write the HDR: {e}")))
    })
}
