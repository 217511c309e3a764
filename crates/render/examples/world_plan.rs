//! Times of the planner alone: full builds, voxel edits, boxes in which nothing differs, and what edits do to the tree.
//!
//! `cargo run --release -p orthant-render --example world_plan -- 352 704 1040 2080`: half extents of `platforms`, in units.

use orthant_render::world::{BuildOptions, DerivedWorld, OpLimits};
use orthant_resident::world::WorldArenas;
use orthant_world::edit::fill_box;
use orthant_world::{Aabb4, Block, BlockId, Generator, RegionId, RegionNode, RegionTree, Scale, World, WorldPatch};
use std::time::{Duration, Instant};

fn main() {
    let extents: Vec<i32> = std::env::args().skip(1).filter_map(|arg| arg.parse().ok()).collect();
    for half_extent in if extents.is_empty() { vec![352, 704, 1040, 2080] } else { extents } {
        measure(half_extent);
    }
}

fn platforms(half_extent: i32) -> World {
    let bounds = Aabb4::from_ints([-half_extent; 4], [half_extent; 4]).expect("a box");
    let mut world = World::new();
    let node = RegionNode::Procedural(Generator::Platforms { seed: 1 });
    world.apply(&WorldPatch::of_tree(RegionTree { bounds, node })).expect("platforms fit");
    world
}

fn measure(half_extent: i32) {
    let start = Instant::now();
    let mut world = platforms(half_extent);
    println!("half extent {half_extent}: {} regions, made in {:.2?}", world.region_count(), start.elapsed());

    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut derived = one.install(|| {
        let (mut best, mut kept) = (Duration::MAX, None);
        for _ in 0..3 {
            drop(kept.take());
            let start = Instant::now();
            kept = Some(DerivedWorld::build(&world, &BuildOptions::default()).expect("it fits"));
            best = best.min(start.elapsed());
        }
        let derived = kept.expect("built");
        let leaves = derived.leaf_count();
        let rate = leaves as f64 / best.as_secs_f64();
        println!("  full build: {best:.2?} on one thread, {rate:.3e} leaves/s, depth {}", derived.depth());
        derived
    });
    let mut resident: WorldArenas = derived.mirror().clone();

    let ids: Vec<RegionId> = world.regions().map(|(id, _)| id).collect();
    let mut state = 1_u64;
    let mut random = |end: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((u128::from(state) * u128::from(end)) >> 64) as u64
    };
    let (mut patch, mut plan, mut apply, mut commit, mut both) = (vec![], vec![], vec![], vec![], vec![]);
    let (mut writes, mut bytes) = (0, 0);
    for _ in 0..10_000 {
        let Some(region) = world.region(ids[random(ids.len() as u64) as usize]) else { continue };
        let (low, extent) = (region.bounds.min_raw(), region.bounds.extent_raw());
        let min = std::array::from_fn(|a| (low[a] + random(extent[a] as u64) as i64) >> 16 << 16);
        let voxel = Aabb4::from_raw(min, min.map(|c| c + (1 << 16))).expect("a voxel");
        let start = Instant::now();
        let block = Block::of(BlockId(9 * (random(3) / 2) as u16), Scale::UNIT);
        let applied = world.apply(&fill_box(voxel, block)).expect("a good patch");
        patch.push(start.elapsed());
        for bounds in applied.changed {
            let start = Instant::now();
            let planned = derived.plan(&world, &bounds, &OpLimits::default()).expect("it fits");
            let planning = start.elapsed();
            let start = Instant::now();
            resident.apply(&planned.batch).expect("it is next");
            let applying = start.elapsed();
            let start = Instant::now();
            derived.commit(&planned.batch).expect("it is next");
            commit.push(start.elapsed());
            plan.push(planning);
            apply.push(applying);
            both.push(planning + applying);
            writes += planned.counts.node_writes;
            bytes += planned.batch.upload_bytes();
        }
    }
    let edits = plan.len();
    report("World::apply", &mut patch);
    report("plan", &mut plan);
    report("apply", &mut apply);
    report("plan and apply", &mut both);
    report("commit", &mut commit);
    println!("  {:.1} node writes, {:.0} bytes an edit", writes as f64 / edits as f64, bytes as f64 / edits as f64);

    let mut nothing = Vec::new();
    for &id in ids.iter().cycle().take(10_000) {
        let Some(region) = world.region(id) else { continue };
        let bounds = region.bounds;
        let start = Instant::now();
        let planned = derived.plan(&world, &bounds, &OpLimits::default()).expect("it fits");
        nothing.push(start.elapsed());
        assert!(planned.batch.is_empty());
    }
    report("nothing differs", &mut nothing);
    let mut snapshots = Vec::new();
    for _ in 0..20 {
        let start = Instant::now();
        let snapshot = derived.snapshot();
        snapshots.push(start.elapsed());
        drop(snapshot);
    }
    report("snapshot", &mut snapshots);
    let fresh =
        DerivedWorld::from_leaves(derived.leaves(), world.palette(), &BuildOptions::default()).expect("it fits");
    println!(
        "  SAH {:.1}, fresh {:.1}: {:.3}",
        derived.sah_cost(),
        fresh.sah_cost(),
        derived.sah_cost() / fresh.sah_cost()
    );
}

fn report(what: &str, times: &mut [Duration]) {
    times.sort_unstable();
    if let (Some(median), Some(p99)) = (times.get(times.len() / 2), times.get(times.len() * 99 / 100)) {
        println!("  {what}: median {median:.2?}, p99 {p99:.2?}, most {:.2?}", times[times.len() - 1]);
    }
}
