//! [`List`]: the writes of a batch, or a part of them, as they lie in the staging ring.
//!
//! A list is as long as what it writes, and 4 bytes for every row (its slot) or 8 for every stretch of payload
//! ([`WordSpan`]): where the writes go has no influence on it. It begins with the rows, so that these are aligned:
//!
//! | what | bytes |
//! |---|---|
//! | rows of nodes, of leaves, of the palette | 80 each |
//! | the slot of each row, in the same order | 4 each |
//! | a [`WordSpan`] for each stretch of payload | 8 each |
//! | the words of these | 4 each |

use super::abi::WordSpan;
use bytemuck::{NoUninit, bytes_of, cast_slice};
use orthant_resident::world::{BlockRow, LeafRow, MutationBatch, WorldNode};

/// Bytes of a row of any arena but the payload's.
pub(super) const ROW: usize = 80;

/// Writes that go to the device in one piece.
pub(super) struct List<'b> {
    pub nodes: &'b [(u32, WorldNode)],
    pub leaves: &'b [(u32, LeafRow)],
    pub palette: &'b [(u32, BlockRow)],
    /// First word in the arena, and what to write there.
    pub spans: Vec<(u32, &'b [u32])>,
}

impl<'b> List<'b> {
    /// The writes of a batch in lists of at most so many bytes, which are at least some hundreds. Long stretches of payload are
    /// cut.
    pub fn all(batch: &'b MutationBatch, most: usize) -> Vec<Self> {
        let (mut nodes, mut leaves, mut palette) =
            (&batch.node_writes[..], &batch.leaf_writes[..], &batch.palette_writes[..]);
        let mut stretches = batch.payload_writes.iter().map(|write| (write.first, &write.words[..]));
        let mut cut = None;
        let mut lists = Vec::new();
        loop {
            let mut room = most;
            let mut list = Self {
                nodes: take(&mut nodes, &mut room),
                leaves: take(&mut leaves, &mut room),
                palette: take(&mut palette, &mut room),
                spans: Vec::new(),
            };
            while room >= size_of::<WordSpan>() + 4 {
                let Some((first, words)) = cut.take().or_else(|| stretches.next()) else { break };
                let (here, left) = words.split_at(words.len().min((room - size_of::<WordSpan>()) / 4));
                if !here.is_empty() {
                    room -= size_of::<WordSpan>() + size_of_val(here);
                    list.spans.push((first, here));
                }
                cut = (!left.is_empty()).then(|| (first + here.len() as u32, left));
            }
            if list.rows() == 0 && list.spans.is_empty() {
                return lists;
            }
            lists.push(list);
        }
    }

    /// Rows of all arenas together.
    pub fn rows(&self) -> usize {
        self.nodes.len() + self.leaves.len() + self.palette.len()
    }

    /// Words of payload.
    pub fn words(&self) -> usize {
        self.spans.iter().map(|(_, words)| words.len()).sum()
    }

    /// Bytes of what is written.
    pub fn content_bytes(&self) -> usize {
        self.rows() * ROW + self.words() * 4
    }

    /// Bytes of the whole list.
    pub fn bytes(&self) -> usize {
        self.content_bytes() + self.rows() * 4 + self.spans.len() * size_of::<WordSpan>()
    }

    /// Writes the list to memory of its size, front to back: it may be memory that the device has and the host cannot cache.
    pub fn write(&self, to: &mut [u8]) {
        let mut to = Writer(to);
        self.write_rows(&mut to);
        let slots = self.nodes.iter().map(|write| write.0).chain(self.leaves.iter().map(|write| write.0));
        for slot in slots.chain(self.palette.iter().map(|write| write.0)) {
            to.put(&slot);
        }
        let mut before = 0;
        for &(first, words) in &self.spans {
            to.put(&WordSpan { first, before });
            before += words.len() as u32;
        }
        self.write_words(&mut to);
    }

    /// Writes only what is written: the rows, and then the words.
    pub fn write_content(&self, to: &mut [u8]) {
        let mut to = Writer(to);
        self.write_rows(&mut to);
        self.write_words(&mut to);
    }

    fn write_rows(&self, to: &mut Writer<'_>) {
        self.nodes.iter().for_each(|(_, row)| to.put(row));
        self.leaves.iter().for_each(|(_, row)| to.put(row));
        self.palette.iter().for_each(|(_, row)| to.put(row));
    }

    fn write_words(&self, to: &mut Writer<'_>) {
        for (_, words) in &self.spans {
            to.put_all(cast_slice(words));
        }
    }
}

/// As many rows as there is room for.
fn take<'b, T>(rest: &mut &'b [(u32, T)], room: &mut usize) -> &'b [(u32, T)] {
    const { assert!(size_of::<T>() == ROW) };
    let (taken, left) = rest.split_at(rest.len().min(*room / (ROW + 4)));
    *rest = left;
    *room -= taken.len() * (ROW + 4);
    taken
}

/// The part of memory that is still to be written.
struct Writer<'m>(&'m mut [u8]);

impl Writer<'_> {
    fn put(&mut self, what: &impl NoUninit) {
        self.put_all(bytes_of(what));
    }

    fn put_all(&mut self, bytes: &[u8]) {
        let (here, rest) = std::mem::take(&mut self.0).split_at_mut(bytes.len());
        here.copy_from_slice(bytes);
        self.0 = rest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::{Zeroable, pod_collect_to_vec};
    use orthant_resident::world::PayloadWrite;

    fn batch() -> MutationBatch {
        let leaf = |i: u32| (3 * i, LeafRow::uniform([0; 4], [1; 4], i));
        let node = |i: u32| (i, WorldNode { reserved: [i; 2], ..Zeroable::zeroed() });
        let row = |i: u32| (i + 7, BlockRow { cells: i, ..Zeroable::zeroed() });
        let words = |i: u32| PayloadWrite { first: 1000 * i, words: (0..i % 5 * 40).map(|w| w + i).collect() };
        MutationBatch {
            node_writes: (0..20).map(node).collect(),
            leaf_writes: (0..9).map(leaf).collect(),
            palette_writes: (0..3).map(row).collect(),
            payload_writes: (0..12).map(words).collect(),
            ..MutationBatch::default()
        }
    }

    #[test]
    fn lists_of_any_size_write_the_same() {
        let batch = batch();
        for most in [180, 181, 999, 1 << 20] {
            let lists = List::all(&batch, most);
            assert!(lists.iter().all(|list| list.bytes() <= most));
            let nodes: Vec<_> = lists.iter().flat_map(|list| list.nodes).copied().collect();
            let leaves: Vec<_> = lists.iter().flat_map(|list| list.leaves).copied().collect();
            let palette: Vec<_> = lists.iter().flat_map(|list| list.palette).copied().collect();
            assert_eq!((nodes, leaves), (batch.node_writes.clone(), batch.leaf_writes.clone()));
            assert_eq!(palette, batch.palette_writes);
            let place = |(first, words): &(u32, &[u32])| (*first..).zip(words.to_vec()).collect::<Vec<_>>();
            let words: Vec<_> = lists.iter().flat_map(|list| &list.spans).flat_map(place).collect();
            let writes = batch.payload_writes.iter().map(|write| (write.first, &write.words[..]));
            assert_eq!(words, writes.flat_map(|write| place(&write)).collect::<Vec<_>>());
            assert_eq!(lists.iter().map(List::content_bytes).sum::<usize>() as u64, batch.upload_bytes());
        }
        assert_eq!(List::all(&batch, 1 << 20).len(), 1);
        assert!(List::all(&MutationBatch::default(), 1 << 20).is_empty());
    }

    #[test]
    fn a_list_is_what_it_writes_and_four_bytes_a_row_and_eight_a_stretch() {
        let batch = batch();
        let list = &List::all(&batch, 1 << 20)[0];
        let filled = batch.payload_writes.iter().filter(|write| !write.words.is_empty()).count();
        assert_eq!(list.bytes() as u64, batch.upload_bytes() + 4 * 32 + 8 * filled as u64);
        let mut bytes = vec![0; list.bytes()];
        list.write(&mut bytes);
        assert_eq!(bytes[20 * ROW..][..ROW], *bytes_of(&batch.leaf_writes[0].1));
        let slots: Vec<u32> = pod_collect_to_vec(&bytes[32 * ROW..][..32 * 4]);
        assert_eq!((slots[19], slots[20], slots[28], slots[29]), (19, 0, 24, 7));
        let spans: Vec<WordSpan> = pod_collect_to_vec(&bytes[32 * (ROW + 4)..][..16]);
        assert_eq!(spans, [WordSpan { first: 1000, before: 0 }, WordSpan { first: 2000, before: 40 }]);
    }
}
