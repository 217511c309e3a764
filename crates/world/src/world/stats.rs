//! What a world consists of, counted.

use super::World;
use super::region::{Content, Region};
use crate::block::Block;
use crate::space::{Aabb4, Fixed};
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
    /// Blocks, each at its own scale; of one that is cut, the part that is there. In a world within `0 <= w < 1` a block that
    /// fills that range is one, whatever its scale.
    pub blocks: f64,
    /// Whether everything lies in `0 <= w < 1`.
    pub is_three_dimensional: bool,
}

impl World {
    /// Whether everything that is not air lies in `0 <= w < 1`. Looks at every region.
    pub fn is_three_dimensional(&self) -> bool {
        let lies_flat = |bounds: Aabb4| bounds.min_raw()[3] >= 0 && bounds.max_raw()[3] <= Fixed::ONE.raw();
        self.regions().filter_map(|(_, region)| region.solid_bounds()).all(lies_flat)
    }

    /// Counts everything; looks at every region.
    pub fn stats(&self) -> WorldStats {
        let is_three_dimensional = self.is_three_dimensional();
        let mut stats = WorldStats { is_three_dimensional, ..WorldStats::default() };
        let mut add = |block: Block, bounds: &Aabb4, count: f64| {
            let extent = bounds.extent();
            let edge = block.scale().edge().to_f64();
            let is_flat = is_three_dimensional && bounds.extent_raw()[3] == Fixed::ONE.raw();
            stats.solid_volume += extent.iter().product::<f64>() * count;
            stats.blocks += extent[..3].iter().map(|e| e / edge).product::<f64>()
                * if is_flat { count } else { extent[3] / edge * count };
        };
        let mut seen = FxHashSet::default();
        let mut counts = (0, 0, 0);
        for (_, region) in self.regions() {
            match &region.content {
                Content::Uniform(block) => {
                    counts.0 += 1;
                    add(*block, &region.bounds, 1.0);
                }
                Content::Chunk { lattice, chunk } => {
                    counts.1 += 1;
                    if seen.insert(Arc::as_ptr(chunk)) {
                        counts.2 += region.heap_bytes() as u64;
                    }
                    let cell = lattice.chunk_at(region.bounds.min_raw());
                    if cell == region.bounds {
                        let one = super::region::block_box(&cell, *lattice, [0; 4], [1; 4]);
                        let mut of_kind = vec![0_u32; chunk.palette().len()];
                        chunk.palette_indices().iter().for_each(|&kind| of_kind[usize::from(kind)] += 1);
                        let solid = chunk.palette().iter().zip(of_kind).filter(|(block, _)| !block.is_air());
                        solid.for_each(|(block, count)| add(*block, &one, f64::from(count)));
                        continue;
                    }
                    let range = super::region::block_range(&region.bounds, *lattice);
                    super::region::for_each_block(range, *lattice, |at, i| {
                        let block = super::region::block_box(&cell, *lattice, at, at.map(|c| c + 1));
                        if let Some(within) = block.intersection(&region.bounds)
                            && !chunk.get(i).is_air()
                        {
                            add(chunk.get(i), &within, 1.0);
                        }
                    });
                }
            }
        }
        (stats.uniform, stats.chunk_arrays, stats.chunk_bytes) = counts;
        stats.dense_chunks = seen.len();
        let nodes = self.index.node_count() * size_of::<orthant_bvh::Node<i64, 4>>();
        stats.region_bytes = (self.region_count() * (size_of::<Region>() + 8) + nodes) as u64;
        stats
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BlockId, RegionTree, Scale, WorldPatch};

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
        assert_eq!((stats.blocks, stats.is_three_dimensional), (50_f64.powi(4) - 2.0, false));
        assert!(stats.chunk_bytes <= 4608 && stats.region_bytes < 4096);
    }
    #[test]
    fn blocks_are_counted_at_their_own_scale_whole_chunks_or_parts() {
        let ints = |min: [i32; 4], max: [i32; 4]| Aabb4::from_ints(min, max).unwrap();
        let blocks = |id: u16, scale: i8| Block::of(BlockId(id), Scale::new(scale).unwrap());
        // Flat: a fine box, a coarse one, and a chunk of one-unit blocks in a pattern.
        let mut world = World::new();
        let mut fill = |bounds: Aabb4, block: Block| {
            world.apply(&WorldPatch::of_tree(RegionTree::uniform(bounds, block))).unwrap();
        };
        fill(ints([100, 0, 0, 0], [102, 2, 2, 1]), blocks(1, -1));
        fill(ints([200, 0, 0, 0], [208, 8, 8, 1]), blocks(1, 2));
        for x in (0..16).step_by(2) {
            fill(ints([x, 0, 0, 0], [x + 1, 1, 1, 1]), blocks(2, 0));
            fill(ints([x, 15, 15, 0], [x + 1, 16, 16, 1]), blocks(3, 0));
        }
        let stats = world.stats();
        assert!(stats.is_three_dimensional && stats.chunk_arrays > 0);
        assert_eq!(stats.blocks, 64.0 + 8.0 + 16.0);
        // With content elsewhere in w, a fine block has its own extent there too.
        world.apply(&WorldPatch::of_tree(RegionTree::uniform(ints([0, 0, 0, 5], [1, 1, 1, 6]), blocks(1, 0)))).unwrap();
        let stats = world.stats();
        assert!(!stats.is_three_dimensional);
        assert_eq!(stats.blocks, 128.0 + 8.0 / 4.0 + 16.0 + 1.0);
    }
}
