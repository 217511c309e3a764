//! Gathering: small content of one cell of a chunk lattice becomes one chunk.
//!
//! An edit of a few blocks takes the cells that it touches out of what was there (of a uniform region at most eight slabs
//! are left) and puts one chunk into each. A cell whose content no chunk of that lattice can hold, as something finer lies in
//! it, is tried in parts, by the next finer lattice.

use super::World;
use super::region::{Content, Region, RegionId, block_range, for_each_block};
use super::splice::Splice;
use crate::block::Block;
use crate::chunk::Chunk;
use crate::space::{Aabb4, CHUNK_BLOCKS, ChunkShape, Fixed, Lattice, Scale};
use std::ops::ControlFlow;
use std::sync::Arc;

/// An edit that touches more cells than this is not small.
const MOST_CELLS: u64 = 16;

/// So many scales a cell is divided before an edit is put in as it is.
const MOST_DIVISIONS: u32 = 3;

impl Splice<'_> {
    /// Puts a small edit into the cells that it touches; `false` if it is not small, and nothing is done.
    pub fn replace_small(&mut self, bounds: &Aabb4, pieces: &[Region]) -> bool {
        let old: Vec<Region> =
            self.regions_in(bounds).into_iter().filter_map(|id| self.world.regions.get(id).cloned()).collect();
        let lattice = lattice_for(bounds, pieces, &old);
        if bounds.cell_count(lattice.chunk_log2()) > MOST_CELLS {
            return false;
        }
        self.replace_in_cells(bounds, pieces, lattice, 0);
        true
    }

    fn replace_in_cells(&mut self, bounds: &Aabb4, pieces: &[Region], lattice: Lattice, divisions: u32) {
        for cell in bounds.cells(lattice.chunk_log2()) {
            let Some(part) = bounds.intersection(&cell) else { continue };
            let within: Vec<Region> = pieces.iter().filter_map(|piece| piece.clipped(&part)).collect();
            if part == cell || !self.gather(&cell, lattice, &part, &within) {
                match lattice.scale.finer() {
                    Some(scale) if part != cell && divisions < MOST_DIVISIONS => {
                        self.replace_in_cells(&part, &within, Lattice { scale, ..lattice }, divisions + 1);
                    }
                    _ => self.replace_exactly(&part, within),
                }
            }
        }
    }

    /// Makes one chunk of what is in a cell with a part of it replaced. `false` if no chunk of the lattice can hold that; nothing is
    /// done then.
    fn gather(&mut self, cell: &Aabb4, lattice: Lattice, part: &Aabb4, pieces: &[Region]) -> bool {
        let there = self.regions_in(cell);
        let old = |id: &RegionId| self.world.regions.get(*id).expect("the index names live regions");
        let (mut taken, mut left): (Vec<_>, Vec<_>) =
            there.into_iter().partition(|id| cell.contains(&old(id).bounds) || part.overlaps(&old(id).bounds));
        if taken.is_empty()
            && pieces.iter().all(|piece| matches!(piece.content, Content::Uniform(_)))
            && pieces.len() <= 1
        {
            self.replace_exactly(part, pieces.to_vec());
            return true;
        }
        let within = |id: &RegionId| old(id).bounds.intersection(cell);
        let mut hull = taken.iter().filter_map(within).fold(*part, |hull, bounds| hull.hull(&bounds));
        if left.iter().any(|id| old(id).bounds.overlaps(&hull)) {
            taken.append(&mut left);
            hull = *cell;
        }
        let holds =
            |region: &Region| region.bounds.intersection(cell).is_none_or(|bounds| can_hold(lattice, region, &bounds));
        if !lattice.has_block_corners(part) || !taken.iter().all(|id| holds(old(id))) || !pieces.iter().all(holds) {
            return false;
        }
        let bounds = if left.is_empty() { *cell } else { hull };
        let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
        for id in &taken {
            paint(&mut blocks, lattice, cell, old(id));
        }
        for_each_block(block_range(part, lattice), lattice, |_, index| blocks[index] = Block::AIR);
        for piece in pieces {
            paint(&mut blocks, lattice, part, piece);
        }
        let gathered = Region::chunk(bounds, lattice, Arc::new(Chunk::from_blocks(&blocks)));
        self.put_in_place_of(&taken, cell, gathered);
        true
    }

    /// Takes regions out, but for what of them lies outside of the cell, and puts another in. One that keeps its bounds keeps
    /// its id.
    fn put_in_place_of(&mut self, taken: &[RegionId], cell: &Aabb4, mut gathered: Option<Region>) {
        for &id in taken {
            let old = self.world.regions.get(id).expect("the splice takes what it found");
            let stays = gathered.as_ref().is_some_and(|new| {
                matches!((&new.content, &old.content), (Content::Chunk { .. }, Content::Chunk { .. }))
                    && new.bounds == old.bounds
            });
            if stays && let Some(new) = gathered.take() {
                self.update(id, new);
                continue;
            }
            let region = self.remove(id);
            self.insert_rest(&region, cell);
        }
        if let Some(new) = gathered {
            self.insert(new);
        }
    }

    /// Changes blocks of a chunk that holds all of an edit; `false` if none does.
    pub fn replace_in_chunk(&mut self, bounds: &Aabb4, pieces: &[Region]) -> bool {
        let there = self.regions_in(bounds);
        let [id] = there[..] else { return false };
        let region = self.world.regions.get(id).expect("the index names live regions");
        let Content::Chunk { lattice, chunk } = &region.content else { return false };
        let (lattice, chunk, whole) = (*lattice, chunk.clone(), region.bounds);
        let holds = |piece: &Region| can_hold(lattice, piece, &piece.bounds);
        if !(whole.contains(bounds) && lattice.has_block_corners(bounds) && pieces.iter().all(holds)) {
            return false;
        }
        let mut blocks = chunk.blocks();
        for_each_block(block_range(bounds, lattice), lattice, |_, index| blocks[index] = Block::AIR);
        for piece in pieces {
            paint(&mut blocks, lattice, bounds, piece);
        }
        let edited = Region::chunk(whole, lattice, Arc::new(Chunk::from_blocks(&blocks)));
        self.put_in_place_of(&[id], &whole, edited);
        true
    }

    /// Gathers what was put in and is less than its cell with what else lies within that cell.
    pub fn gather_fresh(&mut self) {
        let mut next = 0;
        while let Some(&id) = self.fresh.get(next) {
            next += 1;
            let Some(region) = self.world.regions.get(id) else { continue };
            let lattice = match &region.content {
                Content::Chunk { lattice, .. } => *lattice,
                Content::Uniform(_) => lattice_for(&region.bounds, std::slice::from_ref(region), &[]),
            };
            let cell = lattice.chunk_at(region.bounds.min_raw());
            if region.bounds != cell && cell.contains(&region.bounds) {
                self.gather_cell(&cell, lattice);
            }
        }
    }

    /// Makes one chunk of the regions that lie within a cell, if no other reaches between them.
    fn gather_cell(&mut self, cell: &Aabb4, lattice: Lattice) {
        let there = self.regions_in(cell);
        let old = |id: &RegionId| self.world.regions.get(*id).expect("the index names live regions");
        let (taken, left): (Vec<_>, Vec<_>) = there.into_iter().partition(|id| cell.contains(&old(id).bounds));
        let Some(first) = taken.first() else { return };
        let hull = taken.iter().fold(old(first).bounds, |hull, id| hull.hull(&old(id).bounds));
        let holds = |region: &Region| can_hold(lattice, region, &region.bounds);
        let between = left.iter().any(|id| old(id).bounds.overlaps(&hull));
        if taken.len() < 2 || between || !taken.iter().all(|id| holds(old(id))) {
            return;
        }
        let bounds = if left.is_empty() { *cell } else { hull };
        let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
        for id in &taken {
            paint(&mut blocks, lattice, cell, old(id));
        }
        let gathered = Region::chunk(bounds, lattice, Arc::new(Chunk::from_blocks(&blocks)));
        self.put_in_place_of(&taken, cell, gathered);
    }
}

impl World {
    /// The blocks of a cell of a lattice; `None` if no chunk of the lattice holds what is there.
    pub(crate) fn blocks_of_cell(&self, cell: &Aabb4, lattice: Lattice) -> Option<Box<[Block; CHUNK_BLOCKS]>> {
        let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
        let flow = self.query(cell, |_, region| {
            let within = region.bounds.intersection(cell);
            if within.is_some_and(|bounds| !can_hold(lattice, region, &bounds)) {
                return ControlFlow::Break(());
            }
            paint(&mut blocks, lattice, cell, region);
            ControlFlow::Continue(())
        });
        flow.is_continue().then_some(blocks)
    }
}

/// Whether a chunk of the lattice can hold what a region has within a box.
fn can_hold(lattice: Lattice, region: &Region, within: &Aabb4) -> bool {
    let blocks = match &region.content {
        Content::Uniform(_) => true,
        Content::Chunk { lattice: other, .. } => lattice.refines(*other),
    };
    blocks && lattice.has_block_corners(within)
}

/// The lattice whose chunks an edit goes into: the coarsest that has all corners of the edit, but not coarser than the blocks;
/// flat if the edit and all that it touches are flat.
fn lattice_for(bounds: &Aabb4, pieces: &[Region], old: &[Region]) -> Lattice {
    let spans_w = |b: &Aabb4| b.min_raw()[3] == 0 && b.max_raw()[3] == Fixed::ONE.raw();
    let flat = spans_w(bounds)
        && pieces.iter().all(|piece| spans_w(&piece.bounds))
        && old.iter().all(|region| Lattice::flat(Scale::UNIT).admits(&region.bounds));
    let boxes = pieces.iter().map(|piece| &piece.bounds).chain([bounds]);
    let bits = boxes.fold(0, |bits, b| bits | b.alignment_bits(!flat));
    let scale_of = |region: &Region| match &region.content {
        Content::Uniform(block) => block.scale(),
        Content::Chunk { lattice, .. } => lattice.scale,
    };
    let blocks = if pieces.is_empty() { old } else { pieces };
    let coarsest = blocks.iter().map(scale_of).min().unwrap_or(Scale::UNIT);
    let scale = Scale::of_alignment(bits).min(coarsest);
    Lattice { scale, shape: if flat { ChunkShape::Flat } else { ChunkShape::Cube } }
}

/// Writes what a region has within a box into the blocks of the cell that holds the box. The lattice has the region's corners
/// there, and its blocks are not coarser than the region's.
fn paint(blocks: &mut [Block; CHUNK_BLOCKS], lattice: Lattice, within: &Aabb4, region: &Region) {
    let Some(bounds) = region.bounds.intersection(within) else { return };
    let range = block_range(&bounds, lattice);
    match &region.content {
        Content::Uniform(block) => for_each_block(range, lattice, |_, index| blocks[index] = *block),
        Content::Chunk { lattice: own, chunk } if *own == lattice => {
            for_each_block(range, lattice, |_, index| blocks[index] = chunk.get(index));
        }
        Content::Chunk { lattice: own, chunk } => {
            let (origin, log2) = (lattice.chunk_at(bounds.min_raw()).min_raw(), lattice.block_log2());
            for_each_block(range, lattice, |at, index| {
                let raw = std::array::from_fn(|a| origin[a] + ((at[a] as i64) << log2[a]));
                blocks[index] = chunk.get(own.block_index(raw));
            });
        }
    }
}
