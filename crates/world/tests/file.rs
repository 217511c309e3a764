//! World files: what comes back, and what damage does.

mod common;

use common::Random;
use orthant_world::edit::{Sphere, fill_sphere, set_voxel};
use orthant_world::file::{self, FileFault, ReadOptions, read_bytes, salvage_bytes};
use orthant_world::{
    Aabb4, Block, BlockId, Fixed, Generator, Lattice, Material, PaletteEntry, Point4, RegionNode, RegionTree, Scale,
    World, WorldPatch,
};
use std::sync::Arc;

fn generated(generator: Generator, half: i32) -> World {
    let mut world = World::new();
    let bounds = Aabb4::from_ints([-half; 4], [half; 4]).unwrap();
    world.apply(&WorldPatch::of_tree(RegionTree { bounds, node: RegionNode::Procedural(generator) })).unwrap();
    world
}

/// A little of everything.
fn mixed() -> World {
    let mut world = generated(Generator::Platforms { seed: 3 }, 300);
    let materials = [Material::colored("a", [0.1, 0.5, 0.9]), Material::colored("ä", [1.0; 3])];
    let entry = |(i, material)| PaletteEntry { id: BlockId(100 + i as u16), material };
    let mut patch = WorldPatch::of_tree(RegionTree::empty(Aabb4::from_ints([0; 4], [1; 4]).unwrap()));
    patch.palette = materials.into_iter().enumerate().map(entry).collect();
    world.apply(&patch).unwrap();
    let mut random = Random(8);
    for _ in 0..30 {
        let scale = Scale::new(random.below(5) as i8 - 2).unwrap();
        let index = std::array::from_fn(|_| random.below(12) as i64 - 6);
        let block = Block::of(BlockId(100 + random.below(2) as u16), scale);
        world.apply(&set_voxel(index, scale, block).unwrap()).unwrap();
    }
    for (kinds, at) in [(2, 1000), (3, 1008), (14, 1016), (200, 1024), (3000, 1032)] {
        let chunk = orthant_world::Chunk::from_blocks(&std::array::from_fn(|i| {
            Block::of(BlockId((i * 7 % kinds) as u16), Scale::UNIT)
        }));
        let bounds = Aabb4::from_ints([at, 0, 0, 0], [at + 8, 8, 8, 8]).unwrap();
        let tree = RegionTree::chunk_array(bounds, Lattice::cube(Scale::UNIT), vec![Arc::new(chunk)]).unwrap();
        world.apply(&WorldPatch::of_tree(tree)).unwrap();
    }
    world
}

fn bytes_of(world: &World) -> Vec<u8> {
    let mut bytes = Vec::new();
    file::write_to(&mut bytes, world).unwrap();
    bytes
}

#[test]
fn worlds_come_back_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut dug = generated(Generator::Terrain { seed: 2 }, 40);
    let sphere = Sphere { center: Point4::from_ints([0; 4]), radius: Fixed::from_int(9), scale: Scale::UNIT };
    for patch in fill_sphere(&dug.clone(), &sphere, Block::AIR, &Default::default()).unwrap() {
        dug.apply(&patch).unwrap();
    }
    for world in [World::new(), generated(Generator::Flat, 30), mixed(), dug] {
        let path = folder.path().join("w.orw");
        file::write(&path, &world).unwrap();
        let again = file::read(&path, &ReadOptions::default()).unwrap();
        again.validate().unwrap();
        assert!(again == world);
        assert_eq!(again.palette(), world.palette());
        assert_eq!(again.region_count(), world.region_count());
        assert_eq!(bytes_of(&again), bytes_of(&world), "the same regions are the same bytes");
        let salvaged = file::salvage(&path, &ReadOptions::default()).unwrap();
        assert!(salvaged.damage.is_empty() && salvaged.world == world);
    }
}

#[test]
fn a_flipped_bit_in_any_byte_is_an_error_and_never_another_world() {
    let world = mixed();
    let good = bytes_of(&world);
    let options = ReadOptions::default();
    for at in 0..good.len() {
        let mut bad = good.clone();
        bad[at] ^= 1 << (at % 8);
        let error = read_bytes("w.orw", &bad, &options).expect_err("a flipped bit");
        assert!(error.offset <= at as u64, "bit {at} was noticed at {}", error.offset);
        assert!(error.to_string().starts_with("w.orw: byte "));
        if at % 16 == 0
            && let Ok(salvaged) = salvage_bytes("w.orw", &bad, &options)
        {
            assert!(!salvaged.damage.is_empty());
            salvaged.world.validate().unwrap();
        }
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let good = bytes_of(&mixed());
    for length in 0..good.len() {
        let cut = &good[..length];
        assert!(read_bytes("w.orw", cut, &ReadOptions::default()).is_err(), "{length} bytes");
    }
    let mut longer = good;
    longer.push(0);
    let error = read_bytes("w.orw", &longer, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error.fault, FileFault::Trailing));
}

#[test]
fn what_is_intact_can_be_salvaged() {
    let world = generated(Generator::Terrain { seed: 4 }, 100);
    let good = bytes_of(&world);
    let marker = b"\xf0section";
    let sections: Vec<usize> = (0..good.len()).filter(|&i| good[i..].starts_with(marker)).collect();
    assert!(sections.len() >= 4, "{} sections in {} bytes", sections.len(), good.len());
    // One bit in the payload of the second section, and one in the header of the third.
    for damaged in [sections[1] + 100, sections[2] + 20, 3] {
        let mut bad = good.clone();
        bad[damaged] ^= 4;
        let salvaged = salvage_bytes("w.orw", &bad, &ReadOptions::default()).unwrap();
        assert!(!salvaged.damage.is_empty());
        salvaged.world.validate().unwrap();
        assert_eq!(salvaged.world.palette(), world.palette());
        let lost = world.region_count() - salvaged.world.region_count();
        assert!(damaged == 3 || (0 < lost && lost < world.region_count()), "lost {lost}");
        // Nothing is there that was not.
        for (_, region) in salvaged.world.regions() {
            let found = world.region_at(region.bounds.min()).unwrap().1;
            assert_eq!(found, region);
        }
    }
}

#[test]
fn memory_is_bounded_before_it_is_taken() {
    let good = bytes_of(&mixed());
    let error = read_bytes("w.orw", &good, &ReadOptions { max_memory: good.len() as u64 + 1000 }).unwrap_err();
    assert!(matches!(error.fault, FileFault::OverBudget { .. }), "{error}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("w.orw");
    std::fs::write(&path, &good).unwrap();
    let error = file::read(&path, &ReadOptions { max_memory: 10 }).unwrap_err();
    assert!(matches!(error.fault, FileFault::OverBudget { .. }), "{error}");
}

#[test]
fn what_is_no_world_is_said_to_be_none() {
    for bytes in [&b""[..], b"glTF\x02\0\0\0", &[0; 500]] {
        let error = read_bytes("x", bytes, &ReadOptions::default()).unwrap_err();
        assert!(matches!(error.fault, FileFault::NotAWorld), "{error}");
    }
}
