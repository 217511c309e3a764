//! Voxels on their way into a patch.

use super::{Fault, ImportFault, Imported};
use crate::block::{Block, BlockId};
use crate::chunk::Chunk;
use crate::palette::{Material, PaletteEntry};
use crate::space::{Aabb4, CHUNK_BLOCKS, ChunkShape, Fixed, Lattice, Scale};
use crate::tree::RegionTree;
use crate::world::WorldPatch;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Coordinates beyond this, in units, are refused: far more than any of the formats has.
const FARTHEST: i64 = 1 << 40;

/// Memory of a chunk's cell while it is filled, and of the chunk that it becomes, at most.
const CELL_BYTES: u64 = (CHUNK_BLOCKS * size_of::<Block>() * 2 + 256) as u64;

/// Blocks of one unit in `0 <= w < 1`, by chunk.
pub struct Grid {
    cells: FxHashMap<[i64; 3], Box<[Block; CHUNK_BLOCKS]>>,
    entries: Vec<PaletteEntry>,
    budget: Budget,
    pub warnings: Vec<String>,
}

/// Counts bytes up to a limit.
pub struct Budget {
    used: u64,
    limit: u64,
}

impl Budget {
    pub const fn new(limit: u64) -> Self {
        Self { used: 0, limit }
    }

    /// Charges bytes that are about to be taken.
    pub fn charge(&mut self, bytes: u64) -> Result<(), Fault> {
        self.used = self.used.saturating_add(bytes);
        if self.used > self.limit {
            return Err((None, ImportFault::OverBudget { needed: self.used, limit: self.limit }));
        }
        Ok(())
    }
}

impl Grid {
    pub fn new(budget: Budget) -> Self {
        Self { cells: FxHashMap::default(), entries: Vec::new(), budget, warnings: Vec::new() }
    }

    /// A block of a material, which is added; materials have different names.
    pub fn add_material(&mut self, material: Material) -> Result<Block, Fault> {
        let id = u16::try_from(self.entries.len() + 1).map(BlockId);
        let id = id.map_err(|_| (None, ImportFault::Palette(crate::palette::PaletteError::Full)))?;
        self.entries.push(PaletteEntry { id, material });
        Ok(Block::of(id, Scale::UNIT))
    }

    /// Puts a block; a later one takes the place of an earlier.
    pub fn set(&mut self, at: [i64; 3], block: Block) -> Result<(), Fault> {
        if at.iter().any(|c| c.abs() > FARTHEST) {
            let what = format!("a block lies at {at:?}; coordinates may reach to {FARTHEST}");
            return super::content(None, what);
        }
        let cell = at.map(|c| c >> 4);
        let [x, y, z] = at.map(|c| (c & 15) as usize);
        let index = ChunkShape::Flat.index([x, y, z, 0]);
        if let Some(blocks) = self.cells.get_mut(&cell) {
            blocks[index] = block;
        } else if !block.is_air() {
            self.budget.charge(CELL_BYTES)?;
            let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
            blocks[index] = block;
            self.cells.insert(cell, blocks);
        }
        Ok(())
    }

    /// The patch of all blocks.
    pub fn finish(mut self) -> Result<Imported, Fault> {
        let lattice = Lattice::flat(Scale::UNIT);
        let mut cells: Vec<_> = self.cells.drain().collect();
        cells.sort_unstable_by_key(|([x, y, z], _)| [*z, *y, *x]);
        let mut blocks = 0;
        let mut used = vec![false; self.entries.len() + 1];
        let mut parts = Vec::with_capacity(cells.len());
        let mut about: Option<Aabb4> = None;
        for ([x, y, z], cell) in cells {
            let chunk = Chunk::from_blocks(&cell);
            drop(cell);
            let edge = 16 * Fixed::ONE.raw();
            let min = [x * edge, y * edge, z * edge, 0];
            let max = [min[0] + edge, min[1] + edge, min[2] + edge, Fixed::ONE.raw()];
            let bounds = Aabb4::from_raw(min, max).map_err(|e| (None, e.into()))?;
            let Some([first, end]) = chunk.solid_bounds(ChunkShape::Flat) else { continue };
            let solid = crate::world::block_box(&bounds, lattice, first, end);
            about = Some(about.map_or(solid, |about| about.hull(&solid)));
            blocks += chunk.solid_count() as u64;
            chunk.palette().iter().for_each(|block| used[usize::from(block.id().0)] = true);
            let part = RegionTree::chunk_array(bounds, lattice, vec![Arc::new(chunk)]);
            parts.push(part.expect("a cell of the lattice has one chunk"));
        }
        self.entries.retain(|entry| used[usize::from(entry.id.0)]);
        let patch = about.map(|about| {
            let mut patch = WorldPatch::of_tree(RegionTree::branch(lattice.chunks_about(&about), parts));
            patch.palette = self.entries;
            patch
        });
        Ok(Imported { patch, blocks, warnings: self.warnings })
    }
}
