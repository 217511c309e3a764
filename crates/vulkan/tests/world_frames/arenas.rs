//! Worlds of blocks as a set of arenas, without a planner: disjoint leaves of every kind at random, under a median-split tree.

use orthant_resident::world::payload::{ALIGN, OCCUPANCY, PALETTE, words};
use orthant_resident::world::rows::{NO_PAYLOAD, flags, kind, pattern};
use orthant_resident::world::{ArenaLens, BlockRow, LeafRow, MutationBatch, PayloadWrite, Root, WorldNode};

/// Raw steps of a unit.
pub const UNIT: i64 = 1 << 16;
/// Logarithm of the edge of a cell of the lattice that leaves lie in, raw: 4 units.
const CELL: u32 = 18;
/// Materials that may be opaque only.
const OPAQUE: u32 = 6;

/// Numbers that repeat.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
        (self.0 >> 33) as u32
    }

    pub fn below(&mut self, count: u32) -> u32 {
        self.next() % count
    }

    pub fn unit(&mut self) -> f64 {
        f64::from(self.next()) / f64::from(1_u32 << 31)
    }
}

/// What a world is made of.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    pub seed: u64,
    /// The point about which it lies, raw; a multiple of the lattice.
    pub about: [i64; 4],
    /// Cells from there in each direction, along every axis; 0 is one cell.
    pub reach: [i64; 4],
    /// Cells that stay empty, from the middle in each direction of every axis; -1 for none.
    pub hollow: i64,
    /// Of a hundred cells those with something.
    pub percent: u32,
    /// There is glass.
    pub has_media: bool,
    /// Chunks are 16x16x16x1: the cells lie at `0 <= w < 1`.
    pub is_flat: bool,
}

/// A world under construction.
#[derive(Default)]
struct Builder {
    nodes: Vec<WorldNode>,
    leaves: Vec<LeafRow>,
    payload: Vec<u32>,
}

/// The palette: air, opaque materials with every pattern, a number that is left out, then glass.
fn palette() -> Vec<BlockRow> {
    let row = |color: [f32; 3], pattern: u32| BlockRow {
        color,
        flags: flags::KNOWN,
        emission: [0.0; 3],
        weight: 1.0,
        absorption: [0.0; 3],
        roughness: 1.0,
        metallic: 0.0,
        pattern,
        cells: 4,
        contrast: 0.4,
        width: 0.1,
        texture_size: 0,
        reserved: [0; 2],
    };
    let air = BlockRow { flags: 0, ..row([0.0; 3], pattern::NONE) };
    let texture = BlockRow { cells: 0, texture_size: 0x01_0302, ..row([1.0, 0.9, 0.8], pattern::TEXTURE) };
    vec![
        air,
        row([0.7, 0.2, 0.1], pattern::NONE),
        row([0.2, 0.7, 0.2], pattern::CHECKER),
        BlockRow { weight: 2.5, ..row([0.3, 0.4, 0.8], pattern::NOISE) },
        BlockRow { emission: [0.5, 0.4, 0.1], roughness: 0.4, ..row([0.6, 0.6, 0.5], pattern::EDGES) },
        BlockRow { metallic: 1.0, roughness: 0.3, ..texture },
        // Not in the palette.
        BlockRow { flags: 0, ..row([0.0; 3], pattern::NONE) },
        BlockRow {
            flags: flags::KNOWN | flags::TRANSPARENT,
            absorption: [0.3, 0.1, 0.05],
            ..row([1.0; 3], pattern::NONE)
        },
        BlockRow {
            flags: flags::KNOWN | flags::TRANSPARENT,
            absorption: [0.05, 0.2, 0.4],
            emission: [0.0, 0.3, 0.1],
            ..row([1.0; 3], pattern::NONE)
        },
    ]
}

impl Builder {
    /// A block of any material, turned somehow, of a scale between a quarter of a unit and 2 units.
    fn block(random: &mut Random, recipe: &Recipe) -> u32 {
        let id = match random.below(10) {
            0..3 if recipe.has_media => 7 + random.below(2),
            _ => 1 + random.below(OPAQUE),
        };
        let scale = random.below(4) as i32 - 2;
        id | random.below(192) << 16 | (scale as i8 as u8 as u32) << 24
    }

    /// Blocks of a chunk: a few balls of blocks in air.
    fn dense(&mut self, random: &mut Random, recipe: &Recipe, chunk: LeafRow) -> Option<LeafRow> {
        let size = chunk.size_log2();
        let kinds: Vec<u32> = (0..1 + random.below(5)).map(|_| Self::block(random, recipe)).collect();
        let mut entries = vec![0_u32];
        entries.extend(&kinds);
        let bits = [1, 2, 4, 8, 16].into_iter().find(|bits| entries.len() <= 1 << bits).expect("there are few kinds");
        let balls: Vec<([f64; 4], f64, u32)> = (0..1 + random.below(4))
            .map(|_| {
                let middle = std::array::from_fn(|a| random.unit() * f64::from(1_u32 << size[a]));
                (middle, random.unit() * 3.5 + 0.8, 1 + random.below(kinds.len() as u32))
            })
            .collect();
        let at = |i: u32| -> [u32; 4] {
            let (mut rest, mut at) = (i, [0; 4]);
            for a in 0..4 {
                (at[a], rest) = (rest & ((1 << size[a]) - 1), rest >> size[a]);
            }
            at
        };
        let entry = |i: u32| {
            let place = at(i);
            let inside = |middle: &[f64; 4], radius: f64| {
                (0..4).map(|a| (f64::from(place[a]) + 0.5 - middle[a]).powi(2)).sum::<f64>() < radius * radius
            };
            balls.iter().rev().find(|(middle, radius, _)| inside(middle, *radius)).map_or(0, |&(.., entry)| entry)
        };
        let indices: Vec<u32> = (0..4096).map(entry).collect();
        let solid: Vec<u32> = (0..4096).filter(|&i| indices[i as usize] != 0).collect();
        let first = *solid.first()?;
        let mut span = vec![0; words(entries.len(), bits).next_multiple_of(ALIGN as usize)];
        span[0] = bits | (entries.len() as u32) << 8;
        span[1] = solid.len() as u32;
        span[PALETTE..PALETTE + entries.len()].copy_from_slice(&entries);
        let start = PALETTE + entries.len().next_multiple_of(4);
        let (mut low, mut high, mut coarse) = (at(first), at(first), 0);
        for &i in &solid {
            span[OCCUPANCY + i as usize / 32] |= 1 << (i % 32);
            let bit = i * bits;
            span[start + bit as usize / 32] |= indices[i as usize] << (bit % 32);
            let place = at(i);
            let mut part = 0;
            for a in 0..4 {
                (low[a], high[a]) = (low[a].min(place[a]), high[a].max(place[a]));
                if size[a] > 0 {
                    part |= (place[a] >> (size[a] - 1)) << a;
                }
            }
            coarse |= 1 << part;
        }
        let (corner, block) = (chunk.chunk_min(), chunk.block_log2());
        let payload = self.payload.len() as u32;
        self.payload.extend(span);
        Some(LeafRow {
            min: std::array::from_fn(|a| corner[a] + (i64::from(low[a]) << block[a])),
            max: std::array::from_fn(|a| corner[a] + (i64::from(high[a] + 1) << block[a])),
            payload,
            coarse,
            ..chunk
        })
    }

    /// Leaves of one cell of the lattice.
    fn fill(&mut self, random: &mut Random, recipe: &Recipe, min: [i64; 4]) {
        let edge = 1_i64 << CELL;
        let max: [i64; 4] = std::array::from_fn(|a| min[a] + if a == 3 && recipe.is_flat { UNIT } else { edge });
        match random.below(5) {
            0 => self.leaves.push(LeafRow::uniform(min, max, Self::block(random, recipe))),
            1 => {
                // Two boxes that touch, often of one block.
                let axis = random.below(3) as usize;
                let cut = min[axis] + (i64::from(1 + random.below(15)) << (CELL - 4));
                let first = Self::block(random, recipe);
                let second = if random.below(2) == 0 { first } else { Self::block(random, recipe) };
                let (mut upper, mut lower) = (max, min);
                (upper[axis], lower[axis]) = (cut, cut);
                self.leaves.push(LeafRow::uniform(min, upper, first));
                self.leaves.push(LeafRow::uniform(lower, max, second));
            }
            2 => {
                let bits = Self::block(random, recipe);
                let whole = LeafRow::uniform(min, max, bits);
                self.leaves.push(LeafRow { kind: self.chunk_kind(recipe), payload: NO_PAYLOAD, ..whole });
            }
            _ => {
                let chunk = LeafRow { kind: self.chunk_kind(recipe), ..LeafRow::uniform(min, max, 0) };
                if let Some(leaf) = self.dense(random, recipe, chunk) {
                    self.leaves.push(leaf);
                }
            }
        }
    }

    fn chunk_kind(&self, recipe: &Recipe) -> u32 {
        if recipe.is_flat {
            kind::CHUNK_ARRAY | 1 << 8 | (CELL - 4) << 16
        } else {
            kind::CHUNK_ARRAY | (CELL - 3) << 16
        }
    }

    /// The tree over some leaves.
    fn tree(&mut self, slots: &mut [u32], origin: [i64; 4]) -> Root {
        if let [slot] = *slots {
            return Root::leaf(slot);
        }
        let bounds = |leaves: &[LeafRow], slots: &[u32]| {
            let of = |slot: &u32| &leaves[*slot as usize];
            let low: [i64; 4] = std::array::from_fn(|a| slots.iter().map(|s| of(s).min[a]).min().unwrap_or(0));
            let high: [i64; 4] = std::array::from_fn(|a| slots.iter().map(|s| of(s).max[a]).max().unwrap_or(0));
            (low, high)
        };
        let (low, high) = bounds(&self.leaves, slots);
        let axis = (0..4).max_by_key(|&a| high[a] - low[a]).unwrap_or(0);
        slots.sort_by_key(|&s| self.leaves[s as usize].min[axis]);
        let (left, right) = slots.split_at_mut(slots.len() / 2);
        let node = self.nodes.len();
        self.nodes.push(bytemuck::Zeroable::zeroed());
        let boxes = [bounds(&self.leaves, left), bounds(&self.leaves, right)];
        let children = [self.tree(left, origin), self.tree(right, origin)];
        let round = |raw: i64, a: usize, up: bool| {
            let units = (raw - origin[a]) as f64 / UNIT as f64;
            let near = units as f32;
            match up {
                true if f64::from(near) < units => near.next_up(),
                false if f64::from(near) > units => near.next_down(),
                _ => near,
            }
        };
        let corners = |(low, high): ([i64; 4], [i64; 4])| {
            [std::array::from_fn(|a| round(low[a], a, false)), std::array::from_fn(|a| round(high[a], a, true))]
        };
        self.nodes[node] = WorldNode { bounds: boxes.map(corners), children, reserved: [0; 2] };
        Root::node(node as u32)
    }
}

/// The batch that fills an empty set about `origin` with a world.
pub fn build(recipe: &Recipe, origin: [i64; 4]) -> MutationBatch {
    let mut random = Random::new(recipe.seed);
    // Texels of the one texture: 3 x 4 x 2.
    let texels = (0..24).map(|_| random.next()).collect();
    let mut builder = Builder { payload: texels, ..Builder::default() };
    builder.payload.resize(builder.payload.len().next_multiple_of(ALIGN as usize), 0);
    let cells = |a: usize| -recipe.reach[a]..=recipe.reach[a];
    for w in cells(3) {
        for z in cells(2) {
            for y in cells(1) {
                for x in cells(0) {
                    let at = [x, y, z, w];
                    let is_hollow = at.iter().all(|c: &i64| c.abs() <= recipe.hollow);
                    if is_hollow || random.below(100) >= recipe.percent {
                        continue;
                    }
                    let min = std::array::from_fn(|a| recipe.about[a] + (at[a] << CELL));
                    builder.fill(&mut random, recipe, min);
                }
            }
        }
    }
    let mut slots: Vec<u32> = (0..builder.leaves.len() as u32).collect();
    let root = builder.tree(&mut slots, origin);
    let Builder { nodes, leaves, payload } = builder;
    let palette = palette();
    let rows = |len: usize| u32::try_from(len).expect("the world is small");
    MutationBatch {
        new_root: root,
        new_revision: 1,
        lens: ArenaLens {
            nodes: rows(nodes.len()),
            leaves: rows(leaves.len()),
            payload: rows(payload.len()),
            palette: rows(palette.len()),
        },
        node_writes: (0..).zip(nodes).collect(),
        leaf_writes: (0..).zip(leaves).collect(),
        payload_writes: vec![PayloadWrite { first: 0, words: payload.into() }],
        palette_writes: (0..).zip(palette).collect(),
        ..MutationBatch::default()
    }
}
