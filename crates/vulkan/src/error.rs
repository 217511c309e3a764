//! What can go wrong with a device, in words that say what to do.

use ash::vk;
use orthant_resident::BackendError;

/// What a device refused or lost.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum VulkanError {
    /// There is no Vulkan loader on this machine.
    #[error("no Vulkan loader could be opened ({0}); install the Vulkan loader and a driver, or use --backend cpu")]
    NoLoader(String),
    /// No device, or none that can do it.
    #[error("{0}")]
    NoDevice(String),
    /// Memory ran out: on the device or on the host, while something was made.
    #[error("{what}: the device has no memory left ({source}); close other programs, or use --backend cpu")]
    OutOfMemory {
        /// What was being made.
        what: &'static str,
        /// How it says so.
        source: vk::Result,
    },
    /// The device is gone; everything on it is lost.
    #[error("{0}: the device was lost (driver reset or fault); load the scene again, or use --backend cpu")]
    Lost(&'static str),
    /// Anything else.
    #[error("{what}: {source}; the driver may be too old; try another device, or --backend cpu")]
    Call {
        /// What was being done.
        what: &'static str,
        /// What came of it.
        source: vk::Result,
    },
    /// The allocator could not place something.
    #[error("{what} ({bytes} bytes): {why}; close other programs, or use --backend cpu")]
    Allocation {
        /// What was being made.
        what: &'static str,
        /// How large it is.
        bytes: u64,
        /// What the allocator says.
        why: String,
    },
    /// An arena that would be larger than a buffer may be.
    #[error(
        "{what} are full: {bytes} bytes are more than the {most} that they may take; render less, or use --backend cpu"
    )]
    ArenaFull {
        /// Which arena.
        what: &'static str,
        /// How large it would be.
        bytes: u64,
        /// How large it may be.
        most: u64,
    },
    /// A batch or an environment is more than the device can hold.
    #[error("{0}")]
    Limit(String),
}

impl VulkanError {
    /// The kind of failure that it is to whoever uses a backend, in some words.
    pub(crate) fn as_backend_error(&self, text: String) -> BackendError {
        match self {
            _ if self.is_out_of_memory() => BackendError::OutOfMemory(text),
            Self::Lost(_) => BackendError::Lost(text),
            _ => BackendError::Device(text),
        }
    }

    /// Whether there is no room for something.
    pub(crate) fn is_out_of_memory(&self) -> bool {
        matches!(self, Self::OutOfMemory { .. } | Self::Allocation { .. } | Self::ArenaFull { .. })
    }
}

/// What most calls give.
pub type Result<T> = std::result::Result<T, VulkanError>;

impl From<VulkanError> for BackendError {
    fn from(error: VulkanError) -> Self {
        error.as_backend_error(error.to_string())
    }
}

/// Says of a failed call what was being done.
pub trait During<T> {
    /// `what` begins a sentence: "cannot make a pipeline".
    fn during(self, what: &'static str) -> Result<T>;
}

impl<T> During<T> for ash::prelude::VkResult<T> {
    fn during(self, what: &'static str) -> Result<T> {
        self.map_err(|source| match source {
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                VulkanError::OutOfMemory { what, source }
            }
            vk::Result::ERROR_DEVICE_LOST => VulkanError::Lost(what),
            source => VulkanError::Call { what, source },
        })
    }
}
