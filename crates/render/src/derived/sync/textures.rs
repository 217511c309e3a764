//! Textures and images that are resident, for materials that change.
//!
//! A material that is edited is derived by itself, with textures and images of its own numbering; what of them is resident
//! already keeps its place. Images are decoded where a texture is new, and where textures of specular and glossiness are
//! converted anew.

use super::Sync;
use crate::DeriveError;
use crate::derived::material_row;
use crate::derived::materials::{Materials, TextureKey, derive_some, row, uv_transform};
use crate::textures::{ImageLimits, Levels};
use glam::Vec3;
use orthant_resident::batch::{ImageWrite, TextureRow};
use orthant_resident::rows::{MaterialRow, NONE, TextureSlot};
use orthant_scene::model::{Material, MaterialId, SpecularGlossiness, TextureInfo};
use std::borrow::Cow;
use std::collections::HashMap;

/// Which texture rows show what.
#[derive(Clone, Debug, Default)]
pub struct TextureTable {
    rows: HashMap<TextureKey, u32>,
    /// Mean colours of the textures that emit.
    means: HashMap<u32, Vec3>,
    /// By material row: what has been made of specular and glossiness.
    converted: HashMap<u32, Converted>,
    images: u32,
    /// Bytes of the images.
    image_bytes: u64,
}

/// A material given by specular and glossiness, and what stands for it. Converting textures costs their texels, so an edit of
/// something else leaves it.
#[derive(Clone, Debug)]
struct Converted {
    given: SpecularGlossiness,
    base_color: [f32; 4],
    metallic: f32,
    roughness: f32,
    base_color_texture: TextureSlot,
    metallic_roughness_texture: TextureSlot,
}

impl Converted {
    fn of(given: SpecularGlossiness, row: &MaterialRow) -> Self {
        let &MaterialRow { base_color, metallic, roughness, base_color_texture, metallic_roughness_texture, .. } = row;
        Self { given, base_color, metallic, roughness, base_color_texture, metallic_roughness_texture }
    }

    fn write(&self, row: &mut MaterialRow) {
        (row.base_color, row.metallic, row.roughness) = (self.base_color, self.metallic, self.roughness);
        row.base_color_texture = self.base_color_texture;
        row.metallic_roughness_texture = self.metallic_roughness_texture;
    }
}

impl TextureTable {
    /// What a full derivation has made.
    pub fn new(materials: &Materials) -> Self {
        let images = || materials.images.iter().filter_map(|write| write.image.as_ref());
        let image_bytes = images().map(|image| image.texels.len() as u64).sum();
        let mut table = Self { images: materials.images.len() as u32, image_bytes, ..Self::default() };
        let is_there = |row: &TextureRow| materials.images[row.image as usize].image.is_some();
        for (i, (row, key)) in materials.textures.iter().zip(&materials.textures_of).enumerate() {
            if let Some(key) = key.filter(|_| is_there(row)) {
                table.rows.insert(key, i as u32);
            }
        }
        for (row, &mean) in materials.rows.iter().zip(&materials.mean_emission) {
            table.note_mean(row, mean);
        }
        table
    }

    /// Keeps what a row, complete, shows of a material that is given by specular and glossiness.
    pub fn note_conversion(&mut self, id: MaterialId, material: &Material, row: &MaterialRow) {
        if let Some(given) = SpecularGlossiness::of(material) {
            self.converted.insert(material_row(Some(id)), Converted::of(given, row));
        }
    }

    /// Forgets a material that has gone.
    pub fn forget(&mut self, material_row: u32) {
        self.converted.remove(&material_row);
    }

    /// What stands for a specular and glossiness: the material's own, or that of another one alike.
    fn conversion(&self, id: MaterialId, given: &SpecularGlossiness) -> Option<&Converted> {
        let own = self.converted.get(&material_row(Some(id))).filter(|made| made.given == *given);
        own.or_else(|| self.converted.values().find(|made| made.given == *given))
    }

    /// Bytes of the images that are resident.
    pub fn image_bytes(&self) -> u64 {
        self.image_bytes
    }

    /// Slots of the image table that have been given away.
    pub fn images(&self) -> u32 {
        self.images
    }

    fn note_mean(&mut self, row: &MaterialRow, mean: Vec3) {
        if row.emissive_texture.texture != NONE {
            self.means.insert(row.emissive_texture.texture, mean);
        }
    }

    /// A reference to a texture that is resident. `None` if it is not.
    fn slot(&self, info: &TextureInfo, srgb: bool) -> Option<TextureSlot> {
        let texture = *self.rows.get(&(info.texture, srgb))?;
        let uv_set = info.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
        Some(TextureSlot { texture, uv_set, transform: uv_transform(info) })
    }

    /// What a texture row shows: the key in the document.
    pub fn key_of(&self, row: u32) -> Option<TextureKey> {
        self.rows.iter().find(|&(_, &known)| known == row).map(|(&key, _)| key)
    }
}

impl Sync<'_> {
    /// A material's row, and the mean of its emissive texture.
    pub(super) fn material_row(&mut self, id: MaterialId) -> Result<(MaterialRow, Vec3), DeriveError> {
        let material = self.posed.material(id);
        if let Some((row, mean)) = self.resident_row(id, &material) {
            self.live.textures.note_conversion(id, &material, &row);
            return Ok((row, mean));
        }
        let limits = ImageLimits { max_bytes: self.live.bytes_left(), levels: Levels::All };
        let limits = self.live.images.then_some(limits);
        let new = derive_some(self.posed, &[id], limits, &mut self.derived.warnings)?;
        let (mut row, mean) = (new.rows[0], new.mean_emission[0]);
        let mut places: HashMap<u32, u32> = HashMap::new();
        for slot in slots(&mut row) {
            if slot.texture != NONE {
                slot.texture = match places.get(&slot.texture) {
                    Some(&place) => place,
                    None => {
                        let place = self.place_texture(&new, slot.texture);
                        places.insert(slot.texture, place);
                        place
                    }
                };
            }
        }
        self.live.textures.note_mean(&row, mean);
        self.live.textures.note_conversion(id, &material, &row);
        Ok((row, mean))
    }

    /// The row of a material all of whose textures are resident, those among them that were made of others.
    fn resident_row(&self, id: MaterialId, material: &Material) -> Option<(MaterialRow, Vec3)> {
        let table = &self.live.textures;
        let index = orthant_scene::model::Store::<_, ()>::slot(id) as u32;
        let mut material = Cow::Borrowed(material);
        let converted = match SpecularGlossiness::of(&material) {
            Some(given) => {
                // Not shown: they are for programs that do not know the extension.
                let material = material.to_mut();
                (material.base_color_texture, material.metallic_roughness_texture) = (None, None);
                Some(table.conversion(id, &given)?)
            }
            None => None,
        };
        let mut is_missing = false;
        let mut row = row(&material, index, |info, srgb| match info {
            Some(info) if self.live.images => table.slot(info, srgb).unwrap_or_else(|| {
                is_missing = true;
                TextureSlot::NONE
            }),
            _ => TextureSlot::NONE,
        });
        if let Some(converted) = converted {
            converted.write(&mut row);
        }
        let mean = match row.emissive_texture.texture {
            NONE => Vec3::ONE,
            texture => *table.means.get(&texture)?,
        };
        (!is_missing).then_some((row, mean))
    }

    /// The place of a texture that was derived apart: where it is resident, or a new one, with its image.
    fn place_texture(&mut self, new: &Materials, texture: u32) -> u32 {
        let key = new.textures_of[texture as usize];
        if let Some(&place) = key.and_then(|key| self.live.textures.rows.get(&key)) {
            return place;
        }
        let TextureRow { image, sampling } = new.textures[texture as usize];
        let slot = self.live.textures.images;
        self.live.textures.images += 1;
        let image = new.images[image as usize].image.clone();
        self.live.textures.image_bytes += image.as_ref().map_or(0, |image| image.texels.len() as u64);
        self.live.dirty.images.push(ImageWrite { slot, image });
        self.derived.textures.push(TextureRow { image: slot, sampling });
        let place = self.derived.textures.len() as u32 - 1;
        if let Some(key) = key {
            self.live.textures.rows.insert(key, place);
        }
        place
    }
}

/// The texture references of a row.
pub(super) fn slots(row: &mut MaterialRow) -> [&mut TextureSlot; 5] {
    [
        &mut row.base_color_texture,
        &mut row.metallic_roughness_texture,
        &mut row.normal_texture,
        &mut row.occlusion_texture,
        &mut row.emissive_texture,
    ]
}
