//! Streaming: what the receiver has is what is of interest.

mod common;

use orthant_world::stream::{PatchStream, StreamOptions, StreamSource};
use orthant_world::{
    Aabb4, Block, BlockId, Content, Fixed, Generator, RegionNode, RegionTree, Scale, World, WorldPatch,
};
use std::sync::Arc;

fn about(center: [i32; 4], half: [i32; 4]) -> Aabb4 {
    Aabb4::from_ints(std::array::from_fn(|a| center[a] - half[a]), std::array::from_fn(|a| center[a] + half[a]))
        .unwrap()
}

fn fresh(generator: &Generator, bounds: Aabb4) -> World {
    let mut world = World::new();
    let node = RegionNode::Procedural(generator.clone());
    world.apply(&WorldPatch::of_tree(RegionTree { bounds, node })).unwrap();
    world
}

fn drain(stream: &mut PatchStream, world: &mut World) -> Vec<WorldPatch> {
    let mut patches = Vec::new();
    while let Some(patch) = stream.next_patch() {
        world.apply(&patch).unwrap();
        patches.push(patch);
    }
    assert!(stream.is_done());
    patches
}

#[test]
fn a_walk_leaves_what_a_fresh_world_has() {
    let generator = Generator::Platforms { seed: 11 };
    let options = StreamOptions { cell_log2: 8, ..StreamOptions::default() };
    let mut stream = PatchStream::new(StreamSource::Generator(generator.clone()), options);
    let mut world = World::new();
    for step in 0..40 {
        let interest = about([step * 60, step * 7, -step * 30, step * 20], [700; 4]);
        stream.set_interest(&interest).unwrap();
        drain(&mut stream, &mut world);
        if step % 13 == 0 || step == 39 {
            let fresh = fresh(&generator, stream.covered(&interest));
            assert!(world == fresh, "step {step}");
            let (walked, direct) = (world.region_count(), fresh.region_count());
            assert!(2 * walked <= 3 * direct, "step {step}: {walked} regions, a fresh world has {direct}");
        }
    }
    world.validate().unwrap();
    // Standing still sends nothing.
    stream.set_interest(&about([39 * 60, 39 * 7, -39 * 30, 39 * 20], [700; 4])).unwrap();
    assert!(stream.next_patch().is_none());
    // Far away nothing of it is left.
    stream.set_interest(&about([1 << 20; 4], [100; 4])).unwrap();
    drain(&mut stream, &mut world);
    let there = stream.covered(&about([1 << 20; 4], [100; 4]));
    assert!(world == fresh(&generator, there));
}

#[test]
fn patches_are_bounded_and_come_nearest_first() {
    let terrain = Generator::Terrain { seed: 6 };
    let whole = fresh(&terrain, about([0; 4], [100, 100, 100, 100]));
    let options = StreamOptions { cell_log2: 6, max_regions: 20, max_chunks: 8, ..StreamOptions::default() };
    let mut stream = PatchStream::new(StreamSource::World(Arc::new(whole.clone())), options);
    let interest = about([5, 3, -2, 0], [120; 4]);
    stream.set_interest(&interest).unwrap();
    let mut world = World::new();
    let patches = drain(&mut stream, &mut world);
    assert!(world == whole);
    let mut last = 0.0;
    for patch in &patches {
        let RegionNode::Branch(parts) = &patch.subtree.node else { panic!("content is a branch") };
        let chunks = parts.iter().filter(|part| matches!(part.node, RegionNode::ChunkArray(_))).count();
        assert!(parts.len() <= 20 && chunks <= 8, "{} regions, {chunks} chunks", parts.len());
        // The cell of the patch is no nearer than that of the one before.
        let cell = 64 * Fixed::ONE.raw();
        let min = patch.authoritative_bounds.min_raw().map(|c| c.div_euclid(cell) * cell);
        let distance: f64 = (0..4)
            .map(|a| {
                let d = (2 * min[a] + cell) as f64 - (interest.min_raw()[a] + interest.max_raw()[a]) as f64;
                d * d
            })
            .sum();
        assert!(distance >= last, "nearest first");
        last = distance;
    }
}

#[test]
fn what_changed_at_the_source_is_sent_again() {
    let mut source = fresh(&Generator::Flat, about([0; 4], [200; 4]));
    let mut stream = PatchStream::new(StreamSource::World(Arc::new(source.clone())), StreamOptions::default());
    stream.set_interest(&about([0; 4], [150; 4])).unwrap();
    let mut world = World::new();
    drain(&mut stream, &mut world);
    let hole = Aabb4::from_ints([3, -8, 3, 3], [5, 0, 5, 5]).unwrap();
    let tower = Aabb4::from_ints([40, 0, 0, 0], [41, 9, 1, 1]).unwrap();
    source.apply(&WorldPatch::of_tree(RegionTree::empty(hole))).unwrap();
    source.apply(&WorldPatch::of_tree(RegionTree::uniform(tower, Block::of(BlockId(1), Scale::UNIT)))).unwrap();
    stream.resend(&hole.hull(&tower), StreamSource::World(Arc::new(source.clone())));
    let sent = drain(&mut stream, &mut world);
    assert!(!sent.is_empty() && sent.len() < 20);
    assert!(world == source);
    assert!(world.regions().any(|(_, region)| matches!(region.content, Content::Uniform(_))));
}

#[test]
fn a_box_of_too_many_cells_is_refused() {
    let mut stream = PatchStream::new(StreamSource::Generator(Generator::Flat), StreamOptions::default());
    assert!(stream.set_interest(&Aabb4::SPACE).is_err());
    assert!(stream.is_done());
}
