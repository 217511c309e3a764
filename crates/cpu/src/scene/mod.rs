//! [`ResidentScene`]: what is resident in memory, and how a batch changes it.

#[cfg(test)]
mod follow_tests;
mod lights;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod users;

use crate::accel::{Blas, Tlas, TlasWork};
use crate::trace::{self, Hit, Ray};
use glam::Vec3;
use orthant_resident::backend::{ApplyReport, BackendError, ResidentBytes};
use orthant_resident::batch::{RowWrites, SceneBatch, TextureRow};
use orthant_resident::check::{Resident, check_batch};
use orthant_resident::compare::Rows;
use orthant_resident::image::ImageData;
use orthant_resident::rows::{
    EmitterRow, EmitterTriangle, LightRow, Mat3x4, MaterialRow, MeshDesc, NodeFlags, RenderNodeRow, VertexRow,
};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;
use users::PrimitiveUsers;

/// Every stream and row of a model scene, and the acceleration structures over them. It changes by
/// [`ResidentScene::apply`] alone; the fields are public to be read.
#[derive(Clone, Debug, Default)]
pub struct ResidentScene {
    /// Object-space positions in metres.
    pub positions: Vec<[f32; 3]>,
    /// Vertex attributes, parallel to `positions`.
    pub vertices: Vec<VertexRow>,
    /// Vertex indices, local to their MeshDesc, three a triangle.
    pub indices: Vec<u32>,
    /// Tangents per corner.
    pub tangents: Vec<u32>,
    /// Geometry ranges by RenderPrimitive.
    pub mesh_descs: Vec<MeshDesc>,
    /// Images by slot.
    pub images: Vec<Option<Arc<ImageData>>>,
    /// Textures.
    pub textures: Vec<TextureRow>,
    /// Materials.
    pub materials: Vec<MaterialRow>,
    /// Punctual lights.
    pub lights: Vec<LightRow>,
    /// Area tables of emissive primitives.
    pub emitter_triangles: Vec<EmitterTriangle>,
    /// Emissive render nodes.
    pub emitters: Vec<EmitterRow>,
    /// Instances.
    pub render_nodes: Vec<RenderNodeRow>,
    /// The revision that the last batch reached.
    pub revision: u64,
    /// BLAS by RenderPrimitive.
    pub blas: Vec<Option<Blas>>,
    /// The TLAS over `render_nodes`.
    pub tlas: Tlas,
    /// What the last batch took of it.
    pub tlas_work: TlasWork,
    users: PrimitiveUsers,
}

impl ResidentScene {
    /// An empty scene at revision 0.
    pub fn new() -> Self {
        Self::default()
    }

    /// Brings the scene up to date. The TLAS follows the rows that are written, and the BLAS that are built, at their cost;
    /// [`SceneBatch::tlas`] is for devices whose TLAS cannot be edited.
    ///
    /// # Errors
    /// [`BackendError::StaleRevision`] for a batch that starts from another revision, [`BackendError::InvalidBatch`]
    /// for one whose parts contradict each other. The scene is then unchanged.
    pub fn apply(&mut self, batch: SceneBatch) -> Result<ApplyReport, BackendError> {
        check_batch(self.lengths(), &batch)?;
        let mut report = ApplyReport { bytes: batch.upload_bytes(), ..Default::default() };

        // Write the streams and rows
        batch.positions.apply_to(&mut self.positions);
        batch.vertices.apply_to(&mut self.vertices);
        batch.indices.apply_to(&mut self.indices);
        batch.tangents.apply_to(&mut self.tangents);
        batch.mesh_descs.apply_to(&mut self.mesh_descs);
        for write in batch.images {
            let slot = write.slot as usize;
            if slot >= self.images.len() {
                self.images.resize(slot + 1, None);
            }
            self.images[slot] = write.image;
        }
        batch.textures.apply_to(&mut self.textures);
        batch.materials.apply_to(&mut self.materials);
        batch.lights.apply_to(&mut self.lights);
        batch.emitter_triangles.apply_to(&mut self.emitter_triangles);
        batch.emitters.apply_to(&mut self.emitters);
        let mut changed = self.write_render_nodes(batch.render_nodes);

        // Build and free BLAS
        let start = Instant::now();
        self.blas.resize(self.mesh_descs.len(), None);
        for &primitive in &batch.blas_frees {
            self.blas[primitive as usize] = None;
        }
        let built: Vec<Blas> = batch
            .blas_builds
            .par_iter()
            .map(|&p| Blas::build(&self.positions, &self.indices, &self.mesh_descs[p as usize]))
            .collect();
        for (&primitive, blas) in batch.blas_builds.iter().zip(built) {
            self.blas[primitive as usize] = Some(blas);
        }
        for &primitive in &batch.blas_updates {
            let desc = &self.mesh_descs[primitive as usize];
            let slot = &mut self.blas[primitive as usize];
            if slot.as_mut().is_none_or(|blas| !blas.refit(&self.positions, &self.indices, desc)) {
                *slot = Some(Blas::build(&self.positions, &self.indices, desc));
                report.blas_built += 1;
            }
        }
        if !batch.blas_builds.is_empty() || !batch.blas_updates.is_empty() {
            report.blas_built += batch.blas_builds.len() as u32;
            report.blas_time = start.elapsed();
        }

        // Let the TLAS follow
        let start = Instant::now();
        if changed.len() <= self.render_nodes.len() / 2 {
            let geometry = batch.blas_builds.iter().chain(&batch.blas_updates).chain(&batch.blas_frees);
            let users: Vec<u32> = geometry.flat_map(|&primitive| self.users.of(primitive)).collect();
            if !users.is_empty() {
                changed.extend(users);
                changed.sort_unstable();
                changed.dedup();
            }
        }
        self.tlas_work = self.tlas.follow(&changed, &self.render_nodes, &self.blas);
        if !changed.is_empty() {
            report.tlas_time = start.elapsed();
        }
        self.revision = batch.new_revision;
        Ok(report)
    }

    /// What batches are held against.
    fn lengths(&self) -> Resident<'_> {
        Resident {
            revision: self.revision,
            positions: self.positions.len(),
            vertices: self.vertices.len(),
            indices: self.indices.len(),
            tangents: self.tangents.len(),
            mesh_descs: &self.mesh_descs,
            textures: self.textures.len(),
            materials: self.materials.len(),
            lights: self.lights.len(),
            emitter_triangles: self.emitter_triangles.len(),
            emitters: self.emitters.len(),
            render_nodes: self.render_nodes.len(),
            images: self.images.len(),
        }
    }

    /// Writes rows, and returns those by which the TLAS changes.
    fn write_render_nodes(&mut self, writes: RowWrites<RenderNodeRow>) -> Vec<u32> {
        const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
        let is_seen = |row: &RenderNodeRow| row.flags & SEEN == SEEN;
        let shows = |row: &RenderNodeRow| (row.flags & NodeFlags::OCCUPIED != 0).then_some(row.primitive);
        if self.render_nodes.is_empty() {
            self.users.reserve(writes.ranges.first().map_or(0, |range| range.rows.capacity()));
        }
        let mut changed = Vec::new();
        let mut change = |index: u32, old: Option<&RenderNodeRow>, new: Option<&RenderNodeRow>| {
            let (was, now) = (old.and_then(shows), new.and_then(shows));
            if was != now {
                if let Some(primitive) = was {
                    self.users.unlink(index, primitive);
                }
                if let Some(primitive) = now {
                    self.users.link(index, primitive);
                }
            }
            let (old, new) = (old.filter(|row| is_seen(row)), new.filter(|row| is_seen(row)));
            let same = match (old, new) {
                (None, None) => true,
                (Some(old), Some(new)) => {
                    let equal = |a, b| bytemuck::bytes_of::<Mat3x4>(a) == bytemuck::bytes_of::<Mat3x4>(b);
                    old.primitive == new.primitive && equal(&old.world, &new.world) && equal(&old.inverse, &new.inverse)
                }
                _ => false,
            };
            if !same {
                changed.push(index);
            }
        };
        for index in writes.len..self.render_nodes.len() as u32 {
            change(index, self.render_nodes.get(index as usize), None);
        }
        for range in &writes.ranges {
            for (index, row) in (range.first..).zip(&range.rows) {
                change(index, self.render_nodes.get(index as usize), Some(row));
            }
        }
        writes.apply_to(&mut self.render_nodes);
        changed
    }

    /// Checks that the acceleration structures are those of the rows: every invariant of the TLAS, every box. Looks at
    /// everything.
    ///
    /// # Errors
    /// What is wrong, and where.
    pub fn validate(&self) -> Result<(), String> {
        self.users.validate(&self.render_nodes)?;
        self.tlas.validate(&self.render_nodes, &self.blas)
    }

    /// The rows that are resident, to be compared.
    pub fn rows(&self) -> Rows<'_> {
        Rows {
            mesh_descs: &self.mesh_descs,
            textures: &self.textures,
            materials: &self.materials,
            lights: &self.lights,
            emitters: &self.emitters,
            render_nodes: &self.render_nodes,
        }
    }

    /// The nearest hit between `t_min` and `t_max`, both exclusive.
    ///
    /// `accept` is asked about hits of RenderNodes without [`orthant_resident::rows::NodeFlags::OPAQUE`], in no
    /// particular order and at most once for a triangle of a RenderNode; where it says `false` the ray passes through.
    /// Back faces of RenderNodes without [`orthant_resident::rows::NodeFlags::DOUBLE_SIDED`] do not exist. Of equally
    /// near hits the one with the smallest RenderNode, then triangle, counts.
    #[inline]
    pub fn closest_hit(&self, ray: &Ray, accept: impl FnMut(&Hit) -> bool) -> Option<Hit> {
        trace::closest_hit(self, ray, accept)
    }

    /// Whether anything is hit between `t_min` and `t_max`, both exclusive; `accept` as for
    /// [`ResidentScene::closest_hit`].
    #[inline]
    pub fn any_hit(&self, ray: &Ray, accept: impl FnMut(&Hit) -> bool) -> bool {
        trace::any_hit(self, ray, accept)
    }

    /// The hit of one triangle of a RenderNode, whatever else the ray meets; `None` where there is none, or no such triangle.
    /// No tree is asked: for comparisons.
    pub fn triangle_hit(&self, ray: &Ray, render_node: u32, triangle: u32) -> Option<Hit> {
        trace::triangle_hit(self, ray, render_node, triangle)
    }

    /// Object-space corners of a triangle of a RenderNode.
    ///
    /// # Panics
    /// When there is no such triangle; those of a [`Hit`] exist until the next batch.
    #[inline]
    pub fn triangle_positions(&self, render_node: u32, triangle: u32) -> [Vec3; 3] {
        let desc = &self.mesh_descs[self.render_nodes[render_node as usize].primitive as usize];
        let first = desc.first_index as usize + 3 * triangle as usize;
        let corner =
            |k: usize| Vec3::from_array(self.positions[desc.first_vertex as usize + self.indices[first + k] as usize]);
        [corner(0), corner(1), corner(2)]
    }

    /// What is resident, in bytes.
    pub fn resident_bytes(&self) -> ResidentBytes {
        fn bytes<T>(rows: &[T]) -> u64 {
            size_of_val(rows) as u64
        }
        ResidentBytes {
            geometry: bytes(&self.positions) + bytes(&self.vertices) + bytes(&self.indices) + bytes(&self.tangents),
            acceleration: self.blas.iter().flatten().map(Blas::bytes).sum::<u64>()
                + self.tlas.bytes()
                + self.users.bytes(),
            images: self.images.iter().flatten().map(|image| bytes(&image.texels)).sum(),
            rows: bytes(&self.mesh_descs)
                + bytes(&self.textures)
                + bytes(&self.materials)
                + bytes(&self.lights)
                + bytes(&self.emitter_triangles)
                + bytes(&self.emitters)
                + bytes(&self.render_nodes),
        }
    }
}
