//! `bench load FILE`: from the file to decoded arenas, images included, beside the `gltf` crate's own import (which reads
//! buffers and decodes images, and leaves accessors as they are).

use super::{Measured, Settings, memory};
use crate::failure::Failure;
use std::path::Path;

/// Bytes of what was decoded.
struct Decoded {
    geometry: u64,
    images: u64,
}

pub fn run(file: &Path, settings: Settings) -> Result<Vec<Measured>, Failure> {
    // Memory first: later runs find freed memory that the allocator kept.
    let (first, peak) = memory::peak_of(|| load(file, settings));
    let decoded = first?;
    let bytes = std::fs::metadata(file).map_or(0, |m| m.len());
    let mut ours = Measured::new("load", bytes);
    let mut theirs = Measured::new("load_gltf_crate", bytes);
    for _ in 0..settings.runs {
        ours.time(|| load(file, settings)).map(drop)?;
        if theirs.counters.is_empty()
            && let Err(error) = theirs.time(|| gltf::import(file).map(drop))
        {
            theirs.runs.clear();
            theirs = theirs.with("refused", error.to_string());
        }
    }
    if theirs.median_s() > 0.0 {
        ours = ours.clone().with("ratio_to_gltf_crate", ours.median_s() / theirs.median_s());
    }
    let total = decoded.geometry + decoded.images;
    let mut memory = Measured::new("peak_bytes", bytes).with("bytes", peak);
    if let Some(peak) = peak.filter(|_| total > 0) {
        memory = memory.with("ratio_to_decoded", peak as f64 / total as f64);
    }
    let sizes = Measured::new("decoded_bytes", bytes)
        .with("bytes", total)
        .with("geometry", decoded.geometry)
        .with("images", decoded.images);
    Ok(vec![ours, theirs, memory, sizes])
}

fn load(file: &Path, settings: Settings) -> Result<Decoded, Failure> {
    let mut loaded = super::load(file, settings)?;
    let batch = std::hint::black_box(loaded.derived.load_batch());
    let images = batch.images.iter().filter_map(|w| w.image.as_ref()).map(|i| i.texels.len() as u64).sum();
    Ok(Decoded { geometry: batch.upload_bytes(), images })
}
