//! Dense chunks in the payload arena: encoded, shared by all leaves that hold the same blocks, and placed in spans.

use super::{WorldError, full};
use orthant_resident::spans::SpanAllocator;
use orthant_resident::world::payload::{ALIGN, OCCUPANCY, PALETTE, words};
use orthant_world::{Block, Chunk};
use rustc_hash::FxHashMap;
use std::ops::Range;
use std::sync::Arc;

/// What is encoded densely. Equality and hash are those of the blocks.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Dense {
    /// A chunk that is not of one block.
    Chunk(Arc<Chunk>),
    /// 4,096 times one block.
    Filled(Block),
}

/// The words of a dense chunk, as [`orthant_resident::world::payload`] lays them out, with zeros up to a multiple of [`ALIGN`].
pub(super) fn encode(dense: &Dense) -> Arc<[u32]> {
    let (palette, bits, indices): (&[Block], u32, &[u64]) = match dense {
        Dense::Chunk(chunk) => (chunk.palette(), chunk.bits_per_block(), chunk.packed_indices()),
        Dense::Filled(block) => (std::slice::from_ref(block), 1, &[]),
    };
    let occupancy = match dense {
        Dense::Chunk(chunk) => chunk.occupancy(),
        Dense::Filled(_) => [u64::MAX; 64],
    };
    let mut encoded = vec![0_u32; words(palette.len(), bits).next_multiple_of(ALIGN as usize)];
    encoded[0] = bits | (palette.len() as u32) << 8;
    encoded[1] = occupancy.iter().map(|word| word.count_ones()).sum();
    let halves = |word: u64| [word as u32, (word >> 32) as u32];
    for (to, from) in encoded[OCCUPANCY..].chunks_exact_mut(2).zip(occupancy) {
        to.copy_from_slice(&halves(from));
    }
    for (to, block) in encoded[PALETTE..].iter_mut().zip(palette) {
        *to = block.to_bits();
    }
    let first = PALETTE + palette.len().next_multiple_of(4);
    for (to, &from) in encoded[first..].chunks_exact_mut(2).zip(indices) {
        to.copy_from_slice(&halves(from));
    }
    encoded.into()
}

fn address(chunk: &Arc<Chunk>) -> usize {
    Arc::as_ptr(chunk) as usize
}

/// Units of [`ALIGN`] words that a dense chunk takes.
fn units(dense: &Dense) -> u32 {
    let words = match dense {
        Dense::Chunk(chunk) => words(chunk.palette().len(), chunk.bits_per_block()),
        Dense::Filled(_) => words(1, 1),
    };
    (words as u32).div_ceil(ALIGN)
}

/// A dense chunk that is resident.
#[derive(Clone, Debug)]
struct Entry {
    dense: Dense,
    /// The first unit of [`ALIGN`] words.
    first: u32,
    units: u32,
    /// Leaves that hold it.
    users: u32,
}

/// The spans of the payload arena, and what is in them.
#[derive(Clone, Debug, Default)]
pub(super) struct PayloadStore {
    /// In units of [`ALIGN`] words.
    spans: SpanAllocator,
    entries: Vec<Option<Entry>>,
    free: Vec<u32>,
    by_content: FxHashMap<Dense, u32>,
    /// The chunks of entries by address; an entry holds its chunk, so that no other can have the address.
    by_address: FxHashMap<usize, u32>,
}

/// Changes of the payload arena that are one batch's.
#[derive(Debug, Default)]
pub(super) struct PayloadEdit {
    /// Entries that have no place yet.
    fresh: Vec<u32>,
    /// Spans that were in use when the edit began and were given back, in units.
    freed: Vec<Range<u32>>,
    /// Spans taken, in units.
    taken: Vec<Range<u32>>,
}

/// The place of an entry that has none yet.
const UNPLACED: u32 = u32::MAX;

impl PayloadStore {
    /// Leaves that share a dense chunk with another leaf.
    pub fn shared(&self) -> u64 {
        self.entries.iter().flatten().map(|entry| u64::from(entry.users) - 1).sum()
    }

    /// Dense chunks that are resident.
    pub fn chunk_count(&self) -> usize {
        self.entries.len() - self.free.len()
    }

    pub fn spans(&self) -> &SpanAllocator {
        &self.spans
    }

    /// Words up to the end of what is in use.
    pub fn end_words(&self) -> u32 {
        self.spans.end() * ALIGN
    }

    /// The entry of a dense chunk, with one user more. A new one has no place before [`Self::place`].
    pub fn acquire(&mut self, dense: &Dense, edit: &mut PayloadEdit) -> u32 {
        let address = match dense {
            Dense::Chunk(chunk) => Some(address(chunk)),
            Dense::Filled(_) => None,
        };
        let known = address.and_then(|address| self.by_address.get(&address));
        if let Some(&id) = known.or_else(|| self.by_content.get(dense)) {
            if let Some(entry) = &mut self.entries[id as usize] {
                entry.users += 1;
            }
            return id;
        }
        let entry = Entry { dense: dense.clone(), first: UNPLACED, units: units(dense), users: 1 };
        let id = match self.free.pop() {
            Some(id) => {
                self.entries[id as usize] = Some(entry);
                id
            }
            None => {
                self.entries.push(Some(entry));
                self.entries.len() as u32 - 1
            }
        };
        self.by_content.insert(dense.clone(), id);
        self.by_address.extend(address.map(|address| (address, id)));
        edit.fresh.push(id);
        id
    }

    /// Takes one user from an entry; the last one frees its span.
    pub fn release(&mut self, id: u32, edit: &mut PayloadEdit) {
        let Some(entry) = &mut self.entries[id as usize] else { return };
        entry.users -= 1;
        if entry.users > 0 {
            return;
        }
        let (first, units) = (entry.first, entry.units);
        self.by_content.remove(&entry.dense);
        if let Dense::Chunk(chunk) = &entry.dense {
            self.by_address.remove(&address(chunk));
        }
        self.entries[id as usize] = None;
        self.free.push(id);
        if first == UNPLACED {
            edit.fresh.retain(|&fresh| fresh != id);
        } else {
            self.free_units(first, units, edit);
        }
    }

    fn free_units(&mut self, first: u32, units: u32, edit: &mut PayloadEdit) {
        self.spans.free(first, units);
        edit.freed.push(first..first + units);
    }

    fn take_units(&mut self, units: u32, edit: &mut PayloadEdit) -> Option<u32> {
        let first = self.spans.allocate(units)?;
        edit.taken.push(first..first + units);
        Some(first)
    }

    /// Whether `more` units would find room below `limit` words, wherever they go.
    pub fn check_room(&self, more: u64, limit: u32) -> Result<(), WorldError> {
        let needed = (u64::from(self.spans.end()) + more) * u64::from(ALIGN);
        full("payload", needed, limit)
    }

    /// The units that a chunk would take if it is not there yet.
    pub fn units_if_new(&self, dense: &Dense) -> u64 {
        if self.by_content.contains_key(dense) { 0 } else { u64::from(units(dense)) }
    }

    /// Finds places for the new entries: their first words, with what to encode there. Room was checked.
    pub fn place(&mut self, edit: &mut PayloadEdit) -> Vec<(u32, Dense)> {
        let mut placed = Vec::with_capacity(edit.fresh.len());
        for id in std::mem::take(&mut edit.fresh) {
            let Some((units, dense)) = self.entries[id as usize].as_ref().map(|e| (e.units, e.dense.clone())) else {
                continue;
            };
            let first = self.take_units(units, edit).expect("check_room was asked before anything changed");
            if let Some(entry) = &mut self.entries[id as usize] {
                entry.first = first;
            }
            placed.push((first * ALIGN, dense));
        }
        placed
    }

    /// Takes a span for so many words, of something that is no chunk; its first word. Room was checked.
    pub fn take_words(&mut self, count: u32, edit: &mut PayloadEdit) -> u32 {
        self.take_units(count.div_ceil(ALIGN), edit).expect("check_room was asked before anything changed") * ALIGN
    }

    /// Gives such a span back.
    pub fn free_words(&mut self, first: u32, count: u32, edit: &mut PayloadEdit) {
        self.free_units(first / ALIGN, count.div_ceil(ALIGN), edit);
    }

    /// The first word of a placed entry.
    pub fn first_word(&self, id: u32) -> Option<u32> {
        self.entries.get(id as usize)?.as_ref().map(|entry| entry.first * ALIGN)
    }

    /// The chunk and the users of an entry.
    pub fn entry(&self, id: u32) -> Option<(&Dense, u32)> {
        self.entries.get(id as usize)?.as_ref().map(|entry| (&entry.dense, entry.users))
    }

    /// Every entry: its first word, its words, and its chunk.
    pub fn placed(&self) -> impl Iterator<Item = (u32, u32, &Dense)> + '_ {
        self.entries.iter().flatten().map(|entry| (entry.first * ALIGN, entry.units * ALIGN, &entry.dense))
    }

    /// Spans in use, in words, ascending and joined.
    pub fn live(&self) -> Vec<Range<u32>> {
        let mut live = Vec::new();
        let mut start = 0;
        for (first, length) in self.spans.free_spans().chain([(self.spans.end(), 0)]) {
            if start < first {
                live.push(start * ALIGN..first * ALIGN);
            }
            start = first + length;
        }
        live
    }
}

impl PayloadEdit {
    /// Units that the entries without a place will take.
    pub fn fresh_units(&self, store: &PayloadStore) -> u64 {
        let units = |id: &u32| store.entries[*id as usize].as_ref().map_or(0, |entry| u64::from(entry.units));
        self.fresh.iter().map(units).sum()
    }

    /// Spans in words that were in use before the edit and are not now: ascending, disjoint.
    pub fn freed_words(mut self) -> Vec<Range<u32>> {
        self.taken.sort_unstable_by_key(|span| span.start);
        self.freed.sort_unstable_by_key(|span| span.start);
        let mut left = Vec::new();
        for span in self.freed {
            let mut start = span.start;
            for taken in self.taken.iter().filter(|taken| taken.start < span.end && span.start < taken.end) {
                if start < taken.start {
                    left.push(start..taken.start);
                }
                start = start.max(taken.end);
            }
            if start < span.end {
                left.push(start..span.end);
            }
        }
        left.into_iter().map(|span| span.start * ALIGN..span.end * ALIGN).collect()
    }
}
