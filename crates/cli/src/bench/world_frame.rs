//! `bench world-frame`: frames of a world of platforms, by how far they see.

use super::world::{Platforms, Rig, internal};
use super::world_edit::quantile;
use super::{Measured, Settings};
use crate::failure::Failure;
use crate::fly::Camera;
use crate::job::backend::{AnyBackend, Asked, backend_failure, open};
use crate::job::world_view::WorldShot;
use orthant_render::sky::{DEFAULT_SUN, clear_sky};
use orthant_render::world::live::{Budget, LiveOptions, LiveWorld};
use orthant_render::world::view::{Mode, Steps, Turns, WorldCamera, position};
use orthant_world::edit::fill_box;
use orthant_world::{Aabb4, Block};
use std::time::{Duration, Instant};

/// View distances in units.
const DISTANCES: [u32; 4] = [80, 320, 1280, 2560];
/// Half extent of the world in units: the farthest view reaches its end.
const HALF_EXTENT: i32 = 2080;
/// Layers of the integral.
const LAYERS: u32 = 128;
/// Sizes of slice and integral in pixels: on a processor, and on a device.
const ON_PROCESSOR: [(u32, u32); 2] = [(960, 540), (192, 108)];
const ON_DEVICE: [(u32, u32); 2] = [(1920, 1080), (960, 540)];
/// Frames of a flight, and its speed in units a frame: 50 units a second at 60 frames a second.
const FLIGHT: (usize, f64) = (300, 50.0 / 60.0);
/// How long a backend works between two looks.
const POLL: Duration = Duration::from_secs(1);

/// Measures frames over all distances, or the one of `settings.size` units.
pub fn run(asked: &Asked<'_>, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let live = LiveWorld::new(Platforms::world(HALF_EXTENT)?, LiveOptions::default()).map_err(internal)?;
    let mut rig = Rig::new(live, open(asked)?)?;
    let environment = clear_sky(DEFAULT_SUN);
    rig.backend.set_environment(environment.clone()).map_err(backend_failure)?;
    let integral = Mode::Integral { layers: LAYERS, hidden_zoom: 1.0, mix: 8.0 };
    let is_device = matches!(rig.backend, AnyBackend::Vulkan(_)) && !rig.backend.device().contains("llvmpipe");
    let [slice_size, integral_size] = if is_device { ON_DEVICE } else { ON_PROCESSOR };
    let mut results = Vec::new();
    for distance in settings.size.map_or(DISTANCES.to_vec(), |distance| vec![distance]) {
        for (name, mode, (width, height)) in [("slice", Mode::Slice, slice_size), ("integral", integral, integral_size)]
        {
            // Above the platform at the origin, a little downwards.
            let at = position([0.0, 24.0, 0.0, 0.5]).unwrap_or_default();
            let turns = Turns { yaw: 30.0, pitch: -10.0, ..Turns::default() };
            let shot = WorldShot {
                camera: WorldCamera::new(at, &turns),
                mode,
                path: false,
                distance: distance as f32,
                edges: 0.0,
                tan_half_fov_y: 0.5,
            };
            let threads = settings.threads;
            let shade = Camera::shade(&shot, &environment);
            let camera = Camera { shot, shade, width, height, spp: 1, seed: 0, threads };
            results.push(frames(name, &camera, u64::from(distance), &mut rig, settings)?);
            // In memory a flight takes minutes, and says what `world-edit` says.
            if mode == Mode::Slice && is_device {
                results.push(flight(camera, u64::from(distance), &mut rig)?);
            }
        }
    }
    Ok(results)
}

/// The same flight without edits and with a voxel broken in every frame: what the edit costs, and what it does to the frames.
fn flight(camera: Camera, n: u64, rig: &mut Rig) -> Result<Measured, Failure> {
    let (count, speed) = FLIGHT;
    let mut measured = Measured::new("flight_with_edits", n).with("frames", count);
    let mut times = [Vec::new(), Vec::new(), Vec::new()];
    let (mut mutation, mut bytes) = (Vec::new(), 0);
    // The first flight makes what the others find.
    for (pass, times) in times.iter_mut().enumerate() {
        let mut camera = camera.clone();
        for frame in 0..count {
            camera.shot.camera.advance(&Steps { right: 0.0, up: 0.0, forward: speed, hidden: 0.0 });
            let position = camera.shot.camera.position;
            let start = Instant::now();
            let mut edit = Duration::ZERO;
            if pass == 2 {
                // In the platform below, near the camera; each flight has a layer of its own.
                let cell: [i32; 4] = [frame as i32 % 64 - 32, -8, frame as i32 / 64 * 2 - 8, (n % 97) as i32];
                let bounds = Aabb4::from_ints(cell, cell.map(|c| c + 1)).map_err(internal)?;
                rig.patch(&fill_box(bounds, Block::AIR))?;
                edit = start.elapsed();
            }
            let ticked = Instant::now();
            let tick = rig.live.tick(&mut *rig.backend, position, &Budget::default());
            let tick = tick.map_err(crate::fly::live_failure)?;
            edit += ticked.elapsed();
            camera.render(&mut rig.backend, false)?;
            times.push(start.elapsed().as_secs_f64());
            if pass == 2 {
                mutation.push(edit.as_secs_f64());
                bytes = bytes.max(tick.upload_bytes);
                measured.runs.push(start.elapsed());
            }
        }
    }
    let mut over: Vec<f64> = times[2].iter().zip(&times[1]).map(|(with, without)| with - without).collect();
    let [_, without, with] = &mut times;
    Ok(measured
        .with("still_median_s", quantile(without, 0.5))
        .with("still_p99_s", quantile(without, 0.99))
        .with("p99_s", quantile(with, 0.99))
        .with("over_still_median_s", quantile(&mut over, 0.5))
        .with("over_still_p99_s", quantile(&mut over, 0.99))
        .with("edit_median_s", quantile(&mut mutation, 0.5))
        .with("edit_p99_s", quantile(&mut mutation, 0.99))
        .with("upload_bytes_max", bytes))
}

/// Whole frames of a world in which nothing happens.
fn frames(name: &str, camera: &Camera, n: u64, rig: &mut Rig, settings: Settings) -> Result<Measured, Failure> {
    let threads = if settings.threads == 0 { crate::machine::threads() } else { settings.threads };
    let mut measured = Measured::new(name, n).with("width", camera.width).with("height", camera.height);
    let (mut outside, mut traced, mut counts) = (Vec::new(), Duration::ZERO, None);
    // The first frame makes what later ones find: threads, pipelines.
    for run in 0..=settings.runs {
        let start = Instant::now();
        let position = camera.shot.camera.position;
        rig.live.tick(&mut *rig.backend, position, &Budget::default()).map_err(crate::fly::live_failure)?;
        let ticket = rig.backend.submit(camera.frame()).map_err(backend_failure)?;
        let submitted = start.elapsed();
        let status = loop {
            let status = rig.backend.poll(ticket, POLL).map_err(backend_failure)?;
            if status.is_done() {
                break status;
            }
        };
        if run > 0 {
            measured.runs.push(start.elapsed());
            outside.push(submitted.as_secs_f64());
            traced += status.elapsed;
            counts = Some(status.world);
        }
    }
    outside.sort_by(f64::total_cmp);
    let world = counts.unwrap_or_default();
    let rays = world.rays.max(1) as f64;
    let seconds = (traced.as_secs_f64() / settings.runs as f64).max(1e-12);
    Ok(measured
        .with("rays", world.rays)
        .with("mrays_s", rays / seconds * 1e-6)
        .with("threads", threads)
        .with("node_visits_per_ray", world.node_visits as f64 / rays)
        .with("leaf_visits_per_ray", world.leaf_visits as f64 / rays)
        .with("exhausted", world.exhausted)
        .with("frame_cpu_s", outside[outside.len() / 2]))
}
