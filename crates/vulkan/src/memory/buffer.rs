//! [`Buffer`].

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use crate::device::Device;
use crate::error::{During, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// Where a buffer lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// On the device.
    Device,
    /// On the device, written by the background queue and then used by the other.
    ///
    /// Such a buffer belongs to both queue families at once (`VK_SHARING_MODE_CONCURRENT`), where these differ: handing it from
    /// one to the other would take a release on the one queue and an acquire on the other for every arena, recorded in the
    /// first frame after a swap, and saves nothing: drivers lay a buffer out the same either way (it is images that they
    /// compress for one family). What orders the queues is a semaphore, see `Queue::wait_on_device`.
    Shared,
    /// In host memory, mapped, to be written by the host.
    Upload,
    /// In host memory, mapped, to be read by the host.
    Readback,
}

/// A buffer with its memory and its device address.
pub(crate) struct Buffer {
    device: Arc<Device>,
    pub raw: vk::Buffer,
    pub size: u64,
    pub address: u64,
    allocation: Option<Allocation>,
}

impl Buffer {
    /// Makes one of at least one byte.
    pub fn new(
        device: &Arc<Device>,
        what: &'static str,
        size: u64,
        usage: vk::BufferUsageFlags,
        place: Place,
    ) -> Result<Self> {
        let size = size.max(4);
        let usage = usage | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let families = [device.queue.family, device.background.family];
        let mut info = vk::BufferCreateInfo::default().size(size).usage(usage).sharing_mode(vk::SharingMode::EXCLUSIVE);
        if place == Place::Shared && families[0] != families[1] {
            info = info.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(&families);
        }
        // SAFETY: the device lives; `info` is complete.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.during(what)?;
        // From here on dropping it cleans up.
        let mut buffer = Self { device: device.clone(), raw, size, address: 0, allocation: None };
        // SAFETY: the buffer is of this device.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        let location = match place {
            Place::Device | Place::Shared => MemoryLocation::GpuOnly,
            Place::Upload => MemoryLocation::CpuToGpu,
            Place::Readback => MemoryLocation::GpuToCpu,
        };
        let allocation = device.allocate(&AllocationCreateDesc {
            name: what,
            requirements,
            location,
            linear: true,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        })?;
        let allocation = buffer.allocation.insert(allocation);
        // SAFETY: the memory was allocated for this buffer's requirements, and is bound once.
        unsafe { device.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) }.during(what)?;
        let info = vk::BufferDeviceAddressInfo::default().buffer(raw);
        // SAFETY: the buffer has memory, and was made with the usage that this asks for.
        buffer.address = unsafe { device.raw.get_buffer_device_address(&info) };
        Ok(buffer)
    }

    /// The bytes of a mapped buffer, to be written.
    pub fn mapped_mut(&mut self) -> &mut [u8] {
        self.allocation.as_mut().and_then(Allocation::mapped_slice_mut).unwrap_or_default()
    }

    /// The bytes of a mapped buffer. What the device writes is there once its work is known to be done.
    pub fn mapped(&self) -> &[u8] {
        self.allocation.as_ref().and_then(Allocation::mapped_slice).unwrap_or_default()
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: whoever drops it knows that the device does not use it any more (`Queue::retire`).
        unsafe { self.device.raw.destroy_buffer(self.raw, None) };
        if let Some(allocation) = self.allocation.take() {
            self.device.free(allocation);
        }
    }
}
