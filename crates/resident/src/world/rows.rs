//! Rows of a resident world. `repr(C)`, without padding, the same offsets in the shaders.

use bytemuck::{Pod, Zeroable};

/// "No payload": the chunk is of one block.
pub const NO_PAYLOAD: u32 = u32::MAX;

/// What a child of a node, or the root, leads to, in 32 bits: a node's slot; a leaf's slot with the highest bit set; or all
/// ones, nothing.
#[repr(transparent)]
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Pod, Zeroable)]
pub struct Root(pub u32);

impl Root {
    /// Nothing: an empty world, the missing second child of a tree with one leaf.
    pub const EMPTY: Self = Self(u32::MAX);
    /// The bit that tells a leaf from a node.
    pub const LEAF_BIT: u32 = 1 << 31;

    /// A node.
    pub const fn node(slot: u32) -> Self {
        Self(slot)
    }

    /// A leaf.
    pub const fn leaf(slot: u32) -> Self {
        Self(slot | Self::LEAF_BIT)
    }

    /// The node's slot; `None` for a leaf and for nothing.
    pub const fn as_node(self) -> Option<u32> {
        if self.0 & Self::LEAF_BIT == 0 { Some(self.0) } else { None }
    }

    /// The leaf's slot; `None` for a node and for nothing.
    pub const fn as_leaf(self) -> Option<u32> {
        if self.0 & Self::LEAF_BIT != 0 && self.0 != u32::MAX { Some(self.0 & !Self::LEAF_BIT) } else { None }
    }
}

impl Default for Root {
    fn default() -> Self {
        Self::EMPTY
    }
}

/// A node of the root BVH: two children with their bounds. A tree of `n > 1` leaves has `n - 1` nodes; a tree of one leaf may
/// be that leaf as the root, or a node whose second child is [`Root::EMPTY`].
///
/// No leaf has more than 64 nodes above it.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
pub struct WorldNode {
    /// `[child][0: lower, 1: upper corner][axis]`, in units relative to the set's origin, rounded outwards. An empty child has
    /// a lower corner above the upper one.
    pub bounds: [[[f32; 4]; 2]; 2],
    /// What the children are, see [`Root`].
    pub children: [Root; 2],
    /// Zero.
    pub reserved: [u32; 2],
}

/// Kinds of leaves: the low 8 bits of [`LeafRow::kind`].
pub mod kind {
    /// A box of one block, without payload.
    pub const UNIFORM: u32 = 1;
    /// A part of an array of one chunk. (A world keeps chunks one by one, so that an edit touches one and leaves stay disjoint;
    /// the index table of the array is thus one entry: [`LeafRow::payload`](super::LeafRow::payload) and
    /// [`LeafRow::block`](super::LeafRow::block).)
    pub const CHUNK_ARRAY: u32 = 2;
    /// Tetrahedra of a moving body. The place is kept; no planner makes them yet, and a backend refuses them.
    pub const TETRA: u32 = 3;
}

/// A leaf. Leaves of a set share no point.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Eq, Debug, Pod, Zeroable)]
pub struct LeafRow {
    /// Lower corner, raw, exact. Of a chunk array: the tight box of what is solid within its part of the chunk. It lies in
    /// one cell of the chunk's lattice, and what the chunk holds outside of it does not count.
    pub min: [i64; 4],
    /// Upper corner, raw, exact.
    pub max: [i64; 4],
    /// [`kind`], `| shape << 8` (0: 8x8x8x8, 1: 16x16x16x1), `| log2 << 16`: the logarithm of the edge of a block of the lattice
    /// in raw steps, 0..=31. Shape and `log2` are of chunk arrays.
    pub kind: u32,
    /// The block ([`block`]), of a uniform leaf or of a chunk that is of one block.
    pub block: u32,
    /// The first word of the dense chunk in the payload arena, see [`super::payload`]; [`NO_PAYLOAD`] for one block.
    pub payload: u32,
    /// Coarse occupancy: the chunk is cut in halves along every axis of more than one block; bit `x + 2 y + 4 z + 8 w` says that
    /// something in that part is not air.
    pub coarse: u32,
}

impl LeafRow {
    /// A box of one block.
    pub const fn uniform(min: [i64; 4], max: [i64; 4], block: u32) -> Self {
        Self { min, max, kind: kind::UNIFORM, block, payload: NO_PAYLOAD, coarse: 0xffff }
    }

    /// One of [`kind`].
    pub const fn kind(&self) -> u32 {
        self.kind & 0xff
    }

    /// Whether chunks are 16x16x16x1.
    pub const fn is_flat(&self) -> bool {
        self.kind >> 8 & 0xff == 1
    }

    /// Logarithms of the edges of a block in raw steps. A flat chunk spans `0 <= w < 1` at every scale.
    pub const fn block_log2(&self) -> [u32; 4] {
        let log2 = self.kind >> 16 & 0xff;
        if self.is_flat() { [log2, log2, log2, 16] } else { [log2; 4] }
    }

    /// Logarithms of the blocks along the axes of a chunk.
    pub const fn size_log2(&self) -> [u32; 4] {
        if self.is_flat() { [4, 4, 4, 0] } else { [3; 4] }
    }

    /// Lower corner of the chunk, raw.
    pub fn chunk_min(&self) -> [i64; 4] {
        let (block, size) = (self.block_log2(), self.size_log2());
        std::array::from_fn(|a| self.min[a] >> (block[a] + size[a]) << (block[a] + size[a]))
    }
}

/// The 32 bits of a block: the material's number in the low 16 (0 is air), then 8 of orientation, then 8 of scale.
pub mod block {
    /// Row of the palette.
    pub const fn id(bits: u32) -> u32 {
        bits & 0xffff
    }

    /// Code of the orientation, 0..192: `8 * permutation + signs`, the permutation in lexicographic order, a sign bit for each of
    /// the images of x, y and z; the sign of the image of w makes the determinant 1.
    pub const fn orientation(bits: u32) -> u32 {
        bits >> 16 & 0xff
    }

    /// The logarithm of the block's own edge in raw steps, 0..=31: its scale plus 16.
    pub const fn edge_log2(bits: u32) -> u32 {
        ((bits >> 24) as u8 as i8 as i32 + 16) as u32
    }
}

/// Bits of [`BlockRow::flags`].
pub mod flags {
    /// The palette has this number. What has it not is drawn in [`super::UNKNOWN_COLOR`].
    pub const KNOWN: u32 = 1;
    /// Light passes, see [`super::BlockRow::absorption`].
    pub const TRANSPARENT: u32 = 2;
}

/// Albedo of blocks whose number the palette does not have.
pub const UNKNOWN_COLOR: [f32; 3] = [1.0, 0.0, 1.0];

/// What varies over a block: [`BlockRow::pattern`]. Coordinates run from 0 to 1 over the block at its own scale, turned by its
/// orientation; on a face the three that remain are in use, in the material's order of axes.
pub mod pattern {
    /// One colour.
    pub const NONE: u32 = 0;
    /// Cells of two brightnesses.
    pub const CHECKER: u32 = 1;
    /// Hashed value noise.
    pub const NOISE: u32 = 2;
    /// Darker lines along the edges.
    pub const EDGES: u32 = 3;
    /// A texture in three dimensions, in the payload arena.
    pub const TEXTURE: u32 = 4;
}

/// A material of blocks; its slot is the number that blocks call it by. Colours are linear Rec. 709.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
pub struct BlockRow {
    /// Albedo.
    pub color: [f32; 3],
    /// [`flags`].
    pub flags: u32,
    /// Emitted radiance.
    pub emission: [f32; 3],
    /// Weight of a hit in the `integral` mode, relative to the sky's 1.
    pub weight: f32,
    /// Absorption coefficients per unit (Beer's law).
    pub absorption: [f32; 3],
    /// As in glTF.
    pub roughness: f32,
    /// As in glTF.
    pub metallic: f32,
    /// [`pattern`].
    pub pattern: u32,
    /// Cells along an edge ([`pattern::CHECKER`], [`pattern::NOISE`]); first word of the texels in the payload arena
    /// ([`pattern::TEXTURE`]): sRGB, red in the low byte, the first axis fastest.
    pub cells: u32,
    /// The darkest factor.
    pub contrast: f32,
    /// Width of the lines as a fraction of the edge.
    pub width: f32,
    /// Texels along the three axes, each less one in 8 bits, the first in the lowest.
    pub texture_size: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

const _: () = assert!(size_of::<WorldNode>() == 80 && size_of::<LeafRow>() == 80 && size_of::<BlockRow>() == 80);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chunk_is_found_from_any_part_of_it() {
        let leaf = LeafRow {
            kind: kind::CHUNK_ARRAY | 13 << 16,
            ..LeafRow::uniform([-5 << 13, 9 << 13, 3 << 13, -8 << 13], [-4 << 13, 10 << 13, 4 << 13, -7 << 13], 0)
        };
        assert_eq!(leaf.chunk_min(), [-8 << 13, 8 << 13, 0, -8 << 13]);
        let flat = LeafRow { kind: kind::CHUNK_ARRAY | 1 << 8 | 13 << 16, ..leaf };
        assert_eq!(flat.chunk_min(), [-16 << 13, 0, 0, -1 << 16]);
    }

    #[test]
    fn roots_lead_to_nodes_leaves_or_nothing() {
        assert_eq!((Root::node(7).as_node(), Root::node(7).as_leaf()), (Some(7), None));
        assert_eq!((Root::leaf(7).as_node(), Root::leaf(7).as_leaf()), (None, Some(7)));
        assert_eq!((Root::EMPTY.as_node(), Root::EMPTY.as_leaf()), (None, None));
    }

    #[test]
    fn the_scale_of_a_block_is_signed() {
        assert_eq!(block::edge_log2(0xfd00_0005), 13);
        assert_eq!(block::edge_log2(0x0f00_0005), 31);
    }
}
