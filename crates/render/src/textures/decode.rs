//! Encoded images to [`ImageData`], in parallel, within a budget of bytes.

use super::mips::{chain_bytes, mip_chain};
use crate::derived::materials::ImageUse;
use crate::{DeriveError, DeriveWarning};
use image::{DynamicImage, ImageDecoder, ImageReader};
use orthant_resident::image::{ImageData, TexelFormat};
use orthant_scene::Scene;
use orthant_scene::model::{Image, Store};
use rayon::prelude::*;
use std::io::Cursor;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bounds on what images may take.
#[derive(Clone, Copy, Debug)]
pub struct ImageLimits {
    /// Most bytes of all decoded images with their mips.
    pub max_bytes: u64,
}

/// Why an image is not shown.
enum Failure {
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
    let results: Vec<_> =
        uses.par_iter().map(|use_| decode(&scene.images()[use_.image], use_.srgb, limits.max_bytes, &taken)).collect();
    let mut images = Vec::with_capacity(uses.len());
    for (use_, result) in uses.iter().zip(results) {
        let place = format!("/images/{}", Store::<_, ()>::slot(use_.image));
        match result {
            Ok(image) => images.push(Some(Arc::new(image))),
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

fn decode(image: &Image, srgb: bool, max_bytes: u64, taken: &AtomicU64) -> Result<ImageData, Failure> {
    let data = image.data.as_ref().ok_or_else(|| Failure::Warning("the image file is missing".into()))?;
    let broken = |e: image::ImageError| Failure::Warning(format!("the image cannot be decoded: {e}"));
    let reader = ImageReader::new(Cursor::new(data.as_slice()))
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
    let needed = chain_bytes(format, width, height);
    let before = taken.fetch_add(needed, Ordering::Relaxed);
    if before.saturating_add(needed) > max_bytes {
        return Err(Failure::OverBudget { needed });
    }
    // The decoder's own buffers are bounded by the header's size too: a bomb is refused before it is inflated.
    let mut bounds = image::Limits::no_limits();
    bounds.max_alloc = Some(decoder.total_bytes().saturating_mul(2).saturating_add(1 << 20));
    decoder.set_limits(bounds).map_err(broken)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(broken)?;
    let texels = match format {
        TexelFormat::Rgba8Linear | TexelFormat::Rgba8Srgb => decoded.into_rgba8().into_raw(),
        TexelFormat::Rgba16Linear | TexelFormat::Rgba16Srgb => bytemuck::cast_slice(&decoded.into_rgba16()).to_vec(),
        TexelFormat::Rgba32Float => bytemuck::cast_slice(&decoded.into_rgba32f()).to_vec(),
    };
    Ok(mip_chain(format, width, height, texels))
}
