//! Material, texture and image rows.

use super::material_row;
use super::specular_glossiness::Conversions;
use crate::textures::{ImageLimits, decode_images, mean_color};
use crate::{DeriveError, DeriveWarning};
use glam::Vec3;
use orthant_resident::batch::{ImageWrite, TextureRow};
use orthant_resident::image::{ImageData, MipMode, Sampling, Wrap};
use orthant_resident::rows::{AlphaMode as RowAlpha, MaterialFlags, MaterialRow, NONE, TextureSlot};
use orthant_scene::Scene;
use orthant_scene::animation::Posed;
use orthant_scene::model::{
    AlphaMode, ImageId, MagFilter, Material, MaterialId, MinFilter, Sampler, Store, TextureId, TextureInfo, WrapMode,
};
use std::collections::HashMap;
use std::sync::Arc;

/// The derived rows and images.
#[derive(Clone, Debug, Default)]
pub struct Materials {
    /// Row 0 is the default material, row `slot + 1` the document's.
    pub rows: Vec<MaterialRow>,
    /// Textures in the order of their first use.
    pub textures: Vec<TextureRow>,
    /// What each texture row shows; `None` for one that was made of others.
    pub textures_of: Vec<Option<TextureKey>>,
    /// Images in the order of their first use.
    pub images: Vec<ImageWrite>,
    /// Mean linear colour of the emissive texture, by row; white without one.
    pub mean_emission: Vec<Vec3>,
}

/// A texture, and whether its colours are sRGB-encoded.
pub type TextureKey = (TextureId, bool);

/// An image as one kind of texture reads it: the same file can be colour here and data there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageUse {
    /// The image.
    pub image: ImageId,
    /// Colour channels are sRGB-encoded.
    pub srgb: bool,
}

/// Derives all materials. Without `limits` no image is decoded and no texture used.
pub fn derive(
    posed: Posed<'_>,
    limits: Option<ImageLimits>,
    warnings: &mut Vec<DeriveWarning>,
) -> Result<Materials, DeriveError> {
    let scene = posed.scene;
    let ids: Vec<MaterialId> = scene.materials().ids().collect();
    let mut rows = vec![MaterialRow::DEFAULT; scene.materials().slot_bound() + 1];
    let mut derived = derive_some(posed, &ids, limits, warnings)?;
    for (id, row) in ids.iter().zip(std::mem::take(&mut derived.rows)) {
        rows[material_row(Some(*id)) as usize] = row;
    }
    let mut mean_emission = vec![Vec3::ONE; rows.len()];
    for (id, mean) in ids.iter().zip(std::mem::take(&mut derived.mean_emission)) {
        mean_emission[material_row(Some(*id)) as usize] = mean;
    }
    Ok(Materials { rows, mean_emission, ..derived })
}

/// Derives some materials: one row and one mean for each, and the textures and images that they need, numbered from 0.
pub(super) fn derive_some(
    posed: Posed<'_>,
    ids: &[MaterialId],
    limits: Option<ImageLimits>,
    warnings: &mut Vec<DeriveWarning>,
) -> Result<Materials, DeriveError> {
    let scene = posed.scene;
    let mut references = References {
        scene,
        images: Vec::new(),
        by_use: HashMap::new(),
        textures: Vec::new(),
        by_texture: HashMap::new(),
    };
    let used = limits.is_some();
    let mut conversions = Conversions::default();
    let mut rows = Vec::with_capacity(ids.len());
    for (i, &id) in ids.iter().enumerate() {
        let (slot, material) = (Store::<_, ()>::slot(id), posed.material(id));
        let mut row = row(&material, slot as u32, |info, srgb| match info {
            Some(info) if used => references.slot(info, srgb),
            _ => TextureSlot::NONE,
        });
        let place = || format!("/materials/{slot}");
        conversions.add(&material, i, place, &mut row, used.then_some(&mut references));
        rows.push(row);
    }
    let mut decoded = match limits {
        Some(limits) => decode_images(scene, &references.images, limits, warnings)?,
        None => Vec::new(),
    };
    drop_missing(&mut rows, &references.textures, &decoded);
    if let Some(limits) = limits {
        conversions.run(&mut rows, &mut references.textures, &mut decoded, limits, warnings)?;
    }
    let mean_emission = rows.iter().map(|row| mean_emission(row, &references.textures, &decoded)).collect();
    let mut textures_of = vec![None; references.textures.len()];
    for (key, row) in references.by_texture {
        textures_of[row as usize] = Some(key);
    }
    let images = decoded
        .into_iter()
        .enumerate()
        // One that is missing is written as such: the slots of those behind it are counted from the first.
        .map(|(slot, image)| ImageWrite { slot: slot as u32, image })
        .collect();
    Ok(Materials { rows, textures: references.textures, textures_of, images, mean_emission })
}

/// Gives every (texture, encoding) a row and every (image, encoding) a slot, in the order of first use.
pub(super) struct References<'a> {
    scene: &'a Scene,
    images: Vec<ImageUse>,
    by_use: HashMap<ImageUse, u32>,
    textures: Vec<TextureRow>,
    by_texture: HashMap<TextureKey, u32>,
}

impl References<'_> {
    pub(super) fn slot(&mut self, info: &TextureInfo, srgb: bool) -> TextureSlot {
        let texture = &self.scene.textures()[info.texture];
        let Some(image) = texture.best_source(self.scene.images()) else { return TextureSlot::NONE };
        let image = ImageUse { image, srgb };
        let row = *self.by_texture.entry((info.texture, srgb)).or_insert_with(|| {
            let slot = *self.by_use.entry(image).or_insert_with(|| {
                self.images.push(image);
                self.images.len() as u32 - 1
            });
            let sampler = texture.sampler.map(|s| &self.scene.samplers()[s]);
            self.textures.push(TextureRow { image: slot, sampling: sampling(sampler).pack() });
            self.textures.len() as u32 - 1
        });
        let transform = info.transform.as_deref();
        let uv_set = transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
        TextureSlot { texture: row, uv_set, transform: uv_transform(info) }
    }
}

/// KHR_texture_transform: translation * rotation * scale, rotation counter-clockwise with v pointing down.
pub(super) fn uv_transform(info: &TextureInfo) -> [[f32; 3]; 2] {
    let Some(t) = &info.transform else { return TextureSlot::NONE.transform };
    let (sin, cos) = t.rotation.sin_cos();
    let [sx, sy] = t.scale;
    [
        [(cos * sx) as f32, (sin * sy) as f32, t.offset[0] as f32],
        [(-sin * sx) as f32, (cos * sy) as f32, t.offset[1] as f32],
    ]
}

fn sampling(sampler: Option<&Sampler>) -> Sampling {
    let Some(sampler) = sampler else { return Sampling::default() };
    let wrap = |mode: Option<WrapMode>| match mode {
        None | Some(WrapMode::Repeat) => Wrap::Repeat,
        Some(WrapMode::MirroredRepeat) => Wrap::MirroredRepeat,
        Some(WrapMode::ClampToEdge) => Wrap::ClampToEdge,
    };
    let (min_nearest, mip) = match sampler.min_filter {
        Some(MinFilter::Nearest) => (true, MipMode::Base),
        Some(MinFilter::Linear) => (false, MipMode::Base),
        Some(MinFilter::NearestMipmapNearest) => (true, MipMode::Nearest),
        Some(MinFilter::LinearMipmapNearest) => (false, MipMode::Nearest),
        Some(MinFilter::NearestMipmapLinear) => (true, MipMode::Linear),
        None | Some(MinFilter::LinearMipmapLinear) => (false, MipMode::Linear),
    };
    Sampling {
        wrap_s: wrap(sampler.wrap_s),
        wrap_t: wrap(sampler.wrap_t),
        mag_nearest: sampler.mag_filter == Some(MagFilter::Nearest),
        min_nearest,
        mip,
    }
}

pub(super) fn row(
    m: &Material,
    id: u32,
    mut slot: impl FnMut(Option<&TextureInfo>, bool) -> TextureSlot,
) -> MaterialRow {
    let alpha = match m.alpha_mode {
        AlphaMode::Opaque => RowAlpha::Opaque,
        AlphaMode::Mask => RowAlpha::Mask,
        AlphaMode::Blend => RowAlpha::Blend,
    };
    let flag = |on: bool, bit: u32| if on { bit } else { 0 };
    let strength = m.emissive_strength.unwrap_or(1.0);
    let scale = |info: &Option<TextureInfo>| info.as_ref().map_or(1.0, |i| i.scale) as f32;
    MaterialRow {
        base_color: m.base_color.map(|c| c as f32),
        emissive: m.emissive.map(|c| (c * strength) as f32),
        alpha_cutoff: m.alpha_cutoff.unwrap_or(0.5) as f32,
        metallic: m.metallic as f32,
        roughness: m.roughness as f32,
        normal_scale: scale(&m.normal_texture),
        occlusion_strength: scale(&m.occlusion_texture),
        // KHR_materials_ior: 0 stands for an interface that reflects everything, as in the specular-glossiness model.
        ior: m.ior.unwrap_or(1.5) as f32,
        flags: alpha as u32 | flag(m.double_sided, MaterialFlags::DOUBLE_SIDED) | flag(m.unlit, MaterialFlags::UNLIT),
        id,
        reserved: 0,
        base_color_texture: slot(m.base_color_texture.as_ref(), true),
        metallic_roughness_texture: slot(m.metallic_roughness_texture.as_ref(), false),
        normal_texture: slot(m.normal_texture.as_ref(), false),
        occlusion_texture: slot(m.occlusion_texture.as_ref(), false),
        emissive_texture: slot(m.emissive_texture.as_ref(), true),
    }
}

/// A texture whose image could not be read is left out: the factor alone is shown, as the warning says.
fn drop_missing(rows: &mut [MaterialRow], textures: &[TextureRow], images: &[Option<Arc<ImageData>>]) {
    let missing = |slot: &TextureSlot| {
        slot.texture != NONE && images.get(textures[slot.texture as usize].image as usize).is_none_or(Option::is_none)
    };
    for row in rows {
        for slot in [
            &mut row.base_color_texture,
            &mut row.metallic_roughness_texture,
            &mut row.normal_texture,
            &mut row.occlusion_texture,
            &mut row.emissive_texture,
        ] {
            if missing(slot) {
                *slot = TextureSlot::NONE;
            }
        }
    }
}

fn mean_emission(row: &MaterialRow, textures: &[TextureRow], images: &[Option<Arc<ImageData>>]) -> Vec3 {
    let slot = row.emissive_texture.texture;
    if slot == NONE {
        return Vec3::ONE;
    }
    let image = textures[slot as usize].image as usize;
    images.get(image).and_then(Option::as_ref).map_or(Vec3::ONE, |image| mean_color(image))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_scene::model::{Extra, TextureTransform};

    #[test]
    fn a_texture_transform_scales_then_rotates_then_moves() {
        let transform = TextureTransform {
            offset: [0.5, 0.25],
            rotation: std::f64::consts::FRAC_PI_2,
            scale: [2.0, 3.0],
            tex_coord: None,
            extra: Extra::default(),
        };
        let info = TextureInfo {
            texture: TextureId::default(),
            tex_coord: 0,
            transform: Some(Box::new(transform)),
            scale: 1.0,
            extra: Extra::default(),
        };
        let [row_u, row_v] = uv_transform(&info);
        let apply = |row: [f32; 3], u: f32, v: f32| row[0] * u + row[1] * v + row[2];
        // The extension's rotation matrix maps (u, v) to (cos u + sin v, -sin u + cos v).
        let (u, v) = (apply(row_u, 1.0, 1.0), apply(row_v, 1.0, 1.0));
        assert!((u - 3.5).abs() < 1e-6 && (v - (-1.75)).abs() < 1e-6, "{u} {v}");
    }
}
