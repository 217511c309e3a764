//! The [`Backend`] trait: what renders a resident scene.

use crate::batch::SceneBatch;
use crate::environment::Environment;
use crate::film::Film;
use crate::frame::Frame;
use crate::world::{ArenaLens, BatchRefused, MutationBatch, SetSlot, WorldApplied, WorldBytes, WorldCounts};
use std::time::Duration;

/// What can go wrong in a backend.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum BackendError {
    /// The batch starts from another revision than the resident scene has. Nothing was changed.
    #[error(
        "the batch starts at revision {expected}, but the resident scene is at {resident}; apply the batches in order"
    )]
    StaleRevision {
        /// What the batch expects.
        expected: u64,
        /// What is resident.
        resident: u64,
    },
    /// The batch contradicts itself or leads outside its buffers. Nothing was changed.
    #[error("the batch is invalid: {0}")]
    InvalidBatch(String),
    /// A batch for a world was refused. Nothing was changed.
    #[error(transparent)]
    WorldBatch(#[from] BatchRefused),
    /// There is no staging set.
    #[error("there is no staging set: begin one before it is filled or swapped in")]
    NoStagingSet,
    /// The frame cannot be rendered as asked.
    #[error("the frame is invalid: {0}")]
    InvalidFrame(String),
    /// The ticket is not the last one that was handed out, or was read back already.
    #[error("unknown ticket {0:?}: a new frame or a readback has ended it")]
    UnknownTicket(Ticket),
    /// The device lacks something.
    #[error("{0}")]
    Device(String),
    /// The device's memory is used up. A batch that fails so may leave no scene: it has to be loaded again.
    #[error("{0}")]
    OutOfMemory(String),
    /// The device is gone, and with it all that was resident: another backend is needed.
    #[error("{0}")]
    Lost(String),
}

/// A frame that was handed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ticket(pub u64);

/// Work that was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Rays from the camera.
    pub camera: u64,
    /// Rays that continue a path.
    pub bounce: u64,
    /// Visibility rays to lights.
    pub shadow: u64,
}

impl RayCounts {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.camera + self.bounce + self.shadow
    }
}

/// How far a frame is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TicketStatus {
    /// Pixel samples that are done.
    pub done: u64,
    /// Pixel samples of the whole frame.
    pub total: u64,
    /// Rays so far.
    pub rays: RayCounts,
    /// Time spent tracing so far.
    pub elapsed: Duration,
    /// Work in the world so far.
    pub world: WorldCounts,
}

impl TicketStatus {
    /// Whether the frame is finished.
    pub fn is_done(&self) -> bool {
        self.done == self.total
    }
}

/// Bytes that are resident.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResidentBytes {
    /// Positions, attributes, indices, tangents.
    pub geometry: u64,
    /// BLAS and TLAS.
    pub acceleration: u64,
    /// Images with their mips.
    pub images: u64,
    /// All other rows.
    pub rows: u64,
}

/// What an applied batch did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ApplyReport {
    /// Bytes written, images apart.
    pub bytes: u64,
    /// BLAS built.
    pub blas_built: u32,
    /// Time of the BLAS builds.
    pub blas_time: Duration,
    /// Time of the TLAS build or update.
    pub tlas_time: Duration,
}

/// What renders a resident scene. Data flows in as batches and frames, and out as a film on request; a backend never
/// asks the model for anything.
pub trait Backend {
    /// Its name on the command line and in reports, such as `cpu`.
    fn name(&self) -> &'static str;

    /// The device, in words.
    fn device(&self) -> String;

    /// Brings the resident scene up to date. An error changes nothing.
    fn apply(&mut self, batch: SceneBatch) -> Result<ApplyReport, BackendError>;

    /// Sets what surrounds the scene.
    fn set_environment(&mut self, environment: Environment) -> Result<(), BackendError>;

    /// Hands in a frame; it replaces any earlier one.
    fn submit(&mut self, frame: Frame) -> Result<Ticket, BackendError>;

    /// Says how far a frame is. A backend without a device of its own works here, for about `budget`.
    fn poll(&mut self, ticket: Ticket, budget: Duration) -> Result<TicketStatus, BackendError>;

    /// The film of a frame, finished or not (an unfinished one holds whole blocks only); ends the ticket.
    fn read_film(&mut self, ticket: Ticket) -> Result<Film, BackendError>;

    /// What is resident, in bytes.
    fn resident_bytes(&self) -> ResidentBytes;

    /// Makes an empty staging set of world arenas, whose node bounds are relative to `origin` (raw), with room for `lens` if that
    /// is known. One that was being filled is dropped. Frames see nothing of it.
    fn begin_staging(&mut self, origin: [i64; 4], lens: ArenaLens) -> Result<(), BackendError>;

    /// Brings a set of world arenas up to date. An error changes nothing. A frame that was submitted before sees the set as it
    /// was, or is ended.
    fn apply_world(&mut self, set: SetSlot, batch: &MutationBatch) -> Result<WorldApplied, BackendError>;

    /// Whether all that was applied to the staging set has arrived: frames after a swap then wait for nothing. Never waits. A backend
    /// in memory is always ready.
    fn is_staging_ready(&self) -> Result<bool, BackendError> {
        Ok(true)
    }

    /// Puts the staging set in the place of the active one, between two frames, by exchanging handles: nothing is copied and
    /// nothing is waited for. The old set is dropped when no frame uses it.
    fn swap_sets(&mut self) -> Result<(), BackendError>;

    /// Drops the staging set, if there is one.
    fn drop_staging(&mut self);

    /// Bytes of a set; zero if there is none.
    fn world_bytes(&self, set: SetSlot) -> WorldBytes;
}
