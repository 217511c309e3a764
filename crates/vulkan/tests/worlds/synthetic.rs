//! Batches that mean nothing and say everything: random writes of all kinds, sound as `check_batch` has it.

use orthant_resident::world::rows::{NO_PAYLOAD, kind};
use orthant_resident::world::{
    ArenaLens, BlockRow, LeafRow, MutationBatch, PayloadWrite, Root, WorldArenas, WorldNode,
};

/// Random numbers (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub fn below(&mut self, end: u32) -> u32 {
        (self.next() % u64::from(end.max(1))) as u32
    }

    fn float(&mut self) -> f32 {
        self.below(1 << 20) as f32 / 1024.0 - 512.0
    }

    /// Up to so many distinct slots, ascending.
    fn slots(&mut self, count: u32, len: u32) -> Vec<u32> {
        let mut slots: Vec<u32> = (0..count.min(len)).map(|_| self.below(len)).collect();
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    fn root(&mut self, lens: ArenaLens) -> Root {
        match self.below(3) {
            0 if lens.nodes > 0 => Root::node(self.below(lens.nodes)),
            1 if lens.leaves > 0 => Root::leaf(self.below(lens.leaves)),
            _ => Root::EMPTY,
        }
    }

    fn node(&mut self, lens: ArenaLens) -> WorldNode {
        WorldNode {
            bounds: std::array::from_fn(|_| std::array::from_fn(|_| std::array::from_fn(|_| self.float()))),
            children: [self.root(lens), self.root(lens)],
            reserved: [0; 2],
        }
    }

    fn leaf(&mut self, lens: ArenaLens) -> LeafRow {
        let min: [i64; 4] = std::array::from_fn(|_| (self.next() as i64) >> 8);
        let max = min.map(|lower| lower + 1 + i64::from(self.below(1 << 20)));
        let mut leaf = LeafRow::uniform(min, max, self.next() as u32);
        if self.below(2) == 0 {
            leaf.kind = kind::CHUNK_ARRAY | 16 << 16;
            leaf.payload = if lens.payload > 0 { self.below(lens.payload) } else { NO_PAYLOAD };
            leaf.coarse = self.below(1 << 16);
        }
        leaf
    }

    fn row(&mut self) -> BlockRow {
        let [a, b, c] = std::array::from_fn(|_| std::array::from_fn(|_| self.float()));
        let [flags, pattern, cells] = std::array::from_fn(|_| self.next() as u32);
        let zero: BlockRow = bytemuck::Zeroable::zeroed();
        BlockRow { color: a, emission: b, absorption: c, flags, pattern, cells, ..zero }
    }

    /// Stretches that do not overlap, of any length and alignment.
    fn payload(&mut self, count: u32, longest: u32, len: u32) -> Vec<PayloadWrite> {
        let mut writes = Vec::new();
        let mut at = 0;
        for _ in 0..count {
            let first = at + self.below(len / count.max(1));
            let words = (1 + self.below(longest)).min(len.saturating_sub(first));
            if words == 0 {
                break;
            }
            writes.push(PayloadWrite { first, words: (0..words).map(|_| self.next() as u32).collect() });
            at = first + words;
        }
        writes
    }
}

/// How large a batch is.
#[derive(Clone, Copy)]
pub struct Size {
    /// Rows by which each arena grows at most.
    pub growth: u32,
    /// Rows that are written at most.
    pub rows: u32,
    /// Stretches of payload.
    pub spans: u32,
    /// Their words, at most.
    pub words: u32,
}

/// What an edit may have.
pub const SMALL: Size = Size { growth: 3, rows: 6, spans: 2, words: 300 };
/// What a burst may have.
pub const LARGE: Size = Size { growth: 3000, rows: 2000, spans: 40, words: 3000 };

/// A batch that brings a set from what the mirror has to its next revision.
pub fn batch(random: &mut Random, mirror: &WorldArenas, size: Size) -> MutationBatch {
    let now = mirror.lens();
    let mut grown = |len: u32, by: u32| len + random.below(by + 1);
    let lens = ArenaLens {
        nodes: grown(now.nodes, size.growth),
        leaves: grown(now.leaves, size.growth),
        payload: grown(now.payload, size.growth * 20),
        palette: grown(now.palette, size.growth.min(20)),
    };
    MutationBatch {
        expected_root: mirror.root,
        new_root: random.root(lens),
        expected_revision: mirror.revision,
        new_revision: mirror.revision + 1,
        lens,
        node_writes: random.slots(size.rows, lens.nodes).into_iter().map(|slot| (slot, random.node(lens))).collect(),
        leaf_writes: random.slots(size.rows, lens.leaves).into_iter().map(|slot| (slot, random.leaf(lens))).collect(),
        payload_writes: random.payload(size.spans, size.words, lens.payload),
        palette_writes: random
            .slots(size.rows.min(9), lens.palette)
            .into_iter()
            .map(|slot| (slot, random.row()))
            .collect(),
        ..MutationBatch::default()
    }
}
