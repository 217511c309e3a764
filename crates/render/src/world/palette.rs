//! Palette rows: materials of blocks as a backend has them, with the texels of textures in the payload arena.

use super::payload::PayloadEdit;
use super::{DerivedWorld, WorldError, full};
use orthant_resident::world::payload::ALIGN;
use orthant_resident::world::rows::{BlockRow, flags, pattern};
use orthant_resident::world::{MutationBatch, PayloadWrite};
use orthant_world::{BlockId, Material, Palette, Pattern, Texture3, World};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The materials that have rows.
#[derive(Clone, Debug, Default)]
pub(super) struct PaletteStore {
    rows: FxHashMap<BlockId, Resident>,
}

#[derive(Clone, Debug)]
struct Resident {
    material: Arc<Material>,
    /// First word and count of the texels.
    texels: (u32, u32),
}

impl PaletteStore {
    /// Where the texels of textures lie: first word and count.
    pub fn textures(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.rows.values().map(|row| row.texels).filter(|(_, count)| *count > 0)
    }
}

/// The row of a material whose texels, if it has any, begin at `texels`.
pub(super) fn row(material: &Material, texels: u32) -> BlockRow {
    let transparent = if material.transparency.is_some() { flags::TRANSPARENT } else { 0 };
    let plain = BlockRow {
        color: material.color,
        flags: flags::KNOWN | transparent,
        emission: material.emission,
        weight: material.weight,
        absorption: material.transparency.map_or([0.0; 3], |transparency| transparency.absorption),
        roughness: material.roughness,
        metallic: material.metallic,
        pattern: pattern::NONE,
        cells: 0,
        contrast: 1.0,
        width: 0.0,
        texture_size: 0,
        reserved: [0; 2],
    };
    match &material.pattern {
        Pattern::None => plain,
        Pattern::Checker { cells, contrast } => {
            BlockRow { pattern: pattern::CHECKER, cells: u32::from(*cells), contrast: *contrast, ..plain }
        }
        Pattern::Noise { cells, contrast } => {
            BlockRow { pattern: pattern::NOISE, cells: u32::from(*cells), contrast: *contrast, ..plain }
        }
        Pattern::Edges { width, contrast } => {
            BlockRow { pattern: pattern::EDGES, width: *width, contrast: *contrast, ..plain }
        }
        Pattern::Texture(texture) => {
            let [x, y, z] = texture.size.map(|size| u32::from(size - 1));
            BlockRow { pattern: pattern::TEXTURE, cells: texels, texture_size: x | y << 8 | z << 16, ..plain }
        }
    }
}

/// The texels as words.
fn texels(texture: &Texture3) -> impl Iterator<Item = u32> + '_ {
    texture.rgba.chunks_exact(4).map(|texel| u32::from_le_bytes([texel[0], texel[1], texel[2], texel[3]]))
}

impl DerivedWorld {
    /// Brings the rows of these materials to what the world says now, texels included. A number that the palette does not
    /// have is left out: it has no row, or one of zeros, and is drawn as unknown.
    ///
    /// The batch is empty if nothing differs.
    ///
    /// # Errors
    /// [`WorldError::ArenaFull`]; nothing is changed then.
    pub fn plan_palette(&mut self, world: &World, ids: &[BlockId]) -> Result<MutationBatch, WorldError> {
        self.plan_palette_of(world.palette(), ids)
    }

    pub(super) fn plan_palette_of(&mut self, palette: &Palette, ids: &[BlockId]) -> Result<MutationBatch, WorldError> {
        let mut ids = ids.to_vec();
        ids.sort_unstable();
        ids.dedup();
        let known = |id: BlockId| palette.get(id).map(|material| (id, material.clone()));
        let is_news = |(id, material): &(BlockId, Arc<Material>)| {
            self.palette.rows.get(id).is_none_or(|row| row.material != *material)
        };
        let news: Vec<(BlockId, Arc<Material>)> = ids.into_iter().filter_map(known).filter(is_news).collect();
        let rows = news.last().map_or(0, |(id, _)| u32::from(id.0) + 1);
        full("palette", u64::from(rows), self.max.palette)?;
        self.payloads.check_room(news.iter().map(|(_, material)| texel_units(material)).sum(), self.max.payload)?;

        let mut edit = PayloadEdit::default();
        let mut batch = self.begin_batch();
        for (id, material) in news {
            if let Some(Resident { texels: (first, count), .. }) = self.palette.rows.remove(&id) {
                self.payloads.free_words(first, count, &mut edit);
            }
            let texels = self.place_texels(&material, &mut edit, &mut batch);
            batch.palette_writes.push((u32::from(id.0), row(&material, texels.0)));
            self.palette.rows.insert(id, Resident { material, texels });
        }
        batch.payload_writes.sort_unstable_by_key(|write| write.first);
        batch.lens.palette = batch.lens.palette.max(rows);
        self.finish_batch(&mut batch, edit);
        Ok(batch)
    }

    /// First word and count of a material's texels.
    fn place_texels(&mut self, material: &Material, edit: &mut PayloadEdit, batch: &mut MutationBatch) -> (u32, u32) {
        let Pattern::Texture(texture) = &material.pattern else { return (0, 0) };
        let words: Arc<[u32]> = texels(texture).collect();
        let count = words.len() as u32;
        let first = self.payloads.take_words(count, edit);
        batch.payload_writes.push(PayloadWrite { first, words });
        (first, count)
    }
}

fn texel_units(material: &Material) -> u64 {
    match &material.pattern {
        Pattern::Texture(texture) => (texture.rgba.len() as u64 / 4).div_ceil(u64::from(ALIGN)),
        _ => 0,
    }
}
