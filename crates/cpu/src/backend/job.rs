//! A frame under way.
//!
//! The frame is cut into tiles, and its samples into blocks. A tile of a block is the unit of work; blocks are rendered a
//! few at a time, so that a small image occupies many threads too, and are added to the film in order.

use crate::path::PathTracer;
use crate::path::aov::is_averaged;
use crate::path::camera::View;
use crate::path::lights::LightTables;
use crate::path::tile::{TileSums, render_tile};
use crate::scene::ResidentScene;
use crate::world::WorldTracer;
use orthant_resident::backend::RayCounts;
use orthant_resident::film::{BLOCK, FilmBlock};
use orthant_resident::frame::Tile;
use orthant_resident::world::{WorldArenas, WorldCounts};
use orthant_resident::{Film, Frame, Ticket, TicketStatus};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Edge of a tile in pixels.
const TILE: u32 = 16;

/// Units of work that are under way at once, for each thread: enough that the wait at the end of a group is short.
const UNITS_PER_THREAD: usize = 32;

/// A tile of a block.
#[derive(Default)]
struct Unit {
    tile: usize,
    block: u32,
    done: bool,
    sums: TileSums,
}

/// What a frame sees of the backend: by shared reference, so that looking changes nothing.
#[derive(Clone, Copy)]
pub(super) struct Resident<'a> {
    pub scene: &'a ResidentScene,
    pub lights: &'a LightTables,
    pub world: &'a WorldArenas,
}

pub(super) struct Job {
    pub ticket: Ticket,
    frame: Frame,
    pool: Option<Arc<rayon::ThreadPool>>,
    tiles: Vec<Tile>,
    /// First sample of the first block that is in neither `group` nor the film.
    next_sample: u32,
    /// The blocks that are under way, tile by tile.
    group: Vec<Unit>,
    /// Units of a finished group, for the buffers that they hold.
    spare: Vec<Unit>,
    film: Film,
    done: u64,
    rays: RayCounts,
    world: WorldCounts,
    discarded: u64,
    elapsed: Duration,
}

impl Job {
    pub fn new(ticket: Ticket, frame: Frame, pool: Option<Arc<rayon::ThreadPool>>) -> Self {
        let area = frame.tile;
        let mut tiles = Vec::new();
        for y in (area.y..area.y + area.height).step_by(TILE as usize) {
            for x in (area.x..area.x + area.width).step_by(TILE as usize) {
                let (width, height) = (TILE.min(area.x + area.width - x), TILE.min(area.y + area.height - y));
                tiles.push(Tile { x, y, width, height });
            }
        }
        let pixels = area.width as usize * area.height as usize;
        let film = Film {
            width: frame.width,
            height: frame.height,
            tile: area,
            samples: 0,
            sum: vec![[0.0; 3]; pixels],
            blocks: Vec::new(),
            aovs: frame.aovs.iter().map(|&aov| (aov, vec![0.0; pixels * aov.channels()])).collect(),
        };
        Self {
            ticket,
            pool,
            tiles,
            next_sample: frame.samples.start,
            group: Vec::new(),
            spare: Vec::new(),
            film,
            frame,
            done: 0,
            rays: RayCounts::default(),
            world: WorldCounts::default(),
            discarded: 0,
            elapsed: Duration::ZERO,
        }
    }

    pub fn discarded(&self) -> u64 {
        self.discarded
    }

    pub fn status(&self) -> TicketStatus {
        TicketStatus { done: self.done, total: self.total(), rays: self.rays, elapsed: self.elapsed, world: self.world }
    }

    fn total(&self) -> u64 {
        let area = self.frame.tile;
        u64::from(area.width) * u64::from(area.height) * u64::from(self.frame.samples.end - self.frame.samples.start)
    }

    /// Renders for about `budget`, at least one unit of work.
    pub fn work(&mut self, resident: Resident, budget: Duration) {
        let start = Instant::now();
        while self.done < self.total() {
            if self.group.iter().all(|unit| unit.done) {
                self.finish_group();
                self.begin_group();
            }
            self.render_group(resident, start, budget);
            if self.group.iter().all(|unit| unit.done) {
                self.finish_group();
            }
            if start.elapsed() >= budget {
                break;
            }
        }
        self.elapsed += start.elapsed();
    }

    fn threads(&self) -> usize {
        self.pool.as_ref().map_or_else(rayon::current_num_threads, |pool| pool.current_num_threads())
    }

    fn begin_group(&mut self) {
        let blocks_left = (self.frame.samples.end - self.next_sample).div_ceil(BLOCK) as usize;
        let blocks = (UNITS_PER_THREAD * self.threads()).div_ceil(self.tiles.len()).clamp(1, blocks_left.max(1));
        self.group = std::mem::take(&mut self.spare);
        self.group.resize_with(blocks.min(blocks_left) * self.tiles.len(), Unit::default);
        for (i, unit) in self.group.iter_mut().enumerate() {
            unit.block = self.next_sample / BLOCK + (i / self.tiles.len()) as u32;
            unit.tile = i % self.tiles.len();
            unit.done = false;
        }
        let end = u64::from(self.next_sample) + (blocks.min(blocks_left) as u64) * u64::from(BLOCK);
        self.next_sample = end.min(u64::from(self.frame.samples.end)) as u32;
    }

    fn block_samples(frame: &Frame, block: u32) -> Range<u32> {
        block * BLOCK..frame.samples.end.min((block * BLOCK).saturating_add(BLOCK))
    }

    fn render_group(&mut self, Resident { scene, lights, world }: Resident, start: Instant, budget: Duration) {
        let Self { frame, tiles, group, pool, .. } = self;
        let world = WorldTracer::new(frame, world, !scene.render_nodes.is_empty());
        let tracer = PathTracer { scene, lights, frame, view: View::new(frame), world: world.as_ref() };
        let first_block = frame.samples.start / BLOCK;
        let begun = AtomicBool::new(false);
        let newly_done: Vec<&Unit> = {
            let render = |unit: &mut Unit| {
                // The first unit is rendered however small the budget is: polling always gets on.
                if begun.swap(true, Ordering::Relaxed) && start.elapsed() >= budget {
                    return;
                }
                let samples = Self::block_samples(tracer.frame, unit.block);
                render_tile(&tracer, tiles[unit.tile], samples, unit.block == first_block, &mut unit.sums);
                unit.done = true;
            };
            let mut open: Vec<&mut Unit> = group.iter_mut().filter(|unit| !unit.done).collect();
            let mut run = || open.par_iter_mut().with_max_len(1).for_each(|unit| render(unit));
            match pool {
                Some(pool) => pool.install(run),
                None => run(),
            }
            open.into_iter().map(|unit| &*unit).filter(|unit| unit.done).collect()
        };
        for unit in newly_done {
            let (tile, samples) = (tiles[unit.tile], Self::block_samples(frame, unit.block));
            self.done += u64::from(tile.width) * u64::from(tile.height) * u64::from(samples.end - samples.start);
            self.rays.camera += unit.sums.counts.rays.camera;
            self.rays.bounce += unit.sums.counts.rays.bounce;
            self.rays.shadow += unit.sums.counts.rays.shadow;
            self.world += unit.sums.counts.world;
            self.discarded += unit.sums.counts.discarded;
        }
    }

    /// Adds the finished blocks at the front of the group to the film, and ends the group.
    fn finish_group(&mut self) {
        let group = std::mem::take(&mut self.group);
        for units in group.chunks(self.tiles.len()) {
            if !units.iter().all(|unit| unit.done) {
                break;
            }
            self.add_block(units);
        }
        self.spare = group;
    }

    fn add_block(&mut self, units: &[Unit]) {
        let area = self.frame.tile;
        let index = units[0].block;
        let samples = Self::block_samples(&self.frame, index);
        let count = samples.end - samples.start;
        self.film.samples += count;
        let mut kept = self.frame.keep_blocks.then(|| vec![[0.0; 3]; self.film.sum.len()]);
        for unit in units {
            let tile = self.tiles[unit.tile];
            for row in 0..tile.height {
                let width = tile.width as usize;
                let from = (row * tile.width) as usize;
                let to = (tile.y - area.y + row) as usize * area.width as usize + (tile.x - area.x) as usize;
                let radiance = &unit.sums.radiance[from..from + width];
                for (sum, value) in self.film.sum[to..to + width].iter_mut().zip(radiance) {
                    add(sum, value);
                }
                if let Some(kept) = &mut kept {
                    kept[to..to + width].copy_from_slice(radiance);
                }
                let (mut averaged, mut centers) = (unit.sums.averaged.iter(), unit.sums.centers.iter());
                for (aov, pixels) in &mut self.film.aovs {
                    let n = aov.channels();
                    let pixels = &mut pixels[to * n..(to + width) * n];
                    if is_averaged(*aov) {
                        let Some(values) = averaged.next() else { continue };
                        let values = values[from..from + width].as_flattened();
                        pixels.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
                    } else if let Some(values) = centers.next() {
                        pixels.copy_from_slice(&values[from * n..(from + width) * n]);
                    }
                }
            }
        }
        if let Some(sum) = kept {
            self.film.blocks.push(FilmBlock { index, samples: count, sum });
        }
    }

    /// The film: the whole blocks that are done, in order.
    pub fn into_film(mut self) -> Film {
        self.finish_group();
        let samples = self.film.samples.max(1) as f32;
        for (aov, pixels) in &mut self.film.aovs {
            if is_averaged(*aov) {
                pixels.iter_mut().for_each(|v| *v /= samples);
            }
        }
        self.film
    }
}

fn add(sum: &mut [f32; 3], value: &[f32; 3]) {
    for (s, v) in sum.iter_mut().zip(value) {
        *s += v;
    }
}
