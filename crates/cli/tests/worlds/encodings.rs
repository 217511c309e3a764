//! How a region is kept shows nowhere: one uniform leaf, chunks of one block, dense chunks.

use super::images::{MODES, backend, frame, render, shades};
use super::patches::{UNIT, chunk_cell, palette};
use orthant_render::world::view::{Look, Turns, WorldCamera};
use orthant_render::world::{BuildOptions, DerivedWorld, Leaf, LeafContent};
use orthant_resident::Film;
use orthant_resident::frame::Aov;
use orthant_world::{
    Aabb4, Block, BlockId, CHUNK_BLOCKS, Chunk, ChunkShape, Lattice, Orientation, Palette, Point4, Scale,
};
use std::sync::Arc;

/// The box [-8, 8) x [0, 16) x [-8, 8) x [-8, 8), and of flat chunks its part in 0 <= w < 1.
fn region(shape: ChunkShape) -> Aabb4 {
    match shape {
        ChunkShape::Cube => Aabb4::from_ints([-8, 0, -8, -8], [8, 16, 8, 8]),
        ChunkShape::Flat => Aabb4::from_ints([-8, 0, -8, 0], [8, 16, 8, 1]),
    }
    .expect("a box")
}

/// A leaf for every chunk of the region.
fn chunks(lattice: Lattice, content: &LeafContent) -> Vec<Leaf> {
    let region = region(lattice.shape);
    let edge: i64 = lattice.chunk_extent()[0].raw();
    let mut leaves = Vec::new();
    let flat = lattice.shape == ChunkShape::Flat;
    let steps = |a: usize| -> Vec<i64> {
        if a == 3 && flat {
            return vec![0];
        }
        (region.min_raw()[a].div_euclid(edge)..=(region.max_raw()[a] - 1).div_euclid(edge)).map(|k| k * edge).collect()
    };
    for x in steps(0) {
        for y in steps(1) {
            for z in steps(2) {
                for w in steps(3) {
                    let cell = chunk_cell(lattice, [x, y, z, w]);
                    if let Some(bounds) = cell.intersection(&region) {
                        leaves.push(Leaf { bounds, content: content.clone() });
                    }
                }
            }
        }
    }
    leaves
}

fn images(mut leaves: Vec<Leaf>) -> Vec<Film> {
    let floor = Aabb4::from_ints([-30, -3, -30, -30], [30, 0, 30, 30]).expect("a box");
    leaves.push(Leaf { bounds: floor, content: LeafContent::Uniform(Block::of(BlockId(2), Scale::UNIT)) });
    let mut materials = Palette::new();
    for entry in palette() {
        let id = materials.add(entry.material.clone()).expect("a material");
        assert_eq!(id, entry.id);
    }
    let derived = DerivedWorld::from_leaves(leaves, &materials, &BuildOptions::default()).expect("leaves");
    derived.validate().expect("a sound set");
    let mut backend = backend(&derived);
    let position = Point4::from_raw([13 * UNIT + 77, 12 * UNIT + 12_345, 21 * UNIT + 1, UNIT / 2 + 3]);
    let camera = WorldCamera::new(position, &Turns { yaw: 31.0, xw: 2.0, zw: 3.0, pitch: -17.0 });
    let mut films = Vec::new();
    for mode in MODES {
        for shade in shades() {
            let view = camera.view(&mode, &Look { shade, distance: 300.0, edges: 0.03 });
            films
                .push(render(&mut backend, frame(view, 40, 30, vec![Aov::Albedo, Aov::Normal, Aov::Depth, Aov::Cell])));
        }
    }
    films
}

#[test]
fn one_region_in_three_encodings_gives_identical_images() {
    for (id, scale, shape, own) in [
        (3, 0, ChunkShape::Cube, 1),
        (4, 0, ChunkShape::Cube, 0),
        (5, -1, ChunkShape::Cube, 0),
        (4, 0, ChunkShape::Flat, 0),
        (3, -1, ChunkShape::Flat, 0),
    ] {
        let of = |s: i8| Scale::new(s).expect("a scale");
        let lattice = Lattice { scale: of(scale), shape };
        let block = Block::new(BlockId(id), Orientation::new(77).expect("one of 192"), of(own));
        let whole = vec![Leaf { bounds: region(shape), content: LeafContent::Uniform(block) }];
        let chunk = Arc::new(Chunk::from_blocks(&[block; CHUNK_BLOCKS]));
        let expected = images(whole);
        let of_one = images(chunks(lattice, &LeafContent::Chunk { lattice, chunk }));
        let dense = images(chunks(lattice, &LeafContent::Filled { lattice, block }));
        for i in 0..expected.len() {
            assert!(of_one[i] == expected[i], "block {id}, {shape:?}: image {i} of chunks of one block differs");
            assert!(dense[i] == expected[i], "block {id}, {shape:?}: image {i} of dense chunks differs");
        }
    }
}
