//! [`VulkanBackend`].

use crate::device::{Device, DeviceOptions, Messages};
use crate::error::{Result, VulkanError};
use crate::memory::{Queue, Staging, Timings};
use crate::raster::{self, Raster, RasterJob, RasterOptions, RasterPasses, RasterReport, RasterScene};
use crate::scene::{AccelerationBytes, Applied, ResidentRows, ResidentScene};
use crate::trace::{Job, Passes, PathPool, RayTracer, TlasSet};
use crate::world::abi::WorldTable;
use crate::world::{WorldPipelines, WorldSource, WorldWork, Worlds};
use orthant_resident::backend::{ApplyReport, ResidentBytes};
use orthant_resident::check::{check_batch, check_environment, check_frame, check_view_with_scene};
use orthant_resident::world::{ArenaLens, MutationBatch, SetSlot, WorldApplied, WorldArenas, WorldBytes};
use orthant_resident::{Backend, BackendError, Environment, Film, Frame, SceneBatch, Ticket, TicketStatus};
use std::sync::Arc;
use std::time::Duration;

/// Bytes of the staging ring.
const STAGING: u64 = 32 << 20;

/// A resident scene on a Vulkan device, rendered by its ray tracing pipeline or by ray queries.
pub struct VulkanBackend {
    // In this order: what the device may still use goes after the queue has waited for it.
    queue: Queue,
    job: Option<Job>,
    raster_job: Option<RasterJob>,
    tlas: Option<TlasSet>,
    pipeline: RayTracer,
    paths: PathPool,
    world_pipelines: WorldPipelines,
    /// Made with the first frame that is rasterized.
    raster: Option<Raster>,
    raster_report: RasterReport,
    scene: ResidentScene,
    worlds: Worlds,
    staging: Staging,
    device: Arc<Device>,
    last_ticket: u64,
    discarded: u64,
    applied: Applied,
    /// A batch failed half-way: the scene is in no state.
    broken: Option<VulkanError>,
}

/// What the last batch took of the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uploaded {
    /// Bytes of the batch's rows that went through the staging ring: [`SceneBatch::upload_bytes`].
    pub batch: u64,
    /// Bytes besides: images, light tables, addresses.
    pub overhead: u64,
    /// How often the host has waited for the device since the backend was made, whatever for.
    pub waits: u64,
}

/// Splits a backend into the job and what it needs; the job's ticket has been looked at before.
macro_rules! job_and_passes {
    ($backend:ident) => {{
        let passes = Passes {
            device: &$backend.device,
            queue: &mut $backend.queue,
            pipeline: &$backend.pipeline,
            tlas: $backend.tlas.as_ref(),
            images: $backend.scene.images.set,
            layout: $backend.scene.images.layout,
            paths: &mut $backend.paths,
            worlds: &mut $backend.world_pipelines,
        };
        (&mut $backend.job, passes)
    }};
}

/// The same for a frame that is rasterized.
macro_rules! raster_job_and_passes {
    ($backend:ident) => {{
        let Some(raster) = &mut $backend.raster else { return Err(BackendError::Device(NO_SCENE.to_owned())) };
        let passes = RasterPasses {
            device: &$backend.device,
            queue: &mut $backend.queue,
            raster,
            images: $backend.scene.images.set,
        };
        (&mut $backend.raster_job, passes)
    }};
}

impl VulkanBackend {
    /// Opens a device; the scene is empty, in the dark.
    ///
    /// # Errors
    /// As [`Device::open`], and if the device cannot make what the path tracer needs.
    pub fn new(options: &DeviceOptions) -> Result<Self> {
        let device = Device::open(options)?;
        let queue = Queue::new(&device)?;
        let staging = Staging::new(&device, STAGING)?;
        let scene = ResidentScene::new(&device)?;
        let worlds = Worlds::new(&device)?;
        let pipeline = RayTracer::new(&device, scene.images.layout)?;
        device.keep_pipelines();
        let mut backend = Self {
            queue,
            job: None,
            raster_job: None,
            tlas: None,
            pipeline,
            paths: PathPool::default(),
            world_pipelines: WorldPipelines::new(&device)?,
            raster: None,
            raster_report: RasterReport::default(),
            scene,
            worlds,
            staging,
            device,
            last_ticket: 0,
            discarded: 0,
            applied: Applied::default(),
            broken: None,
        };
        backend.scene.set_environment(&mut backend.queue, &mut backend.staging, &Environment::none())?;
        Ok(backend)
    }

    /// Drops the scene, and with it what broke it: the next batch is that of a load. The environment and worlds go too. The memory is
    /// free when the device is done with it.
    ///
    /// # Errors
    /// If the device is gone.
    pub fn clear(&mut self) -> Result<()> {
        self.end_job();
        let empty = ResidentScene::new(&self.device)?;
        let old = std::mem::replace(&mut self.scene, empty);
        self.queue.retire((self.tlas.take(), old));
        self.worlds.clear(&mut self.queue);
        self.broken = None;
        self.scene.set_environment(&mut self.queue, &mut self.staging, &Environment::none())?;
        self.queue.collect()
    }

    /// The device.
    pub fn vulkan_device(&self) -> &Arc<Device> {
        &self.device
    }

    /// What the last batch took.
    pub fn uploaded(&self) -> Uploaded {
        Uploaded {
            batch: self.applied.uploaded,
            overhead: self.applied.overhead,
            waits: self.queue.waits + self.worlds.waits(),
        }
    }

    /// What acceleration structures take.
    pub fn acceleration_bytes(&self) -> AccelerationBytes {
        self.scene.acceleration_bytes()
    }

    /// Whether the device has done all that was handed in. Never waits.
    ///
    /// # Errors
    /// If the device is gone.
    pub fn is_idle(&self) -> Result<bool> {
        Ok(self.queue.done()? == self.queue.last() && self.worlds.is_idle()?)
    }

    /// Has the stages of what is handed in from now on measured on the device, or not. Whether it can: some have no
    /// timestamps.
    pub fn set_timed(&mut self, is_timed: bool) -> bool {
        self.worlds.set_timed(is_timed);
        self.queue.set_timed(is_timed)
    }

    /// What the stages have taken since this was asked last, as far as the device is done with them.
    ///
    /// # Errors
    /// If the device is gone.
    pub fn take_timings(&mut self) -> Result<Timings> {
        let mut timings = self.queue.take_timings()?;
        timings.merge(&self.worlds.take_timings()?);
        Ok(timings)
    }

    /// Where the active set of world arenas lies, for frames that are handed in now.
    pub fn world_table(&self) -> WorldTable {
        self.worlds.table()
    }

    /// What has been recorded for worlds, frames apart.
    pub fn world_work(&self) -> WorldWork {
        self.worlds.work()
    }

    /// Bounds the bytes of each set of world arenas; a batch that asks for more is refused.
    pub fn set_world_limit(&mut self, bytes: Option<u64>) {
        self.worlds.set_limit(bytes);
    }

    /// How many threads share the layers of a pixel (a power of two up to 128, or as many as suit): for measurements. Images differ
    /// by rounding alone.
    pub fn set_layer_slots(&mut self, slots: Option<u32>) {
        self.world_pipelines.layer_slots = slots.map(|slots| slots.clamp(1, 128).next_power_of_two());
    }

    /// Copies a set of world arenas back from the device. It waits.
    ///
    /// # Errors
    /// If there is no staging set to be read; if the device is gone or has no memory for it.
    pub fn read_back_world(&mut self, set: SetSlot) -> std::result::Result<WorldArenas, BackendError> {
        self.worlds.read_back(&mut self.queue, set)
    }

    /// What the validation layers have said; `None` without them.
    pub fn messages(&self) -> Option<Messages> {
        self.device.messages()
    }

    /// Contributions of light that were not finite and were left out, since the backend was made.
    pub fn discarded_contributions(&self) -> u64 {
        self.discarded + self.job.as_ref().map_or(0, Job::discarded)
    }

    /// Copies all rows back from the device. It waits.
    ///
    /// # Errors
    /// If the device is gone or has no memory for it.
    pub fn read_back(&mut self) -> Result<ResidentRows> {
        self.scene.read_back(&mut self.queue)
    }

    /// Hands in a frame to be rasterized; it replaces any earlier one. Samples are taken in passes of four a pixel; limits of
    /// paths, the estimator and threads do not matter.
    ///
    /// # Errors
    /// As [`Backend::submit`]; a frame of a part of the samples; a device that cannot rasterize.
    pub fn submit_raster(&mut self, frame: Frame, options: RasterOptions) -> std::result::Result<Ticket, BackendError> {
        check_frame(&frame)?;
        if frame.world.is_some() {
            return Err(no_worlds());
        }
        raster::check(&frame)?;
        self.usable()?;
        self.end_job();
        if self.tlas.is_none() {
            return Err(BackendError::Device(NO_SCENE.to_owned()));
        }
        if self.raster.is_none() {
            self.raster = Some(Raster::new(&self.device, self.scene.images.layout)?);
            self.device.keep_pipelines();
        }
        self.last_ticket += 1;
        let ticket = Ticket(self.last_ticket);
        let scene = RasterScene {
            table: self.scene.table(),
            lights: self.scene.light_table(),
            map: self.scene.environment_map().cloned(),
            rows: self.scene.render_node_count(),
        };
        let (job, mut passes) = raster_job_and_passes!(self);
        *job = Some(RasterJob::new(&mut passes, ticket, frame, options, &scene)?);
        Ok(ticket)
    }

    /// What rasterizing the last frame has taken so far.
    pub fn raster_report(&self) -> RasterReport {
        self.raster_job.as_ref().map_or(self.raster_report, RasterJob::report)
    }

    /// Bytes of targets, draw commands and filtered environments of the preview; 0 before its first frame.
    pub fn raster_bytes(&self) -> u64 {
        self.raster.as_ref().map_or(0, Raster::bytes)
    }

    fn world_source(&self) -> std::result::Result<WorldSource, BackendError> {
        self.worlds.usable()?;
        Ok(self.worlds.source(self.tlas.is_some() && self.scene.render_node_count() > 0))
    }

    fn is_raster(&self, ticket: Ticket) -> bool {
        self.raster_job.as_ref().is_some_and(|job| job.ticket == ticket)
    }

    fn usable(&self) -> std::result::Result<(), BackendError> {
        match &self.broken {
            Some(error) => Err(error.as_backend_error(format!("an earlier batch failed: {error}"))),
            None => Ok(()),
        }
    }

    fn end_job(&mut self) {
        if let Some(job) = self.job.take() {
            self.discarded += job.discarded();
            job.retire(&mut self.queue);
        }
        if let Some(job) = self.raster_job.take() {
            self.raster_report = job.report();
            job.retire(&mut self.queue);
        }
    }

    /// A frame that shows a world leads to the arenas as they are.
    fn end_world_job(&mut self) {
        if self.job.as_ref().is_some_and(Job::shows_world) {
            self.end_job();
        }
    }

    fn apply_checked(&mut self, batch: &SceneBatch) -> Result<ApplyReport> {
        let applied = self.scene.apply(&mut self.queue, &mut self.staging, batch)?;
        if (applied.tlas_replaced || self.tlas.is_none())
            && let Some(tlas) = self.scene.tlas()
        {
            let new = self.pipeline.bind_tlas(tlas)?;
            if let Some(old) = self.tlas.replace(new) {
                self.queue.retire(old);
            }
        }
        self.queue.collect()?;
        self.applied = applied;
        Ok(applied.report)
    }
}

const NO_SCENE: &str = "nothing is resident; apply a batch first";

impl Backend for VulkanBackend {
    fn name(&self) -> &'static str {
        "vulkan"
    }

    fn device(&self) -> String {
        let info = self.device.info();
        format!("{} (Vulkan {}, {})", info.name, info.api, info.driver)
    }

    /// Ends the ticket of a frame that is under way.
    fn apply(&mut self, batch: SceneBatch) -> std::result::Result<ApplyReport, BackendError> {
        check_batch(self.scene.lengths(), &batch)?;
        self.usable()?;
        self.end_job();
        self.apply_checked(&batch).map_err(|error| {
            self.broken = Some(error.clone());
            error.into()
        })
    }

    /// Ends the ticket of a frame that is under way.
    fn set_environment(&mut self, environment: Environment) -> std::result::Result<(), BackendError> {
        check_environment(&environment)?;
        self.usable()?;
        self.end_job();
        // Half of the tables may be the new ones.
        let set = self.scene.set_environment(&mut self.queue, &mut self.staging, &environment);
        set.map_err(|error| {
            self.broken = Some(error.clone());
            error.into()
        })
    }

    fn submit(&mut self, frame: Frame) -> std::result::Result<Ticket, BackendError> {
        check_frame(&frame)?;
        self.usable()?;
        if let Some(view) = &frame.world
            && self.scene.render_node_count() > 0
        {
            check_view_with_scene(view)?;
        }
        if frame.world.is_none() && self.tlas.is_none() {
            return Err(BackendError::Device(NO_SCENE.to_owned()));
        }
        self.end_job();
        self.last_ticket += 1;
        let ticket = Ticket(self.last_ticket);
        let (scene, lights) = (self.scene.table(), self.scene.light_table());
        let world = self.world_source()?;
        let (job, mut passes) = job_and_passes!(self);
        *job = Some(Job::new(&mut passes, ticket, frame, &scene, &lights, &world)?);
        Ok(ticket)
    }

    fn poll(&mut self, ticket: Ticket, budget: Duration) -> std::result::Result<TicketStatus, BackendError> {
        if self.is_raster(ticket) {
            let (job, mut passes) = raster_job_and_passes!(self);
            let job = job.as_mut().ok_or(BackendError::UnknownTicket(ticket))?;
            job.work(&mut passes, budget)?;
            return Ok(job.status());
        }
        let (job, mut passes) = job_and_passes!(self);
        let job = job.as_mut().filter(|job| job.ticket == ticket).ok_or(BackendError::UnknownTicket(ticket))?;
        job.work(&mut passes, budget)?;
        Ok(job.status())
    }

    fn read_film(&mut self, ticket: Ticket) -> std::result::Result<Film, BackendError> {
        if self.is_raster(ticket) {
            let (slot, mut passes) = raster_job_and_passes!(self);
            let job = slot.take().ok_or(BackendError::UnknownTicket(ticket))?;
            self.raster_report = job.report();
            return Ok(job.into_film(&mut passes)?);
        }
        let (slot, mut passes) = job_and_passes!(self);
        let job = slot.take_if(|job| job.ticket == ticket).ok_or(BackendError::UnknownTicket(ticket))?;
        self.discarded += job.discarded();
        Ok(job.into_film(&mut passes)?)
    }

    fn resident_bytes(&self) -> ResidentBytes {
        self.scene.resident_bytes()
    }

    fn begin_staging(&mut self, origin: [i64; 4], lens: ArenaLens) -> std::result::Result<(), BackendError> {
        self.worlds.begin_staging(origin, lens)
    }

    /// Ends the ticket of a frame of the active set that is under way.
    fn apply_world(&mut self, set: SetSlot, batch: &MutationBatch) -> std::result::Result<WorldApplied, BackendError> {
        if set == SetSlot::Active {
            self.end_world_job();
        }
        self.worlds.apply(&mut self.queue, &mut self.staging, set, batch)
    }

    fn is_staging_ready(&self) -> std::result::Result<bool, BackendError> {
        Ok(self.worlds.is_staging_ready()?)
    }

    /// Ends the ticket of a frame of a world that is under way.
    fn swap_sets(&mut self) -> std::result::Result<(), BackendError> {
        self.end_world_job();
        self.worlds.swap(&mut self.queue)
    }

    fn drop_staging(&mut self) {
        self.worlds.drop_staging();
    }

    fn world_bytes(&self, set: SetSlot) -> WorldBytes {
        self.worlds.bytes(set)
    }
}

fn no_worlds() -> BackendError {
    BackendError::InvalidFrame("the raster preview draws no worlds: hand the frame in to be traced".into())
}
