//! [`Arena`]: a buffer of rows that grows on the device.

use super::{Buffer, Commands, Place, Queue};
use crate::device::Device;
use crate::error::{Result, VulkanError};
use ash::vk;
use std::sync::Arc;

/// Rows on the device. Growing copies there; the host does not see the rows again.
pub(crate) struct Arena {
    what: &'static str,
    usage: vk::BufferUsageFlags,
    place: Place,
    buffer: Option<Buffer>,
    /// Bytes of a row.
    stride: u64,
    /// Rows.
    pub len: u32,
}

impl Arena {
    /// An empty one; it takes memory with its first row.
    pub fn new(what: &'static str, stride: usize, usage: vk::BufferUsageFlags) -> Self {
        use vk::BufferUsageFlags as U;
        let usage = usage | U::STORAGE_BUFFER | U::TRANSFER_SRC | U::TRANSFER_DST;
        Self { what, usage, place: Place::Device, buffer: None, stride: stride as u64, len: 0 }
    }

    /// One that the background queue writes before the other one uses it.
    pub fn shared(what: &'static str, stride: usize) -> Self {
        Self { place: Place::Shared, ..Self::new(what, stride, vk::BufferUsageFlags::empty()) }
    }

    /// Its device address; 0 while it has no memory.
    pub fn address(&self) -> u64 {
        self.buffer.as_ref().map_or(0, |buffer| buffer.address)
    }

    /// The buffer, if there is one.
    pub fn raw(&self) -> vk::Buffer {
        self.buffer.as_ref().map_or(vk::Buffer::null(), |buffer| buffer.raw)
    }

    /// Bytes that it takes on the device.
    pub fn bytes(&self) -> u64 {
        self.buffer.as_ref().map_or(0, |buffer| buffer.size)
    }

    /// Bytes of a row.
    pub fn stride(&self) -> u64 {
        self.stride
    }

    /// Gives it a number of rows: new ones are whatever the memory holds. The first time it takes exactly as many, later it
    /// doubles. Whether it has moved.
    pub fn resize(
        &mut self,
        device: &Arc<Device>,
        queue: &mut Queue,
        commands: &mut Commands,
        len: u32,
    ) -> Result<bool> {
        let new = self.allocate(device, len)?;
        let moved = new.is_some();
        if let Some(new) = new {
            self.copy_to(commands, &new);
            if let Some(old) = self.adopt(new) {
                queue.retire(old);
            }
        }
        self.len = len;
        Ok(moved)
    }

    /// A buffer with room for a number of rows, if there is none: the first one is just as large, later ones at least twice as
    /// large as the one before. Where the device has no memory for that, as large as is needed. The arena is left as it is.
    pub fn allocate(&self, device: &Arc<Device>, len: u32) -> Result<Option<Buffer>> {
        let needed = u64::from(len) * self.stride;
        let has = self.bytes();
        if needed <= has || len == 0 {
            return Ok(None);
        }
        let make = |size| Buffer::new(device, self.what, size, self.usage, self.place);
        let most = device.info.limits.max_buffer;
        if needed > most {
            return Err(VulkanError::ArenaFull { what: self.what, bytes: needed, most });
        }
        let wanted = if self.buffer.is_some() { needed.max((2 * has).min(most)) } else { needed };
        match make(wanted) {
            Err(error) if wanted > needed && error.is_out_of_memory() => make(needed).map(Some),
            made => made.map(Some),
        }
    }

    /// Copies the rows to a buffer of [`Arena::allocate`].
    pub fn copy_to(&self, commands: &mut Commands, new: &Buffer) {
        let bytes = u64::from(self.len) * self.stride;
        if let Some(old) = self.buffer.as_ref().filter(|_| bytes > 0) {
            commands.copy(old.raw, new.raw, &[vk::BufferCopy { src_offset: 0, dst_offset: 0, size: bytes }]);
            commands.transfer_barrier();
        }
    }

    /// Takes such a buffer over, and gives the old one up.
    pub fn adopt(&mut self, new: Buffer) -> Option<Buffer> {
        self.buffer.replace(new)
    }
}
