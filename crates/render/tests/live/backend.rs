//! A backend that is nothing but arenas, and that fails when it is told to.

use orthant_resident::backend::{ApplyReport, ResidentBytes};
use orthant_resident::batch::SceneBatch;
use orthant_resident::world::{ArenaLens, BatchRefused, MutationBatch, SetSlot, WorldApplied, WorldArenas, WorldBytes};
use orthant_resident::{Backend, BackendError, Environment, Film, Frame, Ticket, TicketStatus};
use std::time::Duration;

/// Arenas, and faults to come.
#[derive(Default)]
pub struct Arenas {
    pub active: WorldArenas,
    pub staging: Option<WorldArenas>,
    /// Batches for the active set that are refused from now on.
    pub refuse_active: u32,
    /// Batches for the staging set that are refused from now on.
    pub refuse_staging: u32,
    /// Whether the device is gone.
    pub is_lost: bool,
    /// Batches, stagings and swaps so far.
    pub commands: u64,
}

fn refused() -> BackendError {
    BackendError::WorldBatch(BatchRefused::Invalid("told to refuse".to_owned()))
}

fn no_frames<T>() -> Result<T, BackendError> {
    Err(BackendError::InvalidFrame("arenas render nothing".to_owned()))
}

impl Backend for Arenas {
    fn name(&self) -> &'static str {
        "arenas"
    }

    fn device(&self) -> String {
        "memory".to_owned()
    }

    fn apply(&mut self, _batch: SceneBatch) -> Result<ApplyReport, BackendError> {
        no_frames()
    }

    fn set_environment(&mut self, _environment: Environment) -> Result<(), BackendError> {
        no_frames()
    }

    fn submit(&mut self, _frame: Frame) -> Result<Ticket, BackendError> {
        no_frames()
    }

    fn poll(&mut self, _ticket: Ticket, _budget: Duration) -> Result<TicketStatus, BackendError> {
        no_frames()
    }

    fn read_film(&mut self, _ticket: Ticket) -> Result<Film, BackendError> {
        no_frames()
    }

    fn resident_bytes(&self) -> ResidentBytes {
        ResidentBytes::default()
    }

    fn begin_staging(&mut self, origin: [i64; 4], _lens: ArenaLens) -> Result<(), BackendError> {
        self.commands += 1;
        self.staging = Some(WorldArenas::new(origin));
        Ok(())
    }

    fn apply_world(&mut self, set: SetSlot, batch: &MutationBatch) -> Result<WorldApplied, BackendError> {
        self.commands += 1;
        if self.is_lost {
            return Err(BackendError::Lost("told to be lost".to_owned()));
        }
        let (arenas, refuse) = match set {
            SetSlot::Active => (&mut self.active, &mut self.refuse_active),
            SetSlot::Staging => (self.staging.as_mut().ok_or(BackendError::NoStagingSet)?, &mut self.refuse_staging),
        };
        if *refuse > 0 {
            *refuse -= 1;
            return Err(refused());
        }
        Ok(arenas.apply(batch)?)
    }

    fn swap_sets(&mut self) -> Result<(), BackendError> {
        self.commands += 1;
        self.active = self.staging.take().ok_or(BackendError::NoStagingSet)?;
        Ok(())
    }

    fn drop_staging(&mut self) {
        self.staging = None;
    }

    fn world_bytes(&self, _set: SetSlot) -> WorldBytes {
        self.active.bytes()
    }
}
