//! [`MutationBatch`]: the writes and frees that bring a set of world arenas up to date.

use super::rows::{BlockRow, LeafRow, Root, WorldNode};
use std::ops::Range;
use std::sync::Arc;

/// Lengths of the arenas of a set, in rows (of the payload: words).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArenaLens {
    /// Nodes.
    pub nodes: u32,
    /// Leaves.
    pub leaves: u32,
    /// Words of payload.
    pub payload: u32,
    /// Rows of the palette.
    pub palette: u32,
}

/// Words to write to the payload arena.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PayloadWrite {
    /// The first word.
    pub first: u32,
    /// What to write.
    pub words: Arc<[u32]>,
}

/// The writes that bring a set from one revision to another. Complete and explicit: a backend needs nothing else, and asks
/// nobody. Slots in each list are distinct and ascending. Rows past the old length of an arena are zero until they are written.
///
/// What is freed keeps its bytes; nothing that is live leads there. It is named so that whoever follows can count and check.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MutationBatch {
    /// The root that the set has.
    pub expected_root: Root,
    /// The root that it gets, together with the writes.
    pub new_root: Root,
    /// The revision that the set has.
    pub expected_revision: u64,
    /// The revision that it gets.
    pub new_revision: u64,
    /// Lengths of the arenas afterwards; they never shrink.
    pub lens: ArenaLens,
    /// Nodes.
    pub node_writes: Vec<(u32, WorldNode)>,
    /// Leaves.
    pub leaf_writes: Vec<(u32, LeafRow)>,
    /// Payload, spans that do not overlap.
    pub payload_writes: Vec<PayloadWrite>,
    /// Materials.
    pub palette_writes: Vec<(u32, BlockRow)>,
    /// Nodes that are no longer part of the tree.
    pub freed_nodes: Vec<u32>,
    /// Leaves that are gone.
    pub freed_leaves: Vec<u32>,
    /// Spans of payload that nothing leads to any more, in words.
    pub freed_payload_spans: Vec<Range<u32>>,
}

impl MutationBatch {
    /// Bytes of all rows and words that are written, without what says where to.
    pub fn upload_bytes(&self) -> u64 {
        let words: usize = self.payload_writes.iter().map(|write| write.words.len()).sum();
        let rows = self.node_writes.len() * size_of::<WorldNode>()
            + self.leaf_writes.len() * size_of::<LeafRow>()
            + self.palette_writes.len() * size_of::<BlockRow>();
        (rows + words * 4) as u64
    }

    /// Whether nothing is written or freed.
    pub fn is_empty(&self) -> bool {
        self.upload_bytes() == 0
            && self.freed_nodes.is_empty()
            && self.freed_leaves.is_empty()
            && self.freed_payload_spans.is_empty()
            && self.expected_root == self.new_root
    }
}
