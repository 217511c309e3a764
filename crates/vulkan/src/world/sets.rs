//! [`Worlds`]: the active set and the staging set.

use super::WorldWork;
use super::abi::{ScatterPush, WorldTable};
use super::arenas::{WorldSet, Written};
use super::frame::WorldSource;
use super::write::Writer;
use crate::device::Device;
use crate::error::Result;
use crate::memory::{Queue, Staging, Timings};
use crate::trace::compute::ComputePipeline;
use orthant_resident::BackendError;
use orthant_resident::world::{ArenaLens, MutationBatch, SetSlot, WorldApplied, WorldBytes};
use std::sync::Arc;

/// Bytes of the ring through which a staging set is filled.
const RING: u64 = 16 << 20;

/// What is resident of worlds.
pub(crate) struct Worlds {
    device: Arc<Device>,
    /// What fills the staging set. Its ring is made with the first of them.
    pub(super) background: Queue,
    ring: Option<Staging>,
    scatter: ComputePipeline,
    pub(super) active: WorldSet,
    pub(super) staging: Option<WorldSet>,
    most: u64,
    work: WorldWork,
}

impl Worlds {
    /// Of an empty world.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let push = size_of::<ScatterPush>() as u32;
        let scatter = ComputePipeline::new(device, crate::shaders::WORLD_SCATTER, c"scatter_writes", push)?;
        Ok(Self {
            background: Queue::background(device)?,
            ring: None,
            scatter,
            active: WorldSet::new(device, [0; 4], u64::MAX),
            staging: None,
            most: u64::MAX,
            work: WorldWork::default(),
            device: device.clone(),
        })
    }

    /// The active set, for frames that are handed in from now on.
    pub fn table(&self) -> WorldTable {
        self.active.table()
    }

    /// That set, and what rays have to reckon with in it.
    pub fn source(&self, with_scene: bool) -> WorldSource {
        WorldSource { table: self.active.table(), contents: self.active.contents, with_scene }
    }

    /// That frames cannot show the active set, if so.
    pub fn usable(&self) -> std::result::Result<(), BackendError> {
        self.active.usable()
    }

    /// What has been recorded for worlds so far.
    pub fn work(&self) -> WorldWork {
        self.work
    }

    /// How often the host has waited for the background queue.
    pub fn waits(&self) -> u64 {
        self.background.waits
    }

    /// Whether the background queue has done all that was handed in.
    pub fn is_idle(&self) -> Result<bool> {
        Ok(self.background.done()? == self.background.last())
    }

    /// Has the stages of the background queue measured, or not.
    pub fn set_timed(&mut self, is_timed: bool) {
        self.background.set_timed(is_timed);
    }

    /// What they have taken since this was asked last.
    pub fn take_timings(&mut self) -> Result<Timings> {
        self.background.take_timings()
    }

    /// Bounds the bytes of a set.
    pub fn set_limit(&mut self, bytes: Option<u64>) {
        self.most = bytes.unwrap_or(u64::MAX);
        self.active.most = self.most;
        if let Some(staging) = &mut self.staging {
            staging.most = self.most;
        }
    }

    /// Takes back what finished work does not need any more. Never waits.
    pub fn collect(&mut self) -> Result<()> {
        self.background.collect()
    }

    /// See [`orthant_resident::Backend::begin_staging`].
    pub fn begin_staging(&mut self, origin: [i64; 4], lens: ArenaLens) -> std::result::Result<(), BackendError> {
        self.drop_staging();
        self.collect()?;
        let ring = match &mut self.ring {
            Some(ring) => ring,
            None => self.ring.insert(Staging::new(&self.device, RING)?),
        };
        let mut set = WorldSet::new(&self.device, origin, self.most);
        if lens != ArenaLens::default() {
            let written = set.reserve(&mut self.background, ring, lens)?;
            self.work.add(written);
        }
        set.filled = self.background.last();
        self.staging = Some(set);
        Ok(())
    }

    /// See [`orthant_resident::Backend::apply_world`]; `queue` and `ring` are those of frames.
    pub fn apply(
        &mut self,
        queue: &mut Queue,
        ring: &mut Staging,
        set: SetSlot,
        batch: &MutationBatch,
    ) -> std::result::Result<WorldApplied, BackendError> {
        self.collect()?;
        let (applied, written) = match set {
            SetSlot::Active => self.active.apply(queue, ring, &Writer::Scatter(&self.scatter), batch)?,
            SetSlot::Staging => {
                let (Some(set), Some(ring)) = (&mut self.staging, &mut self.ring) else {
                    return Err(BackendError::NoStagingSet);
                };
                let applied = set.apply(&mut self.background, ring, &Writer::Copies, batch);
                // Also where it failed half-way.
                set.filled = self.background.last();
                applied?
            }
        };
        self.work.batches += 1;
        self.work.add(written);
        Ok(applied)
    }

    /// Whether nothing that fills the staging set is under way: frames after a swap then wait for nothing.
    pub fn is_staging_ready(&self) -> Result<bool> {
        let filled = self.staging.as_ref().map_or(0, |staging| staging.filled);
        Ok(self.background.done()? >= filled)
    }

    /// Exchanges handles. The next submission to `queue`, that of frames, waits on the device for what fills the new set, if
    /// that is still under way; the old set is freed with the last submission that may use it.
    pub fn swap(&mut self, queue: &mut Queue) -> std::result::Result<(), BackendError> {
        let done = self.background.done()?;
        self.staging.as_ref().ok_or(BackendError::NoStagingSet)?.usable()?;
        let Some(new) = self.staging.take() else { return Err(BackendError::NoStagingSet) };
        queue.wait_on_device(&self.background, new.filled);
        let old = std::mem::replace(&mut self.active, new);
        // No frame may have been handed in since the old set was swapped in: then its own filling may be under way.
        let last_use = if old.filled <= done { queue.last() } else { queue.next() };
        queue.retire_after(last_use, old);
        queue.collect()?;
        self.work.swaps += 1;
        Ok(())
    }

    /// Drops the staging set, if there is one.
    pub fn drop_staging(&mut self) {
        if let Some(old) = self.staging.take() {
            self.background.retire_after(self.background.last(), old);
        }
    }

    /// Drops both sets.
    pub fn clear(&mut self, queue: &mut Queue) {
        self.drop_staging();
        let empty = WorldSet::new(&self.device, [0; 4], self.most);
        let old = std::mem::replace(&mut self.active, empty);
        queue.retire(old);
    }

    /// Bytes of a set.
    pub fn bytes(&self, set: SetSlot) -> WorldBytes {
        match set {
            SetSlot::Active => self.active.bytes(),
            SetSlot::Staging => self.staging.as_ref().map_or(WorldBytes::default(), WorldSet::bytes),
        }
    }
}

impl WorldWork {
    fn add(&mut self, written: Written) {
        self.bytes += written.bytes;
        self.commands += written.commands;
        self.submissions += written.submissions;
        self.growths += written.grown;
    }
}
