//! What an edit costs and what it leaves: nothing that depends on how large the world is.

mod common;

use common::Random;
use orthant_world::{
    Aabb4, Block, BlockId, ChunkShape, Content, Lattice, Point4, RegionTree, Scale, Work, World, WorldPatch,
};
use std::sync::Arc;

fn block(id: u16) -> Block {
    Block::of(BlockId(id), Scale::UNIT)
}

fn ints(min: [i32; 4], max: [i32; 4]) -> Aabb4 {
    Aabb4::from_ints(min, max).unwrap()
}

fn voxel(at: [i32; 4]) -> Aabb4 {
    ints(at, at.map(|c| c + 1))
}

fn fill(bounds: Aabb4, block: Block) -> WorldPatch {
    WorldPatch::of_tree(RegionTree::uniform(bounds, block))
}

/// A platform of an odd size at an odd place.
fn platform() -> Aabb4 {
    ints([-103, 5, -77, -91], [150, 21, 99, 120])
}

fn world_with(bounds: Aabb4) -> World {
    let mut world = World::new();
    world.apply(&fill(bounds, block(1))).unwrap();
    world
}

/// Uniform regions and chunk regions.
fn kinds(world: &World) -> (usize, usize) {
    let uniform = world.regions().filter(|(_, region)| matches!(region.content, Content::Uniform(_))).count();
    (uniform, world.region_count() - uniform)
}

#[test]
fn a_hole_in_a_platform_leaves_eight_slabs_and_a_chunk() {
    let mut world = world_with(platform());
    world.apply(&fill(voxel([3, 12, 5, 6]), Block::AIR)).unwrap();
    assert_eq!(kinds(&world), (8, 1));
    world.apply(&fill(voxel([4, 13, 5, 7]), block(2))).unwrap();
    assert_eq!(kinds(&world), (8, 1), "a second block of the same cell goes into the same chunk");
    // At the edge fewer slabs are left, and the chunk does not own more of the platform than the cell.
    let mut world = world_with(platform());
    world.apply(&fill(voxel([-103, 5, -77, -91]), Block::AIR)).unwrap();
    assert_eq!(kinds(&world), (4, 1));
}

#[test]
fn breaking_and_replacing_a_voxel_a_thousand_times_leaves_one_region() {
    let mut world = world_with(platform());
    let (whole, at) = (world.clone(), voxel([17, 9, -30, 2]));
    for _ in 0..1000 {
        assert!(!world.apply(&fill(at, Block::AIR)).unwrap().is_noop());
        assert!(!world.apply(&fill(at, block(1))).unwrap().is_noop());
    }
    assert_eq!(world.region_count(), 1);
    assert!(world.slot_count() <= 24, "{} slots", world.slot_count());
    assert!(world == whole);
    world.validate().unwrap();
}

#[test]
fn a_platform_that_is_whole_again_is_one_region_in_whatever_order() {
    for seed in 0..12 {
        let mut random = Random(seed);
        let mut world = world_with(platform());
        let (min, size) = ([-103, 5, -77, -91], [253, 16, 176, 211]);
        let mut broken: Vec<[i32; 4]> =
            (0..40).map(|_| std::array::from_fn(|a| min[a] + random.below(size[a]) as i32)).collect();
        broken.dedup();
        broken.iter().for_each(|&at| drop(world.apply(&fill(voxel(at), Block::AIR)).unwrap()));
        let fragmented = world.region_count();
        assert!(fragmented <= 1 + 8 * broken.len() + broken.len(), "{fragmented} regions for {} holes", broken.len());
        while !broken.is_empty() {
            let at = broken.swap_remove(random.below(broken.len() as u64) as usize);
            world.apply(&fill(voxel(at), block(1))).unwrap();
        }
        assert_eq!(world.region_count(), 1, "seed {seed}, from {fragmented} regions");
        world.validate().unwrap();
    }
}

#[test]
fn place_and_remove_cycles_do_not_fragment() {
    let mut random = Random(5);
    let mut world = world_with(platform());
    let mut holes: Vec<[i32; 4]> = Vec::new();
    let (mut early, mut late) = (0, 0);
    for step in 0..6000 {
        if holes.len() < 30 {
            let at = [[-103, 253], [3, 20], [-77, 176], [-91, 211]]
                .map(|[min, size]: [i32; 2]| min + random.below(size as u64) as i32);
            let old = world.block_at(Point4::from_ints(at));
            let new = if old.is_air() { block(1) } else { Block::AIR };
            world.apply(&fill(voxel(at), new)).unwrap();
            holes.push(at);
        } else {
            // What was done longest ago is undone, whichever way it was.
            let at = holes.remove(random.below(10) as usize);
            let inside = platform().contains(&voxel(at));
            world.apply(&fill(voxel(at), if inside { block(1) } else { Block::AIR })).unwrap();
        }
        match step {
            500..2000 => early = early.max(world.region_count()),
            4500.. => late = late.max(world.region_count()),
            _ => {}
        }
    }
    assert!(late <= early * 3 / 2, "at most {early} regions early, {late} late");
    assert!(world.slot_count() <= early * 2, "{} slots for {early} regions", world.slot_count());
    for at in holes {
        let inside = platform().contains(&voxel(at));
        world.apply(&fill(voxel(at), if inside { block(1) } else { Block::AIR })).unwrap();
    }
    assert_eq!(world.region_count(), 1);
}

#[test]
fn a_box_of_bricks_that_cannot_be_joined_in_pairs_is_one_region() {
    // Four bricks around a fifth, in x and z.
    let bricks = [([0, 0], [2, 1]), ([2, 0], [3, 2]), ([1, 2], [3, 3]), ([0, 1], [1, 3]), ([1, 1], [2, 2])];
    let mut world = World::new();
    for (min, max) in bricks {
        let at = |[x, z]: [i32; 2], y: i32, w: i32| [x * 100, y, z * 100, w];
        world.apply(&fill(ints(at(min, 0, 0), at(max, 100, 100)), block(1))).unwrap();
    }
    assert_eq!(world.region_count(), 1);
}

#[test]
fn a_chunk_of_one_block_becomes_uniform_and_an_empty_one_goes() {
    let lattice = Lattice::cube(Scale::UNIT);
    let chunk = |fill: &dyn Fn(usize) -> u16| {
        Arc::new(orthant_world::Chunk::from_blocks(&std::array::from_fn(|i| block(fill(i)))))
    };
    let cell = ints([8, 0, 0, 0], [16, 8, 8, 8]);
    let tree = |chunk| RegionTree::chunk_array(cell, lattice, vec![chunk]).unwrap();
    let mut world = World::new();
    world.apply(&WorldPatch::of_tree(tree(chunk(&|i| 1 + (i % 2) as u16)))).unwrap();
    assert_eq!(kinds(&world), (0, 1));
    world.apply(&WorldPatch::of_tree(tree(chunk(&|_| 1)))).unwrap();
    assert_eq!(kinds(&world), (1, 0));
    world.apply(&WorldPatch::of_tree(tree(chunk(&|i| u16::from(i == 77))))).unwrap();
    assert_eq!(kinds(&world), (1, 0), "one block is a box");
    let at = ChunkShape::Cube.at(77).map(|c| c as i32);
    world.apply(&fill(voxel([at[0] + 8, at[1], at[2], at[3]]), Block::AIR)).unwrap();
    assert_eq!(world.region_count(), 0);
}

#[test]
fn worlds_with_the_same_blocks_are_equal_whatever_the_order() {
    for seed in 0..8 {
        let mut random = Random(seed);
        // Boxes that do not overlap, so that the order cannot matter.
        let boxes: Vec<(Aabb4, u16)> = (0..60)
            .map(|i| {
                let at = [i % 5 * 9, i / 5 % 4 * 9, i / 20 * 9, random.below(5) as i32];
                let extent: [i32; 4] = std::array::from_fn(|_| 1 + random.below(9) as i32);
                (ints(at, std::array::from_fn(|a| at[a] + extent[a])), 1 + random.below(2) as u16)
            })
            .collect();
        let build = |order: &[usize]| {
            let mut world = World::new();
            order.iter().for_each(|&i| drop(world.apply(&fill(boxes[i].0, block(boxes[i].1))).unwrap()));
            world
        };
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        let forwards = build(&order);
        for i in (1..order.len()).rev() {
            order.swap(i, random.below(i as u64 + 1) as usize);
        }
        let mut shuffled = build(&order);
        assert!(forwards.same_content(&shuffled) && shuffled.same_content(&forwards));
        let at = boxes[3].0.min().0;
        let one = Point4(at);
        let inside = Aabb4::new(one, Point4(at.map(|c| c.checked_add(orthant_world::Fixed::ONE).unwrap()))).unwrap();
        shuffled.apply(&fill(inside, block(9))).unwrap();
        assert!(!forwards.same_content(&shuffled) && !shuffled.same_content(&forwards));
    }
}

/// A world of many platforms, each alone.
fn scatter(count: i32) -> World {
    let mut world = World::new();
    for i in 0..count {
        let at = [i % 10 * 500, i / 10 % 10 * 100, i / 100 % 10 * 500, i / 1000 * 500];
        world.apply(&fill(ints(at, [at[0] + 251, at[1] + 16, at[2] + 199, at[3] + 288]), block(1))).unwrap();
    }
    world
}

#[test]
fn an_edit_costs_the_same_in_a_large_world() {
    // The most that breaking and replacing a voxel takes, over many platforms.
    let cost = |world: &mut World, count: i32| {
        let mut random = Random(1);
        let mut most = Work::default();
        for _ in 0..100 {
            let i = random.below(count as u64) as i32;
            let at = [i % 10 * 500 + 17, i / 10 % 10 * 100 + 8, i / 100 % 10 * 500 + 33, i / 1000 * 500 + 51];
            for new in [Block::AIR, block(1)] {
                let work = world.apply(&fill(voxel(at), new)).unwrap().work;
                most.regions_read = most.regions_read.max(work.regions_read);
                most.regions_written = most.regions_written.max(work.regions_written);
                most.index_nodes = most.index_nodes.max(work.index_nodes);
            }
        }
        most
    };
    let small = cost(&mut scatter(100), 100);
    let large = cost(&mut scatter(10_000), 10_000);
    assert!(large.regions_written <= small.regions_written + 4, "{small:?} {large:?}");
    assert!(large.regions_read <= small.regions_read + 16, "{small:?} {large:?}");
    // A hundred times as many regions: log2(100) more levels at most for each of the searches and edits.
    assert!(large.index_nodes <= small.index_nodes * 3, "{small:?} {large:?}");
}

#[test]
fn an_edit_costs_the_same_in_a_huge_platform() {
    let cost = |half: i32| {
        let mut world = world_with(ints([-half, 0, -half, -half], [half, 16, half, half]));
        world.apply(&fill(voxel([3, 5, 7, 9]), Block::AIR)).unwrap().work
    };
    assert_eq!(cost(100), cost(1 << 30));
}

#[test]
fn what_changes_nothing_writes_nothing() {
    let mut world = scatter(50);
    world.apply(&fill(voxel([17, 8, 33, 51]), Block::AIR)).unwrap();
    let before = world.clone();
    for patch in [
        fill(voxel([17, 8, 33, 51]), Block::AIR),
        fill(voxel([18, 8, 33, 51]), block(1)),
        fill(ints([-50, -50, -50, -50], [-1, -1, -1, -1]), Block::AIR),
        WorldPatch::of_tree(world.extract(&ints([-9, -9, -9, -9], [2000, 500, 100, 100]))),
        WorldPatch::of_tree(world.extract(&Aabb4::SPACE)),
    ] {
        let applied = world.apply(&patch).unwrap();
        assert!(applied.is_noop() && applied.changed.is_empty());
        assert!(applied.added.is_empty() && applied.removed.is_empty() && applied.updated.is_empty());
        assert_eq!(applied.work.regions_written, 0);
        assert_eq!(world.revision(), before.revision());
    }
    assert!(world.regions().eq(before.regions()));
}

#[test]
fn what_was_taken_out_as_a_tree_makes_the_same_world() {
    let mut world = scatter(30);
    let mut random = Random(3);
    for _ in 0..200 {
        let at = [600, 50, 40, 400].map(|size| random.below(size) as i32);
        world.apply(&fill(voxel(at), block(random.below(3) as u16))).unwrap();
    }
    let tree = world.extract(&Aabb4::SPACE);
    let json = serde_json::to_string(&WorldPatch::of_tree(tree)).unwrap();
    let mut again = World::new();
    again.apply(&serde_json::from_str(&json).unwrap()).unwrap();
    assert!(again == world);
    again.validate().unwrap();
}

#[test]
fn a_patch_of_thousands_of_pieces_over_one_region_is_compared_piece_by_piece() {
    let row = ints([0, 0, 0, 0], [12_000, 1, 1, 1]);
    let mut world = world_with(ints([-5; 4], [12_005, 5, 5, 5]));
    let posts: Vec<RegionTree> =
        (0..6000).map(|i| RegionTree::uniform(voxel([2 * i, 0, 0, 0]), block(1 + (i % 2) as u16))).collect();
    let patch = WorldPatch::of_tree(RegionTree::branch(row, posts));
    let applied = world.apply(&patch).unwrap();
    // Every gap, and every second post.
    assert_eq!(applied.changed.len(), 6000 + 3000);
    for i in [0, 1, 2, 3, 11_998, 11_999] {
        let expected = if i % 2 == 1 { Block::AIR } else { block(1 + (i / 2 % 2) as u16) };
        assert_eq!(world.block_at(Point4::from_ints([i, 0, 0, 0])), expected);
    }
    world.validate().unwrap();
    assert!(world.region_count() <= 12_000 / 8 * 9, "{} regions", world.region_count());
    assert!(world.apply(&patch).unwrap().is_noop());
}

#[test]
fn a_refused_patch_changes_nothing() {
    let mut world = scatter(3);
    let before = world.clone();
    let inner = ints([0; 4], [5; 4]);
    let outside = RegionTree::branch(inner, vec![RegionTree::uniform(ints([0; 4], [6; 4]), block(2))]);
    let overlap = RegionTree::branch(
        inner,
        vec![RegionTree::uniform(ints([0; 4], [3; 4]), block(2)), RegionTree::empty(ints([2; 4], [5; 4]))],
    );
    for patch in [
        WorldPatch::of_tree(outside),
        WorldPatch::of_tree(overlap),
        WorldPatch::new(inner, RegionTree::uniform(ints([0; 4], [6; 4]), block(2))),
    ] {
        assert!(world.apply(&patch).is_err());
        assert!(world.regions().eq(before.regions()) && world.revision() == before.revision());
    }
}
