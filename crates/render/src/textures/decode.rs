//! Encoded images to [`ImageData`], in parallel, within a budget of bytes.

use super::file::TextureFile;
use super::mips::mip_chain;
use super::need::{self, Need};
use super::{dds, jpeg, ktx2};
use crate::derived::materials::ImageUse;
use crate::{DeriveError, DeriveWarning};
use image::{DynamicImage, ImageDecoder, ImageReader};
use orthant_resident::image::{ImageData, MipLevel, TexelFormat};
use orthant_scene::Scene;
use orthant_scene::model::Store;
use rayon::prelude::*;
use std::io::Cursor;
use std::sync::Arc;

/// Bounds on what images may take.
#[derive(Clone, Copy, Debug)]
pub struct ImageLimits {
    /// Most bytes of all decoded images, as many levels as are asked for, and of what decoders have in hand meanwhile.
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

/// Why an image is not shown: it is broken, missing or of an unknown kind, and its textures are left out.
#[derive(Debug)]
pub(super) struct Broken(pub String);

/// Decodes images in the order given. Missing and broken ones become `None` and a warning.
///
/// # Errors
/// When the images together need more than the budget: that is known from their headers, before anything is decoded.
pub fn decode_images(
    scene: &Scene,
    uses: &[ImageUse],
    limits: ImageLimits,
    warnings: &mut Vec<DeriveWarning>,
) -> Result<Vec<Option<Arc<ImageData>>>, DeriveError> {
    let place = |use_: &ImageUse| format!("/images/{}", Store::<_, ()>::slot(use_.image));
    let data = |use_: &ImageUse| {
        let data = scene.images()[use_.image].data.as_deref();
        data.ok_or_else(|| Broken("the image file is missing".into()))
    };
    let need_of = |use_: &ImageUse| Need::of(data(use_)?, use_.srgb, limits.levels);
    let needs: Vec<Result<Need, Broken>> = uses.par_iter().map(need_of).collect();
    if let Err(over) = need::check(&needs, limits.max_bytes, rayon::current_num_threads()) {
        let (needed, max_bytes) = (over.needed, limits.max_bytes);
        let what =
            format!("the image needs {needed} bytes, which with those before it is over the limit of {max_bytes}");
        return Err(DeriveError::new(place(&uses[over.index]), what, "raise --max-memory, or shrink the image"));
    }
    let decode_use = |(use_, need): (&ImageUse, Result<Need, Broken>)| {
        need?;
        decode(data(use_)?, use_.srgb, limits.levels)
    };
    let results: Vec<_> = uses.par_iter().zip(needs).map(decode_use).collect();
    let mut images = Vec::with_capacity(uses.len());
    for (use_, result) in uses.iter().zip(results) {
        match result {
            Ok((image, note)) => {
                warnings.extend(note.map(|what| DeriveWarning { place: place(use_), what }));
                images.push(Some(Arc::new(image)));
            }
            Err(Broken(reason)) => {
                let what = format!("{reason}; its textures are left out");
                warnings.push(DeriveWarning { place: place(use_), what });
                images.push(None);
            }
        }
    }
    warnings.dedup();
    Ok(images)
}

/// An image, and what it shows otherwise than its file says.
pub(super) type Decoded = (ImageData, Option<String>);

/// KTX2 and DDS by content, whatever the document says that the image is; `None` for all else.
pub(super) fn open_file(data: &[u8]) -> Option<Result<TextureFile<'_>, Broken>> {
    let file = if data.starts_with(ktx2::MAGIC) {
        ktx2::open(data)
    } else if data.starts_with(dds::MAGIC) {
        dds::open(data)
    } else {
        return None;
    };
    Some(file.map_err(Broken))
}

/// Reads the header of a PNG, JPEG, WebP or Radiance HDR file. The decoder may take no more than its image warrants.
pub(super) fn open_image(data: &[u8]) -> Result<impl ImageDecoder + '_, Broken> {
    let reader = ImageReader::new(Cursor::new(data))
        .with_guessed_format()
        .map_err(|e| Broken(format!("the image cannot be read: {e}")))?;
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err(Broken("the image has no texels".into()));
    }
    // The decoder's own buffers are bounded by the header's size too: a bomb is refused before it is inflated.
    let mut bounds = image::Limits::no_limits();
    bounds.max_alloc = Some(decoder.total_bytes().saturating_mul(2).saturating_add(1 << 20));
    decoder.set_limits(bounds).map_err(broken)?;
    Ok(decoder)
}

/// What an image becomes.
pub(super) fn texel_format(decoder: &impl ImageDecoder, srgb: bool) -> TexelFormat {
    let color = decoder.color_type();
    match (color.bytes_per_pixel() / color.channel_count(), srgb) {
        (1, true) => TexelFormat::Rgba8Srgb,
        (1, false) => TexelFormat::Rgba8Linear,
        (2, true) => TexelFormat::Rgba16Srgb,
        (2, false) => TexelFormat::Rgba16Linear,
        _ => TexelFormat::Rgba32Float,
    }
}

fn broken(e: image::ImageError) -> Broken {
    Broken(format!("the image cannot be decoded: {e}"))
}

/// Decodes by content. The memory was found to be there.
pub(super) fn decode(data: &[u8], srgb: bool, levels: Levels) -> Result<Decoded, Broken> {
    match open_file(data) {
        Some(file) => decode_file(&file?, srgb, levels),
        None => Ok((decode_image(data, srgb, levels)?, None)),
    }
}

/// The file's own levels where it has all of them, else the first and ours.
fn decode_file(file: &TextureFile<'_>, srgb: bool, levels: Levels) -> Result<Decoded, Broken> {
    let format = file.texel_format(srgb);
    let mut texels = file.decode(0).map_err(Broken)?;
    if file.levels.len() == 1 || levels == Levels::First {
        return Ok((finish(levels, format, file.width, file.height, texels), file.note.clone()));
    }
    let bytes = |level: usize| file.size(level).0 as usize * file.size(level).1 as usize * format.bytes();
    texels.reserve_exact((1..file.levels.len()).map(bytes).sum());
    let mut image =
        ImageData { format, levels: vec![MipLevel { width: file.width, height: file.height, offset: 0 }], texels };
    for level in 1..file.levels.len() {
        let (width, height) = file.size(level);
        image.levels.push(MipLevel { width, height, offset: image.texels.len() });
        image.texels.extend_from_slice(&file.decode(level).map_err(Broken)?);
    }
    Ok((image, file.note.clone()))
}

/// PNG, JPEG, WebP and Radiance HDR.
fn decode_image(data: &[u8], srgb: bool, levels: Levels) -> Result<ImageData, Broken> {
    let decoder = open_image(data)?;
    let ((width, height), format) = (decoder.dimensions(), texel_format(&decoder, srgb));
    let texels = match format {
        TexelFormat::Rgba8Linear | TexelFormat::Rgba8Srgb => match jpeg::rgba8(data) {
            Some(texels) => texels,
            None => rgba8(decoder).map_err(broken)?,
        },
        TexelFormat::Rgba16Linear | TexelFormat::Rgba16Srgb => {
            let decoded = DynamicImage::from_decoder(decoder).map_err(broken)?;
            bytemuck::cast_slice(&decoded.into_rgba16()).to_vec()
        }
        TexelFormat::Rgba32Float => {
            let decoded = DynamicImage::from_decoder(decoder).map_err(broken)?;
            bytemuck::cast_slice(&decoded.into_rgba32f()).to_vec()
        }
    };
    Ok(finish(levels, format, width, height, texels))
}

/// An image of its first level, with the levels that are asked for.
fn finish(levels: Levels, format: TexelFormat, width: u32, height: u32, texels: Vec<u8>) -> ImageData {
    match levels {
        Levels::All => mip_chain(format, width, height, texels),
        Levels::First => ImageData { format, levels: vec![MipLevel { width, height, offset: 0 }], texels },
    }
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
            let (image, _) = decode(&png(color, data), true, Levels::All).unwrap();
            assert_eq!(image.texels[..8], expected, "{color:?}");
        }
    }
}
