//! Filling an empty set of a backend with a derived world.

use super::DerivedWorld;
use orthant_resident::world::payload::ALIGN;
use orthant_resident::world::{ArenaLens, MutationBatch, PayloadWrite, Root, SetSlot, WorldApplied};
use orthant_resident::{Backend, BackendError};
use std::ops::Range;

/// Bytes of rows in a batch of [`load`].
pub const LOAD_BATCH_BYTES: u64 = 64 << 20;

impl DerivedWorld {
    /// Batches that bring an empty set to what the mirror is, over everything that is live. Up to the last one the set has neither
    /// root nor revision: nothing leads to what is not there yet. All lengths come with the first.
    ///
    /// A batch has at most `max_bytes` of rows and words, though at least one row. Payload is cut at multiples of [`ALIGN`] words.
    pub fn load_batches(&self, max_bytes: u64) -> LoadBatches<'_> {
        LoadBatches { derived: self, max_bytes, at: Some(Cursor::default()), live_payload: self.payloads.live() }
    }
}

/// How far loading has come.
#[derive(Clone, Copy, Debug, Default)]
struct Cursor {
    nodes: u32,
    leaves: u32,
    palette: u32,
    /// The span of live payload, and the word in it.
    span: usize,
    word: u32,
}

/// See [`DerivedWorld::load_batches`].
#[derive(Clone, Debug)]
pub struct LoadBatches<'a> {
    derived: &'a DerivedWorld,
    max_bytes: u64,
    /// `None` when all was given.
    at: Option<Cursor>,
    live_payload: Vec<Range<u32>>,
}

impl Iterator for LoadBatches<'_> {
    type Item = MutationBatch;

    fn next(&mut self) -> Option<MutationBatch> {
        let mut at = self.at?;
        let derived = self.derived;
        let mirror = &derived.mirror;
        let lens = mirror.lens();
        let mut batch = MutationBatch { lens, new_root: Root::EMPTY, ..MutationBatch::default() };
        let row = 80;
        let mut left = self.max_bytes.max(row);
        // Takes the rows from `next` on that are live, as long as there is room.
        let mut take = |next: &mut u32, end: u32, is_live: &dyn Fn(u32) -> bool, write: &mut dyn FnMut(u32)| {
            while *next < end && left >= row {
                if is_live(*next) {
                    write(*next);
                    left -= row;
                }
                *next += 1;
            }
            *next == end
        };
        let nodes = derived.tree.nodes();
        let mut done = take(
            &mut at.nodes,
            lens.nodes,
            &|slot| nodes.get(slot as usize).is_some_and(|node| node.child[0] != orthant_bvh::Child::EMPTY),
            &mut |slot| batch.node_writes.push((slot, mirror.nodes[slot as usize])),
        );
        done &= take(&mut at.leaves, lens.leaves, &|slot| derived.leaves.get(slot).is_some(), &mut |slot| {
            batch.leaf_writes.push((slot, mirror.leaves[slot as usize]))
        });
        done &= take(&mut at.palette, lens.palette, &|_| true, &mut |slot| {
            batch.palette_writes.push((slot, mirror.palette[slot as usize]));
        });
        while let Some(span) = self.live_payload.get(at.span) {
            let first = span.start.max(at.word);
            let room = left / 4 / u64::from(ALIGN) * u64::from(ALIGN);
            let count = u64::from(span.end - first).min(room) as u32;
            if count == 0 {
                done = false;
                break;
            }
            let words = mirror.payload[first as usize..(first + count) as usize].into();
            batch.payload_writes.push(PayloadWrite { first, words });
            left -= u64::from(count) * 4;
            at.word = first + count;
            at.span += usize::from(at.word == span.end);
        }
        self.at = (!done).then_some(at);
        if done {
            batch.new_root = mirror.root;
            batch.new_revision = mirror.revision;
        }
        Some(batch)
    }
}

/// Makes a backend show a derived world: fills its staging set and swaps it in. What was committed counts.
///
/// # Errors
/// Of the backend. The active set is then the one that it was, and no staging set is left.
pub fn load(backend: &mut dyn Backend, derived: &DerivedWorld) -> Result<WorldApplied, BackendError> {
    let mirror = derived.mirror();
    let filled = fill(backend, derived, mirror.lens());
    if filled.is_err() {
        backend.drop_staging();
    }
    filled
}

fn fill(backend: &mut dyn Backend, derived: &DerivedWorld, lens: ArenaLens) -> Result<WorldApplied, BackendError> {
    backend.begin_staging(derived.origin(), lens)?;
    let mut bytes = 0;
    for batch in derived.load_batches(LOAD_BATCH_BYTES) {
        bytes += backend.apply_world(SetSlot::Staging, &batch)?.bytes;
    }
    backend.swap_sets()?;
    Ok(WorldApplied { bytes })
}
