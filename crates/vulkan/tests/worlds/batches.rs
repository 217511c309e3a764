//! Batches, one after the other.

use crate::synthetic::{LARGE, Random, SMALL, Size, batch};
use crate::{assert_resident, assert_silent, device};
use orthant_resident::Backend;
use orthant_resident::world::{ArenaLens, MutationBatch, PayloadWrite, Root, SetSlot, WorldArenas};
use orthant_vulkan::Stage;

#[test]
fn arenas_equal_their_mirror_after_every_batch_of_either_set() {
    let Some(mut vulkan) = device() else { return };
    let mut random = Random(1);
    let mut active = WorldArenas::new([0; 4]);
    let mut staging = WorldArenas::new([-7, 5 << 40, 0, 1]);
    vulkan.begin_staging(staging.origin, ArenaLens { nodes: 10, ..ArenaLens::default() }).expect("there is room");
    for i in 0..120 {
        let size = if i % 10 == 9 { LARGE } else { SMALL };
        for (set, mirror) in [(SetSlot::Active, &mut active), (SetSlot::Staging, &mut staging)] {
            let batch = batch(&mut random, mirror, size);
            let applied = vulkan.apply_world(set, &batch).expect("the batch is sound");
            assert_eq!(mirror.apply(&batch).map(|_| ()), Ok(()));
            let rows = batch.node_writes.len() + batch.leaf_writes.len() + batch.palette_writes.len();
            let list = 4 * rows as u64 + 8 * batch.payload_writes.len() as u64;
            let sent = batch.upload_bytes() + if set == SetSlot::Active { list } else { 0 };
            assert_eq!(applied.bytes, sent, "nothing is sent but the writes and where they go");
            assert_resident(&mut vulkan, set, mirror);
        }
        let table = vulkan.world_table();
        assert_eq!((table.root, table.origin), (active.root, active.origin), "the root changes with the writes");
        let lens = active.lens();
        assert_eq!((table.node_count, table.leaf_count), (lens.nodes, lens.leaves));
        assert_eq!((table.payload_count, table.palette_count), (lens.payload, lens.palette));
    }
    assert!(vulkan.world_work().growths > 8, "arenas have grown");
    assert_silent(&vulkan);
}

#[test]
fn batches_under_way_together_keep_their_order() {
    let Some(mut vulkan) = device() else { return };
    let mut random = Random(2);
    let mut mirror = WorldArenas::new([0; 4]);
    for i in 0..400 {
        let batch = batch(&mut random, &mirror, if i % 50 == 0 { LARGE } else { SMALL });
        vulkan.apply_world(SetSlot::Active, &batch).expect("the batch is sound");
        assert_eq!(mirror.apply(&batch).map(|_| ()), Ok(()));
    }
    assert_resident(&mut vulkan, SetSlot::Active, &mirror);
    assert_silent(&vulkan);
}

#[test]
fn a_batch_larger_than_a_piece_or_the_whole_staging_ring_goes_in_several() {
    let Some(mut vulkan) = device() else { return };
    let mut random = Random(3);
    let size = Size { growth: 30_000, rows: 20_000, spans: 3, words: 100_000 };
    // Threads of a software device take their time.
    for (set, words) in [(SetSlot::Active, 2_000_000), (SetSlot::Staging, 9_000_000)] {
        let mut mirror = WorldArenas::new([0; 4]);
        if set == SetSlot::Staging {
            vulkan.begin_staging(mirror.origin, ArenaLens::default()).expect("there is room");
        }
        let mut batch = batch(&mut random, &mirror, size);
        let first = batch.lens.payload + 100;
        batch.lens.payload += 200 + words;
        batch.payload_writes.push(PayloadWrite { first, words: (0..words).map(|w| w ^ 0x5555).collect() });
        vulkan.apply_world(set, &batch).expect("the batch is sound");
        assert_eq!(mirror.apply(&batch).map(|_| ()), Ok(()));
        assert_resident(&mut vulkan, set, &mirror);
    }
    assert_silent(&vulkan);
}

#[test]
fn a_batch_that_writes_nothing_records_nothing_and_moves_the_root() {
    let Some(mut vulkan) = device() else { return };
    let mut random = Random(4);
    let mut mirror = WorldArenas::new([0; 4]);
    let first = batch(&mut random, &mirror, LARGE);
    vulkan.apply_world(SetSlot::Active, &first).expect("the batch is sound");
    assert_eq!(mirror.apply(&first).map(|_| ()), Ok(()));
    let before = vulkan.world_work();
    let nothing = MutationBatch {
        expected_root: mirror.root,
        new_root: Root::leaf(0),
        expected_revision: 1,
        new_revision: 2,
        lens: mirror.lens(),
        ..MutationBatch::default()
    };
    assert_eq!(vulkan.apply_world(SetSlot::Active, &nothing).map(|applied| applied.bytes), Ok(0));
    let work = vulkan.world_work();
    assert_eq!((work.commands, work.submissions, work.bytes), (before.commands, before.submissions, before.bytes));
    assert_eq!(vulkan.world_table().root, Root::leaf(0));
}

#[test]
fn an_edit_is_one_submission_of_one_pass() {
    let Some(mut vulkan) = device() else { return };
    let mut random = Random(5);
    let mut mirror = WorldArenas::new([0; 4]);
    let first = batch(&mut random, &mirror, LARGE);
    vulkan.apply_world(SetSlot::Active, &first).expect("the batch is sound");
    assert_eq!(mirror.apply(&first).map(|_| ()), Ok(()));
    let can = vulkan.set_timed(true);
    let (before, waits) = (vulkan.world_work(), vulkan.uploaded().waits);
    let edit = batch(&mut random, &mirror, Size { growth: 0, ..SMALL });
    let applied = vulkan.apply_world(SetSlot::Active, &edit).expect("the batch is sound");
    let work = vulkan.world_work();
    assert_eq!(work.submissions - before.submissions, 1);
    assert_eq!(work.commands - before.commands, 1);
    assert_eq!(work.bytes - before.bytes, applied.bytes);
    assert_eq!(vulkan.uploaded().waits, waits, "the host waits for nothing");
    if can {
        while !vulkan.is_idle().expect("the device works") {
            std::thread::yield_now();
        }
        let timings = vulkan.take_timings().expect("the device works");
        assert_eq!(timings.of(Stage::WorldScatter).count, 1);
        assert!(timings.of(Stage::WorldScatter).seconds > 0.0);
    }
    assert_silent(&vulkan);
}
