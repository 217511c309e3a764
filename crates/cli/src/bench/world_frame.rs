//! `bench world-frame`: frames of a world of platforms, by how far they see.

use super::world::{Platforms, Rig, internal};
use super::{Measured, Settings};
use crate::failure::Failure;
use crate::fly::Camera;
use crate::job::backend::{Asked, backend_failure, open};
use crate::job::world_view::WorldShot;
use orthant_render::sky::{DEFAULT_SUN, clear_sky};
use orthant_render::world::live::{Budget, LiveOptions, LiveWorld};
use orthant_render::world::view::{Mode, Turns, WorldCamera, position};
use std::time::{Duration, Instant};

/// View distances in units.
const DISTANCES: [u32; 4] = [80, 320, 1280, 2560];
/// Half extent of the world in units: the farthest view reaches its end.
const HALF_EXTENT: i32 = 2080;
/// Layers of the integral, and its size in pixels.
const INTEGRAL: (u32, u32, u32) = (128, 192, 108);
/// Size of the slice in pixels.
const SLICE: (u32, u32) = (960, 540);
/// How long a backend works between two looks.
const POLL: Duration = Duration::from_secs(1);

/// Measures frames over all distances, or the one of `settings.size` units.
pub fn run(asked: &Asked<'_>, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let live = LiveWorld::new(Platforms::world(HALF_EXTENT)?, LiveOptions::default()).map_err(internal)?;
    let mut rig = Rig::new(live, open(asked)?)?;
    let environment = clear_sky(DEFAULT_SUN);
    rig.backend.set_environment(environment.clone()).map_err(backend_failure)?;
    let (layers, width, height) = INTEGRAL;
    let integral = Mode::Integral { layers, hidden_zoom: 1.0, mix: 8.0 };
    let mut results = Vec::new();
    for distance in settings.size.map_or(DISTANCES.to_vec(), |distance| vec![distance]) {
        for (name, mode, (width, height)) in [("slice", Mode::Slice, SLICE), ("integral", integral, (width, height))] {
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
        }
    }
    Ok(results)
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
