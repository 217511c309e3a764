//! [`CpuBackend`]: the backend that always works.

mod job;

use crate::path::lights::LightTables;
use crate::scene::ResidentScene;
use crate::world::WorldSets;
use job::{Job, Resident};
use orthant_resident::backend::{ApplyReport, ResidentBytes};
use orthant_resident::check::{check_environment, check_frame, check_view_with_scene};
use orthant_resident::extent::scene_radius;
use orthant_resident::world::{ArenaLens, MutationBatch, SetSlot, WorldApplied, WorldArenas, WorldBytes};
use orthant_resident::{Backend, BackendError, Environment, Film, Frame, SceneBatch, Ticket, TicketStatus};
use std::sync::Arc;
use std::time::Duration;

/// A resident scene in memory, rendered by all cores.
///
/// Work is done in [`Backend::poll`], on the calling thread's rayon pool, or on a pool of its own where a frame asks for
/// a number of threads. The film depends on neither.
#[derive(Default)]
pub struct CpuBackend {
    scene: ResidentScene,
    lights: LightTables,
    worlds: WorldSets,
    job: Option<Job>,
    last_ticket: u64,
    pool: Option<(usize, Arc<rayon::ThreadPool>)>,
    discarded: u64,
}

impl CpuBackend {
    /// An empty scene in the dark.
    pub fn new() -> Self {
        let mut backend = Self::default();
        backend.lights.set_environment(&Environment::none());
        backend
    }

    /// The resident scene, to be read: for validation and tests.
    pub fn scene(&self) -> &ResidentScene {
        &self.scene
    }

    /// A set of world arenas, to be read: for validation and tests. `None` if there is none.
    pub fn world(&self, set: SetSlot) -> Option<&WorldArenas> {
        self.worlds.get(set)
    }

    /// Checks that the tables of lights are those of the rows. Looks at everything.
    ///
    /// # Errors
    /// The first difference, with the row.
    pub fn validate_lights(&self) -> Result<(), String> {
        let scene = &self.scene;
        self.lights.validate(scene, scene_radius(&scene.render_nodes, &scene.mesh_descs))
    }

    /// Contributions of light that were not finite and were left out, since the backend was made.
    pub fn discarded_contributions(&self) -> u64 {
        self.discarded + self.job.as_ref().map_or(0, Job::discarded)
    }

    fn pool(&mut self, threads: usize) -> Result<Option<Arc<rayon::ThreadPool>>, BackendError> {
        if threads == 0 {
            return Ok(None);
        }
        if let Some((count, pool)) = &self.pool
            && *count == threads
        {
            return Ok(Some(pool.clone()));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("trace {i}")).build();
        let pool =
            Arc::new(pool.map_err(|e| BackendError::Device(format!("cannot start {threads} render threads: {e}")))?);
        self.pool = Some((threads, pool.clone()));
        Ok(Some(pool))
    }

    fn job(&mut self, ticket: Ticket) -> Result<&mut Job, BackendError> {
        self.job.as_mut().filter(|job| job.ticket == ticket).ok_or(BackendError::UnknownTicket(ticket))
    }

    /// Drops the job under way: what it has seen of the scene is about to change.
    fn end_job(&mut self) -> Option<Job> {
        let job = self.job.take()?;
        self.discarded += job.discarded();
        Some(job)
    }
}

impl Backend for CpuBackend {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn device(&self) -> String {
        format!("CPU, {} threads", rayon::current_num_threads())
    }

    /// Ends the ticket of a frame that is under way.
    fn apply(&mut self, batch: SceneBatch) -> Result<ApplyReport, BackendError> {
        let changes = self.scene.light_changes(&batch);
        let report = self.scene.apply(batch)?;
        self.end_job();
        self.lights.update(&self.scene, &changes);
        self.lights.weigh_kinds();
        Ok(report)
    }

    /// Ends the ticket of a frame that is under way.
    fn set_environment(&mut self, environment: Environment) -> Result<(), BackendError> {
        check_environment(&environment)?;
        self.end_job();
        self.lights.set_environment(&environment);
        self.lights.weigh_kinds();
        Ok(())
    }

    fn submit(&mut self, frame: Frame) -> Result<Ticket, BackendError> {
        check_frame(&frame)?;
        if let Some(view) = &frame.world
            && !self.scene.render_nodes.is_empty()
        {
            check_view_with_scene(view)?;
        }
        let pool = self.pool(frame.threads)?;
        self.end_job();
        self.last_ticket += 1;
        let ticket = Ticket(self.last_ticket);
        self.job = Some(Job::new(ticket, frame, pool));
        Ok(ticket)
    }

    fn poll(&mut self, ticket: Ticket, budget: Duration) -> Result<TicketStatus, BackendError> {
        self.job(ticket)?;
        let Self { scene, lights, worlds, job, .. } = self;
        let job = job.as_mut().ok_or(BackendError::UnknownTicket(ticket))?;
        job.work(Resident { scene, lights, world: worlds.active() }, budget);
        Ok(job.status())
    }

    fn read_film(&mut self, ticket: Ticket) -> Result<Film, BackendError> {
        self.job(ticket)?;
        let job = self.end_job().ok_or(BackendError::UnknownTicket(ticket))?;
        Ok(job.into_film())
    }

    fn resident_bytes(&self) -> ResidentBytes {
        self.scene.resident_bytes()
    }

    fn begin_staging(&mut self, origin: [i64; 4], lens: ArenaLens) -> Result<(), BackendError> {
        self.worlds.begin_staging(origin, lens);
        Ok(())
    }

    /// A batch for the active set ends the ticket of a frame that is under way.
    fn apply_world(&mut self, set: SetSlot, batch: &MutationBatch) -> Result<WorldApplied, BackendError> {
        let applied = self.worlds.apply(set, batch)?;
        if set == SetSlot::Active {
            self.end_job();
        }
        Ok(applied)
    }

    /// Ends the ticket of a frame that is under way.
    fn swap_sets(&mut self) -> Result<(), BackendError> {
        self.worlds.swap()?;
        self.end_job();
        Ok(())
    }

    fn drop_staging(&mut self) {
        self.worlds.drop_staging();
    }

    fn world_bytes(&self, set: SetSlot) -> WorldBytes {
        self.worlds.bytes(set)
    }
}
