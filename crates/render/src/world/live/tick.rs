//! One frame's share of the work: operations from the queue, and what becomes of one that is refused.

use super::boxes::Waiting;
use super::budget::Meter;
use super::compaction::Run;
use super::diagnostics::{ArenaCounts, CompactionState, Diagnostics, Occupancies, Occupancy, Revisions};
use super::queue::Next;
use super::{Budget, LiveError, LiveWorld, Trace};
use crate::world::{OpLimits, Plan};
use orthant_resident::world::payload::ALIGN;
use orthant_resident::world::{MutationBatch, SetSlot};
use orthant_resident::{Backend, BackendError};
use orthant_world::{Aabb4, Point4};
use std::time::Instant;

/// Materials that are written by one operation.
pub(super) const MATERIALS: usize = 64;

/// How far the operations of a frame may go in the budget.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Share {
    /// Half: the compaction has work too.
    Half,
    /// All that is left.
    All,
}

impl Share {
    pub fn allows(self, meter: &Meter) -> bool {
        match self {
            Self::Half => meter.has_room_within(0.5),
            Self::All => meter.has_room(),
        }
    }
}

impl LiveWorld {
    /// Does one frame's share of the work, and says what that was. `frame_ms` and `rays` are left to whoever renders.
    ///
    /// A batch that the backend refuses, and an arena that is full, lead to a rebuild in the background: until it is swapped in,
    /// frames show the set as it is, and edits wait.
    ///
    /// # Errors
    /// [`LiveError`] if the backend is gone, or if rebuilding fails again and again.
    pub fn tick(
        &mut self,
        backend: &mut dyn Backend,
        camera: Point4,
        budget: &Budget,
    ) -> Result<Diagnostics, LiveError> {
        self.frame += 1;
        self.trace = Trace::default();
        let mut meter = Meter::start(*budget);
        let within = self.take_offered(&meter)?;
        let pending = std::mem::take(&mut self.pending);
        let mut frame = Diagnostics {
            frame: self.frame,
            patches: pending.patches,
            noop_patches: pending.noops,
            patch_ms: pending.ms,
            patches_waiting: self.offered.len() as u64,
            coalesced: pending.coalesced,
            ..Diagnostics::default()
        };
        self.begin_compaction_if_due(&mut frame);
        if !self.compaction_needs_frames() {
            self.edits(backend, camera, &mut meter, Share::All, &mut frame)?;
        } else if self.run.as_mut().is_some_and(Run::is_stalled) {
            // Every edit leaves boxes to replay: without this a small budget would replay for ever.
            self.compact(backend, &mut meter, Share::All, &mut frame)?;
            self.edits(backend, camera, &mut meter, Share::All, &mut frame)?;
        } else if self.frame.is_multiple_of(2) {
            self.edits(backend, camera, &mut meter, Share::Half, &mut frame)?;
            self.compact(backend, &mut meter, Share::All, &mut frame)?;
            self.edits(backend, camera, &mut meter, Share::All, &mut frame)?;
        } else {
            // In turns, so that either gets on when the budget is one operation.
            self.compact(backend, &mut meter, Share::Half, &mut frame)?;
            self.edits(backend, camera, &mut meter, Share::All, &mut frame)?;
            self.compact(backend, &mut meter, Share::All, &mut frame)?;
        }
        if self.broken.is_some() {
            self.begin_compaction_if_due(&mut frame);
        }
        self.close(&mut frame);
        frame.mutation_ms = pending.ms - within + meter.elapsed_ms();
        Ok(frame)
    }

    /// Operations on the active set, as far as the budget goes.
    fn edits(
        &mut self,
        backend: &mut dyn Backend,
        camera: Point4,
        meter: &mut Meter,
        share: Share,
        frame: &mut Diagnostics,
    ) -> Result<(), LiveError> {
        let start = Instant::now();
        let mut result = Ok(());
        while result.is_ok() && self.broken.is_none() && share.allows(meter) {
            let ids = self.queue.take_palette(MATERIALS);
            if !ids.is_empty() {
                result = self.edit_palette(backend, &ids, meter, frame);
                continue;
            }
            result = match self.queue.next(camera, self.frame) {
                None => break,
                Some(Next::Dirty(waiting)) => {
                    let limits = OpLimits { focus: Some(camera), ..self.options.limits };
                    self.edit(backend, &waiting, &limits, meter, frame)
                }
                Some(Next::Untidy(waiting)) => self.tidy(backend, &waiting.bounds, meter, frame),
            };
        }
        frame.edit_ms += start.elapsed().as_secs_f64() * 1e3;
        result
    }

    fn edit_palette(
        &mut self,
        backend: &mut dyn Backend,
        ids: &[orthant_world::BlockId],
        meter: &mut Meter,
        frame: &mut Diagnostics,
    ) -> Result<(), LiveError> {
        match self.derived.plan_palette(&self.world, ids) {
            Err(full) => {
                self.queue.push_palette(ids);
                self.break_off(format!("{full}"), frame)
            }
            Ok(batch) => {
                if let Some(run) = &mut self.run {
                    run.palette.extend(ids);
                }
                self.apply(backend, &batch, meter, frame)
            }
        }
    }

    /// Brings a box whose content changed up to date.
    fn edit(
        &mut self,
        backend: &mut dyn Backend,
        waiting: &Waiting,
        limits: &OpLimits,
        meter: &mut Meter,
        frame: &mut Diagnostics,
    ) -> Result<(), LiveError> {
        let Waiting { bounds, since } = *waiting;
        let plan = match self.derived.plan(&self.world, &bounds, limits) {
            Ok(plan) => plan,
            Err(full) => {
                self.queue.push(bounds, since);
                return self.break_off(format!("{full}"), frame);
            }
        };
        frame.splits += u64::from(!plan.deferred.is_empty());
        for part in &plan.deferred {
            self.queue.push(*part, since);
        }
        if plan.untidy {
            self.queue.push_untidy(bounds, self.frame);
        }
        self.carry_out(backend, &plan, meter, frame)
    }

    /// Brings a box whose content is right to the pieces that the world has. What does not fit into an operation eight times as
    /// large stays as it is until a compaction.
    fn tidy(
        &mut self,
        backend: &mut dyn Backend,
        bounds: &Aabb4,
        meter: &mut Meter,
        frame: &mut Diagnostics,
    ) -> Result<(), LiveError> {
        let limits = tidying(&self.options.limits);
        match self.derived.plan(&self.world, bounds, &limits) {
            Ok(plan) => {
                for part in &plan.deferred {
                    self.queue.push_untidy(*part, self.frame);
                }
                self.carry_out(backend, &plan, meter, frame)
            }
            // There is no room for both forms at once: what is shown is right, so it stays.
            Err(_) => Ok(()),
        }
    }

    fn carry_out(
        &mut self,
        backend: &mut dyn Backend,
        plan: &Plan,
        meter: &mut Meter,
        frame: &mut Diagnostics,
    ) -> Result<(), LiveError> {
        for done in &plan.synced {
            frame.coalesced += u64::from(self.queue.synced(done));
            if !plan.untidy {
                self.queue.tidied(done);
            }
            if let Some(run) = &mut self.run {
                run.backlog.insert(*done, self.frame);
            }
        }
        self.apply(backend, &plan.batch, meter, frame)?;
        if self.broken.is_none() {
            self.trace.active.extend_from_slice(&plan.synced);
        } else if self.run.is_none() {
            // The leaves have it, so the snapshot that this tick ends with has it too.
            self.trace.staging.extend_from_slice(&plan.synced);
        }
        Ok(())
    }

    /// Applies a batch to the active set, then to the mirror.
    fn apply(
        &mut self,
        backend: &mut dyn Backend,
        batch: &MutationBatch,
        meter: &mut Meter,
        frame: &mut Diagnostics,
    ) -> Result<(), LiveError> {
        if batch.is_empty() {
            frame.noop_edits += 1;
            return Ok(());
        }
        let applied = match backend.apply_world(SetSlot::Active, batch) {
            Ok(applied) => applied,
            Err(gone @ (BackendError::Lost(_) | BackendError::Device(_))) => {
                // The leaves are ahead of the mirror now: `load` starts from the world.
                self.broken = Some(gone.to_string());
                return Err(gone.into());
            }
            Err(refused) => return self.break_off(format!("the backend refused a batch: {refused}"), frame),
        };
        self.resident = batch.new_revision;
        if let Err(refused) = self.derived.commit(batch) {
            return self.break_off(format!("the mirror refused a batch that the backend took: {refused}"), frame);
        }
        self.sah.follow(batch, self.derived.mirror());
        meter.spend(applied.bytes);
        self.schedule.edits += 1;
        frame.edits_applied += 1;
        frame.upload_bytes += applied.bytes;
        frame.writes += ArenaCounts::written(batch);
        frame.frees += ArenaCounts::freed(batch);
        Ok(())
    }

    /// The active set cannot follow: it stays as it is until a new one takes its place.
    fn break_off(&mut self, reason: String, frame: &mut Diagnostics) -> Result<(), LiveError> {
        self.rebuilds += 1;
        frame.rebuild = Some(reason.clone());
        self.broken = Some(reason);
        match &mut self.run {
            // What is being made anyway has all that the old set has, and replays the rest.
            Some(run) => run.is_rebuild = true,
            None => self.schedule.not_before = 0,
        }
        Ok(())
    }

    fn close(&self, frame: &mut Diagnostics) {
        let derived = &self.derived;
        frame.revisions =
            Revisions { world: self.world.revision(), mirror: derived.mirror().revision, resident: self.resident };
        frame.queue_length = (self.queue.dirty().len() + self.queue.palette_len()) as u64;
        frame.untidy_length = self.queue.untidy().len() as u64;
        frame.edits_deferred = self.queue.dirty().len() as u64;
        frame.occupancy = self.occupancy();
        frame.leaves = derived.leaf_count() as u64;
        frame.depth = u64::from(derived.depth());
        frame.sah_growth = self.sah.growth();
        frame.rebuilds_total = self.rebuilds;
        let compaction = &mut frame.compaction;
        compaction.state = self.run.as_ref().map_or(CompactionState::Idle, super::Run::state);
        compaction.backlog = self.run.as_ref().map_or(0, |run| run.backlog.len() as u64);
        compaction.finished_total = self.schedule.finished;
        compaction.discarded_total = self.schedule.discarded;
    }

    /// How full the arenas of the active set are.
    pub(super) fn occupancy(&self) -> Occupancies {
        // Not from `stats`, which costs by the dense chunks.
        let (derived, lens) = (&self.derived, self.derived.head.lens);
        let of = |live: u64, len: u32| Occupancy { live, free: u64::from(len) - live };
        Occupancies {
            nodes: of(derived.tree.node_count() as u64, lens.nodes),
            leaves: of(derived.leaves.len() as u64, lens.leaves),
            payload: of(u64::from(derived.payloads.spans().used()) * u64::from(ALIGN), lens.payload),
        }
    }
}

/// Limits of an operation that tidies: eight times as much.
fn tidying(limits: &OpLimits) -> OpLimits {
    OpLimits { chunks: limits.chunks * 8, leaves: limits.leaves * 8, ..*limits }
}
