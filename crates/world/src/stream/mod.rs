//! A stream of patches: a box of interest follows the camera, and the source sends what entered it and empties for what left
//! it, in patches of bounded size, nearest first.
//!
//! Space is divided into stream cells. A cell that shares points with the box of interest is wanted as a whole; what was sent
//! is known by cells. A cell with more content than one patch may have is sent in parts. What is cut at the borders of cells
//! joins again in the world that receives it, as far as it is uniform.

use crate::block::{Block, BlockId};
use crate::generate::Generator;
use crate::palette::{OnConflict, PaletteEntry};
use crate::space::{Aabb4, Fixed};
use crate::tree::RegionTree;
use crate::world::{Content, Region, World, WorldPatch, tree_of};
use rustc_hash::{FxHashMap, FxHashSet};
use std::ops::ControlFlow;
use std::sync::Arc;

/// What is streamed.
#[derive(Clone, Debug)]
pub enum StreamSource {
    /// A world.
    World(Arc<World>),
    /// A generator.
    Generator(Generator),
}

/// How patches are cut.
#[derive(Clone, Copy, Debug)]
pub struct StreamOptions {
    /// The extent of a stream cell along each axis is 2 to the power of this, in units; 3 to 20.
    pub cell_log2: u32,
    /// Regions in a patch, unless no smaller patch can be made: a part of 8 units is not divided.
    pub max_regions: usize,
    /// Chunks in a patch that are not of one block.
    pub max_chunks: usize,
    /// Stream cells in the box of interest.
    pub max_cells: usize,
}

impl Default for StreamOptions {
    fn default() -> Self {
        Self { cell_log2: 7, max_regions: 256, max_chunks: 64, max_cells: 1 << 18 }
    }
}

/// Why a box cannot be of interest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the box of interest has {cells} stream cells, and {limit} are allowed; make it smaller, or the cells larger")]
pub struct InterestTooLarge {
    /// Cells of the box.
    pub cells: u64,
    /// The limit.
    pub limit: usize,
}

/// The lower corner of a stream cell, in cells.
type CellIndex = [i64; 4];

/// A source of patches for one receiver.
#[derive(Clone, Debug)]
pub struct PatchStream {
    source: StreamSource,
    options: StreamOptions,
    /// Cells that the receiver has; whether anything is in them.
    sent: FxHashMap<CellIndex, bool>,
    /// Cells to send or to empty, farthest first: the next one is the last.
    queue: Vec<CellIndex>,
    /// Parts of the cell that is being sent, in reverse order.
    parts: Vec<Aabb4>,
    wanted: FxHashSet<CellIndex>,
}

impl PatchStream {
    /// A stream of which nothing is wanted yet.
    pub fn new(source: StreamSource, options: StreamOptions) -> Self {
        let options = StreamOptions { cell_log2: options.cell_log2.clamp(3, 20), ..options };
        Self {
            source,
            options,
            sent: FxHashMap::default(),
            queue: Vec::new(),
            parts: Vec::new(),
            wanted: FxHashSet::default(),
        }
    }

    fn log2(&self) -> [u32; 4] {
        [self.options.cell_log2 + Fixed::FRACTION_BITS; 4]
    }

    fn bounds_of(&self, cell: CellIndex) -> Aabb4 {
        let log2 = self.options.cell_log2 + Fixed::FRACTION_BITS;
        let min = cell.map(|c| c << log2);
        Aabb4::from_raw_unchecked(min, min.map(|c| c + (1 << log2)))
    }

    /// What the receiver has when everything of a box of interest is sent: the box, in whole stream cells.
    pub fn covered(&self, interest: &Aabb4) -> Aabb4 {
        interest.snapped_out(self.log2())
    }

    /// Sets the box of interest. What is queued and no longer needed is dropped.
    ///
    /// # Errors
    /// [`InterestTooLarge`]; everything is then as it was.
    pub fn set_interest(&mut self, interest: &Aabb4) -> Result<(), InterestTooLarge> {
        let cells = interest.cell_count(self.log2());
        if cells > self.options.max_cells as u64 {
            return Err(InterestTooLarge { cells, limit: self.options.max_cells });
        }
        let log2 = self.options.cell_log2 + Fixed::FRACTION_BITS;
        self.wanted = interest.cells(self.log2()).map(|cell| cell.min_raw().map(|c| c >> log2)).collect();
        self.enqueue(interest);
        Ok(())
    }

    /// Has what the receiver got of a box sent again, as the source has changed there.
    pub fn resend(&mut self, changed: &Aabb4, source: StreamSource) {
        self.source = source;
        let stale: Vec<CellIndex> =
            self.sent.keys().copied().filter(|&cell| self.bounds_of(cell).overlaps(changed)).collect();
        // A cell that is wanted and not sent is in the queue; what was in it is replaced by what is sent.
        for cell in stale.into_iter().filter(|cell| self.wanted.contains(cell)) {
            self.sent.remove(&cell);
            self.queue.push(cell);
        }
    }

    fn enqueue(&mut self, interest: &Aabb4) {
        // The distance from the middle of the interest to the middle of the cell, in half steps, roughly.
        let middle = |b: &Aabb4| -> [f64; 4] { std::array::from_fn(|a| b.min_raw()[a] as f64 + b.max_raw()[a] as f64) };
        let from = middle(interest);
        let distance = |cell: CellIndex| -> f64 {
            let to = middle(&self.bounds_of(cell));
            (0..4).map(|a| (to[a] - from[a]) * (to[a] - from[a])).sum()
        };
        let entering = self.wanted.iter().filter(|cell| !self.sent.contains_key(*cell));
        let leaving = self.sent.keys().filter(|cell| !self.wanted.contains(*cell));
        let mut queue: Vec<(f64, CellIndex)> = entering.chain(leaving).map(|&cell| (distance(cell), cell)).collect();
        queue.sort_unstable_by(|(a, cell), (b, other)| b.total_cmp(a).then(cell.cmp(other)));
        self.queue = queue.into_iter().map(|(_, cell)| cell).collect();
    }

    /// Whether the receiver has everything that is wanted, and nothing else.
    pub fn is_done(&self) -> bool {
        self.queue.is_empty() && self.parts.is_empty()
    }

    /// The next patch; `None` when nothing is left to send. Cells without content cost no patch.
    pub fn next_patch(&mut self) -> Option<WorldPatch> {
        loop {
            if let Some(part) = self.parts.pop() {
                match self.patch_of(&part) {
                    Some(patch) => return Some(patch),
                    None => continue,
                }
            }
            let cell = self.queue.pop()?;
            let bounds = self.bounds_of(cell);
            if self.wanted.contains(&cell) {
                if self.sent.contains_key(&cell) {
                    continue;
                }
                let empty = self.content(&bounds, 1).is_some_and(|regions| regions.is_empty());
                self.sent.insert(cell, !empty);
                // Sent even if it is empty: the receiver may have what was there before.
                self.parts.push(bounds);
            } else if self.sent.remove(&cell) == Some(true) {
                return Some(WorldPatch::of_tree(RegionTree::empty(bounds)));
            }
        }
    }

    /// The patch of a part, which is divided if it has too much in it; `None` if its halves are to be asked for.
    fn patch_of(&mut self, part: &Aabb4) -> Option<WorldPatch> {
        let smallest = part.extent_raw().iter().all(|&extent| extent <= 8 * Fixed::ONE.raw());
        let regions = match self.content(part, self.options.max_regions) {
            None if smallest => self.content(part, usize::MAX).unwrap_or_default(),
            None => return self.divide(part),
            Some(regions) => regions,
        };
        let chunks = regions.iter().filter(|region| matches!(region.content, Content::Chunk { .. })).count();
        if chunks > self.options.max_chunks && !smallest {
            return self.divide(part);
        }
        let mut used = FxHashSet::default();
        for region in &regions {
            match &region.content {
                Content::Uniform(block) => used.extend([block.id()]),
                Content::Chunk { chunk, .. } => used.extend(chunk.palette().iter().copied().map(Block::id)),
            }
        }
        let tree = RegionTree::branch(*part, regions.into_iter().map(tree_of).collect());
        Some(WorldPatch { palette: self.entries(&used), on_conflict: OnConflict::Keep, ..WorldPatch::of_tree(tree) })
    }

    /// Queues both halves of a part, cut across its longest axis. Parts are powers of two.
    fn divide(&mut self, part: &Aabb4) -> Option<WorldPatch> {
        let extent = part.extent_raw();
        let axis = (0..4).max_by_key(|&a| extent[a]).unwrap_or(0);
        let (mut max, mut min) = (part.max_raw(), part.min_raw());
        (max[axis], min[axis]) = (min[axis] + extent[axis] / 2, min[axis] + extent[axis] / 2);
        self.parts.push(Aabb4::from_raw_unchecked(min, part.max_raw()));
        self.parts.push(Aabb4::from_raw_unchecked(part.min_raw(), max));
        None
    }

    /// What the source has in a box; `None` if that is more than so many regions.
    fn content(&self, bounds: &Aabb4, limit: usize) -> Option<Vec<Region>> {
        match &self.source {
            StreamSource::Generator(generator) => generator.regions(bounds, limit).ok(),
            StreamSource::World(world) => {
                let mut regions = Vec::new();
                let flow = world.query(bounds, |_, region| {
                    regions.extend(region.clipped(bounds));
                    if regions.len() > limit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                });
                flow.is_continue().then_some(regions)
            }
        }
    }

    fn entries(&self, used: &FxHashSet<BlockId>) -> Vec<PaletteEntry> {
        match &self.source {
            StreamSource::World(world) => {
                let mut ids: Vec<BlockId> = used.iter().copied().collect();
                ids.sort_unstable();
                let entry = |id| world.palette().get(id).map(|m| PaletteEntry { id, material: (**m).clone() });
                ids.into_iter().filter_map(entry).collect()
            }
            StreamSource::Generator(generator) => {
                let entries = generator.materials().into_iter().enumerate();
                let entries = entries.map(|(i, material)| PaletteEntry { id: BlockId(i as u16 + 1), material });
                entries.filter(|entry| used.contains(&entry.id)).collect()
            }
        }
    }
}
