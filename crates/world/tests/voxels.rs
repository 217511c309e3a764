//! A world against a plain map of voxels, over long random sequences of patches.

mod common;

use common::{Model, Random};
use orthant_world::{Aabb4, Block, BlockId, ChunkShape, Lattice, RegionTree, Scale, World, WorldPatch};
use std::sync::Arc;

/// Random boxes, voxels and chunks of one range of scales, about a place.
struct Sequence {
    random: Random,
    /// The model's voxel is of this scale: the finest in use.
    finest: i8,
    coarsest: i8,
    /// Lower corner of the arena, in voxels of the coarsest scale.
    corner: [i64; 4],
    /// Its extent, in voxels of the coarsest scale.
    extent: [i64; 4],
}

impl Sequence {
    fn arena(&self) -> Aabb4 {
        self.cells(self.coarsest, [0; 4], self.extent.map(|e| e as u64))
    }

    /// A box of whole voxels of a scale, relative to the arena's corner.
    fn cells(&self, scale: i8, first: [u64; 4], extent: [u64; 4]) -> Aabb4 {
        let edge = Scale::new(scale).unwrap().edge().raw();
        let origin = self.corner.map(|c| c * Scale::new(self.coarsest).unwrap().edge().raw());
        let min: [i64; 4] = std::array::from_fn(|a| origin[a] + first[a] as i64 * edge);
        Aabb4::from_raw(min, std::array::from_fn(|a| min[a] + extent[a] as i64 * edge)).unwrap()
    }

    fn block(&mut self, scale: i8) -> Block {
        Block::of(BlockId(self.random.below(4) as u16), Scale::new(scale).unwrap())
    }

    fn patch(&mut self) -> WorldPatch {
        let scale = self.finest + self.random.below((self.coarsest - self.finest + 1) as u64) as i8;
        let per_coarsest = 1_u64 << (self.coarsest - scale);
        let room = self.extent.map(|e| e as u64 * per_coarsest);
        let kind = self.random.below(10);
        let largest = match kind {
            0..=5 => 1,
            6..=7 => 5,
            _ => u64::MAX,
        };
        let first: [u64; 4] = std::array::from_fn(|a| self.random.below(room[a]));
        let extent: [u64; 4] = std::array::from_fn(|a| 1 + self.random.below((room[a] - first[a]).min(largest)));
        let bounds = self.cells(scale, first, extent);
        if kind == 9 && self.random.below(2) == 0 {
            return self.chunks(bounds, scale);
        }
        WorldPatch::of_tree(RegionTree::uniform(bounds, self.block(scale)))
    }

    /// A patch of chunks with noise in them, of which a part counts.
    fn chunks(&mut self, bounds: Aabb4, scale: i8) -> WorldPatch {
        let scale = Scale::new(scale).unwrap();
        let flat = self.random.below(2) == 0 && Lattice::flat(scale).admits(&bounds);
        let lattice = if flat { Lattice::flat(scale) } else { Lattice::cube(scale) };
        let count = Model::cells(&bounds, lattice.chunk_extent().map(|e| e.raw()));
        let kinds = 1 + self.random.below(4) as u16;
        let chunks = (0..count)
            .map(|_| {
                let coarse = self.random.below(2) == 0;
                Arc::new(orthant_world::Chunk::from_blocks(&std::array::from_fn(|i| {
                    let [x, y, z, w] = lattice.shape.at(i);
                    let noise = if coarse { (x / 4 + y / 4 + z / 4 + w / 4) as u64 } else { self.random.next() };
                    Block::of(BlockId((noise % u64::from(kinds)) as u16), scale)
                })))
            })
            .collect();
        WorldPatch::of_tree(RegionTree::chunk_array(bounds, lattice, chunks).unwrap())
    }

    fn run(mut self, patches: usize) {
        let mut world = World::new();
        let mut model = Model::new(self.arena(), Scale::new(self.finest).unwrap());
        for step in 0..patches {
            let patch = self.patch();
            let expected = model.changed_by(&patch);
            let before = world.clone();
            let applied = world.apply(&patch).unwrap();
            assert_eq!(applied.is_noop(), expected.is_none(), "patch {step}: {patch:?}");
            model.apply(&patch);
            world.validate().unwrap_or_else(|e| panic!("patch {step}: {e}: {patch:?}"));
            model.compare(&world, &format!("patch {step}: {patch:?}"));
            common::check_applied(&before, &world, &patch, &applied, &model);
        }
    }
}

fn sequence(seed: u64, scales: [i8; 2], corner: [i64; 4], extent: [i64; 4]) -> Sequence {
    let random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1);
    Sequence { random, finest: scales[0], coarsest: scales[1], corner, extent }
}

#[test]
fn voxels_of_one_scale_agree_with_a_map() {
    for seed in 0..6 {
        sequence(seed, [0, 0], [-10, -5, -3, -6], [20, 9, 11, 12]).run(80);
    }
}

#[test]
fn voxels_of_all_scales_agree_with_a_map() {
    for (seed, base) in (0..12).zip([-3, -2, -1, 0, 1].into_iter().cycle()) {
        sequence(100 + seed, [base, base + 2], [-3, -2, -1, -2], [5, 4, 3, 4]).run(80);
    }
    for seed in 0..2 {
        sequence(200 + seed, [-3, 0], [-1, -2, -1, 0], [3, 3, 2, 2]).run(80);
    }
}

#[test]
fn voxels_far_from_the_origin_agree_with_a_map() {
    for (seed, corner) in
        (0..4).zip([[1 << 40, -(1 << 41), 5, -7], [-1_000_003, 1_000_001, -999_999, 17]].into_iter().cycle())
    {
        sequence(300 + seed, [-1, 0], corner, [11, 6, 5, 9]).run(80);
    }
}

#[test]
fn three_dimensional_content_agrees_with_a_map() {
    for seed in 0..6 {
        sequence(400 + seed, [-1, 0], [-20, -4, -5, 0], [40, 10, 20, 1]).run(80);
    }
}

#[test]
fn flat_chunks_meet_content_beyond_them() {
    for seed in 0..4 {
        sequence(500 + seed, [0, 1], [-5, -2, -3, -1], [12, 6, 8, 3]).run(80);
    }
    assert_eq!(ChunkShape::Flat.size()[3], 1);
}
