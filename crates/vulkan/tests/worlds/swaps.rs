//! Two sets, and swaps between them.

use crate::synthetic::{LARGE, Random, SMALL, batch};
use crate::{assert_resident, assert_silent, device, settle};
use orthant_resident::world::{ArenaLens, Root, SetSlot, WorldArenas, WorldBytes};
use orthant_resident::{Backend, BackendError};
use orthant_vulkan::{Stage, VulkanBackend};

/// Applies a random batch to a set and its mirror.
fn step(vulkan: &mut VulkanBackend, random: &mut Random, set: SetSlot, mirror: &mut WorldArenas, large: bool) {
    let batch = batch(random, mirror, if large { LARGE } else { SMALL });
    vulkan.apply_world(set, &batch).expect("the batch is sound");
    assert_eq!(mirror.apply(&batch).map(|_| ()), Ok(()));
}

#[test]
fn a_set_is_filled_while_the_active_one_is_edited_and_takes_its_place_with_all_that_it_has() {
    let Some(mut vulkan) = device() else { return };
    let mut random = Random(11);
    let mut active = WorldArenas::new([0; 4]);
    for round in 1..6 {
        let mut staging = WorldArenas::new([round << 20; 4]);
        let lens = ArenaLens { nodes: 4000, leaves: 4000, payload: 500_000, palette: 30 };
        vulkan.begin_staging(staging.origin, lens).expect("there is room");
        for i in 0..12 {
            step(&mut vulkan, &mut random, SetSlot::Staging, &mut staging, i % 3 == 0);
            step(&mut vulkan, &mut random, SetSlot::Active, &mut active, i == 0);
        }
        assert_resident(&mut vulkan, SetSlot::Active, &active);
        let (before, waits) = (vulkan.world_work(), vulkan.uploaded().waits);
        vulkan.swap_sets().expect("there is a set");
        let after = vulkan.world_work();
        assert_eq!(
            (after.commands, after.submissions, after.bytes),
            (before.commands, before.submissions, before.bytes)
        );
        assert_eq!(
            (after.swaps, vulkan.uploaded().waits),
            (before.swaps + 1, waits),
            "nothing is copied or waited for"
        );
        active = staging;
        assert_resident(&mut vulkan, SetSlot::Active, &active);
        assert_eq!(vulkan.world_table().origin, active.origin);
        assert_eq!(vulkan.world_bytes(SetSlot::Staging), WorldBytes::default());
        // It is edited like any other.
        step(&mut vulkan, &mut random, SetSlot::Active, &mut active, round % 2 == 0);
        assert_resident(&mut vulkan, SetSlot::Active, &active);
    }
    assert_silent(&vulkan);
}

#[test]
fn there_is_nothing_to_swap_without_a_staging_set() {
    let Some(mut vulkan) = device() else { return };
    let mut random = Random(12);
    let mut active = WorldArenas::new([0; 4]);
    step(&mut vulkan, &mut random, SetSlot::Active, &mut active, true);
    assert_eq!(vulkan.swap_sets(), Err(BackendError::NoStagingSet));
    let sound = batch(&mut random, &WorldArenas::new([0; 4]), SMALL);
    assert_eq!(vulkan.apply_world(SetSlot::Staging, &sound), Err(BackendError::NoStagingSet));
    assert_eq!(vulkan.read_back_world(SetSlot::Staging).map(|_| ()), Err(BackendError::NoStagingSet));
    assert_resident(&mut vulkan, SetSlot::Active, &active);
    vulkan.begin_staging([3; 4], ArenaLens::default()).expect("there is room");
    vulkan.drop_staging();
    assert_eq!(vulkan.swap_sets(), Err(BackendError::NoStagingSet));
    // An empty set may be swapped in: an empty world.
    vulkan.begin_staging([3; 4], ArenaLens::default()).expect("there is room");
    assert_eq!(vulkan.is_staging_ready(), Ok(true));
    vulkan.swap_sets().expect("there is a set");
    assert_eq!((vulkan.world_table().root, vulkan.world_table().origin), (Root::EMPTY, [3; 4]));
    assert_silent(&vulkan);
}

#[test]
fn nothing_is_left_of_a_thousand_sets() {
    let Some(mut vulkan) = device() else { return };
    let device = vulkan.vulkan_device().clone();
    let mut random = Random(13);
    let mut active = WorldArenas::new([0; 4]);
    let lens = ArenaLens { nodes: 500, leaves: 500, payload: 20_000, palette: 30 };
    let mut load = |vulkan: &mut VulkanBackend, i: u32| {
        let mut staging = WorldArenas::new([i64::from(i); 4]);
        vulkan.begin_staging(staging.origin, lens).expect("there is room");
        step(vulkan, &mut random, SetSlot::Staging, &mut staging, false);
        match i % 5 {
            // Dropped, or replaced by the next.
            0 => vulkan.drop_staging(),
            1 => {}
            _ => {
                vulkan.swap_sets().expect("there is a set");
                active = staging;
            }
        }
        if i.is_multiple_of(3) {
            step(vulkan, &mut random, SetSlot::Active, &mut active, false);
        }
    };
    // Rings and the like are made once. After a round of 15 the same kind of set is active again.
    (0..15).for_each(|i| load(&mut vulkan, i));
    settle(&mut vulkan);
    let (used, most) = (device.used(), 12 * 2 * 500 * 80 + device.used());
    for i in 15..1005 {
        load(&mut vulkan, i);
        // Until the device is done with them they have to be there.
        if i.is_multiple_of(10) {
            settle(&mut vulkan);
        }
        assert!(device.used() < most + (16 << 20), "sets pile up: {} bytes after {i}", device.used());
    }
    settle(&mut vulkan);
    // The active set may have grown otherwise, to twice its size; a set that is not freed is as much again every time.
    let now = device.used();
    assert!(now.abs_diff(used) < 2_000_000, "{used} bytes at first, {now} in the end");
    vulkan.clear().expect("the device works");
    vulkan.set_environment(orthant_resident::Environment::none()).expect("the device works");
    settle(&mut vulkan);
    let empty = device.used();
    for _ in 0..3 {
        vulkan.begin_staging([0; 4], lens).expect("there is room");
        vulkan.clear().expect("the device works");
        vulkan.set_environment(orthant_resident::Environment::none()).expect("the device works");
        settle(&mut vulkan);
        assert_eq!(device.used(), empty, "a cleared backend has no world");
    }
    assert_silent(&vulkan);
}

#[test]
fn filling_in_the_background_is_measured() {
    let Some(mut vulkan) = device() else { return };
    if !vulkan.set_timed(true) {
        return;
    }
    let mut random = Random(14);
    let mut staging = WorldArenas::new([0; 4]);
    vulkan.begin_staging([0; 4], ArenaLens::default()).expect("there is room");
    step(&mut vulkan, &mut random, SetSlot::Staging, &mut staging, true);
    while !vulkan.is_staging_ready().expect("the device works") {
        std::thread::yield_now();
    }
    let timings = vulkan.take_timings().expect("the device works");
    assert_eq!((timings.of(Stage::WorldStaging).count, timings.of(Stage::WorldScatter).count), (1, 0));
    assert!(timings.of(Stage::WorldStaging).seconds > 0.0);
    assert_silent(&vulkan);
}
