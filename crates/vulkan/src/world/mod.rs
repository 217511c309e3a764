//! Worlds on the device.
//!
//! * [`abi`]: what shaders see of a set of arenas; [`view`]: what they see of a frame's view of it;
//! * [`arenas`]: a set: arenas that grow, and the batches that change it;
//! * [`list`]: the writes of a batch as they travel; [`write`]: how they reach the arenas;
//! * [`sets`]: the active set and the staging set;
//! * [`readback`]: a set as it is on the device;
//! * [`pipeline`]: the compute pipelines that trace rays; [`frame`]: what a frame that shows a world has besides.
//!
//! # Order
//! A batch for the active set is a list of writes that a compute pass scatters, between two barriers on the queue of frames: after
//! all frames that were handed in before, before all that come. The root and the addresses of the arenas travel by
//! value with each frame ([`abi::WorldTable`]), so a frame has the root that belongs to what it finds in the arenas.
//!
//! The staging set is written by copies on the background queue, where there is a second one; no frame knows of it. A swap
//! exchanges two values on the host. The first submission of frames after it waits on the device for the last copy, which
//! is over by then if the caller has asked ([`orthant_resident::Backend::is_staging_ready`]). The old set is freed when the last
//! submission before the swap is done.

pub mod abi;
mod arenas;
mod frame;
mod list;
mod pipeline;
mod readback;
mod sets;
pub mod view;
mod write;

pub(crate) use frame::{WorldPart, WorldSource};
pub(crate) use pipeline::{Pass, WorldPipelines};
pub(crate) use sets::Worlds;

/// What has been recorded for worlds since a backend was made, frames apart: while only the camera moves, none of it changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldWork {
    /// Batches that were applied.
    pub batches: u64,
    /// Bytes that were sent for them: rows and words, and 4 bytes for each row and 8 for each stretch of payload in the active
    /// set.
    pub bytes: u64,
    /// Commands that write arenas: passes, copies, fills.
    pub commands: u64,
    /// Submissions that hold these.
    pub submissions: u64,
    /// Arenas that were given a larger place.
    pub growths: u64,
    /// Swaps.
    pub swaps: u64,
}
