//! What becomes of a rendering whose device fails: memory that runs out, at whatever allocation, and a device that is lost.

use crate::{device, frame, open, program, render, scenes};
use orthant::failure::Exit;
use orthant::job::backend::{AnyBackend, cpu};
use orthant::job::rendering::Subject;
use orthant::job::{Loaded, Progress, Rendering};
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::environment::EnvironmentMap;
use orthant_resident::{Backend, BackendError, Environment, Film, Frame};
use orthant_vulkan::VulkanBackend;
use std::path::Path;
use std::sync::Arc;

fn any(vulkan: VulkanBackend) -> AnyBackend {
    AnyBackend::Vulkan(Box::new(vulkan))
}

fn loaded(folder: &Path) -> (Loaded, Frame) {
    program::succeed(folder, &["generate", "material-grid", "-o", "grid.glb"]);
    let loaded = open(&folder.join("grid.glb"));
    let frame = frame(&loaded, (24, 18), 48);
    (loaded, frame)
}

/// A rendering that may fall back, or not.
fn run(
    backend: AnyBackend,
    loaded: &mut Loaded,
    frame: &Frame,
    may: bool,
) -> (Result<Film, orthant::failure::Failure>, &'static str) {
    let environment = Environment::constant([0.5; 3]);
    let mut rendering =
        Rendering::new(backend, Subject { loaded: Some(loaded), world: None }, &environment, Progress::new(true));
    rendering.may_fall_back = may;
    let film = rendering.load().and_then(|()| rendering.render(frame, 0, 1));
    let name = rendering.backend.name();
    (film, name)
}

/// What the CPU makes of it.
fn expected(folder: &Path) -> Film {
    let (mut loaded, frame) = loaded(folder);
    run(cpu(), &mut loaded, &frame, false).0.expect("the CPU renders")
}

#[test]
fn the_cpu_goes_on_when_a_device_is_lost_in_the_middle_of_a_frame() {
    let folder = tempfile::tempdir().expect("folder");
    let expected = expected(folder.path());
    // While the scene is uploaded, when the frame begins, and in its middle.
    for submissions in [0, 2, 4, 5] {
        let Some(vulkan) = device() else { return };
        let (mut loaded, frame) = loaded(folder.path());
        vulkan.vulkan_device().lose_after(submissions);
        let (film, by) = run(any(vulkan), &mut loaded, &frame, true);
        assert_eq!((by, film), ("cpu", Ok(expected.clone())), "after {submissions} submissions");
    }
    let Some(vulkan) = device() else { return };
    let (mut loaded, frame) = loaded(folder.path());
    vulkan.vulkan_device().lose_after(4);
    let (film, by) = run(any(vulkan), &mut loaded, &frame, false);
    let failure = film.expect_err("it was asked for that device");
    assert_eq!((by, failure.exit), ("vulkan", Exit::Missing));
    assert!(failure.what.contains("lost") && failure.what.contains("--backend cpu"), "{failure}");
}

#[test]
fn the_cpu_goes_on_when_the_memory_of_a_device_runs_out() {
    let folder = tempfile::tempdir().expect("folder");
    let expected = expected(folder.path());
    // There is room for a part of the scene, and then for the scene and not for the frame.
    let (mut whole, _) = loaded(folder.path());
    let Some(mut vulkan) = device() else { return };
    let empty = vulkan.vulkan_device().used();
    vulkan.apply(whole.derived.load_batch()).expect("there is room");
    let resident = vulkan.vulkan_device().used();
    assert!(resident > empty + 1000);
    for (limit, may) in [(empty + (resident - empty) / 3, true), (resident + 2000, true), (empty + 100, false)] {
        let Some(vulkan) = device() else { return };
        let (mut loaded, frame) = loaded(folder.path());
        vulkan.vulkan_device().set_memory_limit(Some(limit));
        let (film, by) = run(any(vulkan), &mut loaded, &frame, may);
        if may {
            assert_eq!((by, film), ("cpu", Ok(expected.clone())), "with {limit} bytes");
        } else {
            let failure = film.expect_err("it was asked for that device");
            assert_eq!((by, failure.exit), ("vulkan", Exit::Missing));
            assert!(failure.what.contains("limit") && failure.what.contains("--backend cpu"), "{failure}");
        }
    }
}

#[test]
fn a_batch_that_fails_at_any_allocation_leaves_a_backend_that_can_be_loaded_again() {
    let Some(mut vulkan) = device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    program::succeed(folder.path(), &["generate", "material-grid", "-o", "grid.glb"]);
    let path = folder.path().join("grid.glb");
    let (_, small) = scenes::all().remove(1);
    let device = vulkan.vulkan_device().clone();
    let show = |vulkan: &mut VulkanBackend| {
        let mut derived = DerivedScene::derive(&small, &DeriveOptions::default()).expect("the scene is sound");
        vulkan.apply(derived.load_batch()).expect("there is room");
        let resident = vulkan.read_back().expect("the device works");
        derived.rows().compare(&resident.rows()).expect("what is resident is what was derived");
        resident.check_instances().expect("the TLAS is that of the rows");
        let frame = crate::frame_of(&small, &derived, (16, 12), 1).expect("it shows something");
        render(vulkan, &frame)
    };
    // The first frame takes what a backend keeps.
    let expected = show(&mut vulkan);
    let empty = crate::emptied(&mut vulkan);
    let (mut refused, mut room) = (0, 20_000);
    loop {
        // From the first rows to the last structures: a little more each time.
        room += room / 2;
        device.set_memory_limit(Some(empty.0 + room));
        let mut large = open(&path);
        match vulkan.apply(large.derived.load_batch()) {
            Ok(_) => break,
            Err(BackendError::OutOfMemory(what)) => assert!(what.contains("limit"), "{what}"),
            Err(other) => panic!("{other}"),
        }
        refused += 1;
        // It says so until it is cleared, and follows then.
        let mut derived = DerivedScene::derive(&small, &DeriveOptions::default()).expect("the scene is sound");
        let again = vulkan.apply(derived.load_batch());
        assert!(matches!(again, Err(BackendError::OutOfMemory(_))), "{again:?}");
        device.set_memory_limit(None);
        crate::assert_emptied(&mut vulkan, empty);
        assert_eq!(show(&mut vulkan), expected);
        crate::assert_emptied(&mut vulkan, empty);
    }
    assert!(refused >= 5, "only {refused} limits are too low");
    assert_eq!(vulkan.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
}

#[test]
fn an_environment_that_finds_no_room_leaves_nothing_that_is_shown() {
    let Some(mut vulkan) = device() else { return };
    let (_, small) = scenes::all().remove(1);
    let mut derived = DerivedScene::derive(&small, &DeriveOptions::default()).expect("the scene is sound");
    let frame = crate::frame_of(&small, &derived, (16, 12), 1).expect("it shows something");
    let batch = derived.load_batch();
    vulkan.apply(batch.clone()).expect("there is room");
    let (width, height) = (512, 256);
    let map = EnvironmentMap { width, height, texels: vec![[1.0; 3]; (width * height) as usize] };
    let environment = Environment { map: Some(Arc::new(map)), ..Environment::none() };
    let device = vulkan.vulkan_device().clone();
    device.set_memory_limit(Some(device.used() + 1000));
    let refused = vulkan.set_environment(environment.clone());
    assert!(matches!(refused, Err(BackendError::OutOfMemory(_))), "{refused:?}");
    device.set_memory_limit(None);
    let shown = vulkan.submit(frame.clone());
    assert!(matches!(shown, Err(BackendError::OutOfMemory(_))), "{shown:?}");
    vulkan.clear().expect("the device works");
    vulkan.apply(batch).expect("there is room");
    vulkan.set_environment(environment).expect("there is room");
    assert!(render(&mut vulkan, &frame).sum.iter().any(|pixel| pixel[0] > 0.0));
    assert_eq!(vulkan.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
}
