//! `orthant world info`, and `orthant info` of a world: what it holds.

use crate::args::Common;
use crate::commands::info::print_info;
use crate::failure::Failure;
use crate::job::{LoadedWorld, load_world};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Prints the counts.
///
/// # Errors
/// A bad world (bad input).
pub fn run(file: &Path, as_json: bool, salvage: bool, common: &Common) -> Result<(), Failure> {
    let loaded = load_world(file, salvage, common.max_memory())?;
    if !as_json && !common.quiet {
        loaded.print_warnings();
    }
    print_info(describe(&loaded), as_json)
}

/// The counts, as the documentation names them.
fn describe(loaded: &LoadedWorld) -> Map<String, Value> {
    let world = &loaded.world;
    let stats = world.stats();
    let palette: Vec<&str> = world.palette().iter().map(|(_, material)| &*material.name).collect();
    let info = json!({
        "format": loaded.format.name(),
        "dimensions": if stats.is_three_dimensional { 3 } else { 4 },
        "regions": world.region_count(),
        "leaves": {
            "uniform": stats.uniform,
            "chunk_array": stats.chunk_arrays,
            "tetra": world.bodies().len(),
        },
        "dense_chunks": stats.dense_chunks,
        "blocks": count(stats.blocks),
        "volume": stats.solid_volume,
        "bounds": world.solid_bounds(),
        "materials": palette,
        "bytes": { "file": loaded.file_bytes, "chunks": stats.chunk_bytes, "regions": stats.region_bytes },
        "warnings": loaded.warnings,
    });
    let Value::Object(info) = info else { unreachable!("the macro was given an object") };
    info
}

/// A number of blocks: whole numbers as such, as long as all of them can be told apart.
fn count(blocks: f64) -> Value {
    let rounded = blocks.round();
    if rounded < 9_007_199_254_740_992.0 { json!(rounded as u64) } else { json!(rounded) }
}
