//! [`Arena`]: a buffer of rows that grows on the device.

use super::{Buffer, Commands, Place, Queue};
use crate::device::Device;
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// Rows on the device. Growing copies there; the host does not see the rows again.
pub(crate) struct Arena {
    what: &'static str,
    usage: vk::BufferUsageFlags,
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
        Self { what, usage, buffer: None, stride: stride as u64, len: 0 }
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
        let needed = u64::from(len) * self.stride;
        let has = self.bytes();
        if needed <= has || len == 0 {
            self.len = len;
            return Ok(false);
        }
        let size = if self.buffer.is_some() { needed.max(2 * has) } else { needed };
        let new = Buffer::new(device, self.what, size, self.usage, Place::Device)?;
        if let Some(old) = self.buffer.take() {
            let bytes = u64::from(self.len) * self.stride;
            if bytes > 0 {
                commands.copy(old.raw, new.raw, &[vk::BufferCopy { src_offset: 0, dst_offset: 0, size: bytes }]);
                commands.transfer_barrier();
            }
            queue.retire(old);
        }
        self.buffer = Some(new);
        self.len = len;
        Ok(true)
    }
}
