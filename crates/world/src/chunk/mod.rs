//! Chunks: dense bricks of 4,096 blocks.

mod json;
mod packed;

use crate::block::Block;
use crate::space::{CHUNK_BLOCKS, ChunkShape};
use packed::Packed;

/// 4,096 blocks, by linear index (x fastest, w slowest). The shape belongs to the lattice that the chunk lies in.
///
/// A chunk has one representation for one content: all of one block is uniform; anything else is packed with a local
/// palette in the order of first appearance. So equality and hash of what is stored are those of the content.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub struct Chunk(Repr);

#[derive(Clone, PartialEq, Eq, Hash, Debug)]
enum Repr {
    Uniform(Block),
    Dense(Packed),
}

impl Chunk {
    /// All of one block.
    pub const fn uniform(block: Block) -> Self {
        Self(Repr::Uniform(block))
    }

    /// The block of every index.
    pub fn from_blocks(blocks: &[Block; CHUNK_BLOCKS]) -> Self {
        if blocks.iter().all(|&block| block == blocks[0]) {
            return Self::uniform(blocks[0]);
        }
        Self(Repr::Dense(Packed::new(blocks)))
    }

    /// The block at a linear index below 4,096.
    #[inline]
    pub fn get(&self, index: usize) -> Block {
        match &self.0 {
            Repr::Uniform(block) => *block,
            Repr::Dense(packed) => packed.get(index),
        }
    }

    /// The block of which the whole chunk is made, if it is one.
    pub const fn as_uniform(&self) -> Option<Block> {
        match &self.0 {
            Repr::Uniform(block) => Some(*block),
            Repr::Dense(_) => None,
        }
    }

    /// Every block by linear index.
    pub fn blocks(&self) -> Box<[Block; CHUNK_BLOCKS]> {
        let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
        self.unpack(&mut blocks);
        blocks
    }

    /// Writes every block by linear index.
    pub fn unpack(&self, blocks: &mut [Block; CHUNK_BLOCKS]) {
        match &self.0 {
            Repr::Uniform(block) => blocks.fill(*block),
            Repr::Dense(packed) => packed.unpack(blocks),
        }
    }

    /// The distinct blocks, in the order of their first appearance.
    pub fn palette(&self) -> &[Block] {
        match &self.0 {
            Repr::Uniform(block) => std::slice::from_ref(block),
            Repr::Dense(packed) => packed.palette(),
        }
    }

    /// The block of every index as an index of [`Self::palette`].
    pub fn palette_indices(&self) -> Box<[u16; CHUNK_BLOCKS]> {
        let mut indices = Box::new([0; CHUNK_BLOCKS]);
        if let Repr::Dense(packed) = &self.0 {
            packed.unpack_indices(&mut indices);
        }
        indices
    }

    /// The indices of [`Self::palette`] as they are stored, [`Self::bits_per_block`] bits each: index `i` in word `i / (64 / bits)`,
    /// from the low bits up. Empty for a uniform chunk.
    pub fn packed_indices(&self) -> &[u64] {
        match &self.0 {
            Repr::Uniform(_) => &[],
            Repr::Dense(packed) => packed.words(),
        }
    }

    /// One bit for every block that is not air: bit `index % 64` of word `index / 64`.
    pub fn occupancy(&self) -> [u64; CHUNK_BLOCKS / 64] {
        match &self.0 {
            Repr::Uniform(block) => [if block.is_air() { 0 } else { u64::MAX }; CHUNK_BLOCKS / 64],
            Repr::Dense(packed) => packed.occupancy(),
        }
    }

    /// Blocks that are not air.
    pub fn solid_count(&self) -> usize {
        self.occupancy().iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The box of blocks that are not air, as the first and one past the last index by axis; `None` if all is air.
    pub fn solid_bounds(&self, shape: ChunkShape) -> Option<[[usize; 4]; 2]> {
        let size = shape.size();
        if let Some(block) = self.as_uniform() {
            return (!block.is_air()).then_some([[0; 4], size]);
        }
        let (mut min, mut max) = ([usize::MAX; 4], [0; 4]);
        let mut reach = |axis: usize, at: usize| {
            min[axis] = min[axis].min(at);
            max[axis] = max[axis].max(at + 1);
        };
        // A word is a plane of x and y (8 x 8), or a quarter of one (16 x 4): planes are or-ed together, and their bits looked
        // at once.
        let (planes, rows) = if shape == ChunkShape::Cube { (1, 8) } else { (4, 4) };
        let mut plane = [0_u64; 4];
        for (word, bits) in self.occupancy().into_iter().enumerate().filter(|(_, bits)| *bits != 0) {
            plane[word % planes] |= bits;
            reach(2, word / planes % size[2]);
            reach(3, word / planes / size[2]);
        }
        for (quarter, mut bits) in plane.into_iter().enumerate() {
            while bits != 0 {
                let bit = bits.trailing_zeros() as usize;
                reach(0, bit % size[0]);
                reach(1, quarter * rows + bit / size[0]);
                bits &= bits - 1;
            }
        }
        // A chunk that is not uniform has a block that is not air.
        Some([min, max])
    }

    /// Bytes of memory on the heap.
    pub fn heap_bytes(&self) -> usize {
        match &self.0 {
            Repr::Uniform(_) => 0,
            Repr::Dense(packed) => packed.heap_bytes(),
        }
    }

    /// Bits by which a block is stored: 0 for a uniform chunk, then 1, 2, 4, 8 or 16.
    pub fn bits_per_block(&self) -> u32 {
        match &self.0 {
            Repr::Uniform(_) => 0,
            Repr::Dense(packed) => packed.bits(),
        }
    }

    /// The chunk with every block translated.
    pub fn map(&self, mut translate: impl FnMut(Block) -> Block) -> Self {
        let palette: Vec<Block> = self.palette().iter().map(|&block| translate(block)).collect();
        if palette == self.palette() {
            return self.clone();
        }
        let indices = self.palette_indices();
        let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
        for (block, &index) in blocks.iter_mut().zip(indices.iter()) {
            *block = palette[usize::from(index)];
        }
        Self::from_blocks(&blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::BlockId;
    use crate::space::Scale;
    use proptest::prelude::*;

    fn block(id: u16) -> Block {
        Block::of(BlockId(id), Scale::UNIT)
    }

    fn filled(fill: impl Fn(usize) -> u16) -> Chunk {
        Chunk::from_blocks(&std::array::from_fn(|i| block(fill(i))))
    }

    #[test]
    fn a_chunk_is_packed_as_narrow_as_its_palette_allows() {
        for (kinds, bits) in [(1, 0), (2, 1), (3, 2), (4, 2), (5, 4), (16, 4), (17, 8), (256, 8), (257, 16), (4096, 16)]
        {
            let chunk = filled(|i| (i % kinds) as u16);
            assert_eq!(chunk.bits_per_block(), bits, "{kinds} kinds");
            assert!((0..CHUNK_BLOCKS).all(|i| chunk.get(i) == block((i % kinds) as u16)));
        }
        assert!(filled(|i| (i % 16) as u16).heap_bytes() <= 4608);
    }

    #[test]
    fn solid_bounds_are_tight_in_both_shapes() {
        let cube = ChunkShape::Cube;
        let corners = [cube.index([1, 2, 3, 4]), cube.index([5, 2, 3, 6])];
        let chunk = filled(|i| u16::from(corners.contains(&i)));
        assert_eq!(chunk.solid_bounds(cube), Some([[1, 2, 3, 4], [6, 3, 4, 7]]));
        assert_eq!(chunk.solid_count(), 2);
        assert_eq!(Chunk::uniform(Block::AIR).solid_bounds(cube), None);
        assert_eq!(Chunk::uniform(block(1)).solid_bounds(ChunkShape::Flat), Some([[0; 4], [16, 16, 16, 1]]));
    }

    #[test]
    fn equal_content_is_equal_however_it_came_about() {
        let direct = filled(|i| (i % 3) as u16);
        let translated = filled(|i| (i % 3) as u16 + 10).map(|b| block(b.id().0 - 10));
        assert_eq!(direct, translated);
        let collapsed = direct.map(|_| block(1));
        assert_eq!(collapsed, Chunk::uniform(block(1)));
    }

    proptest! {
        #[test]
        fn blocks_and_json_come_back(kinds in 1u16..600, seed in any::<u64>()) {
            let chunk = filled(|i| {
                let mixed = (i as u64 ^ seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
                (mixed % u64::from(kinds)) as u16
            });
            prop_assert_eq!(&Chunk::from_blocks(&chunk.blocks()), &chunk);
            let json = serde_json::to_string(&chunk).unwrap();
            prop_assert_eq!(&serde_json::from_str::<Chunk>(&json).unwrap(), &chunk);
            let occupied = chunk.occupancy();
            prop_assert!((0..CHUNK_BLOCKS).all(|i| (occupied[i / 64] >> (i % 64) & 1 == 1) != chunk.get(i).is_air()));
        }
    }
}
