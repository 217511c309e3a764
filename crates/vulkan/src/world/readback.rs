//! A set as it is on the device: explicit readback, for validation and tests. It waits.

use super::arenas::WorldSet;
use super::sets::Worlds;
use crate::device::Device;
use crate::error::Result;
use crate::memory::{Arena, Buffer, Place, Queue, Stage};
use ash::vk;
use orthant_resident::BackendError;
use orthant_resident::world::{SetSlot, WorldArenas};
use std::sync::Arc;
use std::time::Duration;

/// Bytes that are copied back at once: large arenas do not take as much of host memory again.
const PIECE: u64 = 32 << 20;

impl Worlds {
    /// Copies a set back; `queue` is that of frames.
    pub fn read_back(&mut self, queue: &mut Queue, set: SetSlot) -> std::result::Result<WorldArenas, BackendError> {
        let (queue, set) = match set {
            SetSlot::Active => (queue, &self.active),
            SetSlot::Staging => (&mut self.background, self.staging.as_ref().ok_or(BackendError::NoStagingSet)?),
        };
        Ok(set.read_back(queue)?)
    }
}

impl WorldSet {
    /// By the queue that writes it.
    fn read_back(&self, queue: &mut Queue) -> Result<WorldArenas> {
        let [nodes, leaves, payload, palette] = &self.arenas;
        Ok(WorldArenas {
            origin: self.origin,
            root: self.root,
            revision: self.revision,
            nodes: read(&self.device, queue, nodes)?,
            leaves: read(&self.device, queue, leaves)?,
            payload: read(&self.device, queue, payload)?,
            palette: read(&self.device, queue, palette)?,
        })
    }
}

fn read<T: bytemuck::Pod>(device: &Arc<Device>, queue: &mut Queue, arena: &Arena) -> Result<Vec<T>> {
    let bytes = u64::from(arena.len) * arena.stride();
    let mut rows = vec![T::zeroed(); arena.len as usize];
    if rows.is_empty() {
        return Ok(rows);
    }
    let to: &mut [u8] = bytemuck::cast_slice_mut(&mut rows);
    let usage = vk::BufferUsageFlags::TRANSFER_DST;
    let buffer = Buffer::new(device, "a readback buffer", bytes.min(PIECE), usage, Place::Readback)?;
    for (i, piece) in to.chunks_mut(PIECE as usize).enumerate() {
        let (from, size) = (i as u64 * PIECE, piece.len() as u64);
        let mut commands = queue.begin()?;
        commands.full_barrier();
        commands.stage(Stage::Readback);
        commands.copy(arena.raw(), buffer.raw, &[vk::BufferCopy { src_offset: from, dst_offset: 0, size }]);
        commands.host_barrier();
        let number = queue.submit(commands)?;
        // SYNC: an explicit readback, which nobody does on the frame path.
        queue.wait(number, Duration::MAX)?;
        piece.copy_from_slice(&buffer.mapped()[..size as usize]);
    }
    Ok(rows)
}
