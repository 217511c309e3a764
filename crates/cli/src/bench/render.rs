//! `bench render FILE`: whole frames through the backend, as `render` makes them.

use super::{Measured, Settings};
use crate::failure::{Exit, Failure};
use crate::job::backend::{AnyBackend, Asked, open};
use crate::job::environment::lights_itself;
use orthant_render::camera::View;
use orthant_render::sky;
use orthant_resident::frame::{Estimator, Frame, PixelFilter, Tile};
use orthant_resident::{Environment, TicketStatus};
use std::path::Path;
use std::time::Duration;

pub(super) const WIDTH: u32 = 960;
pub(super) const HEIGHT: u32 = 540;
const SAMPLES: u32 = 16;

pub(super) fn internal(error: orthant_resident::BackendError) -> Failure {
    Failure::new(Exit::Internal, error.to_string())
}

/// A backend with a scene, as `render` makes it, and a frame of what its first camera sees.
pub(super) fn prepare(file: &Path, asked: &Asked<'_>, settings: Settings) -> Result<(AnyBackend, Frame, u64), Failure> {
    let mut loaded = super::load(file, settings)?;
    let mut backend = open(asked)?;
    backend.measure_stages();
    let environment = if lights_itself(&loaded) { Environment::none() } else { sky::clear_sky(sky::DEFAULT_SUN) };
    backend.set_environment(environment).map_err(internal)?;
    let batch = loaded.derived.load_batch();
    let nodes = u64::from(batch.render_nodes.len);
    backend.apply(batch).map_err(internal)?;
    let (scene, derived) = (&loaded.scene, &loaded.derived);
    let aspect = f64::from(WIDTH) / f64::from(HEIGHT);
    let view =
        View::first_camera(scene, derived, aspect).or_else(|| derived.bounds().map(|b| View::framing(b, aspect)));
    let Some(view) = view else { return Err(Failure::bad_input(file, "the scene shows nothing")) };
    let frame = Frame {
        camera: view.to_camera(derived.origin),
        width: WIDTH,
        height: HEIGHT,
        tile: Tile { x: 0, y: 0, width: WIDTH, height: HEIGHT },
        samples: 0..SAMPLES,
        keep_blocks: false,
        seed: 0,
        max_depth: 8,
        roulette_depth: 3,
        firefly_clamp: None,
        estimator: Estimator::Mis,
        filter: PixelFilter::BlackmanHarris { radius: 1.5 },
        aovs: Vec::new(),
        threads: settings.threads,
        world: None,
    };
    Ok((backend, frame, nodes))
}

pub fn run(file: &Path, asked: &Asked<'_>, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let (mut backend, frame, _) = prepare(file, asked, settings)?;
    let samples = u64::from(WIDTH) * u64::from(HEIGHT) * u64::from(SAMPLES);
    let loading = backend.stage_times().map_err(internal)?;
    let mut measured = Measured::new("render", samples);
    let mut rays = 0;
    for _ in 0..settings.runs {
        let status = measured.time(|| -> Result<TicketStatus, Failure> {
            let ticket = backend.submit(frame.clone()).map_err(internal)?;
            loop {
                let status = backend.poll(ticket, Duration::from_secs(1)).map_err(internal)?;
                if status.is_done() {
                    return Ok(status);
                }
            }
        })?;
        rays = status.rays.total();
    }
    let seconds = measured.median_s();
    // Of the frames an average, of the load all.
    let frames = backend.stage_times().map_err(internal)?;
    let per_frame = |stage: &str| frames[stage].as_f64().map(|seconds| seconds / settings.runs as f64);
    if let (Some(trace), Some(stages)) = (per_frame("trace_s"), loading.as_object()) {
        measured = measured.with("gpu_trace_s", trace);
        for (stage, took) in stages.iter().filter(|(_, took)| took.as_f64() > Some(0.0)) {
            measured = measured.with(&format!("gpu_{stage}"), took.clone());
        }
    }
    Ok(vec![
        measured
            .with("width", WIDTH)
            .with("height", HEIGHT)
            .with("spp", SAMPLES)
            .with("rays", rays)
            .with("msamples_s", samples as f64 / seconds / 1e6)
            .with("mrays_s", rays as f64 / seconds / 1e6)
            .with("backend", backend.name())
            .with("device", backend.device()),
    ])
}
