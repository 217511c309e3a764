//! Small sets of arenas for tests, made by hand.

use glam::Vec3;
use orthant_resident::world::rows::{NO_PAYLOAD, block, flags, kind, pattern};
use orthant_resident::world::{BlockRow, LeafRow, Root, WorldArenas, WorldNode, payload};

/// Raw steps of a unit.
pub const UNIT: i64 = 65_536;

/// The bits of a block that is not turned, of a scale.
pub fn bits(id: u32, scale: i8) -> u32 {
    id | u32::from(scale as u8) << 24
}

/// An opaque row of one colour.
pub fn opaque(color: [f32; 3]) -> BlockRow {
    BlockRow {
        color,
        flags: flags::KNOWN,
        emission: [0.0; 3],
        weight: 1.0,
        absorption: [0.0; 3],
        roughness: 1.0,
        metallic: 0.0,
        pattern: pattern::NONE,
        cells: 0,
        contrast: 0.0,
        width: 0.0,
        texture_size: 0,
        reserved: [0; 2],
    }
}

/// A transparent row.
pub fn glass(absorption: [f32; 3]) -> BlockRow {
    BlockRow { flags: flags::KNOWN | flags::TRANSPARENT, absorption, ..opaque([1.0; 3]) }
}

/// The rows of most tests: 1 to 4 opaque, 5 and 6 transparent, 7 a lamp.
pub fn palette() -> Vec<BlockRow> {
    let mut rows = vec![BlockRow { flags: 0, ..opaque([0.0; 3]) }];
    rows.extend([[0.8, 0.2, 0.2], [0.2, 0.8, 0.2], [0.2, 0.2, 0.8], [0.7, 0.7, 0.7]].map(opaque));
    rows.extend([[0.1, 0.2, 0.4], [0.5, 0.05, 0.3]].map(glass));
    rows.push(BlockRow { emission: [3.0, 2.0, 1.0], ..opaque([0.0; 3]) });
    rows
}

/// Leaves and payload, to be put under a tree.
#[derive(Clone, Default)]
pub struct Content {
    pub leaves: Vec<LeafRow>,
    pub payload: Vec<u32>,
}

impl Content {
    /// A box of one block, raw corners.
    pub fn uniform(&mut self, min: [i64; 4], max: [i64; 4], bits: u32) {
        self.leaves.push(LeafRow::uniform(min, max, bits));
    }

    /// The chunk of the lattice with blocks of `2^log2` raw steps that lies at `cell` (in chunks); `at` gives the block at a place in
    /// the chunk. Its box is the tight one. Nothing if there is no block.
    pub fn dense(&mut self, flat: bool, log2: u32, cell: [i64; 4], at: impl Fn([usize; 4]) -> u32) {
        let mut leaf = LeafRow {
            kind: kind::CHUNK_ARRAY | u32::from(flat) << 8 | log2 << 16,
            payload: self.payload.len() as u32,
            coarse: 0,
            ..LeafRow::uniform([0; 4], [0; 4], 0)
        };
        let (block, size) = (leaf.block_log2(), leaf.size_log2());
        let corner: [i64; 4] = std::array::from_fn(|a| cell[a] << (block[a] + size[a]));
        let (mut lo, mut hi) = ([usize::MAX; 4], [0; 4]);
        let mut entries = vec![0_u32];
        let mut indices = Vec::new();
        let mut occupancy = [0_u32; 128];
        for index in 0..4096_usize {
            let mut rest = index;
            let place: [usize; 4] = std::array::from_fn(|a| {
                let p = rest & ((1 << size[a]) - 1);
                rest >>= size[a];
                p
            });
            let bits = at(place);
            let entry = entries.iter().position(|&e| e == bits).unwrap_or_else(|| {
                entries.push(bits);
                entries.len() - 1
            });
            indices.push(entry);
            if bits != 0 {
                occupancy[index / 32] |= 1 << (index % 32);
                let halves = (0..4).filter(|&a| size[a] > 0 && place[a] >= 1 << (size[a] - 1));
                leaf.coarse |= 1 << halves.map(|a| 1 << a).sum::<usize>();
                for a in 0..4 {
                    (lo[a], hi[a]) = (lo[a].min(place[a]), hi[a].max(place[a] + 1));
                }
            }
        }
        if lo[0] == usize::MAX {
            return;
        }
        leaf.min = std::array::from_fn(|a| corner[a] + ((lo[a] as i64) << block[a]));
        leaf.max = std::array::from_fn(|a| corner[a] + ((hi[a] as i64) << block[a]));
        let index_bits = [1, 2, 4, 8, 16].into_iter().find(|&b| entries.len() <= 1 << b).unwrap();
        let solid: u32 = occupancy.iter().map(|w| w.count_ones()).sum();
        let first = self.payload.len();
        self.payload.extend([index_bits | (entries.len() as u32) << 8, solid, 0, 0]);
        self.payload.extend(occupancy);
        self.payload.extend(&entries);
        self.payload.resize(first + payload::PALETTE + entries.len().next_multiple_of(4), 0);
        for words in indices.chunks(32 / index_bits as usize) {
            let word = words.iter().enumerate().map(|(i, &e)| (e as u32) << (i as u32 * index_bits)).sum();
            self.payload.push(word);
        }
        assert_eq!(self.payload.len() - first, payload::words(entries.len(), index_bits));
        self.payload.resize(self.payload.len().next_multiple_of(payload::ALIGN as usize), 0);
        self.leaves.push(leaf);
    }

    /// A chunk of one block as a chunk array.
    pub fn uniform_chunk(&mut self, log2: u32, cell: [i64; 4], bits: u32) {
        let (min, max) = (cell.map(|c| c << (log2 + 3)), cell.map(|c| (c + 1) << (log2 + 3)));
        let leaf = LeafRow::uniform(min, max, bits);
        self.leaves.push(LeafRow { kind: kind::CHUNK_ARRAY | log2 << 16, payload: NO_PAYLOAD, ..leaf });
    }

    /// Everything moved by raw steps that are a multiple of every chunk's edge.
    pub fn moved(mut self, by: [i64; 4]) -> Self {
        for leaf in &mut self.leaves {
            for a in 0..4 {
                leaf.min[a] += by[a];
                leaf.max[a] += by[a];
            }
        }
        self
    }

    /// A tree over the leaves: halves of their order along the longest side.
    pub fn arenas(self, origin: [i64; 4]) -> WorldArenas {
        let mut arenas = WorldArenas::new(origin);
        let mut order: Vec<u32> = (0..self.leaves.len() as u32).collect();
        arenas.payload = self.payload;
        arenas.palette = palette();
        arenas.root = if order.is_empty() { Root::EMPTY } else { split(&mut arenas, &self.leaves, &mut order) };
        arenas.leaves = self.leaves;
        arenas
    }
}

fn split(arenas: &mut WorldArenas, leaves: &[LeafRow], order: &mut [u32]) -> Root {
    if let [leaf] = order {
        return Root::leaf(*leaf);
    }
    let bounds = raw_bounds(leaves, order);
    let axis = (0..4).max_by_key(|&a| bounds[1][a] - bounds[0][a]).unwrap();
    order.sort_by_key(|&i| leaves[i as usize].min[axis] + leaves[i as usize].max[axis]);
    let (a, b) = order.split_at_mut(order.len() / 2);
    let slot = arenas.nodes.len();
    let origin = arenas.origin;
    let node_bounds = [&*a, &*b].map(|part| {
        let [lo, hi] = raw_bounds(leaves, part);
        [
            std::array::from_fn(|k| below((lo[k] - origin[k]) as f64 / UNIT as f64)),
            std::array::from_fn(|k| -below((origin[k] - hi[k]) as f64 / UNIT as f64)),
        ]
    });
    arenas.nodes.push(WorldNode { bounds: node_bounds, children: [Root::EMPTY; 2], reserved: [0; 2] });
    let children = [split(arenas, leaves, a), split(arenas, leaves, b)];
    arenas.nodes[slot].children = children;
    Root::node(slot as u32)
}

fn raw_bounds(leaves: &[LeafRow], part: &[u32]) -> [[i64; 4]; 2] {
    part.iter().fold([[i64::MAX; 4], [i64::MIN; 4]], |[lo, hi], &i| {
        let leaf = &leaves[i as usize];
        [std::array::from_fn(|a| lo[a].min(leaf.min[a])), std::array::from_fn(|a| hi[a].max(leaf.max[a]))]
    })
}

/// The greatest `f32` that is not above.
fn below(v: f64) -> f32 {
    let near = v as f32;
    if f64::from(near) > v { near.next_down() } else { near }
}

/// Pseudo-random numbers.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = self.0 ^ self.0 >> 32;
        x.wrapping_mul(0xd6e8_feb8_6659_fd93) ^ x >> 29
    }

    pub fn below(&mut self, n: u64) -> u64 {
        (self.next() >> 16) % n
    }

    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    /// A unit vector in four dimensions.
    pub fn direction(&mut self) -> [f32; 4] {
        loop {
            let v: [f32; 4] = std::array::from_fn(|_| 2.0 * self.unit() - 1.0);
            let l2: f32 = v.iter().map(|c| c * c).sum();
            if l2 > 0.01 && l2 <= 1.0 {
                return v.map(|c| c / l2.sqrt());
            }
        }
    }
}

/// Whether two colours agree up to rounding.
pub fn is_close(a: Vec3, b: Vec3) -> bool {
    a.distance(b) <= 1e-5 * (a.length() + b.length()) + 1e-12
}

/// The number of the material of a block.
pub fn id(bits: u32) -> u32 {
    block::id(bits)
}
