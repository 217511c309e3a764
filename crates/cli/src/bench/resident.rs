//! `bench resident`: from a derived scene to one that is resident in a backend, and what it takes there.

use super::{Measured, Settings, edit};
use crate::failure::{Exit, Failure};
use crate::job::backend::{AnyBackend, Asked, backend_failure, open};
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use std::path::Path;
use std::time::Instant;

/// Instances of a thousand meshes, where no file is given.
const SIZES: [u32; 2] = [100_000, 1_000_000];

pub fn run(file: Option<&Path>, asked: &Asked<'_>, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let mut results = Vec::new();
    if let Some(file) = file {
        results.push(measure(&super::load(file, settings)?.scene, asked, settings)?);
        return Ok(results);
    }
    for n in settings.size.map_or(SIZES.to_vec(), |size| vec![size.max(2)]) {
        results.push(measure(&edit::scene(n, 1)?, asked, settings)?);
    }
    Ok(results)
}

fn measure(scene: &Scene, asked: &Asked<'_>, settings: Settings) -> Result<Measured, Failure> {
    let internal = |what: String| Failure::new(Exit::Internal, what);
    let mut backend = open(asked)?;
    backend.measure_stages();
    let mut measured = Measured::new("resident", 0);
    let (mut derive, mut loading) = (Vec::new(), serde_json::Value::Null);
    let mut triangles = 0u64;
    for _ in 0..settings.runs {
        let start = Instant::now();
        let derived = DerivedScene::derive(scene, &DeriveOptions::default());
        let mut derived = derived.map_err(|e| internal(e.to_string()))?;
        derive.push(start.elapsed().as_secs_f64());
        let built = derived.mesh_descs.iter();
        triangles = built.map(|desc| u64::from(desc.triangle_count())).sum();
        measured.n = derived.render_nodes.len() as u64;
        backend.clear().map_err(backend_failure)?;
        settle(&backend)?;
        backend.stage_times().map_err(backend_failure)?;
        let batch = derived.load_batch();
        let applied = measured.time(|| -> Result<_, Failure> {
            let applied = backend.apply(batch).map_err(backend_failure)?;
            settle(&backend)?;
            Ok(applied)
        })?;
        measured = measured.with("upload_bytes", applied.bytes);
        loading = backend.stage_times().map_err(backend_failure)?;
    }
    derive.sort_by(f64::total_cmp);
    measured = measured.with("derive_s", derive[derive.len() / 2]).with("triangles", triangles);
    // Of the last run.
    for (stage, took) in loading.as_object().into_iter().flatten().filter(|(_, took)| took.as_f64() > Some(0.0)) {
        measured = measured.with(&format!("gpu_{stage}"), took.clone());
    }
    if let Some(seconds) = loading["blas_build_s"].as_f64().filter(|seconds| *seconds > 0.0) {
        measured = measured.with("blas_mtris_s", triangles as f64 / seconds / 1e6);
    }
    let (bytes, nodes) = (backend.resident_bytes(), measured.n.max(1) as f64);
    measured = measured
        .with("geometry_bytes", bytes.geometry)
        .with("image_bytes", bytes.images)
        .with("acceleration_bytes", bytes.acceleration);
    if let AnyBackend::Vulkan(vulkan) = &backend {
        let parts = vulkan.acceleration_bytes();
        measured = measured
            .with("blas_bytes", parts.blas)
            .with("tlas_bytes", parts.tlas)
            .with("scratch_bytes", parts.scratch)
            .with("bytes_per_node", (bytes.rows + parts.instances) as f64 / nodes)
            .with("tlas_bytes_per_node", parts.tlas as f64 / nodes);
    } else {
        measured = measured.with("bytes_per_node", bytes.rows as f64 / nodes);
    }
    Ok(measured.with("backend", backend.name()).with("device", backend.device()))
}

/// Waits until a device has done everything.
fn settle(backend: &AnyBackend) -> Result<(), Failure> {
    if let AnyBackend::Vulkan(vulkan) = backend {
        while !vulkan.is_idle().map_err(|e| backend_failure(e.into()))? {
            std::thread::yield_now();
        }
    }
    Ok(())
}
