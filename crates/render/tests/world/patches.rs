//! Random patches.

use orthant_world::edit::{fill_box, voxel_bounds};
use orthant_world::{Aabb4, Block, BlockId, Chunk, ChunkShape, Lattice, RegionTree, Scale, WorldPatch};
use std::sync::Arc;

/// SplitMix64: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    pub fn below(&mut self, end: u64) -> u64 {
        ((u128::from(self.bits()) * u128::from(end)) >> 64) as u64
    }

    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len() as u64) as usize]
    }
}

/// Patches of all kinds about a place, at scales -3 to 3, mostly small and near to each other.
pub struct Patches {
    pub random: Random,
    /// In units.
    pub about: [i64; 4],
    /// Half of the extent, in units.
    pub reach: i64,
}

impl Patches {
    pub fn next(&mut self) -> WorldPatch {
        match self.random.below(12) {
            0..=4 => fill_box(self.voxel(), self.block()),
            5 | 6 => fill_box(self.any_box(), self.block()),
            7 => fill_box(self.any_box(), Block::AIR),
            8 => WorldPatch::of_tree(self.chunks(ChunkShape::Cube)),
            9 if self.about[3] == 0 => WorldPatch::of_tree(self.chunks(ChunkShape::Flat)),
            10 => self.scatter(),
            _ => {
                // A box of which parts are said, and the rest is air.
                let bounds = self.any_box();
                let parts: Vec<RegionTree> = self
                    .voxel()
                    .intersection(&bounds)
                    .map(|b| RegionTree::uniform(b, self.block()))
                    .into_iter()
                    .collect();
                WorldPatch::of_tree(RegionTree::branch(bounds, parts))
            }
        }
    }

    fn block(&mut self) -> Block {
        let id = self.random.pick(&[0, 1, 1, 1, 2, 3]);
        Block::of(BlockId(id), self.random.pick(&[Scale::UNIT, Scale::UNIT, Scale::new(1).unwrap()]))
    }

    fn scale(&mut self) -> Scale {
        Scale::new(self.random.pick(&[-3, -2, -1, -1, 0, 0, 0, 0, 1, 1, 2, 3])).unwrap()
    }

    fn at(&mut self, edge: i64) -> [i64; 4] {
        std::array::from_fn(|a| {
            let offset = self.random.below(2 * self.reach as u64) as i64 - self.reach;
            ((self.about[a] + offset) << 16).div_euclid(edge)
        })
    }

    fn voxel(&mut self) -> Aabb4 {
        let scale = self.scale();
        let at = self.at(scale.edge().raw());
        voxel_bounds(at, scale).unwrap()
    }

    fn any_box(&mut self) -> Aabb4 {
        let edge = self.scale().edge().raw();
        let min = self.at(edge).map(|c| c * edge);
        let most = self.random.pick(&[2, 5, 12]);
        let extent: [i64; 4] = std::array::from_fn(|_| edge * (1 + self.random.below(most)) as i64);
        Aabb4::from_raw(min, std::array::from_fn(|a| min[a] + extent[a])).unwrap()
    }

    /// Scattered voxels of one scale; what is between them becomes air.
    fn scatter(&mut self) -> WorldPatch {
        let bounds = self.any_box();
        let scale = self.scale();
        let edge = scale.edge().raw();
        let cell = |at: i64, b: &Aabb4, a: usize| b.min_raw()[a].div_euclid(edge) + at;
        let mut parts = std::collections::BTreeMap::new();
        for _ in 0..6 {
            let at: [i64; 4] = std::array::from_fn(|a| cell(self.random.below(4) as i64, &bounds, a));
            let voxel = voxel_bounds(at, scale).unwrap();
            let part = voxel.intersection(&bounds).map(|part| RegionTree::uniform(part, self.block()));
            parts.extend(part.map(|part| (at, part)));
        }
        WorldPatch::of_tree(RegionTree::branch(bounds, parts.into_values().collect()))
    }

    /// One chunk of noise, of two or of many kinds, in a part of its cell.
    fn chunks(&mut self, shape: ChunkShape) -> RegionTree {
        let lattice = Lattice { scale: self.scale(), shape };
        let extent = lattice.chunk_extent().map(|extent| extent.raw());
        let mut min: [i64; 4] = std::array::from_fn(|a| self.at(extent[a])[a] * extent[a]);
        if shape == ChunkShape::Flat {
            min[3] = 0;
        }
        let cell = Aabb4::from_raw(min, std::array::from_fn(|a| min[a] + extent[a])).unwrap();
        let kinds = self.random.pick(&[2, 3, 20]);
        let air = self.random.below(8);
        let blocks = std::array::from_fn(|_| {
            let id = if self.random.below(8) < air { 0 } else { self.random.below(kinds) };
            Block::of(BlockId(id as u16), Scale::UNIT)
        });
        let bounds = self.any_box().intersection(&cell).unwrap_or(cell);
        RegionTree::chunk_array(bounds, lattice, vec![Arc::new(Chunk::from_blocks(&blocks))]).unwrap()
    }
}
