//! Materials that are given by specular and glossiness (KHR_materials_pbrSpecularGlossiness), as metallic-roughness rows.
//!
//! How metallic a surface is follows from diffuse and specular together, so textures are converted texel by texel, after
//! they are decoded: two images are made of them, base colour and metallic-roughness. Where the two textures lie on the
//! surface in different ways, no such image exists: the mean of the specular one is taken then, with a warning.

use super::materials::References;
use crate::textures::{
    ImageLimits, first_level_row, mean_texel, mip_chain, mip_chain_bytes, mip_working_bytes, srgb_from_linear,
};
use crate::{DeriveError, DeriveWarning};
use glam::Vec4;
use orthant_resident::batch::TextureRow;
use orthant_resident::image::{ImageData, TexelFormat};
use orthant_resident::rows::{MaterialRow, NONE, TextureSlot};
use orthant_scene::model::{Material, SpecularGlossiness, metallic_roughness};
use rayon::prelude::*;
use std::sync::Arc;

/// Rows whose textures wait to be converted.
#[derive(Default)]
pub struct Conversions(Vec<Conversion>);

struct Conversion {
    /// The material row.
    row: usize,
    place: String,
    given: SpecularGlossiness,
    diffuse: TextureSlot,
    specular: TextureSlot,
}

impl Conversions {
    /// Puts the factors of a material into its row, and asks for its textures where there are `references` for them.
    pub fn add(
        &mut self,
        material: &Material,
        row: usize,
        place: impl FnOnce() -> String,
        out: &mut MaterialRow,
        references: Option<&mut References<'_>>,
    ) {
        let Some(given) = SpecularGlossiness::of(material) else { return };
        let surface = given.factors();
        out.base_color = surface.base_color.map(|c| c as f32);
        (out.metallic, out.roughness) = (surface.metallic as f32, surface.roughness as f32);
        (out.base_color_texture, out.metallic_roughness_texture) = (TextureSlot::NONE, TextureSlot::NONE);
        let Some(references) = references else { return };
        let mut slot = |info: &Option<_>| info.as_ref().map_or(TextureSlot::NONE, |info| references.slot(info, true));
        let (diffuse, specular) = (slot(&given.diffuse_texture), slot(&given.texture));
        if diffuse.texture != NONE || specular.texture != NONE {
            self.0.push(Conversion { row, place: place(), given, diffuse, specular });
        }
    }

    /// Makes the images, and drops those that only served to make them.
    pub fn run(
        self,
        rows: &mut [MaterialRow],
        textures: &mut Vec<TextureRow>,
        images: &mut Vec<Option<Arc<ImageData>>>,
        limits: ImageLimits,
        warnings: &mut Vec<DeriveWarning>,
    ) -> Result<(), DeriveError> {
        let mut taken: u64 = images.iter().flatten().map(|image| image.texels.len() as u64).sum();
        let mut made: Vec<(Key, [u32; 2])> = Vec::new();
        let mut sources = Vec::new();
        for Conversion { row, place, given, diffuse, specular } in self.0 {
            let image = |slot: &TextureSlot| {
                let image = textures.get(slot.texture as usize)?.image as usize;
                images.get(image)?.clone().map(|data| (image, data))
            };
            let (diffuse_image, specular_image) = (image(&diffuse), image(&specular));
            sources.extend([&diffuse_image, &specular_image].into_iter().flatten().map(|(slot, _)| *slot));
            // The one that the new images lie as.
            let Some(leader) = diffuse_image.as_ref().map(|_| diffuse).or(specular_image.as_ref().map(|_| specular))
            else {
                continue;
            };
            let lies_alike = |a: &TextureSlot, b: &TextureSlot| (a.uv_set, a.transform) == (b.uv_set, b.transform);
            let is_apart = diffuse_image.is_some() && specular_image.is_some() && !lies_alike(&diffuse, &specular);
            if is_apart {
                let what =
                    "its two textures lie on the surface in different ways: the mean of the specular one is shown";
                warnings.push(DeriveWarning { place: place.clone(), what: what.to_owned() });
            }
            let key = Key { given: given.clone(), leader: leader.texture, is_apart };
            let pair = match made.iter().find(|(known, _)| *known == key) {
                Some((_, pair)) => *pair,
                None => {
                    let diffuse = diffuse_image.as_ref().map(|(_, image)| &**image);
                    let specular = specular_image.as_ref().map(|(_, image)| &**image);
                    let (width, height) = size([diffuse, specular.filter(|_| !is_apart)]);
                    taken =
                        taken.saturating_add(mip_chain_bytes(TexelFormat::Rgba8Srgb, width, height).saturating_mul(2));
                    let in_hand = mip_working_bytes(width, height).saturating_add(ROWS_IN_HAND * u64::from(width));
                    if taken.saturating_add(in_hand) > limits.max_bytes {
                        let what = format!(
                            "its textures become images of metallic and roughness, with which all images take {taken} bytes, \
                             over the limit of {}",
                            limits.max_bytes
                        );
                        return Err(DeriveError::new(place, what, "raise --max-memory, or shrink the images"));
                    }

                    let converted =
                        convert(&given, Source::new(diffuse, false), Source::new(specular, is_apart), width, height);
                    let sampling = textures[leader.texture as usize].sampling;
                    let pair = converted.map(|image| {
                        images.push(Some(Arc::new(image)));
                        textures.push(TextureRow { image: images.len() as u32 - 1, sampling });
                        textures.len() as u32 - 1
                    });
                    made.push((key, pair));
                    pair
                }
            };
            let row = &mut rows[row];
            row.base_color = [1.0; 4];
            (row.metallic, row.roughness) = (1.0, 1.0);
            row.base_color_texture = TextureSlot { texture: pair[0], ..leader };
            row.metallic_roughness_texture = TextureSlot { texture: pair[1], ..leader };
        }
        for source in sources {
            let is_used =
                |slot: &TextureSlot| textures.get(slot.texture as usize).is_some_and(|t| t.image as usize == source);
            if !rows.iter().any(|row| slots(row).iter().any(is_used)) {
                images[source] = None;
            }
        }
        Ok(())
    }
}

/// Bytes for each texel of a row, of the rows that threads convert at a time.
const ROWS_IN_HAND: u64 = 64 * 16;

/// What makes two conversions the same.
#[derive(PartialEq)]
struct Key {
    given: SpecularGlossiness,
    leader: u32,
    is_apart: bool,
}

fn slots(row: &MaterialRow) -> [TextureSlot; 5] {
    [
        row.base_color_texture,
        row.metallic_roughness_texture,
        row.normal_texture,
        row.occlusion_texture,
        row.emissive_texture,
    ]
}

/// The size of what is made: that of the larger source, each way.
fn size(images: [Option<&ImageData>; 2]) -> (u32, u32) {
    let sizes = images.into_iter().flatten().map(|image| (image.levels[0].width, image.levels[0].height));
    sizes.fold((1, 1), |(w, h), size| (w.max(size.0), h.max(size.1)))
}

/// Linear texels of an image, or one everywhere.
enum Source<'i> {
    Everywhere(Vec4),
    Image(&'i ImageData),
}

impl<'i> Source<'i> {
    fn new(image: Option<&'i ImageData>, is_mean: bool) -> Self {
        match image {
            None => Self::Everywhere(Vec4::ONE),
            Some(image) if is_mean => Self::Everywhere(mean_texel(image)),
            Some(image) => Self::Image(image),
        }
    }

    /// Row `y` of the source, scaled to another size (bilinear): the texel in the middle of each pixel.
    fn row(&self, y: usize, (w, h): (usize, usize)) -> Vec<Vec4> {
        let image = match self {
            Self::Everywhere(value) => return vec![*value; w],
            Self::Image(image) => image,
        };
        let (width, height) = (image.levels[0].width as usize, image.levels[0].height as usize);
        if (width, height) == (w, h) {
            return first_level_row(image, y);
        }
        let coordinate = |i: usize, to: usize, from: usize| {
            let t = ((i as f32 + 0.5) * from as f32 / to as f32 - 0.5).clamp(0.0, (from - 1) as f32);
            (t as usize, (t as usize + 1).min(from - 1), t.fract())
        };
        let (y0, y1, fy) = coordinate(y, h, height);
        let (upper, lower) = (first_level_row(image, y0), first_level_row(image, y1));
        let across = |x: usize| {
            let (x0, x1, fx) = coordinate(x, w, width);
            upper[x0].lerp(upper[x1], fx).lerp(lower[x0].lerp(lower[x1], fx), fy)
        };
        (0..w).map(across).collect()
    }
}

/// Base colour, and metallic-roughness.
fn convert(
    given: &SpecularGlossiness,
    diffuse: Source<'_>,
    specular: Source<'_>,
    width: u32,
    height: u32,
) -> [ImageData; 2] {
    let (w, h) = (width as usize, height as usize);
    let mut base = vec![0u8; 4 * w * h];
    let mut packed = vec![0u8; 4 * w * h];
    let unorm = |v: f64| (v * 255.0).round() as u8;
    base.par_chunks_exact_mut(4 * w).zip(packed.par_chunks_exact_mut(4 * w)).enumerate().for_each(
        |(y, (base, packed))| {
            let (diffuse, specular) = (diffuse.row(y, (w, h)), specular.row(y, (w, h)));
            for x in 0..w {
                let (d, s) = (diffuse[x].to_array().map(f64::from), specular[x].to_array().map(f64::from));
                let surface = metallic_roughness(
                    std::array::from_fn(|c| given.diffuse[c] * d[c]),
                    std::array::from_fn(|c| given.specular[c] * s[c]),
                    given.glossiness * s[3],
                );
                let [r, g, b, a] = surface.base_color;
                let encoded = [r, g, b].map(|c| unorm(f64::from(srgb_from_linear(c as f32))));
                base[4 * x..4 * x + 4].copy_from_slice(&[encoded[0], encoded[1], encoded[2], unorm(a)]);
                packed[4 * x..4 * x + 4].copy_from_slice(&[
                    255,
                    unorm(surface.roughness),
                    unorm(surface.metallic),
                    255,
                ]);
            }
        },
    );
    [mip_chain(TexelFormat::Rgba8Srgb, width, height, base), mip_chain(TexelFormat::Rgba8Linear, width, height, packed)]
}
