//! The leaf set: what the root BVH holds.
//!
//! Leaves lie in pages that are shared with snapshots and copied when they are written ([`LeafSnapshot`]), so that a snapshot of
//! a million leaves costs a list of pages.

use super::payload::Dense;
use orthant_resident::world::rows::{LeafRow, NO_PAYLOAD, kind};
use orthant_world::{Aabb4, Block, Chunk, ChunkShape, Content, Lattice, Region};
use std::sync::Arc;

/// A leaf as its maker gives it.
#[derive(Clone, PartialEq, Debug)]
pub struct Leaf {
    /// The box. Of a chunk: the part of it that counts; what is solid in it may be less.
    pub bounds: Aabb4,
    /// What is in it.
    pub content: LeafContent,
}

/// What is in a leaf.
#[derive(Clone, PartialEq, Debug)]
pub enum LeafContent {
    /// One block, without a chunk.
    Uniform(Block),
    /// A chunk, in the cell of the lattice that holds the leaf. One that is of one block has no payload.
    Chunk {
        /// Where the chunk lies.
        lattice: Lattice,
        /// The blocks.
        chunk: Arc<Chunk>,
    },
    /// A dense chunk of 4,096 times one block: content that no world keeps in this way, for comparing encodings.
    Filled {
        /// Where the chunk lies.
        lattice: Lattice,
        /// The block.
        block: Block,
    },
}

impl From<&Region> for Leaf {
    fn from(region: &Region) -> Self {
        let content = match &region.content {
            Content::Uniform(block) => LeafContent::Uniform(*block),
            Content::Chunk { lattice, chunk } => LeafContent::Chunk { lattice: *lattice, chunk: chunk.clone() },
        };
        Self { bounds: region.bounds, content }
    }
}

/// A part of a chunk, as a leaf keeps it.
#[derive(Clone, Debug)]
pub(super) struct ChunkPart {
    /// The part of the chunk that the leaf stands for, air included.
    pub bounds: Aabb4,
    pub lattice: Lattice,
    pub blocks: ChunkBlocks,
}

#[derive(Clone, Debug)]
pub(super) enum ChunkBlocks {
    /// A chunk of one block, without payload.
    One(Block),
    Dense(Dense),
}

/// A leaf that is ready to be put in: its tight box, and all of its row but where its payload lies.
#[derive(Clone, Debug)]
pub(super) struct Draft {
    /// The payload's place is open.
    pub row: LeafRow,
    pub part: Option<Arc<ChunkPart>>,
}

impl Draft {
    /// The leaf within a box; `None` if there is only air.
    pub fn new(leaf: &Leaf, clip: &Aabb4) -> Option<Self> {
        let bounds = leaf.bounds.intersection(clip)?;
        match &leaf.content {
            LeafContent::Uniform(block) => Self::uniform(bounds, *block),
            LeafContent::Chunk { lattice, chunk } => match chunk.as_uniform() {
                Some(block) => Self::of_one_block(bounds, *lattice, block),
                None => Self::dense(bounds, *lattice, chunk),
            },
            LeafContent::Filled { lattice, block } => {
                let mut draft = Self::of_one_block(bounds, *lattice, *block)?;
                let blocks = ChunkBlocks::Dense(Dense::Filled(*block));
                draft.part = Some(Arc::new(ChunkPart { bounds, lattice: *lattice, blocks }));
                Some(draft)
            }
        }
    }

    /// The leaf of a world's region.
    pub fn of_region(region: &Region, clip: &Aabb4) -> Option<Self> {
        let bounds = region.bounds.intersection(clip)?;
        match &region.content {
            Content::Uniform(block) => Self::uniform(bounds, *block),
            Content::Chunk { lattice, chunk } => Self::dense(bounds, *lattice, chunk),
        }
    }

    /// The leaf's part within a box; `None` if there is only air.
    pub fn clipped(record: &LeafRecord, to: &Aabb4) -> Option<Self> {
        let bounds = record.bounds().intersection(to)?;
        let with = |part: &ChunkPart| Some(Arc::new(ChunkPart { bounds, ..part.clone() }));
        match &record.part {
            None => {
                let row = LeafRow { min: bounds.min_raw(), max: bounds.max_raw(), ..record.row };
                Some(Self { row, part: None })
            }
            Some(part) => match &part.blocks {
                ChunkBlocks::Dense(Dense::Chunk(chunk)) => Self::dense(bounds, part.lattice, chunk),
                ChunkBlocks::Dense(Dense::Filled(block)) | ChunkBlocks::One(block) => {
                    let draft = Self::of_one_block(bounds, part.lattice, *block)?;
                    Some(Self { part: with(part), ..draft })
                }
            },
        }
    }

    fn uniform(bounds: Aabb4, block: Block) -> Option<Self> {
        let row = LeafRow::uniform(bounds.min_raw(), bounds.max_raw(), block.to_bits());
        (!block.is_air()).then_some(Self { row, part: None })
    }

    fn of_one_block(bounds: Aabb4, lattice: Lattice, block: Block) -> Option<Self> {
        let row = LeafRow {
            min: bounds.min_raw(),
            max: bounds.max_raw(),
            kind: chunk_kind(lattice),
            block: block.to_bits(),
            payload: NO_PAYLOAD,
            coarse: if lattice.shape == ChunkShape::Flat { 0xff } else { 0xffff },
        };
        let part = Some(Arc::new(ChunkPart { bounds, lattice, blocks: ChunkBlocks::One(block) }));
        (!block.is_air()).then_some(Self { row, part })
    }

    fn dense(bounds: Aabb4, lattice: Lattice, chunk: &Arc<Chunk>) -> Option<Self> {
        let content = Content::Chunk { lattice, chunk: chunk.clone() };
        let tight = Region { bounds, content }.solid_bounds()?;
        let row = LeafRow {
            min: tight.min_raw(),
            max: tight.max_raw(),
            kind: chunk_kind(lattice),
            block: 0,
            payload: NO_PAYLOAD,
            coarse: coarse(&chunk.occupancy(), lattice.shape),
        };
        let blocks = ChunkBlocks::Dense(Dense::Chunk(chunk.clone()));
        Some(Self { row, part: Some(Arc::new(ChunkPart { bounds, lattice, blocks })) })
    }

    /// The dense chunk that is to lie in the payload arena.
    pub fn dense_blocks(&self) -> Option<&Dense> {
        match &self.part.as_ref()?.blocks {
            ChunkBlocks::Dense(dense) => Some(dense),
            ChunkBlocks::One(_) => None,
        }
    }

    /// The tight box.
    pub fn bounds(&self) -> Aabb4 {
        row_bounds(&self.row)
    }
}

fn chunk_kind(lattice: Lattice) -> u32 {
    let shape = u32::from(lattice.shape == ChunkShape::Flat);
    let log2 = (i32::from(lattice.scale.get()) + 16) as u32;
    kind::CHUNK_ARRAY | shape << 8 | log2 << 16
}

/// Which of the 2^4 parts of a chunk have something in them; of a flat chunk, the 2^3.
pub(super) fn coarse(occupancy: &[u64; 64], shape: ChunkShape) -> u32 {
    let mut mask = 0;
    for (word, &bits) in occupancy.iter().enumerate().filter(|(_, bits)| **bits != 0) {
        // A word is a plane of x and y (8 x 8), or a quarter of one (16 x 4).
        let (x_low, shift, y, z, w) = match shape {
            ChunkShape::Cube => (0x0f0f_0f0f_0f0f_0f0f_u64, 4, None, word % 8 / 4, word / 32),
            ChunkShape::Flat => (0x00ff_00ff_00ff_00ff, 8, Some(word % 4 / 2), word / 32, 0),
        };
        let halves = |bits: u64, y: usize| {
            let at = 2 * y + 4 * z + 8 * w;
            u32::from(bits & x_low != 0) << at | u32::from(bits >> shift & x_low != 0) << (at + 1)
        };
        mask |= match y {
            Some(y) => halves(bits, y),
            None => halves(bits & 0xffff_ffff, 0) | halves(bits >> 32, 1),
        };
    }
    mask
}

/// The box of a row.
pub(super) fn row_bounds(row: &LeafRow) -> Aabb4 {
    match Aabb4::from_raw(row.min, row.max) {
        Ok(bounds) => bounds,
        Err(fault) => unreachable!("rows of leaves are made from boxes: {fault}"),
    }
}

/// A leaf of the set.
#[derive(Clone, Debug)]
pub(super) struct LeafRecord {
    pub row: LeafRow,
    pub part: Option<Arc<ChunkPart>>,
    /// The entry of its dense chunk in the payload store.
    pub entry: Option<u32>,
}

impl LeafRecord {
    /// The tight box.
    pub fn bounds(&self) -> Aabb4 {
        row_bounds(&self.row)
    }

    /// Whether a region of the world, clipped to these bounds, is this leaf. Chunks are compared by content, first by pointer.
    pub fn is_of(&self, region: &Region, bounds: &Aabb4) -> bool {
        match (&region.content, &self.part) {
            (Content::Uniform(block), None) => self.row.block == block.to_bits() && self.bounds() == *bounds,
            (Content::Chunk { lattice, chunk }, Some(part)) => {
                part.bounds == *bounds
                    && part.lattice == *lattice
                    && match &part.blocks {
                        ChunkBlocks::Dense(Dense::Chunk(ours)) => Arc::ptr_eq(ours, chunk) || ours == chunk,
                        ChunkBlocks::Dense(Dense::Filled(_)) | ChunkBlocks::One(_) => false,
                    }
            }
            (Content::Uniform(_), Some(_)) | (Content::Chunk { .. }, None) => false,
        }
    }

    /// Whether the draft is this leaf.
    pub fn is_draft(&self, draft: &Draft) -> bool {
        let row = LeafRow { payload: draft.row.payload, ..self.row };
        let parts = match (&self.part, &draft.part) {
            (None, None) => true,
            (Some(ours), Some(theirs)) => {
                let blocks = match (&ours.blocks, &theirs.blocks) {
                    (ChunkBlocks::One(ours), ChunkBlocks::One(theirs)) => ours == theirs,
                    (ChunkBlocks::Dense(ours), ChunkBlocks::Dense(theirs)) => ours == theirs,
                    _ => false,
                };
                blocks && ours.bounds == theirs.bounds && ours.lattice == theirs.lattice
            }
            _ => false,
        };
        parts && row == draft.row
    }

    /// The leaf as its maker gave it.
    pub fn leaf(&self) -> Leaf {
        match &self.part {
            None => {
                let block = Block::from_bits(self.row.block).unwrap_or_default();
                Leaf { bounds: self.bounds(), content: LeafContent::Uniform(block) }
            }
            Some(part) => {
                let lattice = part.lattice;
                let content = match &part.blocks {
                    ChunkBlocks::One(block) => LeafContent::Chunk { lattice, chunk: Arc::new(Chunk::uniform(*block)) },
                    ChunkBlocks::Dense(Dense::Chunk(chunk)) => LeafContent::Chunk { lattice, chunk: chunk.clone() },
                    ChunkBlocks::Dense(Dense::Filled(block)) => LeafContent::Filled { lattice, block: *block },
                };
                Leaf { bounds: part.bounds, content }
            }
        }
    }
}

/// Leaves in a page.
const PAGE: usize = 128;

type Page = [Option<LeafRecord>; PAGE];

/// Leaves by slot.
#[derive(Clone, Debug, Default)]
pub(super) struct LeafSet {
    pages: Vec<Arc<Page>>,
    /// Slots below this one were in use at some time.
    end: u32,
    free: Vec<u32>,
    chunks: usize,
}

impl LeafSet {
    /// Leaves in the order of slots.
    pub fn from_records(records: Vec<LeafRecord>) -> Self {
        let end = records.len() as u32;
        let chunks = records.iter().filter(|record| record.part.is_some()).count();
        let mut records = records.into_iter();
        let page = |_| Arc::new(std::array::from_fn(|_| records.next()));
        Self { pages: (0..(end as usize).div_ceil(PAGE)).map(page).collect(), end, free: Vec::new(), chunks }
    }

    pub fn len(&self) -> usize {
        self.end as usize - self.free.len()
    }

    /// Leaves with chunks.
    pub fn chunk_count(&self) -> usize {
        self.chunks
    }

    /// One past the highest slot that was ever in use.
    pub fn end(&self) -> u32 {
        self.end
    }

    pub fn get(&self, slot: u32) -> Option<&LeafRecord> {
        self.pages.get(slot as usize / PAGE)?[slot as usize % PAGE].as_ref()
    }

    pub fn iter(&self) -> impl Iterator<Item = (u32, &LeafRecord)> + '_ {
        (0..self.end).filter_map(|slot| self.get(slot).map(|record| (slot, record)))
    }

    fn place(&mut self, slot: u32) -> &mut Option<LeafRecord> {
        &mut Arc::make_mut(&mut self.pages[slot as usize / PAGE])[slot as usize % PAGE]
    }

    /// Takes a free slot, the one that was freed last, or the end.
    pub fn insert(&mut self, record: LeafRecord) -> u32 {
        self.chunks += usize::from(record.part.is_some());
        let slot = self.free.pop().unwrap_or_else(|| {
            let slot = self.end;
            self.end += 1;
            if slot as usize / PAGE == self.pages.len() {
                self.pages.push(Arc::new([const { None }; PAGE]));
            }
            slot
        });
        *self.place(slot) = Some(record);
        slot
    }

    pub fn remove(&mut self, slot: u32) -> Option<LeafRecord> {
        self.get(slot)?;
        let record = self.place(slot).take()?;
        self.chunks -= usize::from(record.part.is_some());
        self.free.push(slot);
        Some(record)
    }

    /// Puts another leaf in the place of one.
    pub fn replace(&mut self, slot: u32, record: LeafRecord) -> Option<LeafRecord> {
        self.get(slot)?;
        self.chunks += usize::from(record.part.is_some());
        let before = self.place(slot).replace(record)?;
        self.chunks -= usize::from(before.part.is_some());
        Some(before)
    }

    pub fn pages(&self) -> Vec<Arc<Page>> {
        self.pages.clone()
    }
}

/// The leaves as they were at one moment, for work on another thread. It costs a list of pages: a page is copied when a leaf of
/// it changes.
#[derive(Clone, Debug)]
pub struct LeafSnapshot {
    pub(super) pages: Vec<Arc<Page>>,
    pub(super) len: usize,
    /// What node bounds of the set are relative to, raw.
    pub origin: [i64; 4],
    /// The box to which the set is clipped.
    pub clip: Aabb4,
    /// The revision of the set.
    pub revision: u64,
}

impl LeafSnapshot {
    /// How many leaves there are.
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Every leaf, in the order of slots. Chunks are shared.
    pub fn leaves(&self) -> impl Iterator<Item = Leaf> + '_ {
        self.pages.iter().flat_map(|page| page.iter().flatten()).map(LeafRecord::leaf)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_world::{BlockId, Scale};

    fn record(x: i32) -> LeafRecord {
        let bounds = Aabb4::from_ints([x, 0, 0, 0], [x + 1, 1, 1, 1]).unwrap();
        let leaf = Leaf { bounds, content: LeafContent::Uniform(Block::of(BlockId(1), Scale::UNIT)) };
        let draft = Draft::new(&leaf, &Aabb4::SPACE).unwrap();
        LeafRecord { row: draft.row, part: draft.part, entry: None }
    }

    #[test]
    fn a_snapshot_keeps_what_is_changed_afterwards_and_shares_the_rest() {
        let mut set = LeafSet::from_records((0..300).map(record).collect());
        let pages = set.pages();
        set.remove(5);
        set.insert(record(1000));
        let shared = pages.iter().zip(&set.pages).filter(|(a, b)| Arc::ptr_eq(a, b)).count();
        assert_eq!(shared, 2, "of three pages one was written");
        assert_eq!(pages[0][5].as_ref().map(|r| r.row.min[0]), Some(5 << 16));
        assert_eq!(set.get(5).map(|r| r.row.min[0]), Some(1000 << 16), "the freed slot is used again");
        assert_eq!((set.len(), set.end()), (300, 300));
    }

    #[test]
    fn coarse_occupancy_is_that_of_the_halves() {
        for shape in [ChunkShape::Cube, ChunkShape::Flat] {
            let size = shape.size();
            for index in 0..4096 {
                let mut occupancy = [0_u64; 64];
                occupancy[index / 64] = 1 << (index % 64);
                let at = shape.at(index);
                let half = |a: usize| usize::from(size[a] > 1 && at[a] >= size[a] / 2);
                let bit = half(0) + 2 * half(1) + 4 * half(2) + 8 * half(3);
                assert_eq!(coarse(&occupancy, shape), 1 << bit, "{shape:?} {at:?}");
            }
        }
    }
}
