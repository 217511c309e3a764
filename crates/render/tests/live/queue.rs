//! The edit queue in a live world: coalescing, budgets, order.

use super::{Random, Rig, block, ints, platforms};
use orthant_render::world::live::{Budget, LiveOptions};
use orthant_world::{Point4, World, edit};

#[test]
fn edits_of_every_voxel_of_a_chunk_in_one_tick_become_one_region() {
    let mut rig = Rig::new(World::new(), LiveOptions::default());
    let mut order: Vec<i64> = (0..4096).collect();
    let mut random = Random(7);
    for i in (1..order.len()).rev() {
        order.swap(i, random.below(i as u64 + 1) as usize);
    }
    for i in order {
        rig.set([i % 8, i / 8 % 8, i / 64 % 8, i / 512], 1 + (i % 5) as u16);
    }
    let frame = rig.tick(&Budget::UNLIMITED);
    assert_eq!((frame.patches, frame.noop_patches), (4096, 0));
    assert_eq!((frame.edits_applied, frame.coalesced), (1, 4095));
    assert_eq!((frame.writes.leaves, frame.queue_length), (1, 0));
}

#[test]
fn a_patch_that_changes_nothing_queues_and_writes_nothing() {
    let mut rig = Rig::new(platforms(352), LiveOptions::default());
    let commands = rig.backend.commands;
    let id = rig.live.world().block_at(Point4::from_ints([0, -5, 0, 0])).id().0;
    rig.set([0, -5, 0, 0], id);
    let frame = rig.tick(&Budget::UNLIMITED);
    assert_eq!((frame.patches, frame.noop_patches, frame.queue_length), (1, 1, 0));
    assert_eq!((frame.upload_bytes, frame.edits_applied, rig.backend.commands), (0, 0, commands));
}

/// Where a burst of patches lands, and the frame in which each was shown.
fn burst(budget: &Budget) -> (Vec<(f64, u64)>, Vec<orthant_render::world::live::Diagnostics>) {
    let mut rig = Rig::new(platforms(704), LiveOptions::default());
    rig.camera = Point4::from_ints([100, 20, -50, 10]);
    let mut random = Random(3);
    let mut waiting = Vec::new();
    for _ in 0..1000 {
        let at = [random.about(700), random.about(700), random.about(700), random.about(700)];
        rig.set(at, 9);
        let camera = rig.camera.raw();
        let distance = (0..4).map(|a| ((at[a] * 65_536 - camera[a]) as f64).powi(2)).sum::<f64>().sqrt();
        waiting.push((at, distance));
    }
    let (mut shown, mut frames) = (Vec::new(), Vec::new());
    while !rig.live.queue().is_empty() {
        assert!(frames.len() < 10_000, "the burst never ends");
        let frame = rig.tick_unchecked(budget);
        waiting.retain(|(at, distance)| {
            let bounds = edit::voxel_bounds(*at, orthant_world::Scale::UNIT).expect("a voxel");
            let done = rig.live.trace().active.iter().any(|synced| synced.contains(&bounds));
            if done {
                shown.push((*distance, frame.frame));
            }
            !done
        });
        frames.push(frame);
    }
    assert!(waiting.is_empty(), "every patch was shown");
    rig.settle(&Budget::UNLIMITED);
    (shown, frames)
}

/// Spearman's rank correlation, with mean ranks for ties.
fn spearman(pairs: &[(f64, u64)]) -> f64 {
    let ranks = |values: Vec<f64>| -> Vec<f64> {
        let less = |v: f64| values.iter().filter(|&&u| u < v).count() as f64;
        let equal = |v: f64| values.iter().filter(|&&u| u == v).count() as f64;
        values.iter().map(|&v| less(v) + (equal(v) - 1.0) / 2.0).collect()
    };
    let a = ranks(pairs.iter().map(|p| p.0).collect());
    let b = ranks(pairs.iter().map(|p| p.1 as f64).collect());
    let mean = (a.len() as f64 - 1.0) / 2.0;
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| (x - mean) * (y - mean)).sum::<f64>();
    dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt()
}

#[test]
fn a_burst_of_a_thousand_patches_stays_within_the_budget_of_operations_and_goes_near_first() {
    let (shown, frames) = burst(&Budget { operations: 8, ..Budget::UNLIMITED });
    assert!(frames.iter().all(|frame| frame.edits_applied <= 8), "an operation more than the budget");
    assert!(frames.len() > 60, "{} frames", frames.len());
    let waiting: Vec<u64> = frames.iter().map(|frame| frame.edits_deferred).collect();
    assert!(waiting.is_sorted_by(|a, b| a >= b), "the queue grows without patches");
    let correlation = spearman(&shown);
    assert!(correlation > 0.9, "near first: {correlation}");
}

#[test]
fn a_burst_stays_within_the_budget_of_bytes_but_for_one_operation() {
    let (shown, frames) = burst(&Budget { bytes: 16 << 10, ..Budget::UNLIMITED });
    for frame in &frames {
        // What one voxel may write: every node on the paths of nine leaves, nine leaves, one chunk.
        let operation = (4 * frame.depth + 32) * 10 * 80 + 9 * 80 + 4608;
        assert!(frame.upload_bytes < (16 << 10) + operation, "{} bytes", frame.upload_bytes);
    }
    assert!(frames.len() > 20 && spearman(&shown) > 0.9, "{} frames, {}", frames.len(), spearman(&shown));
}

#[test]
fn a_far_edit_is_shown_while_near_edits_never_end() {
    let options = LiveOptions { patience: Some(30), ..LiveOptions::default() };
    let mut rig = Rig::new(World::new(), options);
    rig.set([5000, 0, 0, 0], 1);
    let far = ints([5000, 0, 0, 0], [5001, 1, 1, 1]);
    let budget = Budget { operations: 1, ..Budget::UNLIMITED };
    for frame in 1.. {
        assert!(frame < 40, "the far edit starves");
        // Three chunks change for each that one operation can show.
        for k in 0..3 {
            let i = (3 * frame + k) % 300;
            rig.set([8 * i, 0, 0, 0], 1 + (frame % 7) as u16);
        }
        rig.tick_unchecked(&budget);
        if rig.live.trace().active.iter().any(|synced| synced.contains(&far)) {
            assert!(!rig.live.queue().is_empty());
            break;
        }
    }
    rig.settle(&Budget::UNLIMITED);
}

#[test]
fn a_budget_of_nothing_keeps_everything_queued_and_the_picture_as_it_was() {
    let mut rig = Rig::new(platforms(352), LiveOptions::default());
    rig.set([0, 40, 0, 0], 3);
    for budget in [
        Budget { ms: 0.0, ..Budget::UNLIMITED },
        Budget { bytes: 0, ..Budget::UNLIMITED },
        Budget { operations: 0, ..Budget::UNLIMITED },
    ] {
        let frame = rig.tick(&budget);
        assert_eq!((frame.edits_applied, frame.edits_deferred, frame.upload_bytes), (0, 1, 0));
    }
    assert!(frame_shows(&mut rig));
}

fn frame_shows(rig: &mut Rig) -> bool {
    let frame = rig.tick(&Budget::UNLIMITED);
    frame.edits_applied == 1 && frame.revisions.mirror == frame.revisions.resident
}

#[test]
fn a_region_too_large_for_one_operation_is_split_and_the_near_parts_come_first() {
    let mut rig = Rig::new(World::new(), LiveOptions::default());
    // A box of 16^4 voxels of mixed blocks: 16 chunks; a fill over 48 x 48 x 8 x 8 voxels of noise: 36 chunks each; together more
    // than an operation may touch.
    let mut random = Random(5);
    for x in 0..12 {
        for z in 0..12 {
            for _ in 0..3 {
                let at = [8 * x + random.below(8) as i64, random.below(8) as i64, 8 * z + random.below(8) as i64, 2];
                rig.set(at, 1 + random.below(9) as u16);
            }
        }
    }
    rig.settle(&Budget::UNLIMITED);
    // One patch clears it: as one box it is 144 chunks.
    let bounds = ints([-1, -1, -1, 0], [97, 9, 97, 8]);
    rig.patch(&edit::fill_box(bounds, block(0)));
    rig.patch(&edit::fill_box(ints([0, 0, 0, 0], [96, 8, 96, 8]), block(4)));
    let frames = rig.settle(&Budget { operations: 1, ..Budget::UNLIMITED });
    assert!(frames.iter().all(|frame| frame.writes.payload_words <= 64 * 1200));
    assert_eq!(rig.live.derived().leaf_count(), 1, "what is one box of one block is one leaf");
}
