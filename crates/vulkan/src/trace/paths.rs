//! Memory of the paths that are under way where they are traced in stages (`shaders/stages.slang`).

use crate::device::Device;
use crate::error::Result;
use crate::memory::{Buffer, Commands, Place, Queue};
use ash::vk;
use orthant_resident::frame::Tile;
use std::sync::Arc;

/// The pool takes this part of the device's memory, within bounds (and holds a row of the tile at least). The more paths there
/// are, the less it counts that stages wait for each other.
const MEMORY_SHARE: u64 = 64;
const LEAST_PATHS: u64 = 1 << 16;
const MOST_PATHS: u64 = 1 << 21;
/// Columns of four numbers that are kept of a path; `Column` of the shaders.
pub(super) const COLUMNS: u64 = 15;
/// The same where there is a world; `WorldColumn`.
pub(super) const WORLD_COLUMNS: u64 = 21;
/// Bytes of an element of a column.
const ELEMENT: u64 = 16;
/// The column with what is to be done with a path: `Column::THROUGHPUT`.
const STATUS_COLUMN: u64 = 2;

/// The memory, which one frame leaves to the next: frames follow each other on the queue.
#[derive(Default)]
pub(crate) struct PathPool(Option<Buffer>);

/// The pool as a frame uses it.
#[derive(Clone, Copy)]
pub(super) struct Columns {
    pub address: u64,
    /// Paths in a column.
    pub stride: u64,
    raw: vk::Buffer,
}

impl PathPool {
    /// Room for the paths of a tile, or for as many as may be under way at a time, of so many columns.
    pub(super) fn columns(
        &mut self,
        device: &Arc<Device>,
        queue: &mut Queue,
        tile: Tile,
        columns: u64,
    ) -> Result<Columns> {
        let pixels = u64::from(tile.width) * u64::from(tile.height);
        let room = device.info.memory / MEMORY_SHARE / (columns * ELEMENT);
        let stride = pixels.min(room.clamp(LEAST_PATHS, MOST_PATHS).max(u64::from(tile.width)));
        let size = columns * ELEMENT * stride;
        let buffer = match self.0.take() {
            Some(buffer) if buffer.size >= size => buffer,
            old => {
                queue.retire(old);
                let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
                Buffer::new(device, "paths under way", size, usage, Place::Device)?
            }
        };
        let buffer = self.0.insert(buffer);
        Ok(Columns { address: buffer.address, stride, raw: buffer.raw })
    }
}

impl Columns {
    /// Says of the first `count` paths that nothing was begun.
    pub fn begin(self, commands: &mut Commands, count: u64) {
        commands.fill(self.raw, STATUS_COLUMN * ELEMENT * self.stride, ELEMENT * count, 0);
    }
}
