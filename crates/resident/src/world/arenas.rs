//! [`WorldArenas`]: a set of arenas in memory.

use super::batch::{ArenaLens, MutationBatch};
use super::rows::{BlockRow, LeafRow, Root, WorldNode, kind};
use super::{WorldApplied, WorldBytes};

/// A set of arenas in memory: what the CPU backend traces, and what a planner believes a device to have.
#[derive(Clone, Debug, Default)]
pub struct WorldArenas {
    /// What node bounds are relative to, raw.
    pub origin: [i64; 4],
    /// Where rays begin.
    pub root: Root,
    /// How many batches have led here, by their own count.
    pub revision: u64,
    /// Nodes of the root BVH.
    pub nodes: Vec<WorldNode>,
    /// Leaves.
    pub leaves: Vec<LeafRow>,
    /// Dense chunks and textures.
    pub payload: Vec<u32>,
    /// Materials by block number.
    pub palette: Vec<BlockRow>,
}

/// Why a batch was refused. The set is then unchanged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BatchRefused {
    /// The set is at another revision.
    #[error("the batch starts at revision {expected}, but the set is at {resident}; apply the batches in order")]
    StaleRevision {
        /// What the batch expects.
        expected: u64,
        /// What the set has.
        resident: u64,
    },
    /// The set has another root.
    #[error("the batch starts at root {expected:?}, but the set has {resident:?}; apply the batches in order")]
    StaleRoot {
        /// What the batch expects.
        expected: Root,
        /// What the set has.
        resident: Root,
    },
    /// The batch contradicts itself or leads outside of its arenas.
    #[error("the batch is invalid: {0}")]
    Invalid(String),
}

impl WorldArenas {
    /// An empty set about an origin.
    pub fn new(origin: [i64; 4]) -> Self {
        Self { origin, ..Self::default() }
    }

    /// Lengths of the arenas.
    pub fn lens(&self) -> ArenaLens {
        ArenaLens {
            nodes: self.nodes.len() as u32,
            leaves: self.leaves.len() as u32,
            payload: self.payload.len() as u32,
            palette: self.palette.len() as u32,
        }
    }

    /// Bytes of the arenas.
    pub fn bytes(&self) -> WorldBytes {
        WorldBytes {
            nodes: size_of_val(self.nodes.as_slice()) as u64,
            leaves: size_of_val(self.leaves.as_slice()) as u64,
            payload: size_of_val(self.payload.as_slice()) as u64,
            palette: size_of_val(self.palette.as_slice()) as u64,
        }
    }

    /// Checks a batch and carries it out.
    ///
    /// # Errors
    /// [`BatchRefused`]; nothing is changed then.
    pub fn apply(&mut self, batch: &MutationBatch) -> Result<WorldApplied, BatchRefused> {
        check_batch(batch, self.root, self.revision, self.lens())?;
        let lens = batch.lens;
        grow(&mut self.nodes, lens.nodes);
        grow(&mut self.leaves, lens.leaves);
        grow(&mut self.payload, lens.payload);
        grow(&mut self.palette, lens.palette);
        for &(slot, node) in &batch.node_writes {
            self.nodes[slot as usize] = node;
        }
        for &(slot, leaf) in &batch.leaf_writes {
            self.leaves[slot as usize] = leaf;
        }
        for write in &batch.payload_writes {
            let first = write.first as usize;
            self.payload[first..first + write.words.len()].copy_from_slice(&write.words);
        }
        for &(slot, row) in &batch.palette_writes {
            self.palette[slot as usize] = row;
        }
        self.root = batch.new_root;
        self.revision = batch.new_revision;
        Ok(WorldApplied { bytes: batch.upload_bytes() })
    }
}

/// Rows of room for edits in an arena that is made with so many: an eighth of them, and some.
pub const fn slack(rows: usize) -> usize {
    rows / 8 + 1024
}

/// Brings an arena to a length, with zeros. One that is empty gets memory that the system clears when it is first touched: the first
/// batch of a large set brings all lengths, and costs what it writes. There is room for [`slack`], so that the edits after it move nothing.
fn grow<T: Clone + bytemuck::Zeroable>(arena: &mut Vec<T>, len: u32) {
    if arena.is_empty() {
        *arena = bytemuck::allocation::zeroed_vec(len as usize + slack(len as usize));
        arena.truncate(len as usize);
    } else {
        arena.resize(len as usize, T::zeroed());
    }
}

/// Checks a batch against a set with this root, revision and these lengths, at a cost by the batch alone.
///
/// # Errors
/// [`BatchRefused`] for the first fault.
pub fn check_batch(batch: &MutationBatch, root: Root, revision: u64, now: ArenaLens) -> Result<(), BatchRefused> {
    if batch.expected_revision != revision {
        return Err(BatchRefused::StaleRevision { expected: batch.expected_revision, resident: revision });
    }
    if batch.expected_root != root {
        return Err(BatchRefused::StaleRoot { expected: batch.expected_root, resident: root });
    }
    let lens = batch.lens;
    for (what, old, new) in [
        ("nodes", now.nodes, lens.nodes),
        ("leaves", now.leaves, lens.leaves),
        ("payload", now.payload, lens.payload),
        ("palette", now.palette, lens.palette),
    ] {
        if new < old || new >= Root::LEAF_BIT {
            return invalid(format!("{what} go from {old} to {new} rows; they only grow, to below 2^31"));
        }
    }
    slots("node_writes", batch.node_writes.iter().map(|w| w.0), lens.nodes)?;
    slots("leaf_writes", batch.leaf_writes.iter().map(|w| w.0), lens.leaves)?;
    slots("palette_writes", batch.palette_writes.iter().map(|w| w.0), lens.palette)?;
    slots("freed_nodes", batch.freed_nodes.iter().copied(), lens.nodes)?;
    slots("freed_leaves", batch.freed_leaves.iter().copied(), lens.leaves)?;
    let written = batch.payload_writes.iter().map(|w| (u64::from(w.first), w.first as u64 + w.words.len() as u64));
    spans("payload_writes", written, lens.payload)?;
    let freed = batch.freed_payload_spans.iter().map(|s| (u64::from(s.start), u64::from(s.end)));
    spans("freed_payload_spans", freed, lens.payload)?;
    leads_within("new_root", batch.new_root, lens)?;
    for (slot, node) in &batch.node_writes {
        for child in node.children {
            leads_within(&format!("node {slot}"), child, lens)?;
        }
    }
    for (slot, leaf) in &batch.leaf_writes {
        check_leaf(*slot, leaf, lens)?;
    }
    Ok(())
}

fn check_leaf(slot: u32, leaf: &LeafRow, lens: ArenaLens) -> Result<(), BatchRefused> {
    if leaf.kind() != kind::UNIFORM && leaf.kind() != kind::CHUNK_ARRAY {
        return invalid(format!("leaf {slot} is of kind {}, which no backend traces", leaf.kind()));
    }
    if (0..4).any(|a| leaf.min[a] >= leaf.max[a]) {
        return invalid(format!("leaf {slot} is empty: from {:?} to {:?}", leaf.min, leaf.max));
    }
    if leaf.kind() == kind::CHUNK_ARRAY && leaf.payload != super::rows::NO_PAYLOAD && leaf.payload >= lens.payload {
        return invalid(format!("leaf {slot} has its payload at word {}, beyond {}", leaf.payload, lens.payload));
    }
    Ok(())
}

fn leads_within(what: &str, child: Root, lens: ArenaLens) -> Result<(), BatchRefused> {
    let beyond = child.as_node().is_some_and(|node| node >= lens.nodes)
        || child.as_leaf().is_some_and(|leaf| leaf >= lens.leaves);
    if beyond { invalid(format!("{what} leads to {child:?}, beyond the arenas")) } else { Ok(()) }
}

fn slots(what: &str, slots: impl Iterator<Item = u32>, len: u32) -> Result<(), BatchRefused> {
    spans(what, slots.map(|slot| (u64::from(slot), u64::from(slot) + 1)), len)
}

/// Half-open spans: ascending, disjoint, within `len`.
fn spans(what: &str, spans: impl Iterator<Item = (u64, u64)>, len: u32) -> Result<(), BatchRefused> {
    let mut end = 0;
    for (first, last) in spans {
        if first < end || last <= first || last > u64::from(len) {
            return invalid(format!("{what} {first}..{last} is empty, out of order, overlaps, or leaves 0..{len}"));
        }
        end = last;
    }
    Ok(())
}

fn invalid<T>(what: String) -> Result<T, BatchRefused> {
    Err(BatchRefused::Invalid(what))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_leaf() -> MutationBatch {
        MutationBatch {
            new_root: Root::leaf(0),
            new_revision: 1,
            lens: ArenaLens { leaves: 1, ..ArenaLens::default() },
            leaf_writes: vec![(0, LeafRow::uniform([0; 4], [1; 4], 1))],
            ..MutationBatch::default()
        }
    }

    #[test]
    fn a_batch_out_of_order_is_refused_and_changes_nothing() {
        let mut arenas = WorldArenas::new([0; 4]);
        arenas.apply(&one_leaf()).unwrap();
        let stale = arenas.apply(&one_leaf());
        assert_eq!(stale, Err(BatchRefused::StaleRevision { expected: 0, resident: 1 }));
        let other_root = MutationBatch { expected_revision: 1, new_revision: 2, ..one_leaf() };
        let refused = arenas.apply(&other_root);
        assert_eq!(refused, Err(BatchRefused::StaleRoot { expected: Root::EMPTY, resident: Root::leaf(0) }));
        assert_eq!((arenas.revision, arenas.root, arenas.leaves.len()), (1, Root::leaf(0), 1));
    }

    #[test]
    fn a_batch_that_leads_outside_is_refused() {
        type Fault = fn(&mut MutationBatch);
        let faults: [(&str, Fault); 6] = [
            ("root", |b| b.new_root = Root::leaf(1)),
            ("slot", |b| b.leaf_writes[0].0 = 1),
            ("empty", |b| b.leaf_writes[0].1.max = [0; 4]),
            ("kind", |b| b.leaf_writes[0].1.kind = kind::TETRA),
            ("twice", |b| b.freed_leaves = vec![0, 0]),
            ("payload", |b| b.freed_payload_spans.push(0..1)),
        ];
        for (what, fault) in faults {
            let mut batch = one_leaf();
            fault(&mut batch);
            let mut arenas = WorldArenas::new([0; 4]);
            assert!(matches!(arenas.apply(&batch), Err(BatchRefused::Invalid(_))), "{what}");
            assert_eq!(arenas.lens(), ArenaLens::default(), "{what}");
        }
    }
}
