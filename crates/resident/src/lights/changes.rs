//! What a batch may change about lights, and what following it costs.

use crate::SceneBatch;
use crate::batch::RowWrites;
use crate::rows::NONE;
use crate::sampling::LightTree;
use crate::sampling::light_tree::LightTreeWrites;

/// Rows that a batch may make others for light sampling. It is taken before the batch is applied: an instance that ceases to
/// emit says so by its old row.
#[derive(Clone, Debug, PartialEq)]
pub struct LightChanges {
    /// Written rows of the light buffer.
    pub lights: Vec<u32>,
    /// Length of the light buffer before the batch.
    pub lights_len: usize,
    /// Rows of the emitter buffer that are written, or of which an instance is or was one. Some are named twice.
    pub emitters: Vec<u32>,
    /// RenderPrimitives whose geometry is written.
    pub primitives: Vec<u32>,
    /// Radius of the scene after the batch, in metres.
    pub scene_radius: f32,
}

impl LightChanges {
    /// Of a batch on a scene with `lights_len` rows in its light buffer; `emitter_of` gives the emitter of a row of its
    /// render-node buffer, or [`NONE`]. O(the batch).
    pub fn new(lights_len: usize, emitter_of: impl Fn(u32) -> u32, batch: &SceneBatch) -> Self {
        let mut emitters: Vec<u32> = written(&batch.emitters).collect();
        for (row, new) in batch.render_nodes.ranges.iter().flat_map(|range| (range.first..).zip(&range.rows)) {
            let old = emitter_of(row);
            emitters.extend([old, new.emitter].into_iter().filter(|&emitter| emitter != NONE));
        }
        Self {
            lights: written(&batch.lights).collect(),
            lights_len,
            emitters,
            primitives: written(&batch.mesh_descs)
                .chain(batch.blas_builds.iter().chain(&batch.blas_updates).copied())
                .collect(),
            scene_radius: batch.scene_radius,
        }
    }
}

fn written<T>(writes: &RowWrites<T>) -> impl Iterator<Item = u32> {
    writes.ranges.iter().flat_map(|range| range.first..range.first + range.rows.len() as u32)
}

/// What of the tables a batch has changed: what a copy of them has to write.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightWrites {
    /// Emitters that were looked at, ascending: those whose quad may be another.
    pub emitters: Vec<u32>,
    /// What was written of the tree over emitters, if it was touched.
    pub emitter_tree: Option<LightTreeWrites>,
    /// What was written of the tree over punctual lights, if any light was touched; the lists of lights that shine may be
    /// others then, too.
    pub punctual: Option<LightTreeWrites>,
    /// What it has cost.
    pub work: LightWork,
}

/// What following a batch has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightWork {
    /// Light and emitter rows that were looked at.
    pub rows: u64,
    /// Nodes of light trees that were looked at.
    pub visited: u64,
    /// Nodes of light trees that were written.
    pub written: u64,
}

impl LightWork {
    pub(super) fn count(&mut self, rows: usize, tree: &mut LightTree) -> LightTreeWrites {
        let writes = tree.take_writes();
        self.rows += rows as u64;
        self.visited += tree.take_counters().visited;
        self.written += writes.nodes.len() as u64;
        writes
    }
}
