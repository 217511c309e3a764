//! What an edit may write.

use super::interpreter::Interpreter;
use super::patches::Random;
use orthant_render::world::{BuildOptions, DerivedWorld, OpLimits, Plan};
use orthant_resident::world::{MutationBatch, Root};
use orthant_world::edit::fill_box;
use orthant_world::{
    Aabb4, Block, BlockId, Generator, Point4, RegionId, RegionNode, RegionTree, Scale, World, WorldPatch,
};
use std::collections::{BTreeMap, BTreeSet};

pub fn platforms(half_extent: i32) -> World {
    let bounds = Aabb4::from_ints([-half_extent; 4], [half_extent; 4]).unwrap();
    let mut world = World::new();
    let node = RegionNode::Procedural(Generator::Platforms { seed: 7 });
    world.apply(&WorldPatch::of_tree(RegionTree { bounds, node })).unwrap();
    world
}

/// A voxel in one of the regions.
pub fn voxel_in(world: &World, ids: &[RegionId], random: &mut Random) -> Option<Aabb4> {
    let bounds = world.region(random.pick(ids))?.bounds;
    let extent = bounds.extent_raw();
    let min = std::array::from_fn(|a| (bounds.min_raw()[a] + random.below(extent[a] as u64) as i64) >> 16 << 16);
    Aabb4::from_raw(min, min.map(|c| c + (1 << 16))).ok()
}

pub fn plan_all(
    derived: &mut DerivedWorld,
    world: &World,
    dirty: &[Aabb4],
    mut each: impl FnMut(&DerivedWorld, &Plan),
) {
    let mut open = dirty.to_vec();
    while let Some(bounds) = open.pop() {
        let plan = derived.plan(world, &bounds, &OpLimits::default()).unwrap();
        each(derived, &plan);
        if !plan.batch.is_empty() {
            derived.commit(&plan.batch).unwrap();
        }
        open.extend(plan.deferred);
    }
}

/// The parents of nodes and leaves.
fn parents(arenas: &Interpreter) -> BTreeMap<u32, u32> {
    let mut parents = BTreeMap::new();
    for &slot in &arenas.live_nodes {
        for child in arenas.nodes[slot as usize].children.into_iter().filter(|&child| child != Root::EMPTY) {
            parents.insert(child.0, slot);
        }
    }
    parents
}

/// Nodes on the root paths of leaves, and the two below each of them that a rotation of it may write.
fn about_paths(arenas: &Interpreter, leaves: impl Iterator<Item = u32>, near: &mut BTreeSet<u32>) {
    let parents = parents(arenas);
    for leaf in leaves {
        let mut at = Root::leaf(leaf).0;
        while let Some(&parent) = parents.get(&at) {
            near.insert(parent);
            let nodes = arenas.nodes[parent as usize].children.into_iter().filter_map(Root::as_node);
            near.extend(nodes);
            at = parent;
        }
    }
}

fn changed_leaves(batch: &MutationBatch) -> impl Iterator<Item = u32> + '_ {
    batch.leaf_writes.iter().map(|(slot, _)| *slot).chain(batch.freed_leaves.iter().copied())
}

#[test]
fn an_edit_writes_nodes_on_the_paths_of_what_it_changes_and_no_more_than_the_depth_allows() {
    let mut world = platforms(704);
    let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let mut arenas = Interpreter::after(derived.load_batches(u64::MAX));
    let ids: Vec<_> = world.regions().map(|(id, _)| id).collect();
    let mut random = Random(3);
    let mut placed: Vec<(Aabb4, Block)> = Vec::new();
    for step in 0..300 {
        // Break or put one; or take one back, so that slabs join.
        let (bounds, block) = match placed.pop() {
            Some(before) if step % 3 == 0 => before,
            last => {
                placed.extend(last);
                let Some(bounds) = voxel_in(&world, &ids, &mut random) else { continue };
                placed.push((bounds, world.block_at(bounds.min())));
                (bounds, Block::of(BlockId(random.pick(&[0, 0, 9])), Scale::UNIT))
            }
        };
        let applied = world.apply(&fill_box(bounds, block)).unwrap();
        plan_all(&mut derived, &world, &applied.changed, |derived, plan| {
            let counts = plan.counts;
            let leaves = counts.leaves_added + counts.leaves_removed + counts.leaves_changed;
            assert!(!plan.untidy && plan.deferred.is_empty());
            assert!((1..=20).contains(&leaves), "{counts:?}");
            assert_eq!(counts.node_writes, plan.batch.node_writes.len());
            let most = (4 * derived.depth() as usize + 32) * leaves;
            assert!(counts.node_writes <= most, "{counts:?} at depth {}", derived.depth());
            assert!(counts.chunks_written <= 2 && plan.batch.payload_writes.len() == counts.chunks_written);

            let mut near = BTreeSet::new();
            about_paths(&arenas, changed_leaves(&plan.batch), &mut near);
            arenas.apply(&plan.batch);
            about_paths(&arenas, changed_leaves(&plan.batch), &mut near);
            for (slot, _) in &plan.batch.node_writes {
                assert!(near.contains(slot), "node {slot} is on no path of what changed");
            }
        });
    }
    assert_eq!(derived.leaf_count(), world.region_count());
    derived.validate().unwrap();
}

#[test]
fn a_patch_that_changes_nothing_and_a_box_in_which_nothing_differs_write_nothing() {
    let mut world = platforms(352);
    let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let bounds = Aabb4::from_ints([-2; 4], [-1; 4]).unwrap();
    let applied = world.apply(&fill_box(bounds, world.block_at(Point4::from_ints([-2; 4])))).unwrap();
    assert!(applied.is_noop() && applied.changed.is_empty());
    let before = derived.mirror().clone();
    let plan = derived.plan(&world, &bounds, &OpLimits::default()).unwrap();
    assert!(plan.batch.is_empty());
    assert_eq!(plan.batch.upload_bytes(), 0);
    assert!(plan.counts.looked_at <= 8, "{:?}", plan.counts);
    assert_eq!(derived.mirror().revision, before.revision);
}

#[test]
fn edits_leave_a_tree_that_is_nearly_as_good_as_a_fresh_one() {
    let mut world = platforms(704);
    let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let ids: Vec<_> = world.regions().map(|(id, _)| id).collect();
    let mut random = Random(5);
    for _ in 0..2000 {
        let Some(bounds) = voxel_in(&world, &ids, &mut random) else { continue };
        let applied = world.apply(&fill_box(bounds, Block::of(BlockId(random.pick(&[0, 0, 9])), Scale::UNIT))).unwrap();
        plan_all(&mut derived, &world, &applied.changed, |_, _| ());
    }
    let fresh = DerivedWorld::from_leaves(derived.leaves(), world.palette(), &BuildOptions::default()).unwrap();
    let ratio = derived.sah_cost() / fresh.sah_cost();
    assert!(ratio <= 1.3, "{ratio}");
}
