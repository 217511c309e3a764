//! Which backend renders.

use crate::args::BackendArg;
use crate::commands::devices;
use crate::failure::{Exit, Failure};
use orthant_cpu::CpuBackend;
use orthant_render::DerivedScene;
use orthant_resident::{Backend, BackendError};
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::device::DeviceOptions;
use std::ops::{Deref, DerefMut};

/// A backend of either kind: what both can do is [`Backend`].
pub enum AnyBackend {
    /// In memory.
    Cpu(Box<CpuBackend>),
    /// On a device.
    Vulkan(Box<VulkanBackend>),
}

/// A fault of the backend that the frame or the batch is to blame for is one of the program: both are made here.
pub fn backend_failure(error: BackendError) -> Failure {
    let exit = match error {
        BackendError::Device(_) => Exit::Missing,
        BackendError::InvalidFrame(_) => Exit::Usage,
        _ => Exit::Internal,
    };
    Failure::new(exit, error.to_string())
}

/// The backend that is asked for. `auto` takes Vulkan where there is a device that is not a processor itself and can trace
/// rays, else the CPU. `watched` runs a Vulkan device under the validation layers.
///
/// # Errors
/// If there is no such device, or it cannot render.
pub fn open(asked: BackendArg, device: Option<&str>, watched: bool) -> Result<AnyBackend, Failure> {
    let cpu = || AnyBackend::Cpu(Box::new(CpuBackend::new()));
    let vulkan = |device: Option<String>| {
        let can_watch = watched && orthant_vulkan::device::can_validate().unwrap_or(false);
        if watched && !can_watch {
            eprintln!(
                "warning: --validate: the Vulkan validation layers are not installed; only the rows are compared"
            );
        }
        let opened = VulkanBackend::new(&DeviceOptions { device, validate: can_watch });
        opened.map(|backend| AnyBackend::Vulkan(Box::new(backend))).map_err(|e| Failure::missing(e.to_string()))
    };
    let chosen = device.map(|device| devices::choose(device, asked)).transpose()?;
    match (chosen, asked) {
        (Some(devices::Choice::Cpu), _) | (None, BackendArg::Cpu) => Ok(cpu()),
        (Some(devices::Choice::Vulkan(index)), _) => vulkan(Some(index.to_string())),
        (None, BackendArg::Vulkan) => vulkan(None),
        (None, BackendArg::Auto) => {
            let is_real = |d: &orthant_vulkan::device::DeviceInfo| d.unfit.is_empty() && !d.is_software();
            match orthant_vulkan::device::list().ok().and_then(|all| all.into_iter().find(is_real)) {
                None => Ok(cpu()),
                Some(found) => vulkan(Some(found.index.to_string())).or_else(|failure| {
                    eprintln!("warning: {failure}; rendering on the CPU");
                    Ok(cpu())
                }),
            }
        }
    }
}

impl AnyBackend {
    /// Contributions of light that were not finite and were left out.
    pub fn discarded_contributions(&self) -> u64 {
        match self {
            Self::Cpu(cpu) => cpu.discarded_contributions(),
            Self::Vulkan(vulkan) => vulkan.discarded_contributions(),
        }
    }

    /// Compares what is resident with the derived scene.
    ///
    /// # Errors
    /// The first row and the field that differ, or what the validation layers said.
    pub fn validate(&mut self, derived: &DerivedScene) -> Result<(), Failure> {
        let failed = |what: String| Failure::new(Exit::CheckFailed, format!("--validate: {what}"));
        match self {
            Self::Cpu(cpu) => super::validate::validate(derived, cpu.scene()).map_err(failed),
            Self::Vulkan(vulkan) => {
                let resident = vulkan.read_back().map_err(|e| Failure::missing(e.to_string()))?;
                super::validate::validate_vulkan(derived, &resident).map_err(failed)?;
                self.quiet().map_err(failed)
            }
        }
    }

    /// Whether the validation layers had nothing to say.
    ///
    /// # Errors
    /// The first thing that they said.
    pub fn quiet(&self) -> Result<(), String> {
        let Self::Vulkan(vulkan) = self else { return Ok(()) };
        match vulkan.messages().filter(|messages| messages.count > 0) {
            None => Ok(()),
            Some(messages) => Err(messages.first.into_iter().next().unwrap_or_default()),
        }
    }
}

impl Deref for AnyBackend {
    type Target = dyn Backend;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Cpu(cpu) => &**cpu,
            Self::Vulkan(vulkan) => &**vulkan,
        }
    }
}

impl DerefMut for AnyBackend {
    fn deref_mut(&mut self) -> &mut Self::Target {
        match self {
            Self::Cpu(cpu) => &mut **cpu,
            Self::Vulkan(vulkan) => &mut **vulkan,
        }
    }
}
