//! Which backend renders.

use crate::args::{BackendArg, TracerArg};
use crate::commands::devices;
use crate::failure::{Exit, Failure};
use orthant_cpu::CpuBackend;
use orthant_render::DerivedScene;
use orthant_render::world::DerivedWorld;
use orthant_resident::world::compare::{LiveRows, compare_live};
use orthant_resident::world::{SetSlot, WorldArenas};
use orthant_resident::{Backend, BackendError, Frame, Ticket};
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::device::{CacheFolder, DeviceInfo, DeviceOptions, Tracer};
use orthant_vulkan::raster::{RasterOptions, RasterReport};
use serde_json::{Value, json};
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
        BackendError::Device(_) | BackendError::OutOfMemory(_) | BackendError::Lost(_) => Exit::Missing,
        BackendError::InvalidFrame(_) => Exit::Usage,
        _ => Exit::Internal,
    };
    Failure::new(exit, error.to_string())
}

/// Which backend is asked for, and how it is to work.
#[derive(Clone, Copy, Debug)]
pub struct Asked<'a> {
    /// `auto` takes Vulkan where there is a device that is not a processor itself and can trace rays, else the CPU.
    pub backend: BackendArg,
    /// Which device of it.
    pub device: Option<&'a str>,
    /// How a Vulkan device traces rays; what is not `auto` asks for one.
    pub tracer: TracerArg,
    /// Whether a Vulkan device runs under the validation layers.
    pub watched: bool,
    /// Whether warnings are left out.
    pub quiet: bool,
}

impl<'a> Asked<'a> {
    /// As the options `--backend` and `--device` say.
    pub fn new(backend: BackendArg, device: Option<&'a str>) -> Self {
        Self { backend, device, tracer: TracerArg::Auto, watched: false, quiet: false }
    }
}

impl Asked<'_> {
    fn warn(&self, what: std::fmt::Arguments<'_>) {
        if !self.quiet {
            eprintln!("warning: {what}");
        }
    }
}

/// The environment's word on compiled pipelines.
const CACHE: &str = "ORTHANT_PIPELINE_CACHE";

/// Where compiled pipelines are kept: what `ORTHANT_PIPELINE_CACHE` says (a folder, or `off`), else the user's folder.
fn cache_folder() -> CacheFolder {
    match std::env::var_os(CACHE) {
        None => CacheFolder::User,
        Some(word) if word.is_empty() || word == "off" => CacheFolder::None,
        Some(folder) => CacheFolder::At(folder.into()),
    }
}

/// The backend that is asked for.
///
/// # Errors
/// If there is no such device, or it cannot render (missing); options that contradict each other (usage).
pub fn open(asked: &Asked<'_>) -> Result<AnyBackend, Failure> {
    let backend = match (asked.tracer, asked.backend) {
        (TracerArg::Auto, backend) => backend,
        (_, BackendArg::Cpu) => {
            return Err(Failure::usage("--tracer is of Vulkan devices: leave it out with --backend cpu"));
        }
        _ => BackendArg::Vulkan,
    };
    let chosen = asked.device.map(|device| devices::choose(device, backend)).transpose()?;
    match (chosen, backend) {
        (Some(devices::Choice::Cpu), _) | (None, BackendArg::Cpu) => Ok(cpu()),
        (Some(devices::Choice::Vulkan(index)), _) => vulkan(asked, Some(index)),
        (None, BackendArg::Vulkan) => vulkan(asked, None),
        (None, BackendArg::Auto) => {
            let is_real = |d: &DeviceInfo| d.unfit.is_empty() && !d.is_software();
            match orthant_vulkan::device::list().ok().and_then(|all| all.into_iter().find(is_real)) {
                None => Ok(cpu()),
                Some(found) => vulkan(asked, Some(found.index)).or_else(|failure| {
                    asked.warn(format_args!("{failure}; rendering on the CPU"));
                    Ok(cpu())
                }),
            }
        }
    }
}

/// The CPU backend, which is always there.
pub fn cpu() -> AnyBackend {
    AnyBackend::Cpu(Box::new(CpuBackend::new()))
}

fn vulkan(asked: &Asked<'_>, index: Option<usize>) -> Result<AnyBackend, Failure> {
    let can_watch = asked.watched && orthant_vulkan::device::can_validate().unwrap_or(false);
    if asked.watched && !can_watch {
        asked.warn(format_args!("the Vulkan validation layers are not installed; only the rows are compared"));
    }
    let options = DeviceOptions {
        device: index.map(|index| index.to_string()),
        validate: can_watch,
        tracer: match asked.tracer {
            TracerArg::Auto => None,
            TracerArg::Pipeline => Some(Tracer::Pipeline),
            TracerArg::Query => Some(Tracer::Query),
        },
        cache: cache_folder(),
        memory: None,
    };
    let opened = VulkanBackend::new(&options);
    opened.map(|backend| AnyBackend::Vulkan(Box::new(backend))).map_err(|e| Failure::missing(e.to_string()))
}

/// That nothing but a Vulkan device rasterizes.
pub fn cannot_rasterize() -> Failure {
    Failure::missing("the CPU backend cannot rasterize").remedy(
        "--renderer raster takes --backend vulkan and a device that `orthant devices` lists; else use --renderer path",
    )
}

impl AnyBackend {
    /// Hands in a frame to be rasterized.
    ///
    /// # Errors
    /// If the backend cannot, or not such a frame.
    pub fn submit_raster(&mut self, frame: Frame, options: RasterOptions) -> Result<Ticket, Failure> {
        match self {
            Self::Cpu(_) => Err(cannot_rasterize()),
            Self::Vulkan(vulkan) => vulkan.submit_raster(frame, options).map_err(backend_failure),
        }
    }

    /// What rasterizing the last frame took, and the bytes that the preview has on the device; `None` where there is none.
    pub fn raster_report(&self) -> Option<(RasterReport, u64)> {
        match self {
            Self::Cpu(_) => None,
            Self::Vulkan(vulkan) => Some((vulkan.raster_report(), vulkan.raster_bytes())),
        }
    }

    /// What the stages of a device have taken since this was asked last, in seconds by `STAGE_s`; null for one without
    /// timestamps, and in memory, where there are no stages.
    ///
    /// # Errors
    /// If the device is gone.
    pub fn stage_times(&mut self) -> Result<Value, BackendError> {
        let Self::Vulkan(vulkan) = self else { return Ok(Value::Null) };
        if !vulkan.set_timed(true) {
            return Ok(Value::Null);
        }
        let timings = vulkan.take_timings()?;
        Ok(timings.named().map(|(name, time)| (format!("{name}_s"), json!(time.seconds))).collect())
    }

    /// Has stages measured on a device; warns where it cannot.
    pub fn measure_stages(&mut self) {
        if let Self::Vulkan(vulkan) = self
            && !vulkan.set_timed(true)
        {
            eprintln!("warning: {} has no timestamps: its stages are not measured", vulkan.device());
        }
    }

    /// Drops what is resident, so that another scene can be loaded.
    ///
    /// # Errors
    /// If the device is gone.
    pub fn clear(&mut self) -> Result<(), BackendError> {
        match self {
            Self::Cpu(cpu) => **cpu = CpuBackend::new(),
            Self::Vulkan(vulkan) => vulkan.clear()?,
        }
        Ok(())
    }

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

    /// Compares the arenas of the world that is shown, read back, with the planner's mirror, and checks the planner itself.
    ///
    /// # Errors
    /// The first difference, or what the validation layers said.
    pub fn validate_world(&mut self, derived: &DerivedWorld) -> Result<(), Failure> {
        derived.validate().map_err(|what| Failure::new(Exit::CheckFailed, format!("--validate: {what}")))?;
        self.validate_world_set(SetSlot::Active, derived.mirror()).map(|_| ())
    }

    /// Compares a set of world arenas as it is resident with the mirror, over everything that rays can reach. It waits for the
    /// device. How many rows were compared.
    ///
    /// # Errors
    /// The first row and the field that differ, or what the validation layers said.
    pub fn validate_world_set(&mut self, set: SetSlot, mirror: &WorldArenas) -> Result<LiveRows, Failure> {
        let failed = |what: String| Failure::new(Exit::CheckFailed, format!("--validate: {what}"));
        let compared = match self {
            Self::Cpu(cpu) => {
                let resident = cpu.world(set).ok_or(BackendError::NoStagingSet).map_err(backend_failure)?;
                compare_live(mirror, resident)
            }
            Self::Vulkan(vulkan) => compare_live(mirror, &vulkan.read_back_world(set).map_err(backend_failure)?),
        };
        let compared = compared.map_err(|mismatch| failed(mismatch.to_string()))?;
        self.quiet().map_err(failed)?;
        Ok(compared)
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
