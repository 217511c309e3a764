//! Regions: what a world keeps, and the ids under which it does.

use crate::block::Block;
use crate::chunk::Chunk;
use crate::space::{Aabb4, Lattice, Point4};
use std::sync::Arc;

/// A box and what is in it. A world's regions share no point; what none covers is air.
#[derive(Clone, PartialEq, Debug)]
pub struct Region {
    /// The box.
    pub bounds: Aabb4,
    /// What is in it.
    pub content: Content,
}

/// What is in a region.
#[derive(Clone, PartialEq, Debug)]
pub enum Content {
    /// One block that is not air, everywhere in the region.
    Uniform(Block),
    /// An array of one chunk. The region lies within the chunk's box, and may be a part of it: what the chunk holds outside
    /// of the region does not count. The chunk is shared by the regions that carving makes of one.
    ///
    /// Arrays of several chunks exist in trees only: a world keeps them chunk by chunk, so that an edit touches one.
    Chunk {
        /// Where the chunk lies: in the cell of this lattice that holds the region.
        lattice: Lattice,
        /// The blocks.
        chunk: Arc<Chunk>,
    },
}

impl Region {
    /// A region of one block; `None` for air.
    pub fn uniform(bounds: Aabb4, block: Block) -> Option<Self> {
        (!block.is_air()).then_some(Self { bounds, content: Content::Uniform(block) })
    }

    /// A region of a chunk, in the form that a world keeps: nothing if all is air, uniform if what is not air is one block
    /// that fills a box, and otherwise a chunk. `bounds` lies within one chunk of the lattice.
    pub fn chunk(bounds: Aabb4, lattice: Lattice, chunk: Arc<Chunk>) -> Option<Self> {
        debug_assert!(lattice.chunk_at(bounds.min_raw()).contains(&bounds));
        if let Some(block) = chunk.as_uniform() {
            return Self::uniform(bounds, block);
        }
        if let Some(solid) = one_block_box(&bounds, lattice, &chunk) {
            return solid.and_then(|(solid, block)| Self::uniform(solid, block));
        }
        Some(Self { bounds, content: Content::Chunk { lattice, chunk } })
    }

    /// The block at a point of the region.
    pub fn block_at(&self, point: Point4) -> Block {
        debug_assert!(self.bounds.contains_point(point));
        match &self.content {
            Content::Uniform(block) => *block,
            Content::Chunk { lattice, chunk } => chunk.get(lattice.block_index(point.raw())),
        }
    }

    /// The box of the chunk that the region lies in; `None` for a uniform region.
    pub fn chunk_bounds(&self) -> Option<Aabb4> {
        match &self.content {
            Content::Uniform(_) => None,
            Content::Chunk { lattice, .. } => Some(lattice.chunk_at(self.bounds.min_raw())),
        }
    }

    /// The smallest box about what is not air; a uniform region fills its own. `None` if the chunk has nothing within the
    /// region.
    pub fn solid_bounds(&self) -> Option<Aabb4> {
        let Content::Chunk { lattice, chunk } = &self.content else { return Some(self.bounds) };
        let [first, end] = chunk.solid_bounds(lattice.shape)?;
        let cell = lattice.chunk_at(self.bounds.min_raw());
        let solid = block_box(&cell, *lattice, first, end);
        let about = solid.intersection(&self.bounds)?;
        // What lies outside of the region may have widened the box.
        if self.bounds.contains(&solid) { Some(about) } else { solid_within(&about, *lattice, chunk) }
    }

    /// The region within another box; `None` if they share no point, or the chunk has only air there.
    pub(crate) fn clipped(&self, to: &Aabb4) -> Option<Self> {
        let bounds = self.bounds.intersection(to)?;
        match &self.content {
            Content::Uniform(block) => Self::uniform(bounds, *block),
            Content::Chunk { lattice, chunk } => Self::chunk(bounds, *lattice, chunk.clone()),
        }
    }

    /// Bytes of memory on the heap, those of a shared chunk included.
    pub fn heap_bytes(&self) -> usize {
        match &self.content {
            Content::Uniform(_) => 0,
            Content::Chunk { chunk, .. } => size_of::<Chunk>() + chunk.heap_bytes(),
        }
    }
}

/// The box of the blocks `first` to `end` (excluded) of a chunk.
pub(crate) fn block_box(cell: &Aabb4, lattice: Lattice, first: [usize; 4], end: [usize; 4]) -> Aabb4 {
    let (min, log2) = (cell.min_raw(), lattice.block_log2());
    let corner = |at: [usize; 4]| std::array::from_fn(|a| min[a] + ((at[a] as i64) << log2[a]));
    Aabb4::from_raw_unchecked(corner(first), corner(end))
}

/// The blocks of a chunk that share points with a box within its cell: the first, and one past the last, by axis.
pub(crate) fn block_range(bounds: &Aabb4, lattice: Lattice) -> [[usize; 4]; 2] {
    let (log2, size) = (lattice.block_log2(), lattice.shape.size());
    let index = |raw: i64, a: usize| (raw >> log2[a]) as usize & (size[a] - 1);
    let first = std::array::from_fn(|a| index(bounds.min_raw()[a], a));
    [first, std::array::from_fn(|a| index(bounds.max_raw()[a] - 1, a) + 1)]
}

/// Visits the linear indices of a range of blocks, x fastest.
pub(crate) fn for_each_block(
    [first, end]: [[usize; 4]; 2],
    lattice: Lattice,
    mut visit: impl FnMut([usize; 4], usize),
) {
    for w in first[3]..end[3] {
        for z in first[2]..end[2] {
            for y in first[1]..end[1] {
                let row = lattice.shape.index([0, y, z, w]);
                for x in first[0]..end[0] {
                    visit([x, y, z, w], row + x);
                }
            }
        }
    }
}

/// The smallest box about what is not air, within a box of the chunk's cell.
pub(crate) fn solid_within(bounds: &Aabb4, lattice: Lattice, chunk: &Chunk) -> Option<Aabb4> {
    let (mut min, mut max) = ([usize::MAX; 4], [0; 4]);
    for_each_block(block_range(bounds, lattice), lattice, |at, index| {
        if !chunk.get(index).is_air() {
            for a in 0..4 {
                min[a] = min[a].min(at[a]);
                max[a] = max[a].max(at[a] + 1);
            }
        }
    });
    if max == [0; 4] {
        return None;
    }
    block_box(&lattice.chunk_at(bounds.min_raw()), lattice, min, max).intersection(bounds)
}

/// Whether what is not air within the box is one block that fills a box of its own: `Some(None)` if there is only air.
#[expect(clippy::option_option, reason = "the outer says whether it is simple, the inner whether it is anything")]
fn one_block_box(bounds: &Aabb4, lattice: Lattice, chunk: &Chunk) -> Option<Option<(Aabb4, Block)>> {
    let whole = lattice.chunk_at(bounds.min_raw()) == *bounds;
    if whole {
        // The common case is decided by the palette.
        let mut solid = chunk.palette().iter().filter(|block| !block.is_air());
        let (Some(&block), None) = (solid.next(), solid.next()) else { return None };
        let [first, end] = chunk.solid_bounds(lattice.shape)?;
        let count: usize = (0..4).map(|a| end[a] - first[a]).product();
        return (count == chunk.solid_count()).then(|| Some((block_box(bounds, lattice, first, end), block)));
    }
    let Some(solid) = solid_within(bounds, lattice, chunk) else { return Some(None) };
    let block = chunk.get(lattice.block_index(solid.min_raw()));
    let mut one = !block.is_air();
    for_each_block(block_range(&solid, lattice), lattice, |_, index| one &= chunk.get(index) == block);
    one.then_some(Some((solid, block)))
}

/// A region's id. It names the region until that is removed; afterwards it names nothing.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct RegionId {
    slot: u32,
    generation: u32,
}

impl RegionId {
    /// The place in a dense array by region: below the largest number of regions that the world ever had at once. Places
    /// of removed regions are used again.
    pub const fn slot(self) -> usize {
        self.slot as usize
    }
}

/// Regions by slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Regions {
    slots: Vec<Slot>,
    free: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Slot {
    generation: u32,
    region: Option<Region>,
}

impl Regions {
    pub fn len(&self) -> usize {
        self.slots.len() - self.free.len()
    }

    pub fn slot_count(&self) -> usize {
        self.slots.len()
    }

    pub fn insert(&mut self, region: Region) -> RegionId {
        match self.free.pop() {
            Some(slot) => {
                let entry = &mut self.slots[slot as usize];
                entry.region = Some(region);
                RegionId { slot, generation: entry.generation }
            }
            None => {
                let slot = self.slots.len() as u32;
                self.slots.push(Slot { generation: 0, region: Some(region) });
                RegionId { slot, generation: 0 }
            }
        }
    }

    pub fn remove(&mut self, id: RegionId) -> Option<Region> {
        let entry = self.slots.get_mut(id.slot()).filter(|entry| entry.generation == id.generation)?;
        let region = entry.region.take()?;
        entry.generation = entry.generation.wrapping_add(1);
        self.free.push(id.slot);
        Some(region)
    }

    pub fn get(&self, id: RegionId) -> Option<&Region> {
        self.slots.get(id.slot()).filter(|entry| entry.generation == id.generation)?.region.as_ref()
    }

    pub fn get_mut(&mut self, id: RegionId) -> Option<&mut Region> {
        self.slots.get_mut(id.slot()).filter(|entry| entry.generation == id.generation)?.region.as_mut()
    }

    /// The region in a slot that the index names.
    pub fn in_slot(&self, slot: u32) -> Option<(RegionId, &Region)> {
        let entry = self.slots.get(slot as usize)?;
        entry.region.as_ref().map(|region| (RegionId { slot, generation: entry.generation }, region))
    }

    pub fn iter(&self) -> impl Iterator<Item = (RegionId, &Region)> + '_ {
        (0..self.slots.len() as u32).filter_map(|slot| self.in_slot(slot))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::BlockId;
    use crate::space::{ChunkShape, Scale};

    fn block(id: u16) -> Block {
        Block::of(BlockId(id), Scale::UNIT)
    }

    fn chunk(fill: impl Fn([usize; 4]) -> u16) -> Arc<Chunk> {
        Arc::new(Chunk::from_blocks(&std::array::from_fn(|i| block(fill(ChunkShape::Cube.at(i))))))
    }

    #[test]
    fn a_chunk_that_is_one_box_of_one_block_is_uniform() {
        let lattice = Lattice::cube(Scale::UNIT);
        let bounds = Aabb4::from_ints([8, 0, 0, 0], [16, 8, 8, 8]).unwrap();
        let slab = chunk(|at| u16::from((2..5).contains(&at[1])));
        let region = Region::chunk(bounds, lattice, slab.clone()).unwrap();
        assert_eq!(region.content, Content::Uniform(block(1)));
        assert_eq!(region.bounds, Aabb4::from_ints([8, 2, 0, 0], [16, 5, 8, 8]).unwrap());
        let clip = Aabb4::from_ints([8, 0, 0, 0], [9, 2, 8, 8]).unwrap();
        assert_eq!(Region::chunk(clip, lattice, slab.clone()), None, "only air within the clip");
        let clip = Aabb4::from_ints([8, 0, 0, 0], [9, 3, 8, 8]).unwrap();
        let region = Region::chunk(clip, lattice, slab).unwrap();
        assert_eq!(region.bounds, Aabb4::from_ints([8, 2, 0, 0], [9, 3, 8, 8]).unwrap());
    }

    #[test]
    fn solid_bounds_see_nothing_outside_of_the_region() {
        let lattice = Lattice::cube(Scale::UNIT);
        let corners = chunk(|at| u16::from(at == [0; 4] || at == [3, 3, 3, 3] || at == [7; 4]));
        let region = Region {
            bounds: Aabb4::from_ints([1; 4], [8, 8, 8, 7]).unwrap(),
            content: Content::Chunk { lattice, chunk: corners },
        };
        assert_eq!(region.solid_bounds(), Some(Aabb4::from_ints([3; 4], [4; 4]).unwrap()));
    }

    #[test]
    fn a_removed_region_is_not_found_under_its_old_id() {
        let mut regions = Regions::default();
        let region = Region::uniform(Aabb4::SPACE, block(1)).unwrap();
        let first = regions.insert(region.clone());
        assert!(regions.remove(first).is_some());
        let second = regions.insert(region);
        assert_eq!((first.slot(), regions.slot_count()), (second.slot(), 1));
        assert!(regions.get(first).is_none() && regions.get(second).is_some());
        assert!(regions.remove(first).is_none());
    }
}
