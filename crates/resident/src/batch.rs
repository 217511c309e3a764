//! [`SceneBatch`]: the writes that bring a resident model scene up to date.
//!
//! A batch is complete and explicit: it says the new length of every buffer that changes, and carries the bytes of
//! every range that it writes. A backend applies it in the order of the fields and needs nothing else.

use crate::image::ImageData;
use crate::rows::{EmitterRow, EmitterTriangle, LightRow, MaterialRow, MeshDesc, RenderNodeRow, VertexRow};
use std::sync::Arc;

/// Writes to one buffer of rows.
#[derive(Clone, Debug, PartialEq)]
pub struct RowWrites<T> {
    /// The buffer's length in rows after this batch. Rows past the old length are all covered by `ranges`.
    pub len: u32,
    /// Disjoint ranges in ascending order.
    pub ranges: Vec<RowRange<T>>,
}

/// Consecutive rows to write.
#[derive(Clone, Debug, PartialEq)]
pub struct RowRange<T> {
    /// The first row.
    pub first: u32,
    /// What to write.
    pub rows: Vec<T>,
}

impl<T: bytemuck::Pod> RowWrites<T> {
    /// Writes nothing to a buffer of `len` rows.
    pub fn none(len: u32) -> Self {
        Self { len, ranges: Vec::new() }
    }

    /// Writes a buffer whole.
    pub fn whole(rows: Vec<T>) -> Self {
        let len = u32::try_from(rows.len()).expect("row counts are checked to fit u32 when rows are made");
        Self { len, ranges: if rows.is_empty() { Vec::new() } else { vec![RowRange { first: 0, rows }] } }
    }

    /// Bytes that cross to the backend.
    pub fn bytes(&self) -> u64 {
        self.ranges.iter().map(|r| size_of_val(r.rows.as_slice()) as u64).sum()
    }

    /// Applies the writes to rows in memory. A single range that covers the whole buffer is moved, not copied.
    ///
    /// # Panics
    /// When a range lies outside `len` (a batch is made by the planner; such a batch is a bug).
    pub fn apply_to(mut self, rows: &mut Vec<T>) {
        if let [range] = self.ranges.as_mut_slice()
            && range.first == 0
            && range.rows.len() == self.len as usize
        {
            *rows = std::mem::take(&mut range.rows);
            return;
        }
        rows.resize(self.len as usize, T::zeroed());
        for range in &self.ranges {
            let first = range.first as usize;
            rows[first..first + range.rows.len()].copy_from_slice(&range.rows);
        }
    }
}

/// What is to become of the TLAS after the rows are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TlasAction {
    /// Nothing: no instance changed.
    #[default]
    None,
    /// Refit: instances moved.
    Update,
    /// Build anew: the set of active instances changed, or refits have degraded it.
    Rebuild,
}

/// One write to the image table.
#[derive(Clone, Debug)]
pub struct ImageWrite {
    /// The slot.
    pub slot: u32,
    /// The image; `None` frees the slot.
    pub image: Option<Arc<ImageData>>,
}

/// A texture: an image as one sampler reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct TextureRow {
    /// Slot of the image table.
    pub image: u32,
    /// [`crate::image::Sampling`], packed by [`crate::image::Sampling::pack`].
    pub sampling: u32,
}

/// The writes that bring a resident model scene up to date.
#[derive(Clone, Debug)]
pub struct SceneBatch {
    /// Revision of the derived scene that this batch starts from; a backend at another revision refuses it.
    pub expected_revision: u64,
    /// Revision that it reaches.
    pub new_revision: u64,
    /// Object-space positions in metres.
    pub positions: RowWrites<[f32; 3]>,
    /// Vertex attributes, parallel to `positions`.
    pub vertices: RowWrites<VertexRow>,
    /// Local vertex indices, three a triangle, counter-clockwise from the front.
    pub indices: RowWrites<u32>,
    /// Tangents per corner ([`crate::rows::encode_tangent`]), where a MeshDesc points at them.
    pub tangents: RowWrites<u32>,
    /// Geometry ranges by RenderPrimitive index.
    pub mesh_descs: RowWrites<MeshDesc>,
    /// RenderPrimitives whose BLAS is to be built, ascending.
    pub blas_builds: Vec<u32>,
    /// RenderPrimitives whose vertices have moved and whose triangles are the same, ascending: their BLAS may be updated (refitted).
    /// None of them is in `blas_builds` too.
    pub blas_updates: Vec<u32>,
    /// RenderPrimitives whose BLAS is to be dropped, ascending.
    pub blas_frees: Vec<u32>,
    /// Images.
    pub images: Vec<ImageWrite>,
    /// Textures, by the index that [`crate::rows::TextureSlot::texture`] holds.
    pub textures: RowWrites<TextureRow>,
    /// Materials.
    pub materials: RowWrites<MaterialRow>,
    /// Punctual lights.
    pub lights: RowWrites<LightRow>,
    /// Area tables of emissive primitives.
    pub emitter_triangles: RowWrites<EmitterTriangle>,
    /// Emissive render nodes.
    pub emitters: RowWrites<EmitterRow>,
    /// Instances.
    pub render_nodes: RowWrites<RenderNodeRow>,
    /// What the TLAS needs.
    pub tlas: TlasAction,
    /// Radius in metres of the scene after this batch ([`crate::extent::scene_radius`] of its rows): what lights at infinity
    /// shine on.
    pub scene_radius: f32,
}

impl SceneBatch {
    /// Bytes of rows and geometry that cross to the backend, images apart.
    pub fn upload_bytes(&self) -> u64 {
        self.positions.bytes()
            + self.vertices.bytes()
            + self.indices.bytes()
            + self.tangents.bytes()
            + self.mesh_descs.bytes()
            + self.textures.bytes()
            + self.materials.bytes()
            + self.lights.bytes()
            + self.emitter_triangles.bytes()
            + self.emitters.bytes()
            + self.render_nodes.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_written_where_they_say() {
        let mut rows = vec![1u32, 2, 3];
        let writes = RowWrites {
            len: 5,
            ranges: vec![RowRange { first: 1, rows: vec![20] }, RowRange { first: 3, rows: vec![40, 50] }],
        };
        assert_eq!(writes.bytes(), 12);
        writes.apply_to(&mut rows);
        assert_eq!(rows, [1, 20, 3, 40, 50]);
        RowWrites { len: 2, ranges: vec![] }.apply_to(&mut rows);
        assert_eq!(rows, [1, 20]);
        RowWrites::whole(vec![7]).apply_to(&mut rows);
        assert_eq!(rows, [7]);
    }
}
