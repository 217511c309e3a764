//! What a set consists of, counted.

use super::DerivedWorld;
use orthant_resident::world::payload::ALIGN;

/// How an arena is used, in rows (of the payload: words).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArenaUse {
    /// Rows that something leads to.
    pub live: u64,
    /// Rows on the free list.
    pub free: u64,
    /// Rows of the arena: the most that were ever in use at once, as far as holes allowed.
    pub len: u64,
    /// Free spans that do not touch; of arenas of single rows the free rows.
    pub holes: u64,
}

/// Counts of a set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldSetStats {
    /// Leaves of one block, without a chunk.
    pub uniform_leaves: u64,
    /// Chunk leaves.
    pub chunk_leaves: u64,
    /// Dense chunks in the payload arena.
    pub dense_chunks: u64,
    /// Leaves that need no payload of their own because another leaf has an equal chunk.
    pub shared_chunks: u64,
    /// Nodes of the root BVH.
    pub nodes: ArenaUse,
    /// Leaves.
    pub leaves: ArenaUse,
    /// Words of payload.
    pub payload: ArenaUse,
    /// Rows of the palette.
    pub palette_rows: u64,
    /// The most nodes above any leaf.
    pub depth: u32,
}

impl DerivedWorld {
    /// Counts, at a cost by the dense chunks.
    pub fn stats(&self) -> WorldSetStats {
        let chunks = self.leaves.chunk_count() as u64;
        let lens = self.head.lens;
        let single = |live: u64, len: u32| {
            let free = u64::from(len) - live;
            ArenaUse { live, free, len: u64::from(len), holes: free }
        };
        let spans = self.payloads.spans();
        let used = u64::from(spans.used()) * u64::from(ALIGN);
        WorldSetStats {
            uniform_leaves: self.leaves.len() as u64 - chunks,
            chunk_leaves: chunks,
            dense_chunks: self.payloads.chunk_count() as u64,
            shared_chunks: self.payloads.shared(),
            nodes: single(self.tree.node_count() as u64, lens.nodes),
            leaves: single(self.leaves.len() as u64, lens.leaves),
            payload: ArenaUse {
                live: used,
                free: u64::from(lens.payload) - used,
                len: u64::from(lens.payload),
                holes: spans.free_spans().count() as u64,
            },
            palette_rows: u64::from(lens.palette),
            depth: self.depth(),
        }
    }
}
