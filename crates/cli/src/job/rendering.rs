//! A backend at work on a scene. Where it may, the CPU goes on when a device is lost or its memory runs out.

use super::backend::{AnyBackend, backend_failure, cannot_rasterize, cpu};
use super::{Loaded, Progress};
use crate::failure::Failure;
use orthant_render::DerivedScene;
use orthant_render::world::DerivedWorld;
use orthant_resident::backend::{ApplyReport, RayCounts};
use orthant_resident::world::WorldCounts;
use orthant_resident::{BackendError, Environment, Film, Frame};
use orthant_vulkan::raster::RasterOptions;
use std::time::{Duration, Instant};

/// How long the backend works between two looks at the progress.
const SLICE: Duration = Duration::from_millis(100);

/// What rendering took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spent {
    /// Rays.
    pub rays: RayCounts,
    /// Time of tracing.
    pub time: Duration,
    /// Pixel samples.
    pub samples: u64,
    /// Work in the world.
    pub world: WorldCounts,
}

/// What is rendered: a scene, a world, or both.
pub struct Subject<'a> {
    /// The scene.
    pub loaded: Option<&'a mut Loaded>,
    /// The world.
    pub world: Option<&'a DerivedWorld>,
}

/// What is rendered, what surrounds it, and the backend that does it.
pub struct Rendering<'a> {
    /// The backend.
    pub backend: AnyBackend,
    /// What is rendered.
    pub subject: Subject<'a>,
    /// What surrounds it.
    pub environment: &'a Environment,
    /// Whether the CPU goes on where the device fails: it was not asked for that device.
    pub may_fall_back: bool,
    /// How frames are rasterized, if they are.
    pub raster: Option<RasterOptions>,
    /// What whoever waits sees.
    pub progress: Progress,
    /// What the frames took.
    pub spent: Spent,
    /// What the scene took to become resident.
    pub applied: ApplyReport,
    /// The time of that.
    pub upload: Duration,
}

impl<'a> Rendering<'a> {
    /// Nothing is resident yet.
    pub fn new(backend: AnyBackend, subject: Subject<'a>, environment: &'a Environment, progress: Progress) -> Self {
        let (spent, applied, upload) = Default::default();
        let (may_fall_back, raster) = (false, None);
        Self { backend, subject, environment, may_fall_back, raster, progress, spent, applied, upload }
    }

    /// Makes the scene resident.
    ///
    /// # Errors
    /// A backend that has no room for it or is gone, without another to fall back to.
    pub fn load(&mut self) -> Result<(), Failure> {
        let start = Instant::now();
        if let Err(error) = self.upload() {
            self.fall_back(error)?;
        }
        self.upload = start.elapsed();
        Ok(())
    }

    fn upload(&mut self) -> Result<(), BackendError> {
        if let Some(loaded) = &mut self.subject.loaded {
            self.applied = self.backend.apply(loaded.derived.load_batch())?;
        }
        if let Some(derived) = self.subject.world {
            self.applied.bytes += orthant_render::world::load(&mut *self.backend, derived)?.bytes;
        }
        self.backend.set_environment(self.environment.clone())
    }

    /// Compares all that is resident with what it was derived as.
    ///
    /// # Errors
    /// The first difference (check failed).
    pub fn validate(&mut self) -> Result<(), Failure> {
        if let Some(loaded) = &self.subject.loaded {
            self.backend.validate(&loaded.derived)?;
        }
        if let Some(derived) = self.subject.world {
            self.backend.validate_world(derived)?;
        }
        Ok(())
    }

    /// Renders a frame, from the start again where another backend goes on with it. `done` of `total` pixel samples of the whole
    /// work were rendered before it.
    ///
    /// # Errors
    /// As [`Rendering::load`].
    pub fn render(&mut self, frame: &Frame, done: u64, total: u64) -> Result<Film, Failure> {
        match self.attempt(frame, done, total) {
            Ok(film) => Ok(film),
            Err(error) => {
                self.fall_back(error)?;
                self.attempt(frame, done, total).map_err(backend_failure)
            }
        }
    }

    fn attempt(&mut self, frame: &Frame, done: u64, total: u64) -> Result<Film, BackendError> {
        let ticket = match (self.raster, &mut self.backend) {
            (None, backend) => backend.submit(frame.clone())?,
            (Some(options), AnyBackend::Vulkan(vulkan)) => vulkan.submit_raster(frame.clone(), options)?,
            (Some(_), AnyBackend::Cpu(_)) => return Err(BackendError::Device(cannot_rasterize().to_string())),
        };
        let status = loop {
            let status = self.backend.poll(ticket, SLICE)?;
            self.progress.frame(&status, done, total);
            if status.is_done() {
                break status;
            }
        };
        let film = self.backend.read_film(ticket)?;
        let rays = &mut self.spent.rays;
        rays.camera += status.rays.camera;
        rays.bounce += status.rays.bounce;
        rays.shadow += status.rays.shadow;
        self.spent.time += status.elapsed;
        self.spent.samples += status.done;
        self.spent.world += status.world;
        Ok(film)
    }

    /// Has the CPU take over, if the device is lost or its memory is used up. Geometry was moved to the device: it is derived
    /// again, to the same rows.
    fn fall_back(&mut self, error: BackendError) -> Result<(), Failure> {
        let is_spent = matches!(error, BackendError::OutOfMemory(_) | BackendError::Lost(_));
        if !(self.may_fall_back && is_spent && matches!(self.backend, AnyBackend::Vulkan(_))) {
            return Err(backend_failure(error));
        }
        self.may_fall_back = false;
        eprintln!("warning: {}: {error}; the CPU goes on", self.backend.device());
        self.backend = cpu();
        if let Some(Loaded { scene, derived, options, path, .. }) = self.subject.loaded.as_deref_mut() {
            *derived = DerivedScene::derive(scene, options)
                .map_err(|e| Failure::bad_input(path, e.what).at(e.place).remedy(e.remedy))?;
        }
        self.upload().map_err(backend_failure)
    }
}
