//! How long the device takes for what: timestamps at the bounds of stages.
//!
//! Every command buffer that is measured has a pool of queries of its own. Their results are looked at when its submission
//! is known to be done, so that nobody waits for them. Stages of a queue do not overlap: a
//! timestamp is written when all commands before it are done.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use crate::device::Device;
use crate::error::{During, Result};
use ash::vk;
use std::sync::Arc;

/// What the device does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Stage {
    /// Copies from the staging ring: rows, geometry, images, tables of lights.
    Upload,
    /// The pass that writes TLAS instances from render nodes.
    Instances,
    /// BLAS that are built.
    BlasBuild,
    /// BLAS that are updated in their place.
    BlasUpdate,
    /// BLAS that are copied to where they take less, and the question how much that is.
    Compaction,
    /// The TLAS, built anew.
    TlasBuild,
    /// The TLAS, updated.
    TlasUpdate,
    /// Rays of frames.
    Trace,
    /// Copies to the host.
    Readback,
    /// The pass that writes into the arenas of the active world.
    WorldScatter,
    /// Copies into those of the staging set, on the background queue.
    WorldStaging,
}

impl Stage {
    /// All of them, with their names.
    pub const ALL: [(Self, &'static str); 11] = [
        (Self::Upload, "upload"),
        (Self::Instances, "instances"),
        (Self::BlasBuild, "blas_build"),
        (Self::BlasUpdate, "blas_update"),
        (Self::Compaction, "compaction"),
        (Self::TlasBuild, "tlas_build"),
        (Self::TlasUpdate, "tlas_update"),
        (Self::Trace, "trace"),
        (Self::Readback, "readback"),
        (Self::WorldScatter, "world_scatter"),
        (Self::WorldStaging, "world_staging"),
    ];
}

/// What a stage has taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTime {
    /// Seconds of the device.
    pub seconds: f64,
    /// How often it was entered.
    pub count: u64,
}

/// What every stage has taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timings([StageTime; Stage::ALL.len()]);

impl Timings {
    /// Of one stage.
    pub fn of(&self, stage: Stage) -> StageTime {
        self.0[stage as usize]
    }

    /// Every stage by its name.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, StageTime)> {
        Stage::ALL.into_iter().map(|(stage, name)| (name, self.of(stage)))
    }

    /// Adds what others have measured, on another queue.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (time, more) in self.0.iter_mut().zip(other.0) {
            time.seconds += more.seconds;
            time.count += more.count;
        }
    }

    /// Takes over what the timestamps of one command buffer say, of which each begins a stage or ends the one before.
    /// A tick is `period` nanoseconds; of a timestamp `mask` are the bits that count.
    fn add(&mut self, marks: &[Option<Stage>], ticks: &[u64], period: f64, mask: u64) {
        for (i, stage) in marks.iter().enumerate() {
            let (Some(stage), Some(end)) = (stage, ticks.get(i + 1)) else { continue };
            let time = &mut self.0[*stage as usize];
            time.seconds += (end.wrapping_sub(ticks[i]) & mask) as f64 * period * 1e-9;
            time.count += 1;
        }
    }
}

/// Timestamps of one command buffer.
const MARKS: usize = 128;

/// The timestamps of a command buffer that is being recorded or under way.
pub(super) struct Clock {
    device: Arc<Device>,
    pool: vk::QueryPool,
    /// Bits of a timestamp that count.
    bits: u32,
    /// What begins with each; nothing, where it only ends what was before.
    marks: Vec<Option<Stage>>,
}

impl Clock {
    pub fn new(device: &Arc<Device>, bits: u32) -> Result<Self> {
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(MARKS as u32);
        // SAFETY: the device lives.
        let pool = unsafe { device.raw.create_query_pool(&info, None) }.during("cannot make timestamps")?;
        let clock = Self { device: device.clone(), pool, bits, marks: Vec::new() };
        // SAFETY: nothing uses it yet.
        unsafe { device.raw.reset_query_pool(pool, 0, MARKS as u32) };
        Ok(clock)
    }

    /// The stage under way.
    pub fn stage(&self) -> Option<Stage> {
        self.marks.last().copied().flatten()
    }

    /// Begins a stage, or ends the one under way. What does not fit any more is not measured.
    pub fn mark(&mut self, commands: vk::CommandBuffer, stage: Option<Stage>) {
        if stage == self.stage() || self.marks.len() == MARKS {
            return;
        }
        let stage = stage.filter(|_| self.marks.len() + 1 < MARKS);
        let at = self.marks.len() as u32;
        // SAFETY: the command buffer is being recorded; the query is reset, and within the pool.
        unsafe {
            let after = vk::PipelineStageFlags2::ALL_COMMANDS;
            self.device.raw.cmd_write_timestamp2(commands, after, self.pool, at);
        }
        self.marks.push(stage);
    }

    /// Takes over the results of a submission that is done, and is ready for the next.
    pub fn finish(&mut self, timings: &mut Timings) -> Result<()> {
        if self.marks.is_empty() {
            return Ok(());
        }
        let mut ticks = vec![0u64; self.marks.len()];
        // SYNC: the flag asks for a wait, but the submission is done: the host knows.
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: so many queries were written.
        unsafe { self.device.raw.get_query_pool_results(self.pool, 0, &mut ticks, flags) }
            .during("cannot read timestamps")?;
        let limits = self.device.info.limits;
        let mask = u64::MAX >> (64 - self.bits.clamp(1, 64));
        timings.add(&self.marks, &ticks, f64::from(limits.timestamp_period), mask);
        self.reset();
        Ok(())
    }

    /// Forgets what was recorded, none of which is under way.
    pub fn reset(&mut self) {
        self.marks.clear();
        // SAFETY: no submission that uses it is under way.
        unsafe { self.device.raw.reset_query_pool(self.pool, 0, MARKS as u32) };
    }
}

impl Drop for Clock {
    fn drop(&mut self) {
        // SAFETY: it is dropped when no submission uses it.
        unsafe { self.device.raw.destroy_query_pool(self.pool, None) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_get_the_time_until_the_next_mark_also_where_the_counter_has_turned_over() {
        let mut timings = Timings::default();
        let marks = [Some(Stage::Upload), Some(Stage::TlasUpdate), None, Some(Stage::Upload), None];
        timings.add(&marks, &[250, 254, 2, 100, 110], 1000.0, 0xff);
        let close = |stage, seconds: f64, count| {
            let time = timings.of(stage);
            assert!((time.seconds - seconds).abs() < 1e-12 && time.count == count, "{stage:?}: {time:?}");
        };
        close(Stage::Upload, 14e-6, 2);
        close(Stage::TlasUpdate, 4e-6, 1);
        close(Stage::Trace, 0.0, 0);
        for (i, (stage, _)) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, i);
        }
    }
}
