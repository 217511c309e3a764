//! World arenas on a Vulkan device follow a world through long random sequences of patches: after every batch they are, byte for
//! byte, what the planner believes. Without a device the tests say so, unless `ORTHANT_REQUIRE_VULKAN=1`. The validation layers have
//! nothing to say.

mod frames;
mod patches;

use orthant::job::backend::AnyBackend;
use orthant_render::world::{BuildOptions, DerivedWorld, OpLimits, load};
use orthant_resident::world::compare::LiveRows;
use orthant_resident::world::{ArenaLens, MutationBatch, SetSlot};
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::device::{CacheFolder, DeviceOptions};
use orthant_world::{Aabb4, Applied, BlockId, World};
use patches::Patches;

/// A device under the validation layers, or `None` where there is none and none has to be.
fn device() -> Option<AnyBackend> {
    let required = std::env::var("ORTHANT_REQUIRE_VULKAN").is_ok_and(|v| v == "1");
    match VulkanBackend::new(&DeviceOptions { validate: true, cache: CacheFolder::None, ..DeviceOptions::default() }) {
        Ok(backend) => Some(AnyBackend::Vulkan(Box::new(backend))),
        Err(error) if required => panic!("ORTHANT_REQUIRE_VULKAN is set: {error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// A set that follows a world: what it has still to be brought up to date with.
struct Follower {
    set: SetSlot,
    derived: DerivedWorld,
    dirty: Vec<Aabb4>,
    materials: Vec<BlockId>,
    /// All that was compared so far.
    compared: LiveRows,
    batches: u64,
}

impl Follower {
    fn new(set: SetSlot, world: &World) -> Self {
        let derived = DerivedWorld::build(world, &BuildOptions::default()).expect("the world is small");
        let (dirty, materials, compared) = (Vec::new(), Vec::new(), LiveRows::default());
        Self { set, derived, dirty, materials, compared, batches: 0 }
    }

    fn note(&mut self, world: &World, applied: &Applied) {
        self.dirty.extend(&applied.changed);
        let regions = applied.removed.iter().chain(&applied.updated).map(|(_, region)| region.bounds);
        self.dirty.extend(regions);
        let live = applied.added.iter().filter_map(|&id| world.region(id));
        self.dirty.extend(live.map(|region| region.bounds));
        self.materials.extend(&applied.palette);
    }

    /// One operation, if there is one to do. Compares what is resident with the mirror.
    fn step(&mut self, backend: &mut AnyBackend, world: &World) -> bool {
        let Some(batch) = self.plan(world) else { return false };
        if !batch.is_empty() {
            self.apply(backend, &batch);
            self.compare(backend);
        }
        true
    }

    /// All operations, without a look at what is resident.
    fn follow_blindly(&mut self, backend: &mut AnyBackend, world: &World) {
        while let Some(batch) = self.plan(world) {
            if !batch.is_empty() {
                self.apply(backend, &batch);
            }
        }
    }

    fn plan(&mut self, world: &World) -> Option<MutationBatch> {
        if !self.materials.is_empty() {
            let ids = std::mem::take(&mut self.materials);
            return Some(self.derived.plan_palette(world, &ids).expect("there is room"));
        }
        let bounds = self.dirty.pop()?;
        let limits = OpLimits { chunks: 6, leaves: 40, focus: None };
        let plan = self.derived.plan(world, &bounds, &limits).expect("there is room");
        self.dirty.extend(&plan.deferred);
        Some(plan.batch)
    }

    fn apply(&mut self, backend: &mut AnyBackend, batch: &MutationBatch) {
        backend.apply_world(self.set, batch).expect("the batch is sound");
        self.derived.commit(batch).expect("the batch is the next one");
        self.batches += 1;
    }

    fn compare(&mut self, backend: &mut AnyBackend) {
        let rows = backend.validate_world_set(self.set, self.derived.mirror());
        let rows = rows.unwrap_or_else(|failure| panic!("batch {} of {:?}: {failure}", self.batches, self.set));
        self.compared.nodes += rows.nodes;
        self.compared.leaves += rows.leaves;
        self.compared.payload += rows.payload;
        self.compared.palette += rows.palette;
    }
}

fn apply(world: &mut World, patches: &mut Patches, followers: &mut [&mut Follower]) {
    for patch in patches.next(world) {
        let applied = world.apply(&patch).expect("the patch is sound");
        for follower in followers.iter_mut() {
            follower.note(world, &applied);
        }
    }
}

#[test]
fn arenas_equal_the_mirror_after_every_batch_of_a_long_sequence_of_patches() {
    let Some(mut backend) = device() else { return };
    let mut patches = Patches::new(1);
    let mut world = patches.world();
    let mut active = Follower::new(SetSlot::Active, &world);
    load(&mut *backend, &active.derived).expect("there is room");
    active.compare(&mut backend);
    for _ in 0..250 {
        apply(&mut world, &mut patches, &mut [&mut active]);
        while active.step(&mut backend, &world) {}
    }
    let LiveRows { nodes, leaves, payload, palette } = active.compared;
    assert!(active.batches > 400, "{} batches", active.batches);
    assert!(nodes > 10_000 && leaves > 10_000 && payload > 1_000_000 && palette > 1000, "{:?}", active.compared);
    active.derived.validate().expect("the planner keeps its invariants");
}

#[test]
fn a_set_that_is_filled_while_the_world_changes_is_its_mirror_before_and_after_the_swap() {
    let Some(mut backend) = device() else { return };
    let mut patches = Patches::new(2);
    let mut world = patches.world();
    let mut active = Follower::new(SetSlot::Active, &world);
    load(&mut *backend, &active.derived).expect("there is room");
    let mut batches = 0;
    for round in 0..6 {
        // What a compaction has: the world as it was, in packed arenas. It has loading batches, then what has changed since.
        let mut staging = Follower::new(SetSlot::Staging, &world);
        let lens = if round % 2 == 0 { staging.derived.mirror().lens() } else { ArenaLens::default() };
        backend.begin_staging(staging.derived.origin(), lens).expect("there is room");
        let loading: Vec<_> = staging.derived.load_batches(20_000).collect();
        assert!(loading.len() > 2, "it takes several");
        for batch in &loading {
            backend.apply_world(SetSlot::Staging, batch).expect("the batch is sound");
            apply(&mut world, &mut patches, &mut [&mut active, &mut staging]);
            active.step(&mut backend, &world);
        }
        staging.compare(&mut backend);
        while staging.step(&mut backend, &world) | active.step(&mut backend, &world) {}
        active.compare(&mut backend);
        assert!(backend.is_staging_ready().is_ok());
        backend.swap_sets().expect("there is a set");
        batches += active.batches + staging.batches;
        active = Follower { set: SetSlot::Active, ..staging };
        active.compare(&mut backend);
        assert_eq!(active.derived.leaf_count() as u64, world.regions().count() as u64, "as many leaves as regions");
    }
    assert!(batches > 100, "{batches} batches");
}

#[test]
fn a_batch_that_was_left_out_is_seen_by_the_next_and_by_the_comparison() {
    let Some(mut backend) = device() else { return };
    let mut patches = Patches::new(3);
    let mut world = patches.world();
    let mut active = Follower::new(SetSlot::Active, &world);
    load(&mut *backend, &active.derived).expect("there is room");
    active.compare(&mut backend);
    let resident = active.derived.mirror().clone();
    let mut missed = None;
    while missed.is_none() {
        apply(&mut world, &mut patches, &mut [&mut active]);
        while let Some(bounds) = active.dirty.pop() {
            let plan = active.derived.plan(&world, &bounds, &OpLimits::default()).expect("there is room");
            if !plan.batch.is_empty() {
                active.derived.commit(&plan.batch).expect("the batch is the next one");
                match &missed {
                    None => missed = Some(plan.batch),
                    Some(_) => {
                        let refused = backend.apply_world(SetSlot::Active, &plan.batch);
                        assert!(refused.is_err(), "{refused:?}");
                    }
                }
            }
        }
    }
    let failure = backend.validate_world_set(SetSlot::Active, active.derived.mirror()).expect_err("it is behind");
    assert!(failure.what.contains("should be"), "{failure}");
    backend.validate_world_set(SetSlot::Active, &resident).expect("nothing was changed");
}
