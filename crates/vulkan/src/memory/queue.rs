//! [`Queue`]: work in the order in which it is handed in, counted by a timeline semaphore.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::timing::{Clock, Stage, Timings};
use crate::device::{Device, QueueHandle};
use crate::error::{During, Result, VulkanError};
use ash::vk;
use std::any::Any;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// Command buffers that may be under way at once; one more waits for the first. An edit of a world is one of its own, and a burst has
/// dozens of them in each of the frames that the device is behind.
const IN_FLIGHT: usize = 128;

/// A queue of the device, or a share in it: two of these may hand work in to the same one, each in its own order.
pub(crate) struct Queue {
    device: Arc<Device>,
    handle: QueueHandle,
    pool: vk::CommandPool,
    timeline: vk::Semaphore,
    /// Command buffers by the submission that they were handed in with, oldest first.
    flying: VecDeque<(u64, vk::CommandBuffer, Option<Clock>)>,
    idle: Vec<vk::CommandBuffer>,
    /// Whether what is recorded is measured; clocks that wait for something to measure; what has been measured.
    is_timed: bool,
    clocks: Vec<Clock>,
    timings: Timings,
    /// Number of the last submission.
    last: u64,
    /// What to drop once a submission is done.
    retired: VecDeque<(u64, Box<dyn Any + Send>)>,
    /// What the next submission is to wait for on the device.
    awaited: Option<(vk::Semaphore, u64)>,
    /// How often the host has waited for the device, whatever for.
    pub waits: u64,
}

/// Commands that are being recorded.
pub(crate) struct Commands {
    device: Arc<Device>,
    pub raw: vk::CommandBuffer,
    clock: Option<Clock>,
}

impl Queue {
    /// That of frames.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Self::of(device, device.queue)
    }

    /// That of copies in the background. A device with one queue has them there too, in an order of their own.
    pub fn background(device: &Arc<Device>) -> Result<Self> {
        Self::of(device, device.background)
    }

    fn of(device: &Arc<Device>, handle: QueueHandle) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default()
            .queue_family_index(handle.family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER | vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: the device lives, and has this queue family.
        let pool = unsafe { device.raw.create_command_pool(&info, None) }.during("cannot make a command pool")?;
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: as above; the device has the feature.
        let timeline = unsafe { device.raw.create_semaphore(&info, None) }.during("cannot make a semaphore");
        let timeline = timeline.inspect_err(|_| {
            // SAFETY: nothing was made from the pool.
            unsafe { device.raw.destroy_command_pool(pool, None) }
        })?;
        let (flying, idle, retired) = (VecDeque::new(), Vec::new(), VecDeque::new());
        let (is_timed, clocks, timings) = (false, Vec::new(), Timings::default());
        let device = device.clone();
        let (last, awaited, waits) = (0, None, 0);
        Ok(Self {
            device,
            handle,
            pool,
            timeline,
            flying,
            idle,
            is_timed,
            clocks,
            timings,
            last,
            retired,
            awaited,
            waits,
        })
    }

    /// Has what is recorded from now on measured, or not. Whether the device can.
    pub fn set_timed(&mut self, is_timed: bool) -> bool {
        let can = self.handle.timestamp_bits > 0 && self.device.info.limits.timestamp_period > 0.0;
        self.is_timed = is_timed && can;
        can
    }

    /// What stages have taken since it was asked last, as far as they are done.
    pub fn take_timings(&mut self) -> Result<Timings> {
        self.collect()?;
        Ok(std::mem::take(&mut self.timings))
    }

    /// A lost device does nothing more, whatever it answers to the next call.
    fn check_lost(&self) -> Result<()> {
        if self.device.is_lost() { Err(VulkanError::Lost("the device does not answer")) } else { Ok(()) }
    }

    fn note_loss<T>(&self, result: Result<T>) -> Result<T> {
        if let Err(VulkanError::Lost(_)) = &result {
            self.device.lose();
        }
        result
    }

    /// Begins a command buffer.
    pub fn begin(&mut self) -> Result<Commands> {
        self.collect()?;
        if self.flying.len() >= IN_FLIGHT {
            // SYNC: back-pressure: the device is this many submissions behind, and recording more would only grow memory.
            let oldest = self.flying[0].0;
            self.wait(oldest, Duration::MAX)?;
            self.collect()?;
        }
        let raw = match self.idle.pop() {
            Some(raw) => raw,
            None => {
                let info = vk::CommandBufferAllocateInfo::default()
                    .command_pool(self.pool)
                    .level(vk::CommandBufferLevel::PRIMARY)
                    .command_buffer_count(1);
                // SAFETY: the pool is of this device.
                unsafe { self.device.raw.allocate_command_buffers(&info) }.during("cannot make a command buffer")?[0]
            }
        };
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is not in flight: it is new, or its submission is done.
        unsafe { self.device.raw.begin_command_buffer(raw, &info) }.during("cannot record commands")?;
        let clock = match self.clocks.pop() {
            _ if !self.is_timed => None,
            Some(clock) => Some(clock),
            None => Some(Clock::new(&self.device, self.handle.timestamp_bits)?),
        };
        Ok(Commands { device: self.device.clone(), raw, clock })
    }

    /// Hands commands in. The number of the submission, by which to wait for it.
    pub fn submit(&mut self, mut commands: Commands) -> Result<u64> {
        commands.stage(None);
        self.device.count_submission();
        self.check_lost()?;
        // SAFETY: the command buffer is being recorded.
        unsafe { self.device.raw.end_command_buffer(commands.raw) }.during("cannot record commands")?;
        let number = self.last + 1;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands.raw)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.timeline)
            .value(number)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let waits = self.awaited.map(|(semaphore, value)| {
            vk::SemaphoreSubmitInfo::default()
                .semaphore(semaphore)
                .value(value)
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        });
        let info = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(waits.as_slice())
            .command_buffer_infos(&buffers)
            .signal_semaphore_infos(&signals)];
        // SAFETY: the queues of a device are in the hands of one backend, and are reached through `&mut` of it alone, also where
        // two of these share one; what the commands use is kept until the submission is done.
        let submitted = unsafe { self.device.raw.queue_submit2(self.handle.raw, &info, vk::Fence::null()) };
        self.note_loss(submitted.during("the device refused the work"))?;
        self.awaited = None;
        self.last = number;
        self.flying.push_back((number, commands.raw, commands.clock));
        Ok(number)
    }

    /// Gives commands up that were not handed in.
    pub fn abandon(&mut self, commands: Commands) {
        // SAFETY: it is being recorded, and nobody else has it.
        let ended = unsafe { self.device.raw.end_command_buffer(commands.raw) };
        if ended.is_ok() {
            self.idle.push(commands.raw);
        }
        if let Some(mut clock) = commands.clock {
            clock.reset();
            self.clocks.push(clock);
        }
    }

    /// Has the next submission wait, on the device, for one of the background queue, and see what it wrote. The host does not
    /// wait. (The semaphore lives until both queues are at rest: whoever ends first waits for the whole device.)
    pub fn wait_on_device(&mut self, background: &Self, number: u64) {
        if number > 0 {
            // Of one timeline the later value holds for both.
            let before = self.awaited.map_or(0, |(_, value)| value);
            self.awaited = Some((background.timeline, number.max(before)));
        }
    }

    /// The number of the last submission that is done.
    pub fn done(&self) -> Result<u64> {
        self.check_lost()?;
        // SAFETY: the semaphore is a timeline of this device.
        let value = unsafe { self.device.raw.get_semaphore_counter_value(self.timeline) };
        self.note_loss(value.during("the device does not answer"))
    }

    /// The number that the next submission will have.
    pub fn next(&self) -> u64 {
        self.last + 1
    }

    /// The number of the last submission.
    pub fn last(&self) -> u64 {
        self.last
    }

    /// Waits for a submission, or for a time. Whether it is done. Callers say why they wait.
    pub fn wait(&mut self, number: u64, limit: Duration) -> Result<bool> {
        if self.done()? >= number {
            return Ok(true);
        }
        self.waits += 1;
        let (semaphores, values) = ([self.timeline], [number]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        let nanoseconds = u64::try_from(limit.as_nanos()).unwrap_or(u64::MAX);
        // SAFETY: the semaphore is a timeline of this device, and the number is or will be signalled by a submission.
        match unsafe { self.device.raw.wait_semaphores(&info, nanoseconds) } {
            Ok(()) => Ok(true),
            Err(vk::Result::TIMEOUT) => Ok(false),
            Err(error) => self.note_loss(Err(error).during("the device does not answer")),
        }
    }

    /// Drops something when all that has been handed in, and what is being recorded now, is done.
    pub fn retire(&mut self, what: impl Any + Send) {
        self.retire_after(self.next(), what);
    }

    /// Drops something when a submission is done.
    pub fn retire_after(&mut self, number: u64, what: impl Any + Send) {
        self.retired.push_back((number, Box::new(what)));
    }

    /// Takes back what finished work does not need any more. Never waits.
    pub fn collect(&mut self) -> Result<()> {
        let done = self.done()?;
        while let Some((_, raw, clock)) = self.flying.pop_front_if(|(number, ..)| *number <= done) {
            self.idle.push(raw);
            if let Some(mut clock) = clock {
                clock.finish(&mut self.timings)?;
                self.clocks.push(clock);
            }
        }
        while self.retired.front().is_some_and(|(number, _)| *number <= done) {
            self.retired.pop_front();
        }
        Ok(())
    }
}

impl Drop for Queue {
    fn drop(&mut self) {
        // SYNC: the end: what is in flight must be done before its memory goes. A lost device is done.
        // SAFETY: nobody else has the queue any more.
        if unsafe { self.device.raw.device_wait_idle() }.is_err() {
            tracing::warn!("the Vulkan device did not finish its work");
        }
        self.retired.clear();
        // SAFETY: nothing is in flight any more.
        unsafe {
            self.device.raw.destroy_semaphore(self.timeline, None);
            self.device.raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// Everything, as a barrier has it.
const ALL: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::ALL_COMMANDS;
const READS_AND_WRITES: vk::AccessFlags2 =
    vk::AccessFlags2::from_raw(vk::AccessFlags2::MEMORY_READ.as_raw() | vk::AccessFlags2::MEMORY_WRITE.as_raw());

impl Commands {
    /// Begins a stage that is measured, or ends the one under way.
    pub fn stage(&mut self, stage: impl Into<Option<Stage>>) {
        if let Some(clock) = &mut self.clock {
            clock.mark(self.raw, stage.into());
        }
    }

    /// The stage under way, if it is measured.
    pub fn current_stage(&self) -> Option<Stage> {
        self.clock.as_ref().and_then(Clock::stage)
    }

    /// Copies parts of a buffer.
    pub fn copy(&mut self, from: vk::Buffer, to: vk::Buffer, parts: &[vk::BufferCopy]) {
        if !parts.is_empty() {
            // SAFETY: both buffers live until the commands are done, and callers keep to their sizes.
            unsafe { self.device.raw.cmd_copy_buffer(self.raw, from, to, parts) };
        }
    }

    /// Sets bytes of a buffer, both numbers multiples of 4.
    pub fn fill(&mut self, buffer: vk::Buffer, offset: u64, size: u64, value: u32) {
        if size > 0 {
            // SAFETY: as for `copy`.
            unsafe { self.device.raw.cmd_fill_buffer(self.raw, buffer, offset, size, value) };
        }
    }

    /// Writes at most 64 KiB that travel with the commands.
    pub fn update(&mut self, buffer: vk::Buffer, offset: u64, bytes: &[u8]) {
        // SAFETY: as for `copy`; rows are multiples of 4 bytes.
        unsafe { self.device.raw.cmd_update_buffer(self.raw, buffer, offset, bytes) };
    }

    fn barrier(
        &mut self,
        from: (vk::PipelineStageFlags2, vk::AccessFlags2),
        to: (vk::PipelineStageFlags2, vk::AccessFlags2),
    ) {
        let memory = [vk::MemoryBarrier2::default()
            .src_stage_mask(from.0)
            .src_access_mask(from.1)
            .dst_stage_mask(to.0)
            .dst_access_mask(to.1)];
        let info = vk::DependencyInfo::default().memory_barriers(&memory);
        // SAFETY: the command buffer is being recorded.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.raw, &info) };
    }

    /// The device that they are for.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Copies parts of a buffer into an image that is in the layout for it.
    pub fn copy_to_image(&mut self, from: vk::Buffer, to: vk::Image, parts: &[vk::BufferImageCopy]) {
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        // SAFETY: as for `copy`.
        unsafe { self.device.raw.cmd_copy_buffer_to_image(self.raw, from, to, layout, parts) };
    }

    /// Brings an image from a layout and its last use to another layout and its next use.
    pub fn transition(
        &mut self,
        image: vk::Image,
        range: vk::ImageSubresourceRange,
        (old, from): (vk::ImageLayout, (vk::PipelineStageFlags2, vk::AccessFlags2)),
        (new, to): (vk::ImageLayout, (vk::PipelineStageFlags2, vk::AccessFlags2)),
    ) {
        let barrier = [vk::ImageMemoryBarrier2::default()
            .image(image)
            .subresource_range(range)
            .old_layout(old)
            .new_layout(new)
            .src_stage_mask(from.0)
            .src_access_mask(from.1)
            .dst_stage_mask(to.0)
            .dst_access_mask(to.1)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: the image lives until the commands are done.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.raw, &info) };
    }

    /// What follows waits for all before it, handed in earlier or in these commands, and sees what it wrote.
    pub fn full_barrier(&mut self) {
        self.barrier((ALL, READS_AND_WRITES), (ALL, READS_AND_WRITES));
    }

    /// Between shaders that trace paths.
    pub fn shader_barrier(&mut self) {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let shaders = Stage::RAY_TRACING_SHADER_KHR | Stage::COMPUTE_SHADER;
        let storage = Access::SHADER_STORAGE_READ | Access::SHADER_STORAGE_WRITE;
        self.barrier((shaders, storage), (shaders, storage));
    }

    /// Before writes to what earlier frames may still read.
    pub fn begin_writes(&mut self) {
        self.full_barrier();
    }

    /// Before the host reads what was copied or written for it.
    pub fn host_barrier(&mut self) {
        self.barrier((ALL, READS_AND_WRITES), (vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ));
    }

    /// Between transfers that touch the same bytes.
    pub fn transfer_barrier(&mut self) {
        let transfer = (vk::PipelineStageFlags2::ALL_TRANSFER, READS_AND_WRITES);
        self.barrier(transfer, transfer);
    }
}
