//! From render-node rows to draw commands, on the device.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::abi::{CullPush, DrawCommand};
use crate::device::Device;
use crate::error::{Result, VulkanError};
use crate::memory::{Buffer, Commands, Place, Queue};
use crate::trace::compute::ComputePipeline;
use ash::vk;
use std::sync::Arc;

/// Rows of a group of threads; `GROUP` of the shaders.
const GROUP: u32 = 256;
/// `Bucket::COUNT` of the shaders.
pub(super) const BUCKETS: u32 = 4;
const COMMAND: u64 = size_of::<DrawCommand>() as u64;

/// Draws that share a pipeline and its state; `Bucket` of the shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bucket {
    Opaque = 0,
    TwoSided = 1,
    Mask = 2,
    Blend = 3,
}

/// What culling writes.
pub(super) struct DrawList {
    pub commands: Buffer,
    pub group_counts: Buffer,
    pub counts: Buffer,
    /// Commands that a bucket has room for.
    pub capacity: u32,
}

/// See the module.
pub(super) struct Culling {
    device: Arc<Device>,
    count: ComputePipeline,
    sum: ComputePipeline,
    write: ComputePipeline,
    list: Option<DrawList>,
}

impl Culling {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let pipeline =
            |entry| ComputePipeline::new(device, crate::shaders::RASTER_CULL, entry, size_of::<CullPush>() as u32);
        Ok(Self {
            device: device.clone(),
            count: pipeline(c"count_rows")?,
            sum: pipeline(c"sum_counts")?,
            write: pipeline(c"write_commands")?,
            list: None,
        })
    }

    /// Room for the commands of some rows; what was smaller is retired.
    pub fn list(&mut self, queue: &mut Queue, rows: u32) -> Result<&DrawList> {
        if rows.div_ceil(GROUP) > self.device.info.limits.max_dispatch {
            let what = format!("{rows} render nodes are more than the device rasterizes; use --renderer path");
            return Err(VulkanError::Limit(what));
        }
        if self.list.as_ref().is_none_or(|list| list.capacity < rows)
            && let Some(old) = self.list.take()
        {
            queue.retire(old);
        }
        match &mut self.list {
            Some(list) => Ok(list),
            none => Ok(none.insert(DrawList::new(&self.device, rows)?)),
        }
    }

    /// The commands, if any were asked for.
    pub fn current(&self) -> Option<&DrawList> {
        self.list.as_ref()
    }

    /// Bytes of all of it.
    pub fn bytes(&self) -> u64 {
        self.list.as_ref().map_or(0, |list| list.commands.size + list.group_counts.size + list.counts.size)
    }

    /// Writes the commands of what is in the view.
    pub fn run(&self, commands: &mut Commands, push: &CullPush, rows: u32) {
        let Some(list) = &self.list else { return };
        let groups = rows.div_ceil(GROUP);
        let push = bytemuck::bytes_of(push);
        if !self.counts_on_device(list) {
            // What is drawn has to be bounded by commands that draw nothing.
            commands.fill(list.commands.raw, 0, list.commands.size / 4 * 4, 0);
        }
        commands.full_barrier();
        self.count.dispatch(commands, push, groups);
        commands.full_barrier();
        self.sum.dispatch(commands, push, 1);
        commands.full_barrier();
        self.write.dispatch(commands, push, groups);
        commands.full_barrier();
    }

    /// Whether the device reads how many commands there are.
    fn counts_on_device(&self, list: &DrawList) -> bool {
        self.device.info.features.draw_indirect_count && list.capacity <= self.device.info.limits.max_draws
    }

    /// Draws a bucket with whatever is bound.
    pub fn draw(&self, commands: &mut Commands, bucket: Bucket) {
        let Some(list) = &self.list else { return };
        let first = bucket as u64 * u64::from(list.capacity) * COMMAND;
        let raw = &self.device.raw;
        if self.counts_on_device(list) {
            let (count_at, stride) = (4 * bucket as u64, COMMAND as u32);
            let (from, counts) = (list.commands.raw, list.counts.raw);
            // SAFETY: both buffers live until the commands are done, and have room for what is read.
            unsafe {
                raw.cmd_draw_indirect_count(commands.raw, from, first, counts, count_at, list.capacity, stride);
            }
            return;
        }
        let step = self.device.info.limits.max_draws.max(1);
        let mut at = 0;
        while at < list.capacity {
            let count = step.min(list.capacity - at);
            let offset = first + u64::from(at) * COMMAND;
            // SAFETY: as above; commands that culling did not write draw nothing.
            unsafe { raw.cmd_draw_indirect(commands.raw, list.commands.raw, offset, count, COMMAND as u32) };
            at += count;
        }
    }
}

impl DrawList {
    fn new(device: &Arc<Device>, rows: u32) -> Result<Self> {
        let capacity = rows.max(1);
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::TRANSFER_SRC;
        let make = |what, size| Buffer::new(device, what, size, usage, Place::Device);
        Ok(Self {
            commands: make("draw commands", u64::from(BUCKETS) * u64::from(capacity) * COMMAND)?,
            group_counts: make("counts of draws", 4 * u64::from(BUCKETS) * u64::from(capacity.div_ceil(GROUP)))?,
            counts: make("counts of draws", 4 * u64::from(BUCKETS))?,
            capacity,
        })
    }
}
