//! Whether a batch fits the resident scene: checked before anything is written, so that a refused batch changes nothing.

use crate::backend::BackendError;
use crate::batch::{RowWrites, SceneBatch};
use crate::image::ImageData;
use crate::rows::{MeshDesc, NodeFlags};

/// How much is resident: the number of rows by buffer, and what a batch is held against.
#[derive(Clone, Copy, Debug, Default)]
pub struct Resident<'r> {
    /// The revision.
    pub revision: u64,
    /// Rows.
    pub positions: usize,
    /// Rows.
    pub vertices: usize,
    /// Rows.
    pub indices: usize,
    /// Rows.
    pub tangents: usize,
    /// The rows themselves.
    pub mesh_descs: &'r [MeshDesc],
    /// Rows.
    pub textures: usize,
    /// Rows.
    pub materials: usize,
    /// Rows.
    pub lights: usize,
    /// Rows.
    pub emitter_triangles: usize,
    /// Rows.
    pub emitters: usize,
    /// Rows.
    pub render_nodes: usize,
    /// Slots.
    pub images: usize,
}

/// Checks every part of the batch.
///
/// # Errors
/// The first fault: [`BackendError::StaleRevision`] for a batch that starts from another revision,
/// [`BackendError::InvalidBatch`] for one whose parts contradict each other.
pub fn check_batch(scene: Resident<'_>, batch: &SceneBatch) -> Result<(), BackendError> {
    if batch.expected_revision != scene.revision {
        return Err(BackendError::StaleRevision { expected: batch.expected_revision, resident: scene.revision });
    }
    if batch.vertices.len != batch.positions.len {
        return Err(BackendError::InvalidBatch(format!(
            "there are {} positions, but {} vertices; the streams are parallel",
            batch.positions.len, batch.vertices.len
        )));
    }
    if !(batch.scene_radius > 0.0 && batch.scene_radius.is_finite()) {
        return Err(BackendError::InvalidBatch(format!(
            "the scene's radius is {}; it must be positive",
            batch.scene_radius
        )));
    }
    for write in &batch.images {
        if let Some(image) = &write.image
            && !is_sound(image)
        {
            return Err(BackendError::InvalidBatch(format!(
                "image {}: a level is empty or leads outside the texels",
                write.slot
            )));
        }
    }
    check_writes("positions", &batch.positions, scene.positions)?;
    check_writes("vertices", &batch.vertices, scene.vertices)?;
    check_writes("indices", &batch.indices, scene.indices)?;
    check_writes("tangents", &batch.tangents, scene.tangents)?;
    check_writes("mesh_descs", &batch.mesh_descs, scene.mesh_descs.len())?;
    check_writes("textures", &batch.textures, scene.textures)?;
    check_writes("materials", &batch.materials, scene.materials)?;
    check_writes("lights", &batch.lights, scene.lights)?;
    check_writes("emitter_triangles", &batch.emitter_triangles, scene.emitter_triangles)?;
    check_writes("emitters", &batch.emitters, scene.emitters)?;
    check_writes("render_nodes", &batch.render_nodes, scene.render_nodes)?;

    for range in &batch.render_nodes.ranges {
        for (index, row) in (range.first..).zip(&range.rows) {
            if row.flags & NodeFlags::OCCUPIED != 0 && row.primitive >= batch.mesh_descs.len {
                let count = batch.mesh_descs.len;
                return fault(format!("render_nodes: row {index} shows RenderPrimitive {} of {count}", row.primitive));
            }
        }
    }
    let image_slots = scene.images + batch.images.len();
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
        let desc = desc_after(scene.mesh_descs, batch, primitive);
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
fn desc_after(resident: &[MeshDesc], batch: &SceneBatch, primitive: u32) -> MeshDesc {
    let ranges = &batch.mesh_descs.ranges;
    let after = ranges.partition_point(|range| range.first <= primitive);
    let written = ranges[..after].last().and_then(|range| range.rows.get((primitive - range.first) as usize));
    // Rows that are not written are old ones: `check_writes` has seen that new ones are covered.
    *written.unwrap_or_else(|| &resident[primitive as usize])
}

fn is_sound(image: &ImageData) -> bool {
    let max = i32::MAX as u32 / 4;
    !image.levels.is_empty()
        && image.levels.iter().all(|level| {
            let bytes = u64::from(level.width) * u64::from(level.height) * image.format.bytes() as u64;
            let end = (level.offset as u64).checked_add(bytes);
            (1..max).contains(&level.width)
                && (1..max).contains(&level.height)
                && end.is_some_and(|end| end <= image.texels.len() as u64)
        })
}
