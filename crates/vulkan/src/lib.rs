//! The Vulkan backend: it keeps a scene resident on a device by the batches that the CPU backend takes too, and traces
//! rays there.

pub mod abi;
pub mod device;
mod error;
mod memory;

pub use error::VulkanError;
