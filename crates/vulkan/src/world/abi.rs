//! What crosses between the host and the shaders of worlds, besides the rows of [`orthant_resident::world`]: every struct
//! has a twin of the same name and layout in `shaders/world/tables.slang`. A test compares the offsets with the compiled modules
//! by reflection.

use crate::abi::Address;
use bytemuck::{Pod, Zeroable};
use orthant_resident::world::Root;

/// Where a set of arenas lies, and where its rays begin. It is passed by value, with the push constants or the table of a
/// frame: a frame that is handed in after a batch or a swap has the new one, those before it keep theirs.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct WorldTable {
    /// Of [`orthant_resident::world::WorldNode`]s; 0 where there are none.
    pub nodes: Address,
    /// Of [`orthant_resident::world::LeafRow`]s.
    pub leaves: Address,
    /// Of the words of dense chunks and textures.
    pub payload: Address,
    /// Of [`orthant_resident::world::BlockRow`]s by block number.
    pub palette: Address,
    /// What node bounds are relative to, raw.
    pub origin: [i64; 4],
    /// Where rays begin.
    pub root: Root,
    /// Lengths of the arenas.
    pub node_count: u32,
    /// See `node_count`.
    pub leaf_count: u32,
    /// In words.
    pub payload_count: u32,
    /// Blocks with numbers from here on are unknown.
    pub palette_count: u32,
    /// Zero.
    pub reserved: u32,
}

/// Push constants of the pass that writes a list of rows and words into the arenas of a set.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ScatterPush {
    /// The arenas.
    pub world: WorldTable,
    /// Of the list, a multiple of 16: rows (of nodes, then leaves, then the palette), the slot of each row, a [`WordSpan`] for
    /// each stretch of payload, the words of these.
    pub list: Address,
    /// Nodes in the list.
    pub node_rows: u32,
    /// Leaves.
    pub leaf_rows: u32,
    /// Rows of the palette.
    pub palette_rows: u32,
    /// Stretches of payload.
    pub span_count: u32,
    /// Their words.
    pub word_count: u32,
    /// Zero.
    pub reserved: u32,
}

/// A stretch of payload.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct WordSpan {
    /// Where it goes: its first word in the arena.
    pub first: u32,
    /// Words of the list before it.
    pub before: u32,
}
