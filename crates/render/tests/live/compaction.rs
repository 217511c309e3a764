//! Compaction while edits go on.

use super::oracle::leaves;
use super::{Random, Rig, platforms};
use orthant_render::world::live::{Budget, CompactionOptions, LiveOptions};
use orthant_world::World;

fn on_demand() -> LiveOptions {
    LiveOptions { compaction: CompactionOptions::ON_DEMAND, ..LiveOptions::default() }
}

/// Voxels that come and go.
fn churn(rig: &mut Rig, random: &mut Random, edits: u32) {
    for _ in 0..edits {
        let at = [random.about(340), random.about(60), random.about(340), random.about(340)];
        let id = random.below(4) as u16;
        rig.set(at, id);
    }
}

#[test]
fn compaction_under_edits_ends_with_a_swap_and_every_frame_shows_what_it_should() {
    let mut rig = Rig::new(platforms(352), on_demand());
    let mut random = Random(11);
    churn(&mut rig, &mut random, 400);
    rig.settle(&Budget::UNLIMITED);
    rig.live.request_compaction("a test asks");
    let budget = Budget { operations: 6, ..Budget::UNLIMITED };
    let (mut started, mut swapped) = (Vec::new(), 0);
    for frame in 0..100_000 {
        assert!(frame < 99_999, "it neither ends nor says why");
        if swapped == 0 {
            churn(&mut rig, &mut random, 2);
        }
        let frame = rig.tick(&budget);
        assert!(frame.edits_applied <= 6);
        assert!(frame.compaction.discarded.is_none(), "{:?}", frame.compaction);
        started.extend(frame.compaction.started);
        swapped += u32::from(frame.compaction.swapped);
        std::thread::sleep(std::time::Duration::from_micros(100));
        if swapped > 0 && rig.live.is_settled() {
            break;
        }
    }
    assert_eq!((swapped, started.as_slice()), (1, ["a test asks".to_owned()].as_slice()));
    rig.settle(&Budget::UNLIMITED);
}

#[test]
fn compaction_ends_although_edits_never_do_and_the_budget_is_small() {
    for operations in [1, 2, 4] {
        let mut rig = Rig::new(platforms(352), on_demand());
        let mut random = Random(17);
        rig.live.request_compaction("a test asks");
        let budget = Budget { operations, ..Budget::UNLIMITED };
        // More edits than operations in every frame: the queue is never empty.
        let finished = (0..5_000).find(|_| {
            churn(&mut rig, &mut random, 2 * operations);
            if rig.live.is_compacting() {
                std::thread::sleep(std::time::Duration::from_micros(100));
            }
            rig.tick_unchecked(&budget).compaction.swapped
        });
        assert!(finished.is_some(), "{operations} operations a frame: it replays for ever");
        rig.check();
        let before = rig.live.queue().dirty().len();
        (0..8).for_each(|_| drop(rig.tick(&budget)));
        assert!(rig.live.queue().dirty().len() < before, "edits go on");
    }
}

#[test]
fn a_compacted_set_is_packed_and_as_good_as_a_fresh_one() {
    let mut rig = Rig::new(platforms(704), on_demand());
    let mut random = Random(13);
    for _ in 0..30 {
        churn(&mut rig, &mut random, 200);
        rig.settle(&Budget::UNLIMITED);
    }
    let before = rig.live.derived().leaf_count();
    rig.live.request_compaction("now");
    let frames = rig.settle(&Budget::UNLIMITED);
    let last = frames.last().expect("frames");
    assert!(frames.iter().any(|frame| frame.compaction.build_ms.is_some() && frame.compaction.joined.is_some()));
    assert_eq!((last.compaction.finished_total, last.compaction.discarded_total), (1, 0));
    let stats = rig.live.derived().stats();
    assert_eq!((stats.nodes.free, stats.leaves.free, stats.payload.free), (0, 0, 0), "arenas are packed");
    assert!(rig.live.derived().leaf_count() <= before);
    assert_eq!(leaves(&rig.backend.active).len(), rig.live.derived().leaf_count());
    let options = rig_build(&rig);
    let fresh = orthant_render::world::DerivedWorld::build(rig.live.world(), &options).expect("a small world");
    let ratio = rig.live.derived().sah_cost() / fresh.sah_cost();
    assert!(ratio <= 1.05, "SAH cost {ratio} of a fresh build");
    assert!((last.sah_growth - 1.0).abs() < 1e-9, "the meter begins again: {}", last.sah_growth);
}

fn rig_build(rig: &Rig) -> orthant_render::world::BuildOptions {
    orthant_render::world::BuildOptions { clip: *rig.live.derived().clip(), ..Default::default() }
}

#[test]
fn many_holes_make_a_compaction_due() {
    let compaction =
        CompactionOptions { min_edits: 100, min_rows: 64, sah_growth: f64::INFINITY, ..CompactionOptions::default() };
    let mut rig = Rig::new(World::new(), LiveOptions { compaction, ..LiveOptions::default() });
    let place = |i: i64| [16 * (i % 20), 0, 16 * (i / 20), 0];
    for i in 0..200 {
        rig.set(place(i), 1);
    }
    rig.settle(&Budget::UNLIMITED);
    for i in 0..190 {
        rig.set(place(i), 0);
    }
    let frames = rig.settle(&Budget { operations: 50, ..Budget::UNLIMITED });
    let started: Vec<&String> = frames.iter().filter_map(|frame| frame.compaction.started.as_ref()).collect();
    assert!(started.iter().any(|why| why.contains("% of the ")), "{started:?}");
    assert!(frames.last().expect("frames").compaction.finished_total >= 1);
    // When it began, at most half of the leaves were there, and nothing has come since.
    assert!(rig.live.derived().stats().leaves.len <= 100, "{:?}", rig.live.derived().stats().leaves);
}

#[test]
fn a_compaction_that_edits_outrun_is_given_up_with_the_reason_and_begun_again() {
    let compaction = CompactionOptions { max_backlog: 0, pause: 2, ..CompactionOptions::ON_DEMAND };
    let mut rig = Rig::new(platforms(352), LiveOptions { compaction, ..LiveOptions::default() });
    rig.live.request_compaction("a test asks");
    // The first tick takes the snapshot, then applies an edit, which is one box too many.
    rig.set([1, 50, 1, 1], 3);
    let first = rig.tick(&Budget::UNLIMITED);
    assert_eq!(first.compaction.started.as_deref(), Some("a test asks"));
    let frames = rig.settle(&Budget::UNLIMITED);
    let reasons: Vec<&str> =
        [&first].into_iter().chain(&frames).filter_map(|f| f.compaction.discarded.as_deref()).collect();
    assert_eq!(reasons.len(), 1, "{reasons:?}");
    assert!(reasons[0].contains("outrun by edits") && reasons[0].contains("1 boxes"), "{}", reasons[0]);
    let again: Vec<&str> = frames.iter().filter_map(|f| f.compaction.started.as_deref()).collect();
    assert_eq!(again.len(), 1);
    assert!(again[0].starts_with("again") && again[0].contains("outrun"), "{}", again[0]);
    let last = frames.last().expect("frames");
    assert_eq!((last.compaction.finished_total, last.compaction.discarded_total), (1, 1));
}

#[test]
fn a_compaction_stays_within_the_budget_of_each_frame() {
    let compaction = CompactionOptions { slice_bytes: 4096, ..CompactionOptions::ON_DEMAND };
    let mut rig = Rig::new(platforms(704), LiveOptions { compaction, ..LiveOptions::default() });
    rig.live.request_compaction("a test asks");
    let budget = Budget { bytes: 8192, operations: 3, ..Budget::UNLIMITED };
    let mut random = Random(17);
    let mut frames = Vec::new();
    while !rig.live.is_settled() || frames.is_empty() {
        assert!(frames.len() < 100_000);
        if frames.len() < 40 {
            churn(&mut rig, &mut random, 1);
        }
        frames.push(rig.tick_unchecked(&budget));
        std::thread::sleep(std::time::Duration::from_micros(100));
    }
    rig.check();
    assert_eq!(frames.last().map(|frame| frame.compaction.finished_total), Some(1));
    for frame in &frames {
        let operation = (4 * frame.depth + 32) * 10 * 80 + 9 * 80 + 4608;
        assert!(frame.upload_bytes + frame.compaction.upload_bytes < 8192 + operation, "{frame:?}");
        assert!(frame.edits_applied <= 3);
    }
}
