//! Frames beside batches and swaps.

use crate::patches::Patches;
use crate::{Follower, apply, device};
use orthant::job::backend::AnyBackend;
use orthant_render::world::load;
use orthant_render::world::view::{Look, Mode, Steps, Turns, WorldCamera};
use orthant_resident::frame::{Aov, Estimator, PixelFilter, Tile};
use orthant_resident::world::{SetSlot, Shade};
use orthant_resident::{BackendError, Film, Frame};
use orthant_vulkan::VulkanBackend;
use orthant_world::{Point4, World};
use std::time::Duration;

/// What a camera above the middle of the world sees.
fn camera() -> WorldCamera {
    WorldCamera::new(Point4::from_ints([3, 9, 22, 0]), &Turns { pitch: -20.0, ..Turns::default() })
}

fn frame(camera: &WorldCamera, (width, height): (u32, u32)) -> Frame {
    let shade = Shade::Preview {
        direction: [0.36, 0.8, 0.48],
        sun: [0.8, 0.75, 0.7],
        ambient: [0.25, 0.28, 0.33],
        zenith: [0.2, 0.4, 0.9],
        horizon: [0.8, 0.85, 0.9],
        nadir: [0.3, 0.28, 0.25],
    };
    let world = camera.view(&Mode::Slice, &Look { shade, distance: 80.0, edges: 0.0 });
    Frame {
        camera: WorldCamera::camera(&world, 0.6),
        width,
        height,
        tile: Tile { x: 0, y: 0, width, height },
        samples: 0..2,
        keep_blocks: false,
        seed: 5,
        max_depth: 1,
        roulette_depth: 1,
        firefly_clamp: None,
        estimator: Estimator::Mis,
        filter: PixelFilter::Box,
        aovs: vec![Aov::Block, Aov::Face, Aov::Cell],
        threads: 0,
        world: Some(world),
    }
}

fn render(backend: &mut AnyBackend, frame: &Frame) -> Film {
    let ticket = backend.submit(frame.clone()).expect("the frame is sound");
    while !backend.poll(ticket, Duration::from_secs(1)).expect("the device works").is_done() {}
    backend.read_film(ticket).expect("the film is there")
}

fn vulkan(backend: &AnyBackend) -> &VulkanBackend {
    match backend {
        AnyBackend::Vulkan(vulkan) => vulkan,
        AnyBackend::Cpu(_) => panic!("it is a Vulkan backend"),
    }
}

/// What a backend that never saw an edit shows of a world.
fn fresh(world: &World, frame: &Frame) -> Film {
    let mut backend = device().expect("there is one already");
    load(&mut *backend, &Follower::new(SetSlot::Active, world).derived).expect("there is room");
    render(&mut backend, frame)
}

#[test]
fn while_only_the_camera_moves_nothing_is_recorded_or_sent_for_the_world() {
    let Some(mut backend) = device() else { return };
    let mut patches = Patches::new(4);
    let world = patches.world();
    load(&mut *backend, &Follower::new(SetSlot::Active, &world).derived).expect("there is room");
    let mut camera = camera();
    let before = (vulkan(&backend).world_work(), vulkan(&backend).uploaded());
    let first = render(&mut backend, &frame(&camera, (6, 4)));
    let mut last = None;
    for _ in 0..1000 {
        // 50 units a second at 60 frames.
        camera.advance(&Steps { right: 0.3, forward: 0.7, ..Steps::default() });
        camera.steer(&Turns { yaw: 1.0, ..Turns::default() });
        last = Some(render(&mut backend, &frame(&camera, (6, 4))));
    }
    assert_ne!(last.as_ref(), Some(&first), "the camera moves");
    let after = (vulkan(&backend).world_work(), vulkan(&backend).uploaded());
    assert_eq!(after.0, before.0);
    assert_eq!((after.1.batch, after.1.overhead), (before.1.batch, before.1.overhead));
    backend.quiet().expect("the validation layers are silent");
}

#[test]
fn frames_see_all_batches_before_them_and_none_after_though_all_are_under_way_together() {
    let Some(mut backend) = device() else { return };
    let mut patches = Patches::new(5);
    let mut world = patches.world();
    let mut active = Follower::new(SetSlot::Active, &world);
    load(&mut *backend, &active.derived).expect("there is room");
    let frame = frame(&camera(), (48, 36));
    for _ in 0..4 {
        for _ in 0..6 {
            // Its dispatches are handed in, and nobody waits for them.
            let ticket = backend.submit(frame.clone()).expect("the frame is sound");
            backend.poll(ticket, Duration::ZERO).expect("the device works");
            let batches = active.batches;
            while active.batches == batches {
                apply(&mut world, &mut patches, &mut [&mut active]);
                active.follow_blindly(&mut backend, &world);
            }
            let ended = backend.poll(ticket, Duration::ZERO);
            assert_eq!(ended.map(|_| ()), Err(BackendError::UnknownTicket(ticket)), "a batch ends the frame under way");
        }
        assert_eq!(render(&mut backend, &frame), fresh(&world, &frame));
        active.compare(&mut backend);
    }
    assert!(active.batches > 20, "{} batches", active.batches);
}

#[test]
fn an_image_is_the_same_before_and_after_a_swap_and_the_old_set_is_freed_after_its_last_frame() {
    let Some(mut backend) = device() else { return };
    let mut patches = Patches::new(6);
    let mut world = patches.world();
    let mut active = Follower::new(SetSlot::Active, &world);
    load(&mut *backend, &active.derived).expect("there is room");
    for _ in 0..30 {
        apply(&mut world, &mut patches, &mut [&mut active]);
        active.follow_blindly(&mut backend, &world);
    }
    let frame = frame(&camera(), (48, 36));
    let before = render(&mut backend, &frame);
    assert!(before.sum.iter().any(|color| *color != before.sum[0]), "it shows something");
    let device = vulkan(&backend).vulkan_device().clone();
    let mut used = Vec::new();
    for _ in 0..20 {
        // A compacted set of the same world, with the leaves in other slots.
        let staging = Follower::new(SetSlot::Staging, &world);
        backend.begin_staging(staging.derived.origin(), staging.derived.mirror().lens()).expect("there is room");
        for batch in staging.derived.load_batches(100_000) {
            backend.apply_world(SetSlot::Staging, &batch).expect("the batch is sound");
            assert_eq!(render(&mut backend, &frame), before, "while the staging set is filled");
        }
        let ticket = backend.submit(frame.clone()).expect("the frame is sound");
        backend.poll(ticket, Duration::ZERO).expect("the device works");
        backend.swap_sets().expect("there is a set");
        let ended = backend.poll(ticket, Duration::ZERO);
        assert_eq!(ended.map(|_| ()), Err(BackendError::UnknownTicket(ticket)), "a swap ends the frame under way");
        assert_eq!(render(&mut backend, &frame), before, "after the swap");
        used.push(device.used());
    }
    assert!(used[2..].iter().all(|bytes| *bytes == used[2]), "old sets are freed: {used:?}");
    backend.quiet().expect("the validation layers are silent");
}

/// What the CPU backend shows of a set that was derived from the world as it is.
fn on_the_cpu(world: &World, frame: &Frame) -> Film {
    let mut backend = orthant::job::backend::cpu();
    load(&mut *backend, &Follower::new(SetSlot::Active, world).derived).expect("there is room");
    render(&mut backend, frame)
}

#[test]
fn hits_of_every_frame_of_churn_are_those_of_the_cpu_backend_on_a_fresh_set() {
    let Some(mut backend) = device() else { return };
    let mut patches = Patches::new(9);
    let mut world = patches.world();
    let mut active = Follower::new(SetSlot::Active, &world);
    load(&mut *backend, &active.derived).expect("there is room");
    let mut camera = camera();
    let (mut pixels, mut hits, mut others) = (0, 0, 0);
    for number in 0..60 {
        apply(&mut world, &mut patches, &mut [&mut active]);
        active.follow_blindly(&mut backend, &world);
        camera.advance(&Steps { right: 0.2, forward: 0.15, hidden: 0.01, ..Steps::default() });
        camera.steer(&Turns { yaw: 2.0, xw: if number < 30 { 0.0 } else { 1.3 }, ..Turns::default() });
        let frame = frame(&camera, (48, 36));
        let [ours, theirs] = [render(&mut backend, &frame), on_the_cpu(&world, &frame)];
        let channels = |film: &Film, aov: usize, at: usize| {
            let (aov, values) = &film.aovs[aov];
            let count = aov.channels();
            values[at * count..(at + 1) * count].to_vec()
        };
        for at in 0..48 * 36 {
            pixels += 1;
            hits += usize::from(channels(&ours, 0, at) != [-1.0]);
            others += usize::from((0..3).any(|aov| channels(&ours, aov, at) != channels(&theirs, aov, at)));
        }
    }
    assert!(hits * 4 > pixels, "{hits} of {pixels} pixels show a block");
    // A ray through an edge may take either face.
    assert!(others * 1000 < pixels, "{others} of {pixels} pixels show another block, face or cell");
    backend.quiet().expect("the validation layers are silent");
}
