//! The Vulkan backend: it keeps a scene resident on a device by the batches that the CPU backend takes too, and traces
//! rays there.
//!
//! * [`device`]: which devices there are, and opening one;
//! * `memory`: buffers, the queue, the staging ring, and why nothing races;
//! * `scene`: what is resident, and how a batch changes it;
//! * `trace`: the ray tracing pipeline, its twin of ray queries, and frames;
//! * [`raster`]: the preview by graphics pipelines;
//! * [`world`]: the arenas of worlds;
//! * [`abi`]: what the shaders (`shaders/`) see of it.

pub mod abi;
mod backend;
pub mod device;
mod error;
mod film;
mod memory;
pub mod raster;
mod scene;
mod shaders;
mod trace;
pub mod world;

pub use backend::{Uploaded, VulkanBackend};
pub use error::VulkanError;
pub use memory::{Stage, StageTime, Timings};
pub use scene::{AccelerationBytes, ResidentRows};
