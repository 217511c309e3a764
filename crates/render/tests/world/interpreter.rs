//! What a batch means, in a few lines, and who is alive: written from the description of `MutationBatch` alone.

use bytemuck::Zeroable;
use orthant_resident::world::payload;
use orthant_resident::world::rows::{LeafRow, NO_PAYLOAD, WorldNode, kind};
use orthant_resident::world::{BlockRow, MutationBatch, Root, WorldArenas};
use std::collections::BTreeSet;

/// Arenas that follow batches, with the sets of what is alive by what batches write and free.
#[derive(Clone, Default)]
pub struct Interpreter {
    pub root: Root,
    pub revision: u64,
    pub nodes: Vec<WorldNode>,
    pub leaves: Vec<LeafRow>,
    pub payload: Vec<u32>,
    pub palette: Vec<BlockRow>,
    pub live_nodes: BTreeSet<u32>,
    pub live_leaves: BTreeSet<u32>,
    /// In units of the alignment of spans.
    pub live_units: BTreeSet<u32>,
}

impl Interpreter {
    /// What an empty set is after these batches.
    pub fn after(batches: impl Iterator<Item = MutationBatch>) -> Self {
        let mut arenas = Self::default();
        batches.for_each(|batch| arenas.apply(&batch));
        arenas
    }

    pub fn apply(&mut self, batch: &MutationBatch) {
        assert_eq!((batch.expected_root, batch.expected_revision), (self.root, self.revision));
        for slot in &batch.freed_nodes {
            assert!(self.live_nodes.remove(slot), "node {slot} was not alive and is freed");
        }
        for slot in &batch.freed_leaves {
            assert!(self.live_leaves.remove(slot), "leaf {slot} was not alive and is freed");
        }
        for unit in batch.freed_payload_spans.iter().cloned().flat_map(units) {
            assert!(self.live_units.remove(&unit), "payload unit {unit} was not alive and is freed");
        }
        self.nodes.resize(batch.lens.nodes as usize, WorldNode::zeroed());
        self.leaves.resize(batch.lens.leaves as usize, LeafRow::zeroed());
        self.payload.resize(batch.lens.payload as usize, 0);
        self.palette.resize(batch.lens.palette as usize, BlockRow::zeroed());
        for (slot, node) in &batch.node_writes {
            self.nodes[*slot as usize] = *node;
            assert!(!batch.freed_nodes.contains(slot), "node {slot} is written and freed");
            self.live_nodes.insert(*slot);
        }
        for (slot, leaf) in &batch.leaf_writes {
            self.leaves[*slot as usize] = *leaf;
            assert!(!batch.freed_leaves.contains(slot), "leaf {slot} is written and freed");
            self.live_leaves.insert(*slot);
        }
        for write in &batch.payload_writes {
            let end = write.first + write.words.len() as u32;
            self.payload[write.first as usize..end as usize].copy_from_slice(&write.words);
            self.live_units.extend(units(write.first..end));
        }
        for (slot, row) in &batch.palette_writes {
            self.palette[*slot as usize] = *row;
        }
        self.root = batch.new_root;
        self.revision = batch.new_revision;
    }

    /// Whether the mirror is the same, byte for byte.
    pub fn check_mirror(&self, mirror: &WorldArenas) {
        assert_eq!((self.root, self.revision), (mirror.root, mirror.revision));
        assert!(bytes(&self.nodes) == bytes(&mirror.nodes), "nodes differ");
        assert!(bytes(&self.leaves) == bytes(&mirror.leaves), "leaves differ");
        assert!(bytes(&self.payload) == bytes(&mirror.payload), "payload differs");
        assert!(bytes(&self.palette) == bytes(&mirror.palette), "the palette differs");
    }

    /// The leaves that the root leads to, with the check that node bounds hold them, that the tree is no deeper than is allowed, and
    /// that what it leads to is what is alive.
    pub fn reach(&self, origin: [i64; 4]) -> Vec<LeafRow> {
        let (mut nodes, mut leaves) = (BTreeSet::new(), BTreeSet::new());
        let mut open = vec![(self.root, [[f32::MIN; 4], [f32::MAX; 4]], 0)];
        while let Some((at, bounds, depth)) = open.pop() {
            assert!(depth <= 64);
            if let Some(slot) = at.as_leaf() {
                assert!(leaves.insert(slot), "leaf {slot} is led to twice");
                let row = &self.leaves[slot as usize];
                for a in 0..4 {
                    let units = |raw: i64| (i128::from(raw) - i128::from(origin[a])) as f64 / 65_536.0;
                    assert!(f64::from(bounds[0][a]) <= units(row.min[a]), "leaf {slot} leaves its bounds");
                    assert!(f64::from(bounds[1][a]) >= units(row.max[a]), "leaf {slot} leaves its bounds");
                }
            } else if let Some(slot) = at.as_node() {
                assert!(nodes.insert(slot), "node {slot} is led to twice");
                let node = &self.nodes[slot as usize];
                for (child, child_bounds) in node.children.into_iter().zip(node.bounds) {
                    if child == Root::EMPTY {
                        assert!((0..4).all(|a| child_bounds[0][a] > child_bounds[1][a]));
                        continue;
                    }
                    assert!((0..4).all(|a| child_bounds[0][a] >= bounds[0][a] && child_bounds[1][a] <= bounds[1][a]));
                    open.push((child, child_bounds, depth + 1));
                }
            }
        }
        assert_eq!(nodes, self.live_nodes, "the nodes that are led to are those that are alive");
        assert_eq!(leaves, self.live_leaves, "the leaves that are led to are those that are alive");
        let rows: Vec<LeafRow> = leaves.iter().map(|&slot| self.leaves[slot as usize]).collect();
        let mut used = BTreeSet::new();
        for row in rows.iter().filter(|row| row.kind() == kind::CHUNK_ARRAY && row.payload != NO_PAYLOAD) {
            let chunk = &self.payload[row.payload as usize..];
            let count = payload::words((chunk[0] >> 8) as usize, chunk[0] & 0xff) as u32;
            used.extend(units(row.payload..row.payload + count));
        }
        let textures = self.palette.iter().filter(|row| row.pattern == orthant_resident::world::rows::pattern::TEXTURE);
        for row in textures {
            let texels: u32 = (0..3).map(|a| (row.texture_size >> (8 * a) & 0xff) + 1).product();
            used.extend(units(row.cells..row.cells + texels));
        }
        assert_eq!(used, self.live_units, "the payload that is led to is what is alive");
        rows
    }
}

fn units(words: std::ops::Range<u32>) -> std::ops::Range<u32> {
    assert_eq!(words.start % payload::ALIGN, 0, "spans begin at multiples of the alignment");
    words.start / payload::ALIGN..words.end.div_ceil(payload::ALIGN)
}

fn bytes<T: bytemuck::Pod>(rows: &[T]) -> &[u8] {
    bytemuck::cast_slice(rows)
}
