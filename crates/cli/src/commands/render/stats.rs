//! `--stats`: what the work took.

use super::Plan;
use crate::failure::Failure;
use crate::job::Rendering;
use crate::job::backend::backend_failure;
use crate::output::write_bytes;
use orthant_render::world::DerivedWorld;
use orthant_resident::world::SetSlot;
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

/// Times that the rendering does not know.
#[derive(Clone, Copy, Debug, Default)]
pub struct Times {
    /// Loading files.
    pub load: Duration,
    /// Deriving what is resident.
    pub derive: Duration,
    /// Making the sky, or reading a map.
    pub environment: Duration,
    /// All of it.
    pub total: Duration,
}

/// Writes the statistics.
///
/// # Errors
/// A device that is gone; an I/O error.
pub fn write_stats(path: &Path, plan: &Plan, work: &mut Rendering<'_>, times: &Times) -> Result<(), Failure> {
    let gpu = work.backend.stage_times().map_err(backend_failure)?;
    let Rendering { backend, spent, applied, upload, .. } = work;
    let bytes = backend.resident_bytes();
    let world = backend.world_bytes(SetSlot::Active);
    let world_bytes = world.nodes + world.leaves + world.payload + world.palette;
    let seconds = spent.time.as_secs_f64();
    let structures = applied.blas_time + applied.tlas_time;
    let rate = |count: u64| if seconds > 0.0 { count as f64 / seconds * 1e-6 } else { 0.0 };
    let mut stats = json!({
        "backend": backend.name(),
        "device": backend.device(),
        "width": plan.width,
        "height": plan.height,
        "samples": spent.samples,
        "load_s": times.load.as_secs_f64(),
        "derive_s": times.derive.as_secs_f64(),
        "environment_s": times.environment.as_secs_f64(),
        "upload_s": upload.saturating_sub(structures).as_secs_f64(),
        "blas_s": applied.blas_time.as_secs_f64(),
        "tlas_s": applied.tlas_time.as_secs_f64(),
        "render_s": seconds,
        "total_s": times.total.as_secs_f64(),
        "rays": {
            "camera": spent.rays.camera,
            "bounce": spent.rays.bounce,
            "shadow": spent.rays.shadow,
            "total": spent.rays.total(),
        },
        "mrays_s": rate(spent.rays.total()),
        "msamples_s": rate(spent.samples),
        "blas_built": applied.blas_built,
        "upload_bytes": applied.bytes,
        "memory": {
            "geometry": bytes.geometry,
            "acceleration": bytes.acceleration,
            "images": bytes.images,
            "rows": bytes.rows,
            "total": bytes.geometry + bytes.acceleration + bytes.images + bytes.rows + world_bytes,
        },
        "discarded_contributions": backend.discarded_contributions(),
        "gpu": gpu,
    });
    if let Some((report, bytes)) = plan.raster.and_then(|_| backend.raster_report()) {
        stats["raster"] = json!({
            "passes": report.passes,
            "drawn": report.drawn,
            "pass_s": report.pass_time.map(|time| time.as_secs_f64()),
            "cull_s": report.cull_time.map(|time| time.as_secs_f64()),
            "bytes": bytes,
        });
    }
    if let Some(derived) = work.subject.world {
        stats["world"] = world_stats(derived, work);
    }
    write_bytes(path, format!("{stats:#}\n").as_bytes())
}

/// What of a world is resident, and the work of its rays.
fn world_stats(derived: &DerivedWorld, work: &Rendering<'_>) -> Value {
    let (sets, counts) = (derived.stats(), work.spent.world);
    let bytes = work.backend.world_bytes(SetSlot::Active);
    let per_ray = |count: u64| if counts.rays > 0 { count as f64 / counts.rays as f64 } else { 0.0 };
    let seconds = work.spent.time.as_secs_f64();
    json!({
        "leaves": { "uniform": sets.uniform_leaves, "chunk_array": sets.chunk_leaves },
        "dense_chunks": sets.dense_chunks,
        "depth": sets.depth,
        "memory": { "nodes": bytes.nodes, "leaves": bytes.leaves, "payload": bytes.payload, "palette": bytes.palette },
        "rays": counts.rays,
        "mrays_s": if seconds > 0.0 { counts.rays as f64 / seconds * 1e-6 } else { 0.0 },
        "node_visits_per_ray": per_ray(counts.node_visits),
        "leaf_visits_per_ray": per_ray(counts.leaf_visits),
        "dda_steps_per_ray": per_ray(counts.dda_steps),
        "exhausted": counts.exhausted,
    })
}
