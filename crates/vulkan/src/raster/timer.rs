//! Timestamps of the passes of a frame.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use crate::device::Device;
use crate::error::{During, Result};
use crate::memory::Commands;
use ash::vk;
use std::sync::Arc;
use std::time::Duration;

/// Moments of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moment {
    Begin = 0,
    Culled = 1,
    End = 2,
}

const MOMENTS: u32 = 3;

/// Three timestamps for each of some passes under way.
pub(super) struct Timer {
    device: Arc<Device>,
    raw: vk::QueryPool,
}

impl Timer {
    pub fn new(device: &Arc<Device>, passes: u32) -> Result<Self> {
        let info =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(MOMENTS * passes);
        // SAFETY: the device lives.
        let raw = unsafe { device.raw.create_query_pool(&info, None) }.during("cannot make queries")?;
        Ok(Self { device: device.clone(), raw })
    }

    /// Makes the timestamps of a pass ready to be written; none of an earlier pass may be under way in their place.
    pub fn reset(&self, pass: u32) {
        // SAFETY: the caller has seen that the earlier pass is done.
        unsafe { self.device.raw.reset_query_pool(self.raw, MOMENTS * pass, MOMENTS) };
    }

    /// Takes a timestamp once all before it is done.
    pub fn mark(&self, commands: &mut Commands, pass: u32, moment: Moment) {
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the query was reset, and is written once.
        unsafe { self.device.raw.cmd_write_timestamp2(commands.raw, stage, self.raw, MOMENTS * pass + moment as u32) };
    }

    /// How long a finished pass took, and how long until it was culled; `None` where the device has no clock.
    pub fn read(&self, pass: u32) -> Option<(Duration, Duration)> {
        let period = f64::from(self.device.info.limits.timestamp_period);
        let mut ticks = [0u64; MOMENTS as usize];
        // SAFETY: the pool has these queries; without the flag to wait it says so where one is not written.
        let read = unsafe {
            let flags = vk::QueryResultFlags::TYPE_64;
            self.device.raw.get_query_pool_results(self.raw, MOMENTS * pass, &mut ticks, flags)
        };
        let [begin, culled, end] = ticks;
        let between = |from: u64, to: u64| Duration::from_secs_f64(to.saturating_sub(from) as f64 * period * 1e-9);
        (read.is_ok() && period > 0.0 && end > begin).then(|| (between(begin, end), between(begin, culled)))
    }
}

impl Drop for Timer {
    fn drop(&mut self) {
        // SAFETY: whoever drops it knows that the device does not use it any more (`Queue::retire`).
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}
