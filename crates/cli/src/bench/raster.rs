//! `bench render FILE --renderer raster`: passes of the preview over the image, with and without culling.

use super::render::{HEIGHT, WIDTH, internal, prepare};
use super::{Measured, Settings};
use crate::failure::Failure;
use crate::job::backend::Asked;
use orthant_resident::Frame;
use orthant_vulkan::raster::{RasterOptions, RasterReport};
use std::path::Path;
use std::time::Duration;

/// Passes of one run: the fastest of them is reported beside the time of all.
const PASSES: u32 = 8;
/// Samples of a pixel in a pass.
const SAMPLES: u32 = 4;

pub fn run(file: &Path, asked: &Asked<'_>, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let (mut backend, frame, nodes) = prepare(file, asked, settings)?;
    let frame = Frame { samples: 0..PASSES * SAMPLES, ..frame };
    let choices = [("raster", true), ("raster, no culling", false)];
    let mut results = choices.map(|(name, _)| (Measured::new(name, nodes), RasterReport::default()));
    // A first frame makes the pipelines, and takes turns with nobody.
    for run in 0..=settings.runs {
        for ((measured, report), (_, culls)) in results.iter_mut().zip(choices) {
            let options = RasterOptions { culls, ..RasterOptions::default() };
            let mut once = || -> Result<(), Failure> {
                let ticket = backend.submit_raster(frame.clone(), options)?;
                while !backend.poll(ticket, Duration::from_secs(1)).map_err(internal)?.is_done() {}
                Ok(())
            };
            if run == 0 {
                once()?;
                continue;
            }
            measured.time(once)?;
            let Some((last, _)) = backend.raster_report() else { continue };
            let fastest = report.pass_time.into_iter().chain(last.pass_time).min();
            let is_new = fastest != report.pass_time || report.pass_time.is_none();
            if is_new {
                *report = last;
            }
        }
    }
    let milliseconds = |time: Option<Duration>| time.map(|time| time.as_secs_f64() * 1e3);
    Ok(results
        .into_iter()
        .map(|(measured, report)| {
            measured
                .with("width", WIDTH)
                .with("height", HEIGHT)
                .with("passes", PASSES)
                .with("drawn", report.drawn)
                .with("pass_ms", milliseconds(report.pass_time))
                .with("cull_ms", milliseconds(report.cull_time))
                .with("backend", backend.name())
                .with("device", backend.device())
        })
        .collect())
}
