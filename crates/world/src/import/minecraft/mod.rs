//! Schematics of Minecraft: NBT, as a rule packed by gzip. Minecraft's axes are those of a world here (y up, z towards the south).

mod colors;
mod gzip;
mod legacy;
mod nbt;

use super::grid::{Budget, Grid};
use super::{Fault, ImportFault, Imported, content};
use crate::block::Block;
use nbt::Tag;
use rustc_hash::FxHashMap;
use std::collections::hash_map::Entry;

/// The blocks of a grid by name.
struct Names {
    grid: Grid,
    known: FxHashMap<String, Block>,
    /// Names without a colour of their own.
    hashed: Vec<String>,
}

impl Names {
    fn new(budget: Budget) -> Self {
        Self { grid: Grid::new(budget), known: FxHashMap::default(), hashed: Vec::new() }
    }

    /// The block of a name, without its properties in brackets.
    fn block(&mut self, state: &str) -> Result<Block, Fault> {
        let name = state.split('[').next().unwrap_or(state);
        let name = name.strip_prefix("minecraft:").unwrap_or(name);
        if matches!(name, "air" | "cave_air" | "void_air" | "structure_void" | "barrier" | "light") || name.is_empty() {
            return Ok(Block::AIR);
        }
        if let Some(&block) = self.known.get(name) {
            return Ok(block);
        }
        // A name is a part of the palette, and bounded there.
        let short: String = name.chars().take(60).collect();
        let (material, hashed) = colors::material(&short);
        let block = match self.known.get(&short) {
            Some(&block) => block,
            None => self.grid.add_material(material)?,
        };
        if hashed {
            self.hashed.push(short.clone());
        }
        self.known.insert(short, block);
        self.known.insert(name.to_owned(), block);
        Ok(block)
    }

    fn finish(mut self) -> Result<Imported, Fault> {
        if let Some(first) = self.hashed.first() {
            let count = self.hashed.len();
            let more = if count == 1 { String::new() } else { format!(" and {} more", count - 1) };
            let what = format!("no colour is known for {first:?}{more}; they have colours made from their names");
            self.grid.warnings.push(what);
        }
        self.grid.finish()
    }
}

fn required<T>(value: Option<T>, what: &str) -> Result<T, Fault> {
    value.ok_or_else(|| (None, ImportFault::Content(format!("the schematic has no {what}"))))
}

/// Width (x), height (y) and length (z), which are unsigned 16-bit numbers.
fn size_of(root: &Tag) -> Result<[usize; 3], Fault> {
    let mut size = [0; 3];
    for (extent, name) in size.iter_mut().zip(["Width", "Height", "Length"]) {
        *extent = usize::from(required(root.get(name).and_then(Tag::whole), name)? as u16);
    }
    Ok(size)
}

/// Puts blocks that come x fastest, then z, then y. There must be as many as the box has.
fn fill(
    grid: &mut Grid,
    [width, height, length]: [usize; 3],
    mut next: impl FnMut() -> Result<Block, Fault>,
) -> Result<(), Fault> {
    for y in 0..height {
        for z in 0..length {
            for x in 0..width {
                let block = next()?;
                if !block.is_air() {
                    grid.set([x as i64, y as i64, z as i64], block)?;
                }
            }
        }
    }
    Ok(())
}

/// Sponge schematics, versions 1, 2 and 3.
pub fn import_sponge(bytes: &[u8], limit: u64) -> Result<Imported, Fault> {
    let mut budget = Budget::new(limit);
    let unpacked = gzip::unpack(bytes, limit)?;
    budget.charge(unpacked.len() as u64)?;
    let root = nbt::read(&unpacked, &mut budget)?;
    let root = root.get("Schematic").unwrap_or(&root);
    let version = required(root.get("Version").and_then(Tag::whole), "\"Version\"")?;
    let (palette, data) = match version {
        1 | 2 => (root.get("Palette"), root.get("BlockData")),
        3 => match root.get("Blocks") {
            Some(blocks) => (blocks.get("Palette"), blocks.get("Data")),
            // A schematic of biomes or entities alone.
            None => return Names::new(budget).finish(),
        },
        other => {
            return content(None, format!("version {other} of Sponge schematics is not known; export version 2 or 3"));
        }
    };
    let size = size_of(root)?;
    let palette = required(palette.and_then(Tag::fields), "palette")?;
    let data = required(data.and_then(Tag::bytes), "block data")?;
    let mut names = Names::new(budget);
    let mut blocks: FxHashMap<i64, Block> = FxHashMap::default();
    for (state, number) in palette {
        let number = required(number.whole(), "number for a block of its palette")?;
        let block = names.block(state)?;
        blocks.insert(number, block);
    }
    let mut rest = data.iter();
    fill(&mut names.grid, size, || {
        let mut number = 0_u32;
        for shift in (0..35).step_by(7) {
            let Some(&byte) = rest.next() else { return Err((None, ImportFault::Truncated("the block data"))) };
            number |= u32::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
            if byte & 0x80 == 0 {
                let block = blocks.get(&i64::from(number)).copied();
                return required(block, &format!("block {number} in its palette"));
            }
        }
        content(None, "a number of the block data is longer than five bytes")
    })?;
    names.finish()
}

/// MCEdit schematics, which number blocks as Minecraft did before version 1.13.
pub fn import_mcedit(bytes: &[u8], limit: u64) -> Result<Imported, Fault> {
    let mut budget = Budget::new(limit);
    let unpacked = gzip::unpack(bytes, limit)?;
    budget.charge(unpacked.len() as u64)?;
    let root = nbt::read(&unpacked, &mut budget)?;
    let root = root.get("Schematic").unwrap_or(&root);
    let size = size_of(root)?;
    let ids = required(root.get("Blocks").and_then(Tag::bytes), "\"Blocks\"")?;
    let data = root.get("Data").and_then(Tag::bytes).unwrap_or(&[]);
    // Ids above 255: four more bits each, the even index in the low half, as WorldEdit writes them.
    let more = root.get("AddBlocks").and_then(Tag::bytes).unwrap_or(&[]);
    let mut names = Names::new(budget);
    let mut known: FxHashMap<(u16, u8), Block> = FxHashMap::default();
    let mut index = 0;
    // First which numbers there are, then the blocks.
    let number_at = |index: usize| -> Option<(u16, u8)> {
        let high = more.get(index / 2).map_or(0, |&byte| if index & 1 == 0 { byte & 15 } else { byte >> 4 });
        let id = u16::from(*ids.get(index)?) | u16::from(high) << 8;
        Some((id, data.get(index).map_or(0, |&byte| byte & 15)))
    };
    for number @ (id, data) in (0..ids.len()).filter_map(number_at) {
        if let Entry::Vacant(entry) = known.entry(number) {
            entry.insert(names.block(&legacy::name(id, data))?);
        }
    }
    fill(&mut names.grid, size, || {
        let number = number_at(index).ok_or((None, ImportFault::Truncated("\"Blocks\"")))?;
        index += 1;
        Ok(known.get(&number).copied().unwrap_or(Block::AIR))
    })?;
    names.finish()
}

/// Litematica: regions of packed palette indices that run across the borders of 64-bit words.
pub fn import_litematic(bytes: &[u8], limit: u64) -> Result<Imported, Fault> {
    let mut budget = Budget::new(limit);
    let unpacked = gzip::unpack(bytes, limit)?;
    budget.charge(unpacked.len() as u64)?;
    let root = nbt::read(&unpacked, &mut budget)?;
    let regions = required(root.get("Regions").and_then(Tag::fields), "\"Regions\"")?;
    let mut names = Names::new(budget);
    for (name, region) in regions {
        let axes = |key: &str| -> Result<[i64; 3], Fault> {
            let vector = required(region.get(key), &format!("{key:?} for region {name:?}"))?;
            let mut axes = [0; 3];
            for (value, axis) in axes.iter_mut().zip(["x", "y", "z"]) {
                // They are 32-bit numbers; anything else would only overflow below.
                *value = i64::from(required(vector.get(axis).and_then(Tag::whole), axis)? as i32);
            }
            Ok(axes)
        };
        let (position, size) = (axes("Position")?, axes("Size")?);
        // A negative size reaches back from the position.
        let corner: [i64; 3] = std::array::from_fn(|a| position[a] + (size[a] + 1).min(0));
        let extent = size.map(|extent| extent.unsigned_abs() as usize);
        let states = required(region.get("BlockStatePalette").and_then(Tag::list), "\"BlockStatePalette\"")?;
        let mut blocks = Vec::new();
        for state in states {
            let name = required(state.get("Name").and_then(Tag::text), "name for a block state")?;
            blocks.push(names.block(name)?);
        }
        let longs = region.get("BlockStates").and_then(Tag::longs);
        let words: Vec<u64> = required(longs, "\"BlockStates\"")?.collect();
        let bits = (usize::BITS - blocks.len().saturating_sub(1).leading_zeros()).max(2) as usize;
        let count = extent.iter().try_fold(1_usize, |count, &extent| count.checked_mul(extent));
        let enough =
            count.and_then(|count| count.checked_mul(bits)).is_some_and(|bits| bits.div_ceil(64) <= words.len());
        if !enough {
            return Err((None, ImportFault::Truncated("\"BlockStates\"")));
        }
        for i in 0..count.unwrap_or(0) {
            let (word, shift) = (i * bits / 64, i * bits % 64);
            let low = words[word] >> shift;
            let high = if shift + bits > 64 { words[word + 1] << (64 - shift) } else { 0 };
            let number = ((low | high) & ((1 << bits) - 1)) as usize;
            let block = *required(blocks.get(number), &format!("block state {number} in its palette"))?;
            let at = [i % extent[0], i / (extent[0] * extent[2]), i / extent[0] % extent[2]];
            if !block.is_air() {
                names.grid.set(std::array::from_fn(|a| corner[a] + at[a] as i64), block)?;
            }
        }
    }
    names.finish()
}
