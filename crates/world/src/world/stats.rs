//! What a world consists of, counted.

use super::World;
use super::region::{Content, Region};
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// Counts of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorldStats {
    /// Regions of one block.
    pub uniform: usize,
    /// Chunk regions: parts of chunks that are not of one block.
    pub chunk_arrays: usize,
    /// Chunks in memory; several regions may share one.
    pub dense_chunks: usize,
    /// Bytes of the chunks in memory.
    pub chunk_bytes: u64,
    /// Bytes of regions and of the index, without free places.
    pub region_bytes: u64,
    /// What is not air, in units to the fourth power.
    pub solid_volume: f64,
}

impl World {
    /// Counts everything; looks at every region.
    pub fn stats(&self) -> WorldStats {
        let mut stats = WorldStats::default();
        let mut seen = FxHashSet::default();
        for (_, region) in self.regions() {
            match &region.content {
                Content::Uniform(_) => {
                    stats.uniform += 1;
                    stats.solid_volume += region.bounds.extent().iter().product::<f64>();
                }
                Content::Chunk { lattice, chunk } => {
                    stats.chunk_arrays += 1;
                    if seen.insert(Arc::as_ptr(chunk)) {
                        stats.dense_chunks += 1;
                        stats.chunk_bytes += region.heap_bytes() as u64;
                    }
                    super::region::for_each_block(
                        super::region::block_range(&region.bounds, *lattice),
                        *lattice,
                        |at, i| {
                            if !chunk.get(i).is_air() {
                                let cell = lattice.chunk_at(region.bounds.min_raw());
                                let block = super::region::block_box(&cell, *lattice, at, at.map(|c| c + 1));
                                let within = block.intersection(&region.bounds);
                                stats.solid_volume += within.map_or(0.0, |b| b.extent().iter().product());
                            }
                        },
                    );
                }
            }
        }
        let nodes = self.index.node_count() * size_of::<orthant_bvh::Node<i64, 4>>();
        stats.region_bytes = (self.region_count() * (size_of::<Region>() + 8) + nodes) as u64;
        stats
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb4, Block, BlockId, RegionTree, Scale, WorldPatch};

    #[test]
    fn a_platform_with_a_hole_is_its_slabs_and_a_chunk() {
        let mut world = World::new();
        let fill = |min: [i32; 4], max: [i32; 4], id| {
            let bounds = Aabb4::from_ints(min, max).unwrap();
            WorldPatch::of_tree(RegionTree::uniform(bounds, Block::of(BlockId(id), Scale::UNIT)))
        };
        world.apply(&fill([-20; 4], [30; 4], 1)).unwrap();
        world.apply(&fill([3; 4], [4, 4, 4, 5], 0)).unwrap();
        let stats = world.stats();
        assert_eq!((stats.uniform, stats.chunk_arrays, stats.dense_chunks), (8, 1, 1));
        assert_eq!(stats.solid_volume, 50_f64.powi(4) - 2.0);
        assert!(stats.chunk_bytes <= 4608 && stats.region_bytes < 4096);
    }
}
