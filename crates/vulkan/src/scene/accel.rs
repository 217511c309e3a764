//! Acceleration structures and the memory that they lie in.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use crate::device::Device;
use crate::error::{During, Result, VulkanError};
use crate::memory::{Buffer, Place};
use ash::vk;
use offset_allocator::{Allocation, Allocator};
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes of a page; what is larger gets one of its own.
const PAGE: u64 = 64 << 20;
/// Offsets within a page are multiples of this (VUID-VkAccelerationStructureCreateInfoKHR-offset-03734).
const ALIGNMENT: u64 = 256;

struct Page {
    buffer: Buffer,
    /// `None` for a page of one large structure.
    free: Option<Allocator>,
    /// Structures that lie in it.
    used: u32,
}

/// Device memory for acceleration structures: pages that many share.
#[derive(Clone)]
pub(crate) struct Pages(Arc<Mutex<Vec<Option<Page>>>>);

/// Where a structure lies.
struct Placement {
    pages: Pages,
    page: usize,
    part: Option<Allocation>,
}

/// An acceleration structure; it ends with its memory when it is dropped.
pub(crate) struct Accel {
    device: Arc<Device>,
    pub raw: vk::AccelerationStructureKHR,
    pub address: u64,
    pub size: u64,
    // Dropped after the handle.
    _placement: Placement,
}

impl Pages {
    pub fn new() -> Self {
        Self(Arc::default())
    }

    fn place(&self, device: &Arc<Device>, size: u64) -> Result<(vk::Buffer, u64, Placement)> {
        let units = size.div_ceil(ALIGNMENT);
        let Ok(units) = u32::try_from(units) else {
            return Err(VulkanError::Limit(format!("an acceleration structure of {size} bytes is too large")));
        };
        let mut pages = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = pages.iter_mut().enumerate().find_map(|(i, page)| {
            let page = page.as_mut()?;
            let part = page.free.as_mut()?.allocate(units)?;
            page.used += 1;
            Some((i, page.buffer.raw, part))
        });
        if let Some((page, raw, part)) = found {
            let offset = u64::from(part.offset) * ALIGNMENT;
            return Ok((raw, offset, Placement { pages: self.clone(), page, part: Some(part) }));
        }
        // The allocator rounds sizes up to its bins: what is nearly as large as a page may not fit an empty one.
        let is_large = size > PAGE / 2;
        let bytes = if is_large { u64::from(units) * ALIGNMENT } else { PAGE };
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR;
        let buffer = Buffer::new(device, "memory for acceleration structures", bytes, usage, Place::Device)?;
        let mut free = (!is_large).then(|| Allocator::new((PAGE / ALIGNMENT) as u32));
        let part = free.as_mut().and_then(|free| free.allocate(units));
        debug_assert!(is_large || part.is_some(), "half a page fits an empty one");
        let raw = buffer.raw;
        let page = pages.iter().position(Option::is_none).unwrap_or(pages.len());
        if page == pages.len() {
            pages.push(None);
        }
        pages[page] = Some(Page { buffer, free, used: 1 });
        let offset = part.map_or(0, |part| u64::from(part.offset) * ALIGNMENT);
        Ok((raw, offset, Placement { pages: self.clone(), page, part }))
    }
}

impl Drop for Placement {
    fn drop(&mut self) {
        let mut pages = self.pages.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(slot) = pages.get_mut(self.page)
            && let Some(page) = slot
        {
            if let (Some(free), Some(part)) = (&mut page.free, self.part) {
                free.free(part);
            }
            page.used -= 1;
            if page.used == 0 {
                *slot = None;
            }
        }
    }
}

impl Accel {
    /// One with room for a build of `size` bytes.
    pub fn new(device: &Arc<Device>, pages: &Pages, kind: vk::AccelerationStructureTypeKHR, size: u64) -> Result<Self> {
        let (buffer, offset, placement) = pages.place(device, size)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default().buffer(buffer).offset(offset).size(size).ty(kind);
        // SAFETY: the part of the buffer is this structure's alone, aligned, and lives as long as it.
        let raw = unsafe { device.accel.create_acceleration_structure(&info, None) }
            .during("cannot make an acceleration structure")?;
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
        // SAFETY: it was made above.
        let address = unsafe { device.accel.get_acceleration_structure_device_address(&info) };
        Ok(Self { device: device.clone(), raw, address, size, _placement: placement })
    }
}

impl Drop for Accel {
    fn drop(&mut self) {
        // SAFETY: whoever drops it knows that the device does not use it any more (`Queue::retire`).
        unsafe { self.device.accel.destroy_acceleration_structure(self.raw, None) };
    }
}

/// Scratch memory for builds, used again and again.
#[derive(Default)]
pub(crate) struct Scratch(Option<Buffer>);

impl Scratch {
    /// The address of at least `size` aligned bytes. What builds before use must be separated by a barrier from those after.
    pub fn at_least(&mut self, device: &Arc<Device>, queue: &mut crate::memory::Queue, size: u64) -> Result<u64> {
        let alignment = device.info.limits.scratch_alignment;
        if self.0.as_ref().is_none_or(|buffer| buffer.size < size + alignment) {
            let new = Buffer::new(
                device,
                "scratch memory for acceleration structures",
                size + alignment,
                vk::BufferUsageFlags::STORAGE_BUFFER,
                Place::Device,
            )?;
            if let Some(old) = self.0.replace(new) {
                queue.retire(old);
            }
        }
        let address = self.0.as_ref().map_or(0, |buffer| buffer.address);
        Ok(address.next_multiple_of(alignment))
    }

    /// Its bytes.
    pub fn bytes(&self) -> u64 {
        self.0.as_ref().map_or(0, |buffer| buffer.size)
    }
}
