//! A frame of the preview under way: passes over the image, each of four samples a pixel, added up on the device.

use super::abi::{CullPush, RasterTable, ResolvePush};
use super::camera;
use super::cull::BUCKETS;
use super::record::{Part, Raster};
use super::timer::{Moment, Timer};
use super::{RasterOptions, RasterReport};
use crate::abi::{FrameTable, LightTable, SceneTable};
use crate::device::Device;
use crate::error::{Result, VulkanError};
use crate::film::FilmBuffers;
use crate::memory::{Buffer, Place, Queue};
use ash::vk;
use orthant_resident::camera::Projection;
use orthant_resident::environment::EnvironmentMap;
use orthant_resident::frame::Tile;
use orthant_resident::{BackendError, Film, Frame, Ticket, TicketStatus};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Samples of a pixel in one pass.
const SAMPLES: u32 = 4;
/// Passes that are handed in before the first of them is done.
const AHEAD: u32 = 2;
/// View numbers of the AOVs that are averaged like colour.
const ALBEDO_VIEW: u32 = super::RasterView::BaseColor as u32;
const NORMAL_VIEW: u32 = 12;

// Where the tables are in their buffer.
const SCENE_AT: u64 = 0;
const LIGHTS_AT: u64 = 256;
const FRAME_AT: u64 = 512;
const RASTER_AT: u64 = 1024;
const TABLES: u64 = 1280;

/// What a frame needs of the backend.
pub(crate) struct RasterPasses<'p> {
    pub device: &'p Arc<Device>,
    pub queue: &'p mut Queue,
    pub raster: &'p mut Raster,
    pub images: vk::DescriptorSet,
}

/// What a frame is drawn from.
pub(crate) struct RasterScene {
    pub table: SceneTable,
    pub lights: LightTable,
    pub map: Option<Arc<EnvironmentMap>>,
    /// Rows of the render-node buffer.
    pub rows: u32,
}

/// A pass that is on its way.
struct Flight {
    submission: u64,
    slot: u32,
}

pub(crate) struct RasterJob {
    pub ticket: Ticket,
    frame: Frame,
    options: RasterOptions,
    rows: u32,
    buffers: Option<Buffers>,
    /// Passes that were handed in.
    pass: u32,
    flying: VecDeque<Flight>,
    report: RasterReport,
    elapsed: Duration,
}

/// What a frame writes.
struct Buffers {
    tables: Buffer,
    film: FilmBuffers,
    /// What each pass under way drew, by part and bucket.
    counts: Buffer,
    timer: Timer,
}

/// What of a frame the preview cannot do.
///
/// # Errors
/// [`BackendError::InvalidFrame`], which says what.
pub(crate) fn check(frame: &Frame) -> std::result::Result<(), BackendError> {
    if frame.keep_blocks || frame.samples.start != 0 {
        let what = "the preview renders whole images, no shares of samples".to_owned();
        return Err(BackendError::InvalidFrame(what));
    }
    Ok(())
}

impl RasterJob {
    /// Makes its buffers and hands in what they begin with, and the filtering of an environment that is new.
    pub fn new(
        passes: &mut RasterPasses<'_>,
        ticket: Ticket,
        frame: Frame,
        options: RasterOptions,
        scene: &RasterScene,
    ) -> Result<Self> {
        let buffers = Buffers::new(passes.device, &frame)?;
        let largest = camera::parts(frame.tile)[0];
        passes.raster.targets_for(passes.queue, (largest.width, largest.height), buffers.film.centers.is_some())?;
        let filtered = passes.raster.environment.address();
        let list = passes.raster.culling.list(passes.queue, scene.rows)?;
        let table = RasterTable {
            frame: buffers.tables.address + FRAME_AT,
            commands: list.commands.address,
            group_counts: list.group_counts.address,
            counts: list.counts.address,
            filtered,
            capacity: list.capacity,
            row_count: scene.rows,
            group_count: scene.rows.div_ceil(256),
            has_environment: u32::from(scene.map.is_some()),
            inverse_focus: camera::inverse_focus(&frame.camera),
            blend_scale: camera::blend_scale(&frame.camera),
        };
        let [_, _, centers] = buffers.film.addresses();
        let frame_table = FrameTable {
            scene: buffers.tables.address + SCENE_AT,
            lights: buffers.tables.address + LIGHTS_AT,
            centers,
            ..FrameTable::new(&frame)
        };
        let mut commands = passes.queue.begin()?;
        commands.full_barrier();
        commands.update(buffers.tables.raw, SCENE_AT, bytemuck::bytes_of(&scene.table));
        commands.update(buffers.tables.raw, LIGHTS_AT, bytemuck::bytes_of(&scene.lights));
        commands.update(buffers.tables.raw, FRAME_AT, bytemuck::bytes_of(&frame_table));
        commands.update(buffers.tables.raw, RASTER_AT, bytemuck::bytes_of(&table));
        for sums in buffers.film.sums() {
            commands.fill(sums.raw, 0, sums.size / 4 * 4, 0);
        }
        commands.full_barrier();
        let lights = buffers.tables.address + LIGHTS_AT;
        passes.raster.environment.follow(&mut commands, lights, scene.map.as_ref());
        if let Err(error) = passes.queue.submit(commands) {
            passes.raster.environment.forget();
            return Err(error);
        }
        Ok(Self {
            ticket,
            options,
            rows: scene.rows,
            buffers: Some(buffers),
            pass: 0,
            flying: VecDeque::new(),
            report: RasterReport::default(),
            elapsed: Duration::ZERO,
            frame,
        })
    }

    /// What it took so far.
    pub fn report(&self) -> RasterReport {
        self.report
    }

    fn passes(&self) -> u32 {
        self.frame.samples.end.div_ceil(SAMPLES)
    }

    /// Samples of a pixel after some passes: the last may stand for fewer than the others.
    fn samples(&self, passes: u32) -> u32 {
        passes.saturating_mul(SAMPLES).min(self.frame.samples.end)
    }

    pub fn status(&self) -> TicketStatus {
        let pixels = u64::from(self.frame.tile.width) * u64::from(self.frame.tile.height);
        TicketStatus {
            done: pixels * u64::from(self.samples(self.report.passes)),
            total: pixels * u64::from(self.frame.samples.end),
            rays: orthant_resident::backend::RayCounts::default(),
            elapsed: self.elapsed,
            world: orthant_resident::world::WorldCounts::default(),
        }
    }

    /// Hands in passes and takes back what is done, for about `budget`.
    pub fn work(&mut self, passes: &mut RasterPasses<'_>, budget: Duration) -> Result<()> {
        let start = Instant::now();
        loop {
            self.collect(passes)?;
            while self.flying.len() < AHEAD as usize && self.pass < self.passes() {
                self.hand_in(passes)?;
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

    /// Hands in one pass over the image.
    fn hand_in(&mut self, passes: &mut RasterPasses<'_>) -> Result<()> {
        let Some(buffers) = &self.buffers else { return Ok(()) };
        let (pass, slot) = (self.pass, self.pass % AHEAD);
        let table = buffers.tables.address + RASTER_AT;
        let tile = self.frame.tile;
        let offsets = camera::offsets(&self.frame, pass, self.passes());
        let weight = (self.samples(pass + 1) - self.samples(pass)) as f32;
        let is_reversed = matches!(self.frame.camera.projection, Projection::Perspective { .. });
        let shaded = self.options.view == super::RasterView::Shaded;
        let mut commands = passes.queue.begin()?;
        buffers.timer.reset(slot);
        buffers.timer.mark(&mut commands, slot, Moment::Begin);
        let (mut is_culled, mut part_number) = (false, 0);
        let parts = camera::parts(tile).len() as u64;
        let raster = &*passes.raster;
        let cull = |commands: &mut _, part: Tile, offsets| {
            let planes = camera::planes(&self.frame, part, offsets);
            let push = CullPush { table, culls: u32::from(self.options.culls), reserved: 0, planes };
            raster.cull(commands, &push, self.rows);
        };
        let resolve_push = |part: Tile, sums| ResolvePush {
            table,
            sums,
            x: part.x - tile.x,
            y: part.y - tile.y,
            width: part.width,
            height: part.height,
            weight,
            reserved: 0,
        };
        for part in camera::parts(tile) {
            if pass == 0 && buffers.film.centers.is_some() {
                let centred = camera::Offsets::default();
                cull(&mut commands, part, centred);
                let push = camera::push(&self.frame, table, part, centred, 0, 0);
                raster.draw_hits(&mut commands, Part { push: &push, images: passes.images, is_reversed });
                raster.resolve_hits(&mut commands, &resolve_push(part, 0));
            }
            cull(&mut commands, part, offsets);
            if !std::mem::replace(&mut is_culled, true) {
                buffers.timer.mark(&mut commands, slot, Moment::Culled);
            }
            let averaged = [
                (Some(&buffers.film.sum), self.options.view as u32, shaded),
                (buffers.film.albedo.as_ref(), ALBEDO_VIEW, false),
                (buffers.film.normal.as_ref(), NORMAL_VIEW, false),
            ];
            for (sums, view, backdrop) in averaged {
                let Some(sums) = sums else { continue };
                let push = camera::push(&self.frame, table, part, offsets, view, pass);
                raster.draw(&mut commands, Part { push: &push, images: passes.images, is_reversed }, backdrop);
                raster.resolve(&mut commands, &resolve_push(part, sums.address));
            }
            if let Some(list) = raster.culling.current() {
                let size = 4 * u64::from(BUCKETS);
                let to = size * (u64::from(slot) * parts + part_number);
                commands.full_barrier();
                commands.copy(
                    list.counts.raw,
                    buffers.counts.raw,
                    &[vk::BufferCopy { src_offset: 0, dst_offset: to, size }],
                );
                commands.full_barrier();
            }
            part_number += 1;
        }
        buffers.timer.mark(&mut commands, slot, Moment::End);
        commands.host_barrier();
        let submission = passes.queue.submit(commands)?;
        self.flying.push_back(Flight { submission, slot });
        self.pass += 1;
        Ok(())
    }

    /// Takes back what is done.
    fn collect(&mut self, passes: &mut RasterPasses<'_>) -> Result<()> {
        let Some(buffers) = &self.buffers else { return Ok(()) };
        let done = passes.queue.done()?;
        while let Some(flight) = self.flying.pop_front_if(|flight| flight.submission <= done) {
            let counts: &[u32] = bytemuck::cast_slice(&buffers.counts.mapped()[..buffers.counts.size as usize]);
            let own = counts.chunks_exact(counts.len() / AHEAD as usize).nth(flight.slot as usize).unwrap_or_default();
            let report = &mut self.report;
            report.passes += 1;
            report.drawn = own.iter().map(|&count| u64::from(count)).sum();
            if let Some((whole, culled)) = buffers.timer.read(flight.slot)
                && report.pass_time.is_none_or(|before| whole < before)
            {
                (report.pass_time, report.cull_time) = (Some(whole), Some(culled));
            }
        }
        passes.queue.collect()
    }

    /// The film, of the passes that were handed in.
    pub fn into_film(self, passes: &mut RasterPasses<'_>) -> Result<Film> {
        let film = self.film(passes);
        if film.is_err() {
            // The device may still write into the buffers.
            self.retire(passes.queue);
        }
        film
    }

    fn film(&self, passes: &mut RasterPasses<'_>) -> Result<Film> {
        let samples = self.samples(self.pass);
        let Some(buffers) = &self.buffers else {
            return Err(VulkanError::Limit("the frame was read back already".to_owned()));
        };
        buffers.film.read(passes.device, passes.queue, &self.frame, samples, self.pass > 0)
    }

    /// Gives up what is under way: its buffers go when the device is done with them.
    pub fn retire(mut self, queue: &mut Queue) {
        if let Some(buffers) = self.buffers.take() {
            queue.retire(buffers);
        }
    }
}

impl Buffers {
    fn new(device: &Arc<Device>, frame: &Frame) -> Result<Self> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let make = |what, size| Buffer::new(device, what, size, usage, Place::Device);
        let counts = 4 * u64::from(BUCKETS * AHEAD) * camera::parts(frame.tile).len() as u64;
        Ok(Self {
            tables: make("tables of a frame", TABLES)?,
            film: FilmBuffers::new(device, frame, 1)?,
            counts: Buffer::new(device, "counts of draws", counts, usage, Place::Readback)?,
            timer: Timer::new(device, AHEAD)?,
        })
    }
}
