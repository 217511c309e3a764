//! Batches that are refused and arenas that are full: counted, explained, and never a wrong picture.

use super::{Rig, platforms};
use orthant_render::world::BuildOptions;
use orthant_render::world::live::{Budget, CompactionOptions, LiveError, LiveOptions};
use orthant_resident::world::ArenaLens;
use orthant_world::World;

fn on_demand() -> LiveOptions {
    LiveOptions { compaction: CompactionOptions::ON_DEMAND, ..LiveOptions::default() }
}

#[test]
fn a_refused_batch_is_a_counted_rebuild_and_the_picture_is_never_wrong() {
    let mut rig = Rig::new(platforms(352), on_demand());
    rig.set([1, 50, 1, 1], 3);
    rig.set([9, 50, 90, 1], 4);
    rig.backend.refuse_active = 1;
    let frame = rig.tick(&Budget::UNLIMITED);
    assert_eq!((frame.edits_applied, frame.rebuilds_total), (0, 1));
    assert!(frame.rebuild.as_ref().is_some_and(|why| why.contains("told to refuse")), "{:?}", frame.rebuild);
    // Edits wait, and every frame shows the old set as it is.
    rig.set([-9, 50, 90, 1], 5);
    let mut swapped = false;
    while !swapped {
        let frame = rig.tick(&Budget { operations: 1, ..Budget::UNLIMITED });
        swapped = frame.compaction.swapped;
        std::thread::sleep(std::time::Duration::from_micros(200));
    }
    let frames = rig.settle(&Budget::UNLIMITED);
    let last = frames.last().expect("the rest of the queue");
    assert_eq!((last.rebuilds_total, last.compaction.finished_total), (1, 1));
}

#[test]
fn a_batch_refused_during_a_compaction_makes_that_the_rebuild() {
    let mut rig = Rig::new(platforms(704), on_demand());
    rig.live.request_compaction("a test asks");
    rig.tick(&Budget { operations: 0, ..Budget::UNLIMITED });
    assert!(rig.live.is_compacting());
    rig.set([1, 50, 1, 1], 3);
    rig.backend.refuse_active = 1;
    let mut frames = vec![rig.tick(&Budget { operations: 1, ..Budget::UNLIMITED })];
    frames.extend(rig.settle(&Budget::UNLIMITED));
    let last = frames.last().expect("frames");
    assert_eq!(frames.iter().filter(|frame| frame.compaction.started.is_some()).count(), 0, "no second one");
    assert_eq!((last.rebuilds_total, last.compaction.finished_total), (1, 1));
}

#[test]
fn a_staging_set_that_refuses_is_given_up_with_the_reason_and_the_old_set_stays() {
    let mut rig = Rig::new(
        platforms(352),
        LiveOptions {
            compaction: CompactionOptions { pause: 1, ..CompactionOptions::ON_DEMAND },
            ..LiveOptions::default()
        },
    );
    rig.live.request_compaction("a test asks");
    rig.backend.refuse_staging = 2;
    let frames = rig.settle(&Budget::UNLIMITED);
    let reasons: Vec<&str> = frames.iter().filter_map(|f| f.compaction.discarded.as_deref()).collect();
    assert_eq!(reasons.len(), 2);
    assert!(reasons.iter().all(|why| why.contains("staging set refused") && why.contains("told to")), "{reasons:?}");
    let last = frames.last().expect("frames");
    assert_eq!((last.compaction.finished_total, last.compaction.discarded_total, last.rebuilds_total), (1, 2, 0));
}

#[test]
fn a_full_arena_is_compacted_and_then_has_room() {
    // Room for six dense chunks of two blocks and air: 132 words of occupancy, 4 of palette, 256 of indices, in whole units of 16.
    let max = ArenaLens { payload: 6 * 400, nodes: 1000, leaves: 1000, palette: 1000 };
    let build = BuildOptions { max, ..BuildOptions::default() };
    let mut rig = Rig::new(World::new(), LiveOptions { build, ..on_demand() });
    // Two voxels of different blocks in one cell are a dense chunk.
    let cell = |rig: &mut Rig, i: i64, [a, b]: [u16; 2]| {
        rig.set([16 * i, 0, 0, 0], a);
        rig.set([16 * i + 3, 1, 0, i % 7], b);
    };
    for i in 0..6 {
        cell(&mut rig, i, [1, 2]);
        rig.settle(&Budget::UNLIMITED);
    }
    assert_eq!(rig.live.derived().stats().payload.live, 6 * 400);
    for i in 0..4 {
        cell(&mut rig, i, [0, 0]);
    }
    rig.settle(&Budget::UNLIMITED);
    // Holes are no room that a planner counts on; packed arenas have it.
    cell(&mut rig, 6, [1, 2]);
    let frames = rig.settle(&Budget::UNLIMITED);
    let reasons: Vec<&str> = frames.iter().filter_map(|frame| frame.rebuild.as_deref()).collect();
    assert_eq!(reasons.len(), 1, "{reasons:?}");
    assert!(reasons[0].contains("the payload of the world would need"), "{}", reasons[0]);
    let last = frames.last().expect("frames");
    assert_eq!((last.rebuilds_total, last.compaction.finished_total), (1, 1));
    assert_eq!(rig.live.derived().stats().payload.live, 3 * 400);
}

#[test]
fn another_backend_takes_the_place_of_one_that_was_lost_in_the_midst_of_an_edit() {
    let mut rig = Rig::new(platforms(352), on_demand());
    rig.set([1, 50, 1, 1], 3);
    rig.settle(&Budget::UNLIMITED);
    rig.set([2, 51, 1, 1], 4);
    rig.set([9, 50, 90, 1], 5);
    rig.backend.is_lost = true;
    let lost = rig.live.tick(&mut rig.backend, rig.camera, &Budget::UNLIMITED);
    assert!(matches!(lost, Err(LiveError::Backend(_))), "{lost:?}");
    rig.backend = super::Arenas::default();
    rig.live.load(&mut rig.backend).expect("a new backend");
    rig.shadow = super::Shadow::new(rig.live.world());
    rig.check();
    rig.set([3, 52, 1, 1], 6);
    rig.settle(&Budget::UNLIMITED);
}

#[test]
fn a_rebuild_that_cannot_be_made_ends_with_an_error_and_the_picture_as_it_was() {
    let mut rig = Rig::new(platforms(352), on_demand());
    rig.set([1, 50, 1, 1], 3);
    rig.backend.refuse_active = 1;
    rig.backend.refuse_staging = u32::MAX;
    let error = loop {
        match rig.live.tick(&mut rig.backend, rig.camera, &Budget::UNLIMITED) {
            Ok(_) => std::thread::sleep(std::time::Duration::from_micros(200)),
            Err(error) => break error,
        }
    };
    let LiveError::Rebuild { tries, reason } = &error else { panic!("{error}") };
    assert!(*tries == 3 && reason.contains("told to refuse"), "{error}");
    rig.check();
}
