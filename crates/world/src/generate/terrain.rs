//! `terrain`: hills, seas, caves, trees, in three dimensions (`0 <= w < 1`).
//!
//! Everything is a function of the seed and the place, in integers: the height by two-dimensional value noise, caves where two
//! three-dimensional noises are near their middle (so that they are tunnels), veins where one is high, trees by a hash of
//! the cell that they stand in. Chunks are made one by one, layers of them along z in parallel.

use super::hash::{Noise3, below, hash, noise2};
use super::{TooManyRegions, block};
use crate::block::Block;
use crate::chunk::Chunk;
use crate::palette::{Material, Pattern, Transparency};
use crate::space::{Aabb4, CHUNK_BLOCKS, ChunkShape, Fixed, Lattice, Scale};
use crate::world::Region;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The lowest layer, of bedrock.
const BOTTOM: i64 = -64;
/// Nothing is at this height or above.
const TOP: i64 = 144;
/// Water lies below this height.
const SEA: i64 = 0;
/// Ground above this height is snow.
const SNOW: i64 = 44;

// Entries of the materials.
const BEDROCK: u16 = 0;
const STONE: u16 = 1;
const DIRT: u16 = 2;
const GRASS: u16 = 3;
const SAND: u16 = 4;
const SNOWFIELD: u16 = 5;
const WATER: u16 = 6;
const TRUNK: u16 = 7;
const LEAVES: u16 = 8;
const ORE: u16 = 9;
const CRYSTAL: u16 = 10;

pub fn materials() -> Vec<Material> {
    let noisy = |name: &str, srgb, contrast| Material {
        pattern: Pattern::Noise { cells: 8, contrast },
        ..Material::colored(name, Material::linear(srgb))
    };
    vec![
        noisy("bedrock", [48, 46, 50], 0.6),
        noisy("stone", [126, 124, 122], 0.8),
        noisy("dirt", [122, 88, 62], 0.8),
        noisy("grass", [98, 142, 70], 0.8),
        noisy("sand", [214, 198, 152], 0.9),
        noisy("snow", [238, 242, 246], 0.95),
        Material {
            transparency: Some(Transparency { absorption: [0.45, 0.12, 0.07] }),
            roughness: 0.05,
            ..Material::colored("water", Material::linear([92, 148, 176]))
        },
        noisy("trunk", [104, 78, 52], 0.7),
        noisy("leaves", [70, 116, 54], 0.6),
        noisy("ore", [186, 146, 92], 0.5),
        Material { emission: [1.2, 3.0, 4.0], ..Material::colored("crystal", Material::linear([140, 220, 235])) },
    ]
}

/// Streams of hashes that have nothing to do with each other.
fn stream(seed: u64, number: i64) -> u64 {
    hash(seed, [number, -1])
}

/// The height of the ground: the lowest y that is not ground.
fn height(seed: u64, at: [i64; 2]) -> i64 {
    let octave = |number: i64, log2: u32| noise2(stream(seed, number), at, log2) - 32_768;
    // Continents and hills; mountains where a slow noise is high.
    let plain = octave(0, 9) * 30 + octave(1, 7) * 18 + octave(2, 5) * 8 + octave(3, 3) * 2;
    let mountains = (noise2(stream(seed, 4), at, 8) - 30_000).max(0);
    let ridges = 32_768 - octave(5, 6).abs();
    (12 + (plain >> 15) + ((mountains * ridges) >> 23)).clamp(BOTTOM + 8, TOP - 24)
}

/// A tree: where it stands and how tall it is.
struct Tree {
    foot: [i64; 3],
    trunk: i64,
    radius: i64,
}

/// Trees stand in cells of this many units, at least [`CROWN`] from none of its borders.
const TREE_CELL: i64 = 9;
/// Leaves reach so far from the trunk.
const CROWN: i64 = 3;

/// The tree of a cell, if it has one.
fn tree(seed: u64, cell: [i64; 2]) -> Option<Tree> {
    let bits = hash(stream(seed, 6), cell);
    let woods = noise2(stream(seed, 7), cell.map(|c| c * TREE_CELL), 6);
    if (bits >> 48) as i64 > woods - 12_000 {
        return None;
    }
    let at = [
        cell[0] * TREE_CELL + below(bits as u32, TREE_CELL as u64),
        cell[1] * TREE_CELL + below((bits as u32).rotate_left(16), TREE_CELL as u64),
    ];
    let ground = height(seed, at);
    let trunk = 4 + (bits >> 40 & 3) as i64;
    (ground > SEA + 2 && ground < SNOW - 8).then_some(Tree {
        foot: [at[0], ground, at[1]],
        trunk,
        radius: CROWN - (bits >> 44 & 1) as i64,
    })
}

/// What the chunks above one another have in common.
struct Column {
    /// Heights of the ground, x fastest.
    heights: [i64; 256],
    /// Trees whose crowns may reach into it.
    trees: Vec<Tree>,
}

impl Column {
    fn new(seed: u64, [cx, cz]: [i64; 2]) -> Self {
        let cells = |c: i64| (c - CROWN).div_euclid(TREE_CELL)..=(c + 15 + CROWN).div_euclid(TREE_CELL);
        Self {
            heights: std::array::from_fn(|i| height(seed, [cx + i as i64 % 16, cz + i as i64 / 16])),
            trees: cells(cz).flat_map(|z| cells(cx).filter_map(move |x| tree(seed, [x, z]))).collect(),
        }
    }
}

/// The blocks of a chunk, whose lower corner is given in units.
fn chunk(seed: u64, corner: [i64; 3], column: &Column) -> Chunk {
    let cy = corner[1];
    let heights = &column.heights;
    let lowest = heights.iter().copied().min().unwrap_or(0);
    let highest = heights.iter().copied().max().unwrap_or(0);
    let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
    if cy < highest.max(SEA) {
        let tunnels = [10, 11].map(|number| Noise3::new(stream(seed, number), corner, 5));
        let veins = Noise3::new(stream(seed, 12), corner, 3);
        for (i, slot) in blocks.iter_mut().enumerate() {
            let [x, dy, z, _] = ChunkShape::Flat.at(i);
            let (y, ground) = (cy + dy as i64, heights[x + 16 * z]);
            let noise = |noise: &Noise3| noise.at(corner, [x, dy, z]);
            *slot = if y < BOTTOM || y >= ground.max(SEA) {
                Block::AIR
            } else if y >= ground {
                block(WATER)
            } else if y == BOTTOM {
                block(BEDROCK)
            } else if is_cave(y, ground, || tunnels.iter().map(noise)) {
                Block::AIR
            } else if y < ground - 4 {
                let vein = noise(&veins);
                block(match vein {
                    58_500.. if y < -20 && vein & 1 == 0 => CRYSTAL,
                    56_500.. => ORE,
                    _ => STONE,
                })
            } else {
                block(surface(y, ground))
            };
        }
    }
    if cy + 16 > lowest && cy < TOP {
        plant(&column.trees, corner, &mut blocks);
    }
    Chunk::from_blocks(&blocks)
}

/// Tunnels open to the air on land, and never to the sea.
fn is_cave<N: Iterator<Item = i64>>(y: i64, ground: i64, noise: impl FnOnce() -> N) -> bool {
    if y <= BOTTOM + 2 || (ground <= SEA + 3 && y > ground - 8) {
        return false;
    }
    noise().all(|value| (value - 32_768).abs() < 3_600)
}

fn surface(y: i64, ground: i64) -> u16 {
    if ground <= SEA + 2 {
        SAND
    } else if ground > SNOW {
        if y == ground - 1 { SNOWFIELD } else { STONE }
    } else if y == ground - 1 {
        GRASS
    } else {
        DIRT
    }
}

/// Trees whose crowns reach into the chunk: first all leaves, then all trunks, so that no order of trees matters.
fn plant(trees: &[Tree], corner: [i64; 3], blocks: &mut [Block; CHUNK_BLOCKS]) {
    let [cx, cy, cz] = corner;
    let mut put = |at: [i64; 3], new: Block, over_leaves: bool| {
        let within = [at[0] - cx, at[1] - cy, at[2] - cz];
        if within.iter().all(|c| (0..16).contains(c)) {
            let slot =
                &mut blocks[ChunkShape::Flat.index([within[0] as usize, within[1] as usize, within[2] as usize, 0])];
            if slot.is_air() || (over_leaves && *slot == block(LEAVES)) {
                *slot = new;
            }
        }
    };
    for Tree { foot: [x, y, z], trunk, radius } in trees {
        for i in 0..343 {
            let [dx, dy, dz] = [i % 7 - 3, i / 7 % 7 - 3, i / 49 - 3];
            if dx * dx + dy * dy + dz * dz <= radius * radius + 1 {
                put([x + dx, y + trunk + dy, z + dz], block(LEAVES), false);
            }
        }
    }
    for Tree { foot: [x, y, z], trunk, .. } in trees {
        (0..=*trunk).for_each(|up| put([*x, y + up, *z], block(TRUNK), true));
    }
}

pub fn regions(seed: u64, bounds: &Aabb4, limit: usize) -> Result<Vec<Region>, TooManyRegions> {
    let lattice = Lattice::flat(Scale::UNIT);
    let one = Fixed::ONE.raw();
    let (mut min, mut max) = (Aabb4::SPACE.min_raw(), Aabb4::SPACE.max_raw());
    (min[1], max[1]) = (BOTTOM * one, TOP * one);
    (min[3], max[3]) = (0, one);
    let Some(bounds) = bounds.intersection(&Aabb4::from_raw_unchecked(min, max)) else { return Ok(Vec::new()) };
    if bounds.cell_count(lattice.chunk_log2()) > limit as u64 {
        return Err(TooManyRegions { limit });
    }
    // Rows of one z know nothing of each other.
    let (first, end) = (bounds.min_raw()[2].div_euclid(16 * one), (bounds.max_raw()[2] - 1).div_euclid(16 * one));
    let rows: Vec<Vec<Region>> = (first..=end)
        .into_par_iter()
        .map(|row| {
            let (mut min, mut max) = (bounds.min_raw(), bounds.max_raw());
            (min[2], max[2]) = (min[2].max(row * 16 * one), max[2].min((row + 1) * 16 * one));
            row_regions(seed, &Aabb4::from_raw_unchecked(min, max), lattice)
        })
        .collect();
    Ok(rows.into_iter().flatten().collect())
}

/// The regions of a box that lies in one layer of chunks along z.
fn row_regions(seed: u64, bounds: &Aabb4, lattice: Lattice) -> Vec<Region> {
    let mut columns: FxHashMap<i64, Column> = FxHashMap::default();
    let cells = bounds.cells(lattice.chunk_log2()).filter_map(|cell| {
        let [x, y, z, _] = cell.min_raw().map(|c| c / Fixed::ONE.raw());
        let column = columns.entry(x).or_insert_with(|| Column::new(seed, [x, z]));
        Region::chunk(cell.intersection(bounds)?, lattice, Arc::new(chunk(seed, [x, y, z], column)))
    });
    cells.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn a_landscape_has_all_of_its_materials_and_caves() {
        let bounds = Aabb4::from_ints([-192, -80, -192, 0], [192, 160, 192, 1]).unwrap();
        let mut counts: BTreeMap<u16, usize> = BTreeMap::new();
        let mut caves = 0;
        for region in regions(1, &bounds, 1 << 20).unwrap() {
            let crate::Content::Chunk { lattice, chunk } = &region.content else { continue };
            assert_eq!(lattice.shape, ChunkShape::Flat);
            let corner = region.bounds.min_raw().map(|c| c / Fixed::ONE.raw());
            for (i, block) in chunk.blocks().iter().enumerate() {
                *counts.entry(block.id().0).or_default() += 1;
                let [x, y, z, _] = ChunkShape::Flat.at(i);
                let ground = height(1, [corner[0] + x as i64, corner[2] + z as i64]);
                caves += usize::from(block.is_air() && corner[1] + (y as i64) < ground);
            }
        }
        for entry in 0..materials().len() as u16 {
            assert!(counts.contains_key(&(entry + 1)), "no {} in {counts:?}", materials()[usize::from(entry)].name);
        }
        assert!(caves > 10_000, "{caves} blocks of caves");
    }
}
