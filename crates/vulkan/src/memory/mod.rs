//! Buffers on the device.
//!
//! * [`buffer`]: a buffer with its memory, which ends both when it is dropped;
//! * [`growable`]: an arena that doubles on the device;
//! * [`queue`]: work that is handed in, in order, and what may be freed when some of it is done;
//! * [`staging`]: the ring through which bytes go to the device;
//! * [`timing`]: how long the device takes for what.
//!
//! # Why nothing races
//! All work of frames goes to one queue, in the order in which it is handed in, and every command buffer that writes what shaders
//! read begins and ends with a barrier over everything ([`queue::Commands::begin_writes`]): writes wait on the device for
//! the frames handed in before them, and frames after them wait for the writes. The host waits for neither. What a frame in
//! flight may still read is not freed but retired ([`queue::Queue::retire`]), with the number of the last submission that
//! may use it.
//!
//! What is copied in the background ([`queue::Queue::background`]) is no frame's yet, so nothing on the other queue is ordered
//! against it. When a frame is to see it, the first submission from then on waits on the device for a value of the background
//! queue's timeline ([`queue::Queue::wait_on_device`]), which makes all that was written before visible to it and, by the
//! barriers, to all after it. What the background queue may still read or write is retired there.

mod buffer;
mod growable;
mod queue;
mod staging;
mod timing;

pub(crate) use buffer::{Buffer, Place};
pub(crate) use growable::Arena;
pub(crate) use queue::{Commands, Queue};
pub(crate) use staging::{Order, Staging, Uploads};
pub use timing::{Stage, StageTime, Timings};
