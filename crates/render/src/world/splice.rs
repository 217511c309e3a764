//! Splicing: leaves go and come, and what that writes becomes a batch.

use super::leaves::{Draft, LeafRecord};
use super::payload::{PayloadEdit, encode};
use super::plan::PlanCounts;
use super::{DerivedWorld, WorldError, full, space};
use orthant_bvh::{Child, Node};
use orthant_resident::world::rows::{NO_PAYLOAD, Root, WorldNode};
use orthant_resident::world::{MutationBatch, PayloadWrite};
use orthant_world::Lattice;
use rustc_hash::FxHashMap;

/// The row of a node.
pub(super) fn node_row(node: &Node<f32, 4>) -> WorldNode {
    let bounds = |slot: usize| {
        if node.child[slot] == Child::EMPTY {
            // Finite, so that no arithmetic on it makes a NaN.
            [[f32::MAX; 4], [f32::MIN; 4]]
        } else {
            [node.bounds[slot].min, node.bounds[slot].max]
        }
    };
    WorldNode { bounds: [bounds(0), bounds(1)], children: node.child.map(|child| Root(child.0)), reserved: [0; 2] }
}

/// The cell of a chunk, by which a leaf that changes is told from one that goes and another that comes.
fn cell(lattice: Lattice, min: [i64; 4]) -> (Lattice, [i64; 4]) {
    let extent = lattice.chunk_extent();
    (lattice, std::array::from_fn(|a| min[a] & !(extent[a].raw() - 1)))
}

impl DerivedWorld {
    /// Takes leaves out and puts others in. A chunk leaf whose cell gets another one keeps its slot.
    ///
    /// # Errors
    /// [`WorldError::ArenaFull`]; nothing is changed then.
    pub(super) fn splice(
        &mut self,
        stale: &[u32],
        wanted: Vec<Draft>,
        counts: &mut PlanCounts,
    ) -> Result<MutationBatch, WorldError> {
        self.check_room(&wanted)?;
        let mut batch = self.begin_batch();
        let mut edit = PayloadEdit::default();

        // Wanted chunks first, so that one that was there already keeps its place.
        let mut records: Vec<LeafRecord> = wanted
            .into_iter()
            .map(|draft| {
                let entry = draft.dense_blocks().map(|dense| self.payloads.acquire(dense, &mut edit));
                LeafRecord { row: draft.row, part: draft.part, entry }
            })
            .collect();
        for &slot in stale {
            if let Some(entry) = self.leaves.get(slot).and_then(|record| record.entry) {
                self.payloads.release(entry, &mut edit);
            }
        }
        for (first, dense) in self.payloads.place(&mut edit) {
            counts.chunks_written += 1;
            batch.payload_writes.push(PayloadWrite { first, words: encode(&dense) });
        }
        batch.payload_writes.sort_unstable_by_key(|write| write.first);
        for record in &mut records {
            record.row.payload = record.entry.and_then(|id| self.payloads.first_word(id)).unwrap_or(NO_PAYLOAD);
        }

        let kept = self.keep_slots(stale, &mut records, counts, &mut batch);
        for &slot in stale.iter().filter(|slot| !kept.contains_key(slot)) {
            self.tree.remove(slot).expect("every leaf is in the tree");
            self.leaves.remove(slot);
            batch.freed_leaves.push(slot);
            counts.leaves_removed += 1;
        }
        let mut items = Vec::with_capacity(records.len());
        for record in records {
            let (row, bounds) = (record.row, space::outward(&record.bounds(), self.origin));
            let slot = self.leaves.insert(record);
            items.push((slot, bounds));
            batch.leaf_writes.push((slot, row));
            counts.leaves_added += 1;
        }
        self.tree.insert_many(&items).expect("new slots and boxes of the space");
        batch.leaf_writes.sort_unstable_by_key(|(slot, _)| *slot);
        batch.freed_leaves.sort_unstable();
        batch.freed_leaves.retain(|slot| self.leaves.get(*slot).is_none());
        self.finish_batch(&mut batch, edit);
        counts.node_writes = batch.node_writes.len();
        Ok(batch)
    }

    /// Leaves whose chunk is changed in place, with the records taken out of `records`.
    fn keep_slots(
        &mut self,
        stale: &[u32],
        records: &mut Vec<LeafRecord>,
        counts: &mut PlanCounts,
        batch: &mut MutationBatch,
    ) -> FxHashMap<u32, ()> {
        let mut kept = FxHashMap::default();
        let mut by_cell: FxHashMap<(Lattice, [i64; 4]), u32> = FxHashMap::default();
        for &slot in stale {
            if let Some(part) = self.leaves.get(slot).and_then(|record| record.part.as_ref()) {
                by_cell.entry(cell(part.lattice, part.bounds.min_raw())).or_insert(slot);
            }
        }
        if by_cell.is_empty() {
            return kept;
        }
        let mut left = Vec::with_capacity(records.len());
        for record in records.drain(..) {
            let same = record.part.as_ref().map(|part| cell(part.lattice, part.bounds.min_raw()));
            let Some(slot) = same.and_then(|cell| by_cell.remove(&cell)) else {
                left.push(record);
                continue;
            };
            kept.insert(slot, ());
            let (row, bounds) = (record.row, space::outward(&record.bounds(), self.origin));
            let before = self.leaves.replace(slot, record);
            self.tree.move_leaf(slot, bounds).expect("the leaf is in the tree, its box is of the space");
            if before.is_none_or(|before| before.row != row) {
                batch.leaf_writes.push((slot, row));
            }
            counts.leaves_changed += 1;
        }
        *records = left;
        kept
    }

    /// Whether all arenas would hold the wanted leaves, by bounds that no outcome exceeds.
    fn check_room(&self, wanted: &[Draft]) -> Result<(), WorldError> {
        let more = wanted.len() as u64;
        full("leaves", u64::from(self.leaves.end()) + more, self.max.leaves)?;
        full("nodes", self.tree.nodes().len() as u64 + more, self.max.nodes)?;
        let units = wanted.iter().filter_map(Draft::dense_blocks).map(|dense| self.payloads.units_if_new(dense)).sum();
        self.payloads.check_room(units, self.max.payload)
    }

    /// Adds node writes, frees and lengths, and sets the root and the revision if the batch has anything in it.
    pub(super) fn finish_batch(&mut self, batch: &mut MutationBatch, edit: PayloadEdit) {
        let mut writes = std::mem::take(&mut self.writes);
        self.tree.take_writes_into(&mut writes);
        writes.written.sort_unstable();
        writes.freed.sort_unstable();
        let nodes = self.tree.nodes();
        batch.node_writes = writes.written.iter().map(|id| (id.0, node_row(&nodes[id.index()]))).collect();
        batch.freed_nodes = writes.freed.iter().map(|id| id.0).collect();
        batch.new_root = writes.new_root.map_or(Root::EMPTY, |id| Root::node(id.0));
        self.writes = writes;

        batch.freed_payload_spans = edit.freed_words();
        let lens = &mut batch.lens;
        lens.nodes = lens.nodes.max(nodes.len() as u32);
        lens.leaves = lens.leaves.max(self.leaves.end());
        lens.payload = lens.payload.max(self.payloads.end_words());
        if batch.is_empty() {
            return;
        }
        batch.new_revision = batch.expected_revision + 1;
        self.head = super::Head { root: batch.new_root, revision: batch.new_revision, lens: batch.lens };
    }
}
