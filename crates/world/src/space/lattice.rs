//! Scales, and the lattices of blocks and chunks that they give.

use super::aabb::Aabb4;
use super::fixed::Fixed;
use serde::{Deserialize, Serialize};

/// The size of a block: its edge is `2^scale` world units, -16 <= scale <= 15.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(try_from = "i8", into = "i8")]
#[repr(transparent)]
pub struct Scale(i8);

/// A scale that is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("scale {0} is out of range; scales run from -16 to 15")]
pub struct ScaleError(pub i8);

impl Scale {
    /// The finest: an edge of 1/65,536 unit.
    pub const MIN: Self = Self(-16);
    /// An edge of one unit.
    pub const UNIT: Self = Self(0);
    /// The coarsest: an edge of 32,768 units.
    pub const MAX: Self = Self(15);

    /// # Errors
    /// [`ScaleError`] beyond -16..=15.
    pub const fn new(scale: i8) -> Result<Self, ScaleError> {
        if scale < Self::MIN.0 || scale > Self::MAX.0 { Err(ScaleError(scale)) } else { Ok(Self(scale)) }
    }

    /// The exponent.
    pub const fn get(self) -> i8 {
        self.0
    }

    /// The edge of a block.
    pub const fn edge(self) -> Fixed {
        Fixed::from_raw(1 << self.log2_raw())
    }

    /// The next finer scale; `None` below the finest.
    pub const fn finer(self) -> Option<Self> {
        if self.0 == Self::MIN.0 { None } else { Some(Self(self.0 - 1)) }
    }

    /// The logarithm of the edge in steps of 1/65,536: 0..=31.
    pub(crate) const fn log2_raw(self) -> u32 {
        (self.0 + 16) as u32
    }

    /// The coarsest scale whose lattice has all of these coordinates, given or-ed together in steps of 1/65,536.
    pub(crate) fn of_alignment(bits: i64) -> Self {
        Self(bits.trailing_zeros().min(31) as i8 - 16)
    }
}

impl TryFrom<i8> for Scale {
    type Error = ScaleError;
    fn try_from(scale: i8) -> Result<Self, ScaleError> {
        Self::new(scale)
    }
}

impl From<Scale> for i8 {
    fn from(scale: Scale) -> i8 {
        scale.0
    }
}

/// How the 4,096 blocks of a chunk lie.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChunkShape {
    /// 8 x 8 x 8 x 8: content in four dimensions.
    Cube,
    /// 16 x 16 x 16 x 1: content in three. Chunk and blocks span `0 <= w < 1` at every scale.
    Flat,
}

/// Blocks in a chunk.
pub const CHUNK_BLOCKS: usize = 4096;

impl ChunkShape {
    /// Blocks along x, y, z and w.
    pub const fn size(self) -> [usize; 4] {
        match self {
            Self::Cube => [8, 8, 8, 8],
            Self::Flat => [16, 16, 16, 1],
        }
    }

    /// Logarithms of [`Self::size`].
    pub const fn log2_size(self) -> [u32; 4] {
        match self {
            Self::Cube => [3, 3, 3, 3],
            Self::Flat => [4, 4, 4, 0],
        }
    }

    /// The linear index of a block: x fastest, w slowest.
    pub const fn index(self, at: [usize; 4]) -> usize {
        let log2 = self.log2_size();
        at[0] | (at[1] << log2[0]) | (at[2] << (log2[0] + log2[1])) | (at[3] << (log2[0] + log2[1] + log2[2]))
    }

    /// Where the block of a linear index is.
    pub const fn at(self, index: usize) -> [usize; 4] {
        let [nx, ny, nz, _] = self.size();
        [index % nx, index / nx % ny, index / (nx * ny) % nz, index / (nx * ny * nz)]
    }
}

/// The lattice of blocks and of chunks of one scale and shape. Both are anchored at the origin.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
pub struct Lattice {
    /// Size of the blocks.
    pub scale: Scale,
    /// Shape of the chunks.
    pub shape: ChunkShape,
}

impl Lattice {
    /// Chunks of 8 x 8 x 8 x 8 blocks.
    pub const fn cube(scale: Scale) -> Self {
        Self { scale, shape: ChunkShape::Cube }
    }

    /// Chunks of 16 x 16 x 16 x 1 blocks in `0 <= w < 1`.
    pub const fn flat(scale: Scale) -> Self {
        Self { scale, shape: ChunkShape::Flat }
    }

    /// By axis, the logarithm of a block's extent in steps of 1/65,536.
    pub(crate) const fn block_log2(self) -> [u32; 4] {
        let s = self.scale.log2_raw();
        match self.shape {
            ChunkShape::Cube => [s; 4],
            ChunkShape::Flat => [s, s, s, Fixed::FRACTION_BITS],
        }
    }

    /// By axis, the logarithm of a chunk's extent in steps of 1/65,536.
    pub(crate) const fn chunk_log2(self) -> [u32; 4] {
        let (block, size) = (self.block_log2(), self.shape.log2_size());
        [block[0] + size[0], block[1] + size[1], block[2] + size[2], block[3] + size[3]]
    }

    /// The extent of a block along each axis.
    pub fn block_extent(self) -> [Fixed; 4] {
        self.block_log2().map(|log2| Fixed::from_raw(1 << log2))
    }

    /// The extent of a chunk along each axis.
    pub fn chunk_extent(self) -> [Fixed; 4] {
        self.chunk_log2().map(|log2| Fixed::from_raw(1 << log2))
    }

    /// The smallest box of whole blocks about a box.
    pub fn blocks_about(self, bounds: &Aabb4) -> Aabb4 {
        bounds.snapped_out(self.block_log2())
    }

    /// The smallest box of whole chunks about a box.
    pub fn chunks_about(self, bounds: &Aabb4) -> Aabb4 {
        bounds.snapped_out(self.chunk_log2())
    }

    /// Whether the box is made of whole blocks.
    pub fn has_block_corners(self, bounds: &Aabb4) -> bool {
        bounds.is_aligned(self.block_log2())
    }

    /// Whether the box is made of whole chunks.
    pub fn has_chunk_corners(self, bounds: &Aabb4) -> bool {
        bounds.is_aligned(self.chunk_log2())
    }

    /// Whether chunks of this lattice may lie about the box: flat ones only in `0 <= w < 1`.
    pub fn admits(self, bounds: &Aabb4) -> bool {
        self.shape == ChunkShape::Cube || (bounds.min_raw()[3] >= 0 && bounds.max_raw()[3] <= Fixed::ONE.raw())
    }

    /// Whether every block of `other` is made of whole blocks of this lattice.
    pub fn refines(self, other: Self) -> bool {
        let (fine, coarse) = (self.block_log2(), other.block_log2());
        (0..4).all(|a| fine[a] <= coarse[a])
    }

    /// The chunk that holds a point, given in steps of 1/65,536.
    pub(crate) fn chunk_at(self, raw: [i64; 4]) -> Aabb4 {
        let log2 = self.chunk_log2();
        let min = std::array::from_fn(|a| raw[a] >> log2[a] << log2[a]);
        Aabb4::from_raw_unchecked(min, std::array::from_fn(|a| min[a] + (1 << log2[a])))
    }

    /// The linear index, in its chunk, of the block that holds a point, given in steps of 1/65,536.
    pub(crate) fn block_index(self, raw: [i64; 4]) -> usize {
        let (block, size) = (self.block_log2(), self.shape.size());
        self.shape.index(std::array::from_fn(|a| (raw[a] >> block[a]) as usize & (size[a] - 1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_linear_index_runs_x_fastest_and_w_slowest() {
        assert_eq!(ChunkShape::Cube.index([1, 0, 0, 0]), 1);
        assert_eq!(ChunkShape::Cube.index([0, 0, 0, 1]), 512);
        assert_eq!(ChunkShape::Flat.index([0, 0, 1, 0]), 256);
        for shape in [ChunkShape::Cube, ChunkShape::Flat] {
            assert!((0..CHUNK_BLOCKS).all(|i| shape.index(shape.at(i)) == i));
        }
    }

    #[test]
    fn a_flat_chunk_spans_one_unit_of_w_at_every_scale() {
        for scale in -16..=15 {
            let lattice = Lattice::flat(Scale::new(scale).unwrap());
            assert_eq!(lattice.chunk_extent()[3], Fixed::ONE);
            assert_eq!(lattice.block_extent()[3], Fixed::ONE);
            assert_eq!(lattice.chunk_extent()[0].raw(), 16 * lattice.block_extent()[0].raw());
        }
    }

    #[test]
    fn scales_beyond_the_range_are_refused() {
        assert_eq!(Scale::new(-17), Err(ScaleError(-17)));
        assert_eq!(Scale::new(16), Err(ScaleError(16)));
        assert!(serde_json::from_str::<Scale>("16").is_err());
        assert_eq!(Scale::MIN.edge(), Fixed::STEP);
        assert_eq!(Scale::MAX.edge(), Fixed::from_int(32_768));
    }

    #[test]
    fn blocks_left_of_the_origin_belong_to_the_chunk_left_of_it() {
        let lattice = Lattice::cube(Scale::UNIT);
        let chunk = lattice.chunk_at([-1, 0, 0, 0]);
        assert_eq!(chunk.min_raw()[0], -8 * Fixed::ONE.raw());
        assert_eq!(lattice.block_index([-1, 0, 0, 0]), 7);
    }
}
