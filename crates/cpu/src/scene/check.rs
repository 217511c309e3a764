//! Whether a batch fits the resident scene: checked before anything is written, so that a refused batch changes nothing.

use super::ResidentScene;
use orthant_resident::backend::BackendError;
use orthant_resident::batch::{RowWrites, SceneBatch};
use orthant_resident::rows::{MeshDesc, NodeFlags};

/// Checks every part of the batch; the first fault is the error.
pub(super) fn check(scene: &ResidentScene, batch: &SceneBatch) -> Result<(), BackendError> {
    check_writes("positions", &batch.positions, scene.positions.len())?;
    check_writes("vertices", &batch.vertices, scene.vertices.len())?;
    check_writes("indices", &batch.indices, scene.indices.len())?;
    check_writes("tangents", &batch.tangents, scene.tangents.len())?;
    check_writes("mesh_descs", &batch.mesh_descs, scene.mesh_descs.len())?;
    check_writes("textures", &batch.textures, scene.textures.len())?;
    check_writes("materials", &batch.materials, scene.materials.len())?;
    check_writes("lights", &batch.lights, scene.lights.len())?;
    check_writes("emitter_triangles", &batch.emitter_triangles, scene.emitter_triangles.len())?;
    check_writes("emitters", &batch.emitters, scene.emitters.len())?;
    check_writes("render_nodes", &batch.render_nodes, scene.render_nodes.len())?;

    for range in &batch.render_nodes.ranges {
        for (index, row) in (range.first..).zip(&range.rows) {
            if row.flags & NodeFlags::OCCUPIED != 0 && row.primitive >= batch.mesh_descs.len {
                let count = batch.mesh_descs.len;
                return fault(format!("render_nodes: row {index} shows RenderPrimitive {} of {count}", row.primitive));
            }
        }
    }
    let image_slots = scene.images.len() + batch.images.len();
    if let Some(write) = batch.images.iter().find(|write| write.slot as usize >= image_slots) {
        return fault(format!("image slot {} would leave a gap: {image_slots} slots are possible", write.slot));
    }
    let lists =
        [("blas_builds", &batch.blas_builds), ("blas_updates", &batch.blas_updates), ("blas_frees", &batch.blas_frees)];
    for (name, list) in lists {
        if !list.is_sorted_by(|a, b| a < b) {
            return fault(format!("{name} is not in ascending order"));
        }
        if let Some(&last) = list.last()
            && last >= batch.mesh_descs.len
        {
            return fault(format!("{name} names RenderPrimitive {last} of {}", batch.mesh_descs.len));
        }
    }
    for &primitive in batch.blas_builds.iter().chain(&batch.blas_updates) {
        let desc = desc_after(scene, batch, primitive);
        let within = |first: u32, count: u32, len: u32| u64::from(first) + u64::from(count) <= u64::from(len);
        if !within(desc.first_vertex, desc.vertex_count, batch.positions.len)
            || !within(desc.first_index, desc.index_count, batch.indices.len)
        {
            return fault(format!("the MeshDesc of RenderPrimitive {primitive} leads outside the streams"));
        }
    }
    Ok(())
}

fn fault<T>(message: String) -> Result<T, BackendError> {
    Err(BackendError::InvalidBatch(message))
}

fn check_writes<T>(name: &str, writes: &RowWrites<T>, old_len: usize) -> Result<(), BackendError> {
    // Rows past the old length that no range has covered yet begin here.
    let mut uncovered = old_len as u64;
    let mut end = 0;
    for range in &writes.ranges {
        let first = u64::from(range.first);
        if first < end {
            return fault(format!("{name}: the range at row {first} overlaps the one before or is out of order"));
        }
        end = first + range.rows.len() as u64;
        if end > u64::from(writes.len) {
            return fault(format!("{name}: the range {first}..{end} leads outside {} rows", writes.len));
        }
        if first <= uncovered {
            uncovered = uncovered.max(end);
        }
    }
    if uncovered < u64::from(writes.len) {
        return fault(format!("{name}: row {uncovered} is new, but not written"));
    }
    Ok(())
}

/// The row as it will be.
fn desc_after(scene: &ResidentScene, batch: &SceneBatch, primitive: u32) -> MeshDesc {
    let ranges = &batch.mesh_descs.ranges;
    let after = ranges.partition_point(|range| range.first <= primitive);
    let written = ranges[..after].last().and_then(|range| range.rows.get((primitive - range.first) as usize));
    // Rows that are not written are old ones: `check_writes` has seen that new ones are covered.
    *written.unwrap_or_else(|| &scene.mesh_descs[primitive as usize])
}
