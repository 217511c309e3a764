//! `orthant bench`: figures that the documentation quotes, each measured beside its peer in the same run.
//!
//! Timings on shared machines are noisy. So every figure is a median of repetitions, peers take turns with what they are
//! compared to, and ratios are of medians of one run.

mod bvh;
mod derive;
mod edit;
mod load;
mod memory;
mod raster;
mod render;
mod resident;
mod trace;
mod world;
mod world_edit;
mod world_frame;

use crate::failure::Failure;
use crate::job::backend::Asked;
use crate::job::{self, LoadOptions, Loaded};
use serde_json::{Map, Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// One figure of a suite.
#[derive(Clone, Debug)]
pub struct Measured {
    /// What was measured.
    pub name: String,
    /// Its size: nodes, triangles, rays, or what the suite says.
    pub n: u64,
    /// Time of each run.
    pub runs: Vec<Duration>,
    /// More figures.
    pub counters: Map<String, Value>,
}

impl Measured {
    /// A figure without runs yet.
    fn new(name: &str, n: u64) -> Self {
        Self { name: name.to_owned(), n, runs: Vec::new(), counters: Map::new() }
    }

    /// Adds a counter.
    fn with(mut self, key: &str, value: impl Into<Value>) -> Self {
        self.counters.insert(key.to_owned(), value.into());
        self
    }

    /// Times one more run and gives what it returns.
    fn time<T>(&mut self, run: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let value = run();
        self.runs.push(start.elapsed());
        value
    }

    /// Median of the runs in seconds; 0 without any.
    fn median_s(&self) -> f64 {
        let mut seconds: Vec<f64> = self.runs.iter().map(Duration::as_secs_f64).collect();
        seconds.sort_by(f64::total_cmp);
        seconds.get(seconds.len() / 2).copied().unwrap_or(0.0)
    }

    fn to_json(&self) -> Value {
        let seconds = || self.runs.iter().map(Duration::as_secs_f64);
        let mut object = Map::new();
        object.insert("name".into(), json!(self.name));
        object.insert("n".into(), json!(self.n));
        object.insert("median_s".into(), json!(self.median_s()));
        object.insert("min_s".into(), json!(seconds().reduce(f64::min)));
        object.insert("max_s".into(), json!(seconds().reduce(f64::max)));
        object.insert("runs".into(), json!(self.runs.len()));
        object.extend(self.counters.clone());
        Value::Object(object)
    }
}

/// What to run.
#[derive(Clone, Copy, Debug)]
pub enum Suite<'a> {
    /// File to decoded arenas, beside the `gltf` crate.
    Load(&'a Path),
    /// Model to rows, beside copying the rows.
    Derive,
    /// Rays through the resident scene, beside `obvhs`.
    Trace(&'a Path),
    /// Whole frames, by a backend on a device.
    Render(&'a Path, Asked<'a>),
    /// Passes of the raster preview, likewise.
    Raster(&'a Path, Asked<'a>),
    /// A derived scene to a resident one, of a file or of made instances.
    Resident(Option<&'a Path>, Asked<'a>),
    /// Edit, sync and apply, by a backend on a device.
    Edit(Asked<'a>),
    /// Bounding volume hierarchies, beside `obvhs`.
    Bvh,
    /// Edits of a live world, by a backend on a device.
    WorldEdit(Asked<'a>),
    /// Frames of a world, likewise.
    WorldFrame(Asked<'a>),
}

impl Suite<'_> {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Load(_) => "load",
            Self::Derive => "derive",
            Self::Trace(_) => "trace",
            Self::Render(..) | Self::Raster(..) => "render",
            Self::Resident(..) => "resident",
            Self::Edit(..) => "edit",
            Self::Bvh => "bvh",
            Self::WorldEdit(_) => "world-edit",
            Self::WorldFrame(_) => "world-frame",
        }
    }
}

/// How to run it.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Repetitions of each measurement, at least 1.
    pub runs: usize,
    /// Threads of what is measured; 0 takes all.
    pub threads: usize,
    /// Most bytes that inputs may take.
    pub max_memory: u64,
    /// The size of what is made to be measured, in place of the suite's own sizes.
    pub size: Option<u32>,
}

/// Runs a suite and gives its document: `{ suite, machine, results: [...] }`.
///
/// # Errors
/// A scene that cannot be loaded.
pub fn run(suite: Suite, settings: Settings) -> Result<Value, Failure> {
    let results = match suite {
        Suite::Load(file) => load::run(file, settings)?,
        Suite::Derive => derive::run(settings)?,
        Suite::Trace(file) => trace::run(file, settings)?,
        Suite::Render(file, asked) => render::run(file, &asked, settings)?,
        Suite::Raster(file, asked) => raster::run(file, &asked, settings)?,
        Suite::Resident(file, asked) => resident::run(file, &asked, settings)?,
        Suite::Edit(asked) => edit::run(&asked, settings)?,
        Suite::Bvh => bvh::run(settings),
        Suite::WorldEdit(asked) => world_edit::run(&asked, settings)?,
        Suite::WorldFrame(asked) => world_frame::run(&asked, settings)?,
    };
    Ok(json!({
        "suite": suite.name(),
        "machine": machine(),
        "results": results.iter().map(Measured::to_json).collect::<Vec<_>>(),
    }))
}

/// A scene as `render` loads it.
fn load(file: &Path, settings: Settings) -> Result<Loaded, Failure> {
    let options = LoadOptions {
        scene: None,
        variant: None,
        moment: None,
        allow_external_files: false,
        max_memory: settings.max_memory,
    };
    job::load(file, &options)
}

/// What the figures were measured on.
fn machine() -> Value {
    json!({
        "cpu": crate::machine::cpu_name(),
        "threads": crate::machine::threads(),
        "memory_bytes": crate::machine::memory(),
        "os": std::env::consts::OS,
        "version": env!("CARGO_PKG_VERSION"),
    })
}

/// The document as a table for people.
pub fn table(document: &Value) -> String {
    let mut out = String::new();
    for result in document["results"].as_array().into_iter().flatten() {
        let Some(object) = result.as_object() else { continue };
        let number = |key: &str| object.get(key).and_then(Value::as_f64).unwrap_or(0.0);
        out.push_str(&format!(
            "{:<24} n = {:<10} {:>12.6} s ({:.6} .. {:.6})",
            result["name"].as_str().unwrap_or_default(),
            number("n"),
            number("median_s"),
            number("min_s"),
            number("max_s"),
        ));
        for (key, value) in object.iter().skip(6) {
            out.push_str(&format!("  {key} = {}", short(value)));
        }
        out.push('\n');
    }
    out
}

fn short(value: &Value) -> String {
    match value.as_f64() {
        Some(v) if value.is_f64() => format!("{v:.3}"),
        _ => value.as_str().map_or_else(|| value.to_string(), str::to_owned),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_the_median_of_its_runs() {
        let mut measured = Measured::new("x", 3).with("rows", 7);
        measured.runs = [5, 1, 9].map(Duration::from_secs).to_vec();
        let json = measured.to_json();
        assert_eq!(json["median_s"], 5.0);
        assert_eq!((json["min_s"].as_f64(), json["max_s"].as_f64()), (Some(1.0), Some(9.0)));
        assert_eq!((&json["runs"], &json["rows"]), (&json!(3), &json!(7)));
    }
}
