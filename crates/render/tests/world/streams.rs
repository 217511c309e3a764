//! A walk through a streamed world.

use super::costs::plan_all;
use orthant_render::world::{BuildOptions, DerivedWorld, OpLimits};
use orthant_world::stream::{PatchStream, StreamOptions, StreamSource};
use orthant_world::{Aabb4, Generator, RegionNode, RegionTree, World, WorldPatch};

#[test]
fn a_walk_of_forty_steps_leaves_about_the_leaves_of_a_fresh_world() {
    let generator = Generator::Platforms { seed: 7 };
    let mut stream = PatchStream::new(StreamSource::Generator(generator.clone()), StreamOptions::default());
    let mut world = World::new();
    let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let interest = |step: i32| {
        let at = [step * 60, 0, -step * 30, step * 10];
        Aabb4::from_ints(at.map(|c| c - 352), at.map(|c| c + 352)).unwrap()
    };
    let mut untidy: Vec<Aabb4> = Vec::new();
    for step in 0..=40 {
        stream.set_interest(&interest(step)).unwrap();
        while let Some(patch) = stream.next_patch() {
            let applied = world.apply(&patch).unwrap();
            if !applied.palette.is_empty() {
                let batch = derived.plan_palette(&world, &applied.palette).unwrap();
                derived.commit(&batch).unwrap();
            }
            let restructured = applied.removed.iter().map(|(_, region)| region.bounds);
            let dirty: Vec<Aabb4> = applied.changed.iter().copied().chain(restructured).collect();
            plan_all(&mut derived, &world, &dirty, |_, plan| untidy.extend(plan.synced.iter().filter(|_| plan.untidy)));
        }
        for bounds in std::mem::take(&mut untidy) {
            let plan = derived.plan(&world, &bounds, &OpLimits { leaves: 4096, ..OpLimits::default() }).unwrap();
            derived.commit(&plan.batch).unwrap();
        }
    }
    derived.validate().unwrap();
    let covered = stream.covered(&interest(40));
    let mut fresh = World::new();
    let node = RegionNode::Procedural(generator);
    fresh.apply(&WorldPatch::of_tree(RegionTree { bounds: covered, node })).unwrap();
    assert!(fresh.same_content(&world));
    let fresh = DerivedWorld::build(&fresh, &BuildOptions::default()).unwrap();
    let (walked, fresh) = (derived.leaf_count(), fresh.leaf_count());
    assert!(fresh > 20 && 2 * walked <= 3 * fresh, "{walked} leaves, a fresh world has {fresh}");
}
