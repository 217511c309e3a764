//! Random patches of every kind about a place.

use super::Random;
use orthant_world::edit::{EditLimits, Sphere, fill_box, fill_sphere, voxel_bounds};
use orthant_world::{
    Aabb4, Block, BlockId, CHUNK_BLOCKS, Chunk, ChunkShape, Fixed, Lattice, Orientation, PaletteEntry, Point4,
    RegionTree, Scale, World, WorldPatch,
};
use std::sync::Arc;

/// Raw steps of a unit.
pub const UNIT: i64 = 65_536;

/// Half the edge of the box that patches lie in, in units.
pub const HALF: i64 = 16;

/// Three opaque materials, two transparent ones, one of them shining.
pub fn palette() -> Vec<PaletteEntry> {
    serde_json::from_str(
        r#"[
        {"id": 1, "material": {"name": "stone", "color": [0.4, 0.4, 0.4]}},
        {"id": 2, "material": {"name": "grass", "color": [0.2, 0.6, 0.1], "pattern": {"checker": {"cells": 3, "contrast": 0.5}}}},
        {"id": 3, "material": {"name": "brick", "color": [0.6, 0.2, 0.1], "pattern": {"noise": {"cells": 4, "contrast": 0.4}}}},
        {"id": 4, "material": {"name": "glass", "color": [1, 1, 1], "transparency": {"absorption": [0.02, 0.05, 0.1]}}},
        {"id": 5, "material": {"name": "glow", "color": [1, 1, 1], "emission": [2, 1, 0.5],
                               "transparency": {"absorption": [0.2, 0.1, 0.05]}}},
        {"id": 6, "material": {"name": "lamp", "color": [0, 0, 0], "emission": [5, 5, 4]}}]"#,
    )
    .expect("a palette")
}

/// A world that is empty but for its palette.
pub fn empty_world() -> World {
    let mut world = World::new();
    let bounds = Aabb4::from_ints([0; 4], [1; 4]).expect("a box");
    world.apply(&WorldPatch { palette: palette(), ..WorldPatch::of_tree(RegionTree::empty(bounds)) }).expect("a patch");
    world
}

pub fn block(random: &mut Random) -> Block {
    let id = BlockId(random.between(1, 6) as u16);
    let orientation = Orientation::new(random.below(192) as u8).expect("one of 192");
    Block::new(id, orientation, scale(random, -3, 3))
}

fn scale(random: &mut Random, low: i64, high: i64) -> Scale {
    Scale::new(random.between(low, high) as i8).expect("a scale")
}

/// A patch about `base` (raw, whole multiples of 64 units), as a world takes it: spheres look at what is there.
pub fn patch(random: &mut Random, world: &World, base: [i64; 4]) -> Vec<WorldPatch> {
    let block = block(random);
    match random.below(10) {
        // A voxel
        0..3 => {
            let scale = scale(random, -3, 3);
            let index = place(random, base).map(|c| c.div_euclid(scale.edge().raw()));
            vec![fill_box(voxel_bounds(index, scale).expect("in space"), block)]
        }
        // A box, on a lattice or on none; some of air
        3..6 => {
            let edge = if random.below(4) == 0 { 1 } else { scale(random, -3, 2).edge().raw() };
            let low = place(random, base).map(|c| c.div_euclid(edge) * edge);
            let high = low.map(|c| c + edge * (1 + random.below((10 * UNIT / edge) as u64) as i64));
            let bounds = Aabb4::from_raw(low, high).expect("a box");
            vec![if random.below(3) == 0 {
                WorldPatch::of_tree(RegionTree::empty(bounds))
            } else {
                fill_box(bounds, block)
            }]
        }
        // A sphere
        6 => {
            let sphere = Sphere {
                center: Point4::from_raw(place(random, base)),
                radius: Fixed::from_raw(random.between(UNIT / 2, 2 * UNIT)),
                scale: scale(random, -1, 0),
            };
            let block = if random.below(3) == 0 { Block::AIR } else { block };
            fill_sphere(world, &sphere, block, &EditLimits::default()).expect("a sphere")
        }
        // A chunk, dense
        7 | 8 => vec![chunk(random, base, ChunkShape::Cube)],
        // A flat chunk, where there may be one
        _ if base[3] == 0 => vec![chunk(random, base, ChunkShape::Flat)],
        _ => vec![chunk(random, base, ChunkShape::Cube)],
    }
}

/// The box of the chunk that a point lies in.
pub fn chunk_cell(lattice: Lattice, at: [i64; 4]) -> Aabb4 {
    let extent = lattice.chunk_extent().map(|extent| extent.raw());
    let min: [i64; 4] = std::array::from_fn(|a| at[a].div_euclid(extent[a]) * extent[a]);
    Aabb4::from_raw(min, std::array::from_fn(|a| min[a] + extent[a])).expect("in space")
}

fn place(random: &mut Random, base: [i64; 4]) -> [i64; 4] {
    base.map(|c| c + random.between(-HALF * UNIT, HALF * UNIT - 1))
}

fn chunk(random: &mut Random, base: [i64; 4], shape: ChunkShape) -> WorldPatch {
    let lattice = Lattice { scale: scale(random, -3, 0), shape };
    let kinds: Vec<Block> = (0..1 + random.below(6)).map(|_| block(random)).collect();
    let solid = random.between(5, 95) as u64;
    let mut blocks = [Block::AIR; CHUNK_BLOCKS];
    for block in &mut blocks {
        if random.below(100) < solid {
            *block = kinds[random.below(kinds.len() as u64) as usize];
        }
    }
    let mut at = place(random, base);
    if shape == ChunkShape::Flat {
        at[3] = 0;
    }
    let cell = chunk_cell(lattice, at);
    let tree = RegionTree::chunk_array(cell, lattice, vec![Arc::new(Chunk::from_blocks(&blocks))]).expect("one chunk");
    WorldPatch::of_tree(tree)
}
