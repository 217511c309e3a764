//! World arenas on the device hold what the batches say, in both sets, whatever fails. Without a device the tests say so, unless
//! `ORTHANT_REQUIRE_VULKAN=1`. The validation layers have nothing to say.

mod batches;
mod faults;
mod swaps;
mod synthetic;

use orthant_resident::world::{SetSlot, WorldArenas};
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::device::{CacheFolder, DeviceOptions};

/// A device under the validation layers, or `None` where there is none and none has to be.
fn device() -> Option<VulkanBackend> {
    let required = std::env::var("ORTHANT_REQUIRE_VULKAN").is_ok_and(|v| v == "1");
    let validate = orthant_vulkan::device::can_validate().unwrap_or(false);
    assert!(validate || !required, "ORTHANT_REQUIRE_VULKAN is set: the validation layers are not installed");
    match VulkanBackend::new(&DeviceOptions { validate, cache: CacheFolder::None, ..DeviceOptions::default() }) {
        Ok(backend) => Some(backend),
        Err(error) if required => panic!("ORTHANT_REQUIRE_VULKAN is set: {error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// That a set is a mirror, row for row, the free ones too: what was never written is zero.
fn assert_resident(vulkan: &mut VulkanBackend, set: SetSlot, mirror: &WorldArenas) {
    let resident = vulkan.read_back_world(set).expect("the device works");
    assert_eq!((resident.origin, resident.root, resident.revision), (mirror.origin, mirror.root, mirror.revision));
    assert_eq!(resident.lens(), mirror.lens());
    // Not by `assert_eq`, which would print all of it.
    assert!(resident.nodes == mirror.nodes, "nodes of {set:?} at revision {}", mirror.revision);
    assert!(resident.leaves == mirror.leaves, "leaves of {set:?} at revision {}", mirror.revision);
    assert!(resident.payload == mirror.payload, "payload of {set:?} at revision {}", mirror.revision);
    assert!(resident.palette == mirror.palette, "palette of {set:?} at revision {}", mirror.revision);
}

fn assert_silent(vulkan: &VulkanBackend) {
    let said = vulkan.messages().map_or(Vec::new(), |messages| messages.first);
    assert_eq!(said, Vec::<String>::new(), "the validation layers are silent");
}

/// Lets the device come to an end, and frees what it does not need any more.
fn settle(vulkan: &mut VulkanBackend) {
    while !vulkan.is_idle().expect("the device works") {
        std::thread::yield_now();
    }
    vulkan.take_timings().expect("the device works");
}
