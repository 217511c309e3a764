//! The frame loop's side of a compaction: what is taken from its thread, replayed, and swapped.

use super::budget::Meter;
use super::compaction::{Built, Gone, Job, Message, Run, Worker};
use super::diagnostics::Diagnostics;
use super::tick::MATERIALS;
use super::tick::Share;
use super::{BuildOptions, LiveError, LiveWorld, Quality};
use orthant_resident::world::{MutationBatch, SetSlot};
use orthant_resident::{Backend, BackendError};
use std::time::Instant;

/// Times in a row that a rebuild may fail.
const TRIES: u32 = 3;

/// What became of a step.
enum Step {
    /// There is more to do.
    More,
    /// Nothing can be done in this frame.
    Wait,
    /// The set took the place of the active one.
    Swapped,
    /// It cannot come to its end.
    GiveUp(String),
}

impl LiveWorld {
    /// Begins a compaction if one is due, asked for, or needed because the active set no longer follows.
    pub(super) fn begin_compaction_if_due(&mut self, frame: &mut Diagnostics) {
        if self.run.is_some() || self.frame < self.schedule.not_before {
            return;
        }
        let due = || {
            let (edits, leaves) = (self.schedule.edits, self.derived.leaf_count() as u64);
            self.options.compaction.due(edits, leaves, self.sah.growth(), &self.occupancy())
        };
        let reason = self.broken.clone().or_else(|| self.schedule.asked.clone()).or_else(due);
        let Some(reason) = reason else { return };
        self.schedule.asked = None;
        // A set that no longer follows is needed soon, and only then a good one.
        let quality = if self.broken.is_some() { Quality::Fast } else { Quality::Best };
        let options = BuildOptions { origin: None, quality, ..self.options.build };
        let job = Job {
            snapshot: self.derived.snapshot(),
            palette: self.world.palette().clone(),
            options,
            slice: self.options.compaction.slice_bytes,
        };
        match Worker::spawn(job) {
            Ok(worker) => {
                self.run = Some(Run::new(worker, self.broken.is_some()));
                self.trace.snapshot = true;
                frame.compaction.started = Some(reason);
            }
            Err(error) => {
                self.schedule.pause(self.frame, &self.options.compaction);
                frame.compaction.discarded = Some(format!("no thread for it: {error}"));
            }
        }
    }

    /// Whether the frame loop has a part in what is under way.
    pub(super) fn compaction_needs_frames(&self) -> bool {
        self.run.is_some()
    }

    /// Fills, replays and swaps, as far as the budget goes.
    pub(super) fn compact(
        &mut self,
        backend: &mut dyn Backend,
        meter: &mut Meter,
        share: Share,
        frame: &mut Diagnostics,
    ) -> Result<(), LiveError> {
        let Some(mut run) = self.run.take() else { return Ok(()) };
        let start = Instant::now();
        let mut step = self.outrun(&run);
        while matches!(step, Step::More) && share.allows(meter) {
            step = self.step(&mut run, backend, meter, frame)?;
        }
        frame.compaction.upload_ms += start.elapsed().as_secs_f64() * 1e3;
        match step {
            Step::More | Step::Wait => self.run = Some(run),
            Step::Swapped => {}
            Step::GiveUp(reason) => self.give_up(run, backend, reason, frame)?,
        }
        Ok(())
    }

    fn outrun(&self, run: &Run) -> Step {
        let (backlog, limit) = (run.backlog.len(), self.options.compaction.max_backlog);
        if backlog > limit {
            let state = run.state().name();
            return Step::GiveUp(format!(
                "outrun by edits while {state}: {backlog} boxes to replay, and {limit} are allowed"
            ));
        }
        Step::More
    }

    fn step(
        &mut self,
        run: &mut Run,
        backend: &mut dyn Backend,
        meter: &mut Meter,
        frame: &mut Diagnostics,
    ) -> Result<Step, LiveError> {
        match run.built.take() {
            None => match run.worker.news() {
                Ok(None) => Ok(Step::Wait),
                Err(Gone) => Ok(Step::GiveUp("its thread ended before its time".to_owned())),
                Ok(Some(message)) => self.take_in(run, message, backend, meter, frame),
            },
            Some(mut built) => {
                let step = match self.replay(run, &mut built, backend, meter, frame)? {
                    Some(step) => step,
                    None => match backend.is_staging_ready() {
                        Ok(true) => return self.swap(run, *built, backend, frame),
                        // Frames after a swap would wait for what is on its way.
                        Ok(false) => Step::Wait,
                        Err(error) => failed("the staging set was not filled", error)?,
                    },
                };
                run.built = Some(built);
                Ok(step)
            }
        }
    }

    fn take_in(
        &mut self,
        run: &mut Run,
        message: Message,
        backend: &mut dyn Backend,
        meter: &mut Meter,
        frame: &mut Diagnostics,
    ) -> Result<Step, LiveError> {
        match message {
            Message::Planned { time, origin, lens, joined } => {
                frame.compaction.build_ms = Some(time.as_secs_f64() * 1e3);
                frame.compaction.joined = Some(joined as u64);
                match backend.begin_staging(origin, lens) {
                    Ok(()) => {
                        run.is_filling = true;
                        Ok(Step::More)
                    }
                    Err(error) => failed("there is no staging set", error),
                }
            }
            Message::Batch(batch) => stage(backend, &batch, meter, frame),
            Message::Done(built) => {
                run.built = Some(built);
                Ok(Step::More)
            }
            Message::Failed(error) => Ok(Step::GiveUp(error)),
        }
    }

    /// Replays one box, or the materials; `None` if nothing is left to replay.
    fn replay(
        &mut self,
        run: &mut Run,
        built: &mut Built,
        backend: &mut dyn Backend,
        meter: &mut Meter,
        frame: &mut Diagnostics,
    ) -> Result<Option<Step>, LiveError> {
        if !run.palette.is_empty() {
            let ids: Vec<_> = run.palette.iter().copied().take(MATERIALS).collect();
            run.palette.retain(|id| !ids.contains(id));
            return match built.derived.plan_palette(&self.world, &ids) {
                Ok(batch) => follow(built, &batch, backend, meter, frame).map(Some),
                Err(full) => Ok(Some(Step::GiveUp(full.to_string()))),
            };
        }
        let Some(waiting) = run.backlog.take_oldest() else { return Ok(None) };
        let plan = match built.derived.plan(&self.world, &waiting.bounds, &self.options.limits) {
            Ok(plan) => plan,
            Err(full) => return Ok(Some(Step::GiveUp(full.to_string()))),
        };
        for part in &plan.deferred {
            run.backlog.insert(*part, waiting.since);
        }
        if plan.untidy {
            run.untidy.push(waiting.bounds);
        }
        for done in &plan.synced {
            run.backlog.remove_within(done);
        }
        frame.compaction.replayed += 1;
        self.trace.staging.extend_from_slice(&plan.synced);
        follow(built, &plan.batch, backend, meter, frame).map(Some)
    }

    fn swap(
        &mut self,
        run: &mut Run,
        built: Built,
        backend: &mut dyn Backend,
        frame: &mut Diagnostics,
    ) -> Result<Step, LiveError> {
        let start = Instant::now();
        if let Err(error) = backend.swap_sets() {
            return failed("the sets could not be exchanged", error);
        }
        let old = (std::mem::replace(&mut self.derived, built.derived), std::mem::replace(&mut self.sah, built.sah));
        run.worker.discard(old);
        self.resident = self.derived.mirror().revision;
        for bounds in run.untidy.drain(..) {
            self.queue.push_untidy(bounds, self.frame);
        }
        self.broken = None;
        self.schedule.failed_rebuilds = 0;
        self.schedule.finish();
        self.trace.swapped = true;
        frame.compaction.swapped = true;
        frame.compaction.swap_ms = Some(start.elapsed().as_secs_f64() * 1e3);
        Ok(Step::Swapped)
    }

    fn give_up(
        &mut self,
        run: Run,
        backend: &mut dyn Backend,
        reason: String,
        frame: &mut Diagnostics,
    ) -> Result<(), LiveError> {
        backend.drop_staging();
        self.schedule.pause(self.frame, &self.options.compaction);
        if run.is_rebuild {
            self.schedule.failed_rebuilds += 1;
            let tries = self.schedule.failed_rebuilds;
            if tries >= TRIES {
                return Err(LiveError::Rebuild { tries, reason });
            }
            self.schedule.not_before = self.frame + 1;
        } else {
            self.schedule.asked = Some(format!("again, after one was given up: {reason}"));
        }
        frame.compaction.discarded = Some(reason);
        run.discard();
        Ok(())
    }
}

/// Applies a batch to the staging set.
fn stage(
    backend: &mut dyn Backend,
    batch: &MutationBatch,
    meter: &mut Meter,
    frame: &mut Diagnostics,
) -> Result<Step, LiveError> {
    match backend.apply_world(SetSlot::Staging, batch) {
        Ok(applied) => {
            meter.spend(applied.bytes);
            frame.compaction.upload_bytes += applied.bytes;
            Ok(Step::More)
        }
        Err(error) => failed("the staging set refused a batch", error),
    }
}

/// Applies a replayed batch to the staging set, then to its mirror.
fn follow(
    built: &mut Built,
    batch: &MutationBatch,
    backend: &mut dyn Backend,
    meter: &mut Meter,
    frame: &mut Diagnostics,
) -> Result<Step, LiveError> {
    if batch.is_empty() {
        return Ok(Step::More);
    }
    let step = stage(backend, batch, meter, frame)?;
    if matches!(step, Step::More) {
        if let Err(refused) = built.derived.commit(batch) {
            return Ok(Step::GiveUp(format!("its mirror refused a batch that the staging set took: {refused}")));
        }
        built.sah.follow(batch, built.derived.mirror());
    }
    Ok(step)
}

/// A backend that is gone ends everything; what else it says ends the compaction.
fn failed(what: &str, error: BackendError) -> Result<Step, LiveError> {
    match error {
        gone @ (BackendError::Lost(_) | BackendError::Device(_)) => Err(gone.into()),
        other => Ok(Step::GiveUp(format!("{what}: {other}"))),
    }
}
