//! Buffers on the device.
//!
//! * [`buffer`]: a buffer with its memory, which ends both when it is dropped;
//! * [`growable`]: an arena that doubles on the device;
//! * [`queue`]: work that is handed in, in order, and what may be freed when some of it is done;
//! * [`staging`]: the ring through which bytes go to the device;
//! * [`timing`]: how long the device takes for what.
//!
//! # Why nothing races
//! All work goes to one queue, in the order in which it is handed in, and every command buffer that writes what shaders
//! read begins and ends with a barrier over everything ([`queue::Commands::begin_writes`]): writes wait on the device for
//! the frames handed in before them, and frames after them wait for the writes. The host waits for neither. What a frame in
//! flight may still read is not freed but retired ([`queue::Queue::retire`]), with the number of the last submission that
//! may use it.

mod buffer;
mod growable;
mod queue;
mod staging;
mod timing;

pub(crate) use buffer::{Buffer, Place};
pub(crate) use growable::Arena;
pub(crate) use queue::{Commands, Queue};
pub(crate) use staging::{Staging, Uploads};
pub use timing::{Stage, StageTime, Timings};
