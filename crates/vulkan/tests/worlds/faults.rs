//! What is refused, and what fails.

use crate::synthetic::{LARGE, Random, SMALL, Size, batch};
use crate::{assert_resident, assert_silent, device, settle};
use orthant_resident::world::{ArenaLens, BatchRefused, MutationBatch, PayloadWrite, Root, SetSlot, WorldArenas};
use orthant_resident::{Backend, BackendError};
use orthant_vulkan::VulkanBackend;

/// A backend with something in both sets.
fn filled(seed: u64) -> Option<(VulkanBackend, Random, [WorldArenas; 2])> {
    let mut vulkan = device()?;
    let mut random = Random(seed);
    let mut mirrors = [WorldArenas::new([0; 4]), WorldArenas::new([9; 4])];
    vulkan.begin_staging([9; 4], ArenaLens::default()).expect("there is room");
    for (set, mirror) in SETS.into_iter().zip(&mut mirrors) {
        let batch = batch(&mut random, mirror, LARGE);
        vulkan.apply_world(set, &batch).expect("the batch is sound");
        assert_eq!(mirror.apply(&batch).map(|_| ()), Ok(()));
    }
    Some((vulkan, random, mirrors))
}

const SETS: [SetSlot; 2] = [SetSlot::Active, SetSlot::Staging];

#[test]
fn a_batch_out_of_order_or_out_of_bounds_is_refused_and_changes_nothing() {
    let Some((mut vulkan, mut random, mirrors)) = filled(21) else { return };
    type Fault = fn(&mut MutationBatch);
    let faults: [(&str, Fault); 6] = [
        ("revision", |batch| batch.expected_revision += 1),
        ("root", |batch| batch.expected_root = Root(batch.expected_root.0 ^ 1)),
        ("new_root", |batch| batch.new_root = Root::node(batch.lens.nodes)),
        ("slot", |batch| batch.leaf_writes.last_mut().expect("a batch writes leaves").0 = batch.lens.leaves),
        ("order", |batch| batch.node_writes.reverse()),
        ("lens", |batch| batch.lens.palette = 0),
    ];
    for (set, mirror) in SETS.into_iter().zip(&mirrors) {
        let before = vulkan.world_work();
        for (what, fault) in faults {
            let mut batch = batch(&mut random, mirror, LARGE);
            fault(&mut batch);
            match (what, vulkan.apply_world(set, &batch)) {
                (
                    "revision",
                    Err(BackendError::WorldBatch(BatchRefused::StaleRevision { expected: 2, resident: 1 })),
                ) => {}
                ("root", Err(BackendError::WorldBatch(BatchRefused::StaleRoot { resident, .. }))) => {
                    assert_eq!(resident, mirror.root);
                }
                (_, Err(BackendError::WorldBatch(BatchRefused::Invalid(_)))) => {}
                (what, other) => panic!("{what}: {other:?}"),
            }
        }
        assert_eq!(vulkan.world_work(), before, "nothing was recorded");
        assert_resident(&mut vulkan, set, mirror);
    }
    assert_silent(&vulkan);
}

#[test]
fn a_full_arena_refuses_what_does_not_fit_and_takes_what_does() {
    let Some((mut vulkan, mut random, mut mirrors)) = filled(22) else { return };
    for (set, mirror) in SETS.into_iter().zip(&mut mirrors) {
        let bytes = mirror.bytes();
        let all = bytes.nodes + bytes.leaves + bytes.payload + bytes.palette;
        vulkan.set_world_limit(Some(all + 1000));
        let mut large = batch(&mut random, mirror, SMALL);
        large.lens.nodes += 13;
        match vulkan.apply_world(set, &large) {
            Err(BackendError::OutOfMemory(what)) => assert!(what.contains("full"), "{what}"),
            other => panic!("{other:?}"),
        }
        assert_resident(&mut vulkan, set, mirror);
        let small = batch(&mut random, mirror, Size { growth: 0, ..SMALL });
        vulkan.apply_world(set, &small).expect("it fits");
        assert_eq!(mirror.apply(&small).map(|_| ()), Ok(()));
        assert_resident(&mut vulkan, set, mirror);
        vulkan.set_world_limit(None);
    }
    let beyond = vulkan.begin_staging([0; 4], ArenaLens { nodes: 0x7fff_ffff, ..ArenaLens::default() });
    assert!(matches!(beyond, Err(BackendError::OutOfMemory(_))), "{beyond:?}");
    assert_resident(&mut vulkan, SetSlot::Active, &mirrors[0]);
    assert_silent(&vulkan);
}

#[test]
fn memory_that_runs_out_at_any_arena_leaves_the_set_as_it_was() {
    let Some((mut vulkan, mut random, mut mirrors)) = filled(23) else { return };
    let device = vulkan.vulkan_device().clone();
    for (set, mirror) in SETS.into_iter().zip(&mut mirrors) {
        settle(&mut vulkan);
        let huge = batch(&mut random, mirror, Size { growth: 30_000, ..LARGE });
        let (used, mut refused) = (device.used(), 0);
        for room in (0..).map(|i| i * 400_000) {
            device.set_memory_limit(Some(used + room));
            match vulkan.apply_world(set, &huge) {
                Ok(_) => break,
                Err(BackendError::OutOfMemory(what)) => assert!(what.contains("limit"), "{what}"),
                Err(other) => panic!("{other}"),
            }
            refused += 1;
            device.set_memory_limit(None);
            assert_eq!(device.used(), used, "nothing is left of it");
            assert_resident(&mut vulkan, set, mirror);
            settle(&mut vulkan);
        }
        device.set_memory_limit(None);
        assert!(refused > 4, "it failed at {refused} sizes");
        assert_eq!(mirror.apply(&huge).map(|_| ()), Ok(()));
        assert_resident(&mut vulkan, set, mirror);
    }
    assert_silent(&vulkan);
}

#[test]
fn a_staging_set_without_memory_leaves_the_active_one_alone() {
    let Some((mut vulkan, mut random, mut mirrors)) = filled(24) else { return };
    let device = vulkan.vulkan_device().clone();
    vulkan.drop_staging();
    settle(&mut vulkan);
    let used = device.used();
    device.set_memory_limit(Some(used + 1_000_000));
    let lens = ArenaLens { nodes: 5_000, leaves: 5_000, payload: 5_000_000, palette: 7 };
    let refused = vulkan.begin_staging([1; 4], lens);
    assert!(matches!(refused, Err(BackendError::OutOfMemory(_))), "{refused:?}");
    assert_eq!(vulkan.swap_sets(), Err(BackendError::NoStagingSet));
    settle(&mut vulkan);
    assert_eq!(device.used(), used, "nothing is left of it");
    let edit = batch(&mut random, &mirrors[0], Size { growth: 0, ..SMALL });
    vulkan.apply_world(SetSlot::Active, &edit).expect("it fits");
    assert_eq!(mirrors[0].apply(&edit).map(|_| ()), Ok(()));
    device.set_memory_limit(None);
    assert_resident(&mut vulkan, SetSlot::Active, &mirrors[0]);
    vulkan.begin_staging([1; 4], lens).expect("there is room");
    assert_silent(&vulkan);
}

#[test]
fn a_lost_device_is_an_error_of_everything_after() {
    for (set, submissions) in SETS.into_iter().flat_map(|set| [(set, 0), (set, 1)]) {
        let Some((mut vulkan, mut random, mirrors)) = filled(25) else { return };
        let mirror = &mirrors[usize::from(set == SetSlot::Staging)];
        vulkan.vulkan_device().lose_after(submissions);
        // The second takes several submissions, of which the last ones fail.
        let mut batch = batch(&mut random, mirror, SMALL);
        if submissions > 0 {
            let (first, words) = (batch.lens.payload, vec![7; 2_000_000]);
            batch.lens.payload += words.len() as u32;
            batch.payload_writes.push(PayloadWrite { first, words: words.into() });
        }
        let lost = vulkan.apply_world(set, &batch);
        assert!(matches!(lost, Err(BackendError::Lost(_))), "{set:?}: {lost:?}");
        let again = vulkan.apply_world(set, &batch);
        assert!(matches!(again, Err(BackendError::Lost(_))), "{again:?}");
        assert!(vulkan.is_staging_ready().is_err());
        assert!(matches!(vulkan.swap_sets(), Err(BackendError::Lost(_))));
        assert!(matches!(vulkan.begin_staging([0; 4], ArenaLens::default()), Err(BackendError::Lost(_))));
        assert!(matches!(vulkan.read_back_world(SetSlot::Active), Err(BackendError::Lost(_))));
        vulkan.drop_staging();
        assert_silent(&vulkan);
    }
}
