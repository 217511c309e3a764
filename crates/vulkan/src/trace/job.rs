//! A frame under way.
//!
//! The samples of a frame are cut into blocks, and a block into dispatches of whole rows of the tile: as many as the device
//! does in about the time that the caller gives, learnt from the dispatches before. Each dispatch adds to the sums on the
//! device in a fixed order, so the film does not depend on how a block is cut.
//!
//! Where paths are traced in stages, what is called a dispatch here is one for each stage of each vertex that the longest
//! path may have, if need be in several submissions: those that find all paths at their end take next to no time.

use super::paths::{COLUMNS, Columns, PathPool, WORLD_COLUMNS};
use super::{Generation, RayTracer, Sets, TlasSet};
use crate::abi::{FrameTable, LightTable, SceneTable, TracePush};
use crate::device::Device;
use crate::error::{Result, VulkanError};
use crate::film::{FilmBuffers, rgb};
use crate::memory::{Buffer, Place, Queue, Stage};
use crate::world::{Pass, WorldPart, WorldPipelines, WorldSource};
use ash::vk;
use orthant_resident::backend::RayCounts;
use orthant_resident::film::{BLOCK, FilmBlock};
use orthant_resident::world::{Shade, WorldCounts};
use orthant_resident::{Film, Frame, Ticket, TicketStatus};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Dispatches that are handed in before the first of them is done.
const AHEAD: usize = 3;
/// Samples of the first dispatch of a frame, whose speed nobody knows.
const FIRST_SAMPLES: u64 = 1 << 16;
/// The same where paths are traced in stages, except by software: few paths take as long as many.
const FIRST_STAGED: u64 = 1 << 21;
/// Rays of the first dispatch of the first frame of a world.
const FIRST_RAYS: u64 = 1 << 20;
/// Sets of four counters of one dispatch; `COUNTER_SETS` of the shaders.
const COUNTER_SETS: u64 = 64;
/// Bytes of them.
const COUNTERS: u64 = 16 * COUNTER_SETS;
/// Time that one dispatch should take at most: longer ones make a desktop stutter.
const LONGEST: Duration = Duration::from_millis(100);
/// Time that one dispatch of a world should take at least.
const SHORTEST: Duration = Duration::from_millis(8);

/// Vertices that one submission traces.
const VERTICES: u64 = 128;

/// What the passes of a frame need of the scene.
pub(crate) struct Passes<'p> {
    pub device: &'p Arc<Device>,
    pub queue: &'p mut Queue,
    pub pipeline: &'p RayTracer,
    /// A frame without a TLAS shows a world.
    pub tlas: Option<&'p TlasSet>,
    pub images: vk::DescriptorSet,
    /// Of `images`.
    pub layout: vk::DescriptorSetLayout,
    pub paths: &'p mut PathPool,
    pub worlds: &'p mut WorldPipelines,
}

/// A dispatch that is on its way.
struct Flight {
    submission: u64,
    /// Samples that are taken with it: none before the last submission of a dispatch.
    samples: u64,
    /// Number of the dispatch.
    dispatch: u64,
    /// Which four counters are its own.
    slot: u32,
    handed_in: Instant,
}

/// Rows of a block that are being handed in.
struct Dispatch {
    number: u64,
    rows: u32,
    samples: u64,
    /// Samples that are known to be taken.
    taken: u64,
    /// Vertices that paths may still have.
    vertices: u64,
    /// The status of its paths is set.
    begun: bool,
}

pub(crate) struct Job {
    pub ticket: Ticket,
    frame: Frame,
    buffers: Option<Buffers>,
    /// What the frame shows of a world.
    world: Option<WorldPart>,
    /// First sample of the block that is being handed in, and the rows of it that have been.
    sample: u32,
    row: u32,
    /// Where paths are traced in stages: what is kept of them.
    columns: Option<Columns>,
    dispatch: Option<Dispatch>,
    dispatches: u64,
    has_centers: bool,
    flying: VecDeque<Flight>,
    /// Seconds that a sample takes, once that is known.
    pace: Option<f64>,
    /// Seconds that the submissions before have taken for the oldest dispatch.
    took: f64,
    /// When the last dispatch was seen to be done.
    last_done: Instant,
    /// Blocks by themselves: index, samples, where their sums are or will be.
    kept: Vec<(u32, u32, Buffer)>,
    slots: u32,
    done: u64,
    rays: RayCounts,
    counts: WorldCounts,
    discarded: u64,
    elapsed: Duration,
}

/// What the rays of a frame meet.
#[derive(Clone, Copy)]
enum Target<'a> {
    Scene(&'a RayTracer),
    /// Light transport in a world, and in a scene where there is one.
    World(&'a WorldPart, &'a RayTracer),
    Preview(&'a WorldPart),
}

/// What a frame writes.
struct Buffers {
    /// The three tables that shaders read.
    tables: Buffer,
    film: FilmBuffers,
    block: Buffer,
    counters: Buffer,
    read_counters: Buffer,
}

/// Where the tables are in their buffer.
const SCENE_AT: u64 = 0;
const LIGHTS_AT: u64 = 256;
const FRAME_AT: u64 = 512;
const TABLES: u64 = 1024;

impl Job {
    /// Makes its buffers and hands in what they begin with. A scene without a TLAS has no rays to trace.
    pub fn new(
        passes: &mut Passes<'_>,
        ticket: Ticket,
        frame: Frame,
        scene: &SceneTable,
        lights: &LightTable,
        world: &WorldSource,
    ) -> Result<Self> {
        passes.pipeline.check_width(frame.tile.width)?;
        let buffers = Buffers::new(passes.device, &frame)?;
        let columns = match &frame.world {
            None => passes.pipeline.is_staged().then_some(COLUMNS),
            Some(view) => (view.shade == Shade::Path).then_some(WORLD_COLUMNS),
        };
        let columns = columns.map(|columns| passes.paths.columns(passes.device, passes.queue, frame.tile, columns));
        let columns = columns.transpose()?;
        let mut table = buffers.table(&frame);
        if let Some(columns) = columns {
            (table.paths, table.path_stride) = (columns.address, columns.stride as u32);
        }
        let mut commands = passes.queue.begin()?;
        commands.full_barrier();
        commands.update(buffers.tables.raw, SCENE_AT, bytemuck::bytes_of(scene));
        commands.update(buffers.tables.raw, LIGHTS_AT, bytemuck::bytes_of(lights));
        commands.update(buffers.tables.raw, FRAME_AT, bytemuck::bytes_of(&table));
        for sum in buffers.film.sums().chain([&buffers.block]) {
            commands.fill(sum.raw, 0, sum.size / 4 * 4, 0);
        }
        let world = frame
            .world
            .as_ref()
            .map(|view| WorldPart::new(&mut commands, passes.worlds, passes.layout, &frame, view, world, AHEAD as u64));
        let world = match world.transpose() {
            Ok(world) => world,
            Err(error) => {
                passes.queue.abandon(commands);
                return Err(error);
            }
        };
        commands.full_barrier();
        passes.queue.submit(commands)?;
        let pace = world.as_ref().and_then(|world| Some(world.pace(passes.worlds)? * f64::from(world.layers())));
        Ok(Self {
            ticket,
            sample: frame.samples.start,
            row: 0,
            columns,
            dispatch: None,
            dispatches: 0,
            has_centers: false,
            flying: VecDeque::new(),
            pace,
            world,
            took: 0.0,
            last_done: Instant::now(),
            kept: Vec::new(),
            slots: 0,
            done: 0,
            rays: RayCounts::default(),
            counts: WorldCounts::default(),
            discarded: 0,
            elapsed: Duration::ZERO,
            buffers: Some(buffers),
            frame,
        })
    }

    pub fn discarded(&self) -> u64 {
        self.discarded
    }

    pub fn status(&self) -> TicketStatus {
        TicketStatus {
            done: self.done,
            total: self.total(),
            rays: self.rays,
            elapsed: self.elapsed,
            world: self.counts,
        }
    }

    /// Whether the frame shows a world: its tables lead to the arenas of the active set.
    pub fn shows_world(&self) -> bool {
        self.world.is_some()
    }

    fn total(&self) -> u64 {
        let area = self.frame.tile;
        u64::from(area.width) * u64::from(area.height) * u64::from(self.frame.samples.end - self.frame.samples.start)
    }

    fn block_end(&self) -> u32 {
        (self.sample / BLOCK * BLOCK).saturating_add(BLOCK).min(self.frame.samples.end)
    }

    /// Hands in dispatches and takes back what is done, for about `budget`.
    pub fn work(&mut self, passes: &mut Passes<'_>, budget: Duration) -> Result<()> {
        let start = Instant::now();
        loop {
            self.collect(passes)?;
            while self.flying.len() < AHEAD && self.sample < self.frame.samples.end {
                self.hand_in(passes, budget.clamp(self.shortest(), LONGEST))?;
            }
            let Some(oldest) = self.flying.front().map(|flight| flight.submission) else { break };
            let left = budget.saturating_sub(start.elapsed());
            // SYNC: the caller polls, and says for how long it wants to wait.
            if !passes.queue.wait(oldest, left)? {
                break;
            }
        }
        self.elapsed += start.elapsed();
        Ok(())
    }

    /// Layers of each sample.
    fn layers(&self) -> u64 {
        self.world.as_ref().map_or(1, |world| u64::from(world.layers()))
    }

    /// Time that a dispatch should take at least. Previews of worlds are shown as they come: one should be a dispatch or two.
    fn shortest(&self) -> Duration {
        if self.world.as_ref().is_some_and(WorldPart::is_preview) { SHORTEST } else { Duration::ZERO }
    }

    /// The next rows of the block, as many as take about a time.
    fn next_dispatch(&mut self, device: &Device, time: Duration) -> Dispatch {
        let (tile, end) = (self.frame.tile, self.block_end());
        let a_row = u64::from(tile.width) * u64::from(end - self.sample);
        let is_quick = self.columns.is_some() && !device.info.is_software();
        let mut first = if is_quick { FIRST_STAGED } else { FIRST_SAMPLES };
        if let Some(world) = &self.world {
            first = if world.is_preview() { FIRST_RAYS } else { first } / u64::from(world.layers());
        }
        let samples = self.pace.map_or(first as f64, |pace| time.as_secs_f64() / pace);
        let mut rows = ((samples / a_row as f64) as u32).clamp(1, tile.height - self.row);
        if let Some(columns) = self.columns {
            let most = device.info.limits.max_dispatch_rows.max(1);
            rows = rows.min((columns.stride / u64::from(tile.width)) as u32).min(most);
        }
        self.dispatches += 1;
        Dispatch {
            number: self.dispatches,
            rows,
            samples: a_row * u64::from(rows),
            taken: 0,
            vertices: u64::from(end - self.sample) * u64::from(self.frame.max_depth) * self.layers(),
            begun: false,
        }
    }

    /// Hands in the next rows of the block, or more vertices of their paths.
    fn hand_in(&mut self, passes: &mut Passes<'_>, time: Duration) -> Result<()> {
        let mut dispatch = match self.dispatch.take() {
            Some(dispatch) => dispatch,
            None => self.next_dispatch(passes.device, time),
        };
        let Some(buffers) = &self.buffers else { return Ok(()) };
        let sets = Sets { tlas: passes.tlas, images: passes.images };
        let target = match &self.world {
            None => Target::Scene(passes.pipeline),
            Some(world) => match world.paths(passes.worlds) {
                Some(tracer) => Target::World(world, tracer),
                None => Target::Preview(world),
            },
        };
        let (tile, end, rows) = (self.frame.tile, self.block_end(), dispatch.rows);
        let slot = self.slots % AHEAD as u32;
        self.slots += 1;

        let mut commands = passes.queue.begin()?;
        commands.full_barrier();
        commands.fill(buffers.counters.raw, u64::from(slot) * COUNTERS, COUNTERS, 0);
        if let Some(world) = &self.world {
            world.clear_counters(&mut commands, slot);
        }
        if let Some(columns) = self.columns.filter(|_| !std::mem::replace(&mut dispatch.begun, true)) {
            columns.begin(&mut commands, u64::from(tile.width) * u64::from(rows));
        }
        commands.full_barrier();
        commands.stage(Stage::Trace);
        let mut push = TracePush {
            frame: buffers.tables.address + FRAME_AT,
            first_row: self.row,
            first_sample: self.sample,
            end_sample: end,
            counters: slot,
        };
        let size = (tile.width, rows);
        let mut is_handed_in = true;
        let mut vertices = (0, true);
        if self.columns.is_some() {
            let now = dispatch.vertices.min(VERTICES);
            dispatch.vertices -= now;
            is_handed_in = dispatch.vertices == 0;
            vertices = (now as u32, is_handed_in);
        }
        match target {
            Target::Preview(world) => world.record(&mut commands, passes.worlds, Pass::Block, push, size),
            Target::World(world, tracer) => {
                let push = world.push(push, rows);
                tracer.trace_vertices(&mut commands, &sets, bytemuck::bytes_of(&push), size, vertices);
            }
            Target::Scene(tracer) if tracer.is_staged() => {
                tracer.trace_vertices(&mut commands, &sets, bytemuck::bytes_of(&push), size, vertices);
            }
            Target::Scene(tracer) => {
                tracer.trace(&mut commands, Generation::Block, &sets, bytemuck::bytes_of(&push), size);
            }
        }
        if !self.has_centers && buffers.film.centers.is_some() {
            // With the first rows; it is one ray a pixel.
            push.first_row = 0;
            let size = (tile.width, tile.height);
            match target {
                Target::Preview(world) => world.record(&mut commands, passes.worlds, Pass::Centers, push, size),
                Target::World(world, tracer) => {
                    let push = world.push(push, tile.height);
                    tracer.trace(&mut commands, Generation::Centers, &sets, bytemuck::bytes_of(&push), size);
                }
                Target::Scene(tracer) => {
                    tracer.trace(&mut commands, Generation::Centers, &sets, bytemuck::bytes_of(&push), size);
                }
            }
        }
        self.has_centers = true;
        commands.full_barrier();
        commands.stage(None);
        let counters = vk::BufferCopy {
            src_offset: u64::from(slot) * COUNTERS,
            dst_offset: u64::from(slot) * COUNTERS,
            size: COUNTERS,
        };
        commands.copy(buffers.counters.raw, buffers.read_counters.raw, &[counters]);
        if let Some(world) = &self.world {
            world.copy_counters(&mut commands, slot);
        }
        let is_whole = is_handed_in && self.row + rows == tile.height;
        if is_whole && self.frame.keep_blocks {
            let size = buffers.block.size;
            let usage = vk::BufferUsageFlags::TRANSFER_DST;
            let kept = Buffer::new(passes.device, "a block of a film", size, usage, Place::Readback)?;
            commands.copy(buffers.block.raw, kept.raw, &[vk::BufferCopy { src_offset: 0, dst_offset: 0, size }]);
            self.kept.push((self.sample / BLOCK, end - self.sample, kept));
        }
        commands.host_barrier();
        let submission = passes.queue.submit(commands)?;
        let samples = if is_handed_in { dispatch.samples } else { 0 };
        let handed_in = Instant::now();
        self.flying.push_back(Flight { submission, samples, dispatch: dispatch.number, slot, handed_in });
        if is_whole {
            (self.sample, self.row) = (end, 0);
        } else if is_handed_in {
            self.row += rows;
        } else {
            self.dispatch = Some(dispatch);
        }
        Ok(())
    }

    /// Takes back what is done.
    fn collect(&mut self, passes: &mut Passes<'_>) -> Result<()> {
        let Some(buffers) = &self.buffers else { return Ok(()) };
        let (done, layers) = (passes.queue.done()?, self.layers());
        while let Some(flight) = self.flying.pop_front_if(|flight| flight.submission <= done) {
            let at = flight.slot as usize * COUNTERS as usize;
            let counters: &[u32] = bytemuck::cast_slice(&buffers.read_counters.mapped()[at..at + COUNTERS as usize]);
            let of = |k: usize| counters.iter().skip(k).step_by(4).map(|&count| u64::from(count)).sum::<u64>();
            self.rays.camera += of(0);
            self.rays.bounce += of(1);
            self.rays.shadow += of(2);
            self.discarded += of(3);
            if let Some(world) = &self.world {
                self.counts += world.counts(flight.slot);
            }
            self.done += flight.samples;
            if let Some(dispatch) = self.dispatch.as_mut().filter(|dispatch| dispatch.number == flight.dispatch) {
                dispatch.taken += of(0);
                if dispatch.taken == dispatch.samples * layers {
                    dispatch.vertices = 0;
                }
            }
            let now = Instant::now();
            let took = now.duration_since(flight.handed_in.max(self.last_done)).as_secs_f64();
            self.last_done = now;
            self.took += took;
            if flight.samples == 0 {
                continue;
            }
            let pace = std::mem::take(&mut self.took) / flight.samples as f64;
            // The first dispatch of a device may compile its shaders: what is faster counts at once.
            self.pace =
                Some(self.pace.map_or(pace, |before| if pace < before { pace } else { 0.7 * before + 0.3 * pace }));
            if self.world.as_ref().is_some_and(WorldPart::is_preview) {
                passes.worlds.pace = self.pace.map(|pace| pace / layers as f64);
            }
        }
        passes.queue.collect()
    }

    /// The film: whole blocks only. A block that was begun is brought to its end first.
    pub fn into_film(mut self, passes: &mut Passes<'_>) -> Result<Film> {
        let film = self.film(passes);
        if film.is_err() {
            // The device may still write into the buffers.
            self.retire(passes.queue);
        }
        film
    }

    fn film(&mut self, passes: &mut Passes<'_>) -> Result<Film> {
        while self.row > 0 || self.dispatch.is_some() {
            if let Some(oldest) = self.flying.front().filter(|_| self.flying.len() >= AHEAD) {
                // SYNC: an explicit readback, and each flight has counters of its own.
                passes.queue.wait(oldest.submission, Duration::MAX)?;
                self.collect(passes)?;
            }
            self.hand_in(passes, LONGEST)?;
        }
        let samples = self.sample - self.frame.samples.start;
        let Some(buffers) = &self.buffers else {
            return Err(VulkanError::Limit("the frame was read back already".to_owned()));
        };
        let mut film = buffers.film.read(passes.device, passes.queue, &self.frame, samples, self.has_centers)?;
        // The kept blocks were handed in before it.
        let blocks = self.kept.iter().map(|(index, samples, buffer)| {
            let floats: &[f32] = bytemuck::cast_slice(buffer.mapped());
            FilmBlock {
                index: *index,
                samples: *samples,
                sum: floats.chunks_exact(4).take(film.sum.len()).map(rgb).collect(),
            }
        });
        film.blocks = blocks.collect();
        Ok(film)
    }

    /// Gives up what is under way: its buffers go when the device is done with them.
    pub fn retire(mut self, queue: &mut Queue) {
        queue.retire((self.buffers.take(), self.world.take(), std::mem::take(&mut self.kept)));
    }
}

impl Buffers {
    fn new(device: &Arc<Device>, frame: &Frame) -> Result<Self> {
        let pixels = u64::from(frame.tile.width) * u64::from(frame.tile.height);
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let make = |what, size| Buffer::new(device, what, size, usage, Place::Device);
        Ok(Self {
            tables: make("tables of a frame", TABLES)?,
            // The sums of the frame, then those of the block under way.
            film: FilmBuffers::new(device, frame, 2)?,
            block: make("a block of a film", 16 * pixels)?,
            counters: make("counters of a frame", COUNTERS * AHEAD as u64)?,
            read_counters: Buffer::new(device, "counters of a frame", COUNTERS * AHEAD as u64, usage, Place::Readback)?,
        })
    }

    fn table(&self, frame: &Frame) -> FrameTable {
        let [albedo, normal, centers] = self.film.addresses();
        FrameTable {
            scene: self.tables.address + SCENE_AT,
            lights: self.tables.address + LIGHTS_AT,
            film: self.film.sum.address,
            block: self.block.address,
            albedo,
            normal,
            centers,
            counters: self.counters.address,
            ..FrameTable::new(frame)
        }
    }
}
