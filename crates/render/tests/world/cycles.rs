//! Nothing only grows.

use super::interpreter::Interpreter;
use super::patches::Random;
use orthant_render::world::{BuildOptions, DerivedWorld, OpLimits};
use orthant_world::edit::fill_box;
use orthant_world::{Aabb4, Block, BlockId, Chunk, Lattice, RegionTree, Scale, World, WorldPatch};
use std::sync::Arc;

fn noise(random: &mut Random, kinds: u64) -> Arc<Chunk> {
    let blocks = std::array::from_fn(|_| Block::of(BlockId(random.below(kinds) as u16), Scale::UNIT));
    Arc::new(Chunk::from_blocks(&blocks))
}

/// The most that was alive at once.
#[derive(Default)]
struct Peak {
    nodes: usize,
    leaves: usize,
    units: usize,
}

#[test]
fn a_hundred_thousand_cycles_of_placing_and_removing_use_the_arenas_again() {
    let mut random = Random(1);
    let mut world = World::new();
    let ground = Aabb4::from_ints([-100, -16, -100, -100], [100, 0, 100, 100]).unwrap();
    world.apply(&fill_box(ground, Block::of(BlockId(1), Scale::UNIT))).unwrap();
    let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let mut arenas = Interpreter::after(derived.load_batches(u64::MAX));
    let mut peak = Peak::default();
    // Dense chunks of all widths, which come and go: a payload of holes that do not fit.
    let chunks: Vec<Arc<Chunk>> = (0..24).map(|i| noise(&mut random, [2, 4, 16, 200][i % 4])).collect();
    let lattice = Lattice::cube(Scale::UNIT);
    let mut is_placed = [false; 24];
    let mut cycles = 0;
    for step in 0_u64.. {
        if cycles == 100_000 {
            break;
        }
        let patch = if step % 6 == 0 {
            let at = random.below(24);
            let min = [8 * at as i32 % 64, 8, 8 * (at as i32 / 8), 0];
            let bounds = Aabb4::from_ints(min, min.map(|c| c + 8)).unwrap();
            let is_placed = &mut is_placed[at as usize];
            *is_placed = !*is_placed;
            cycles += u64::from(!*is_placed);
            if *is_placed {
                let chunk = random.pick(&[at as usize, 0, 1, 2, 3]);
                WorldPatch::of_tree(RegionTree::chunk_array(bounds, lattice, vec![chunks[chunk].clone()]).unwrap())
            } else {
                WorldPatch::of_tree(RegionTree::empty(bounds))
            }
        } else {
            // A voxel of the ground, and back again.
            let at = [random.below(40) as i32, -4, random.below(3) as i32, 0];
            let bounds = Aabb4::from_ints(at, at.map(|c| c + 1)).unwrap();
            let is_air = world.block_at(bounds.min()).is_air();
            cycles += u64::from(is_air);
            fill_box(bounds, Block::of(BlockId(u16::from(is_air)), Scale::UNIT))
        };
        let applied = world.apply(&patch).unwrap();
        for bounds in &applied.changed {
            let plan = derived.plan(&world, bounds, &OpLimits::default()).unwrap();
            if !plan.batch.is_empty() {
                arenas.apply(&plan.batch);
                derived.commit(&plan.batch).unwrap();
            }
        }
        peak.nodes = peak.nodes.max(arenas.live_nodes.len());
        peak.leaves = peak.leaves.max(arenas.live_leaves.len());
        peak.units = peak.units.max(arenas.live_units.len());
    }
    derived.validate().unwrap();
    arenas.check_mirror(derived.mirror());
    arenas.reach(derived.origin());
    let units = arenas.payload.len() / orthant_resident::world::payload::ALIGN as usize;
    for (what, len, peak) in [
        ("nodes", arenas.nodes.len(), peak.nodes),
        ("leaves", arenas.leaves.len(), peak.leaves),
        ("payload", units, peak.units),
    ] {
        assert!(2 * len <= 3 * peak, "{what}: {len} rows for at most {peak}");
    }
    assert!(peak.units > 100 && peak.leaves > 20);
}
