//! Encoded images to [`ImageData`], in parallel, within a budget of bytes.

use super::file::TextureFile;
use super::mips::{chain_bytes, mip_chain};
use super::{dds, ktx2};
use crate::derived::materials::ImageUse;
use crate::{DeriveError, DeriveWarning};
use image::{DynamicImage, ImageDecoder, ImageReader};
use orthant_resident::image::{ImageData, MipLevel, TexelFormat};
use orthant_scene::Scene;
use orthant_scene::model::{Image, Store};
use rayon::prelude::*;
use std::io::Cursor;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bounds on what images may take.
#[derive(Clone, Copy, Debug)]
pub struct ImageLimits {
    /// Most bytes of all decoded images, as many levels as are asked for.
    pub max_bytes: u64,
    /// Which levels are made.
    pub levels: Levels,
}

/// Levels of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Levels {
    /// The image as it is.
    First,
    /// And its mip chain: the file's, where it has one.
    All,
}

/// Why an image is not shown.
#[derive(Debug)]
pub(super) enum Failure {
    /// It is broken, missing or of an unknown kind: its textures are left out.
    Warning(String),
    /// It does not fit the budget.
    OverBudget { needed: u64 },
}

/// Decodes images in the order given. Missing and broken ones become `None` and a warning.
///
/// # Errors
/// When the images together need more than the budget; nothing larger than the budget is allocated before that is known.
pub fn decode_images(
    scene: &Scene,
    uses: &[ImageUse],
    limits: ImageLimits,
    warnings: &mut Vec<DeriveWarning>,
) -> Result<Vec<Option<Arc<ImageData>>>, DeriveError> {
    let taken = AtomicU64::new(0);
    let budget = Budget { limits, taken: &taken };
    let decode_use = |use_: &ImageUse| {
        let image: &Image = &scene.images()[use_.image];
        let data = image.data.as_ref().ok_or_else(|| Failure::Warning("the image file is missing".into()))?;
        decode(data, use_.srgb, &budget)
    };
    let results: Vec<_> = uses.par_iter().map(decode_use).collect();
    let mut images = Vec::with_capacity(uses.len());
    for (use_, result) in uses.iter().zip(results) {
        let place = format!("/images/{}", Store::<_, ()>::slot(use_.image));
        match result {
            Ok((image, note)) => {
                warnings.extend(note.map(|what| DeriveWarning { place, what }));
                images.push(Some(Arc::new(image)));
            }
            Err(Failure::Warning(reason)) => {
                warnings.push(DeriveWarning { place, what: format!("{reason}; its textures are left out") });
                images.push(None);
            }
            Err(Failure::OverBudget { needed }) => {
                let what = format!(
                    "the image needs {needed} bytes, which with those before it is over the limit of {}",
                    limits.max_bytes
                );
                return Err(DeriveError::new(place, what, "raise --max-memory, or shrink the image"));
            }
        }
    }
    warnings.dedup();
    Ok(images)
}

/// An image, and what it shows otherwise than its file says.
type Decoded = (ImageData, Option<String>);

/// The bytes that images may take, and have taken.
struct Budget<'a> {
    limits: ImageLimits,
    taken: &'a AtomicU64,
}

impl Budget<'_> {
    /// Charges an image with its levels, before memory is taken for it.
    fn charge(&self, format: TexelFormat, width: u32, height: u32) -> Result<(), Failure> {
        let needed = match self.limits.levels {
            Levels::All => chain_bytes(format, width, height),
            Levels::First => (u64::from(width) * u64::from(height)).saturating_mul(format.bytes() as u64),
        };
        let before = self.taken.fetch_add(needed, Ordering::Relaxed);
        let fits = before.saturating_add(needed) <= self.limits.max_bytes;
        if fits { Ok(()) } else { Err(Failure::OverBudget { needed }) }
    }

    /// An image of its first level, with the levels that are asked for.
    fn finish(&self, format: TexelFormat, width: u32, height: u32, texels: Vec<u8>) -> ImageData {
        match self.limits.levels {
            Levels::All => mip_chain(format, width, height, texels),
            Levels::First => ImageData { format, levels: vec![MipLevel { width, height, offset: 0 }], texels },
        }
    }
}

/// Decodes by content, whatever the document says that the image is.
fn decode(data: &[u8], srgb: bool, budget: &Budget<'_>) -> Result<Decoded, Failure> {
    if data.starts_with(ktx2::MAGIC) {
        return decode_file(&ktx2::open(data).map_err(Failure::Warning)?, srgb, budget);
    }
    if data.starts_with(dds::MAGIC) {
        return decode_file(&dds::open(data).map_err(Failure::Warning)?, srgb, budget);
    }
    Ok((decode_image(data, srgb, budget)?, None))
}

/// [`decode`] of one image alone.
#[cfg(test)]
pub(super) fn decode_bytes(data: &[u8], srgb: bool, max_bytes: u64) -> Result<Decoded, Failure> {
    decode(data, srgb, &Budget { limits: ImageLimits { max_bytes, levels: Levels::All }, taken: &AtomicU64::new(0) })
}

/// KTX2 and DDS: the file's own levels where it has all of them, else the first and ours.
fn decode_file(file: &TextureFile<'_>, srgb: bool, budget: &Budget<'_>) -> Result<Decoded, Failure> {
    let format = file.texel_format(srgb);
    budget.charge(format, file.width, file.height)?;
    let first = file.decode(0).map_err(Failure::Warning)?;
    if file.levels.len() == 1 || budget.limits.levels == Levels::First {
        return Ok((budget.finish(format, file.width, file.height, first), file.note.clone()));
    }
    let mut image = ImageData { format, levels: Vec::with_capacity(file.levels.len()), texels: Vec::new() };
    for level in 0..file.levels.len() {
        let texels = if level == 0 { &first } else { &file.decode(level).map_err(Failure::Warning)? };
        let (width, height) = file.size(level);
        image.levels.push(MipLevel { width, height, offset: image.texels.len() });
        image.texels.extend_from_slice(texels);
    }
    Ok((image, file.note.clone()))
}

/// PNG, JPEG, WebP and Radiance HDR.
fn decode_image(data: &[u8], srgb: bool, budget: &Budget<'_>) -> Result<ImageData, Failure> {
    let broken = |e: image::ImageError| Failure::Warning(format!("the image cannot be decoded: {e}"));
    let reader = ImageReader::new(Cursor::new(data))
        .with_guessed_format()
        .map_err(|e| Failure::Warning(format!("the image cannot be read: {e}")))?;
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(Failure::Warning("the image has no texels".into()));
    }
    let color = decoder.color_type();
    let format = match (color.bytes_per_pixel() / color.channel_count(), srgb) {
        (1, true) => TexelFormat::Rgba8Srgb,
        (1, false) => TexelFormat::Rgba8Linear,
        (2, true) => TexelFormat::Rgba16Srgb,
        (2, false) => TexelFormat::Rgba16Linear,
        _ => TexelFormat::Rgba32Float,
    };
    budget.charge(format, width, height)?;
    // The decoder's own buffers are bounded by the header's size too: a bomb is refused before it is inflated.
    let mut bounds = image::Limits::no_limits();
    bounds.max_alloc = Some(decoder.total_bytes().saturating_mul(2).saturating_add(1 << 20));
    decoder.set_limits(bounds).map_err(broken)?;
    if matches!(format, TexelFormat::Rgba8Linear | TexelFormat::Rgba8Srgb) {
        return Ok(budget.finish(format, width, height, rgba8(decoder).map_err(broken)?));
    }
    let decoded = DynamicImage::from_decoder(decoder).map_err(broken)?;
    let texels = match format {
        TexelFormat::Rgba8Linear | TexelFormat::Rgba8Srgb => decoded.into_rgba8().into_raw(),
        TexelFormat::Rgba16Linear | TexelFormat::Rgba16Srgb => bytemuck::cast_slice(&decoded.into_rgba16()).to_vec(),
        TexelFormat::Rgba32Float => bytemuck::cast_slice(&decoded.into_rgba32f()).to_vec(),
    };
    Ok(budget.finish(format, width, height, texels))
}

/// Decodes an image of one to four channels of a byte as RGBA: into the front of the texels, which are then spread in
/// place.
fn rgba8(decoder: impl ImageDecoder) -> image::ImageResult<Vec<u8>> {
    let (width, height) = decoder.dimensions();
    let count = width as usize * height as usize;
    let channels = usize::from(decoder.color_type().channel_count());
    let mut texels = vec![0; 4 * count];
    decoder.read_image(&mut texels[..channels * count])?;
    match channels {
        1 => spread(&mut texels, |[l]| [l, l, l, u8::MAX]),
        2 => spread(&mut texels, |[l, a]| [l, l, l, a]),
        3 => spread(&mut texels, |[r, g, b]| [r, g, b, u8::MAX]),
        _ => {}
    }
    Ok(texels)
}

/// Makes texels of four bytes of those of `N` that lie at the front: from the last one on, so that none is overwritten
/// before it is read.
fn spread<const N: usize>(texels: &mut [u8], to_rgba: impl Fn([u8; N]) -> [u8; 4]) {
    /// Texels that are moved at once.
    const BLOCK: usize = 16;
    let count = texels.len() / 4;
    let whole = count / BLOCK * BLOCK;
    for i in (whole..count).rev() {
        let texel = std::array::from_fn(|c| texels[N * i + c]);
        texels[4 * i..4 * i + 4].copy_from_slice(&to_rgba(texel));
    }
    for first in (0..whole).step_by(BLOCK).rev() {
        let mut block = [[0; N]; BLOCK];
        block.as_flattened_mut().copy_from_slice(&texels[N * first..N * (first + BLOCK)]);
        let out = &mut texels[4 * first..4 * (first + BLOCK)];
        for (out, texel) in out.as_chunks_mut::<4>().0.iter_mut().zip(block) {
            *out = to_rgba(texel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_spread_without_being_overwritten() {
        for count in [0, 1, 15, 16, 17, 100] {
            let rgb: Vec<u8> = (0..3 * count).map(|i| (i * 7) as u8).collect();
            let mut texels = rgb.clone();
            texels.resize(4 * count, 0);
            spread(&mut texels, |[r, g, b]| [r, g, b, 9]);
            let expected: Vec<u8> = rgb.chunks(3).flat_map(|t| [t[0], t[1], t[2], 9]).collect();
            assert_eq!(texels, expected);
        }
    }

    #[test]
    fn every_number_of_channels_is_read() {
        let png = |color, data: &[u8]| {
            let mut out = Vec::new();
            let encoder = image::codecs::png::PngEncoder::new(&mut out);
            image::ImageEncoder::write_image(encoder, data, 2, 1, color).unwrap();
            out
        };
        use image::ExtendedColorType::{L8, La8, Rgb8, Rgba8};
        for (color, data, expected) in [
            (L8, &[1u8, 2][..], [1, 1, 1, 255, 2, 2, 2, 255]),
            (La8, &[1, 2, 3, 4], [1, 1, 1, 2, 3, 3, 3, 4]),
            (Rgb8, &[1, 2, 3, 4, 5, 6], [1, 2, 3, 255, 4, 5, 6, 255]),
            (Rgba8, &[1, 2, 3, 4, 5, 6, 7, 8], [1, 2, 3, 4, 5, 6, 7, 8]),
        ] {
            let (image, _) = decode_bytes(&png(color, data), true, 1 << 20).unwrap();
            assert_eq!(image.texels[..8], expected, "{color:?}");
        }
    }
}
