//! What is resident on the device, and how a batch changes it.
//!
//! * [`accel`]: acceleration structures and their memory; [`blas`], [`tlas`]: what is built when;
//! * [`images`]: the table of images;
//! * [`lights`]: the tables by which lights are chosen;
//! * [`readback`]: rows as they are on the device, for validation.
//!
//! Geometry lies in global arenas, of which BLAS are built; every other row in a buffer of its own. Buffers that grow are
//! copied on the device.

mod accel;
mod blas;
mod images;
mod lights;
mod readback;
mod tlas;

pub use readback::ResidentRows;

use crate::abi::{Constants, SceneTable};
use crate::device::Device;
use crate::error::Result;
use crate::memory::{Arena, Queue, Staging, Uploads};
use accel::Pages;
use ash::vk;
use blas::{BlasSet, Streams};
use images::ImageTable;
use lights::{Lights, Mirror};
use orthant_resident::backend::{ApplyReport, ResidentBytes};
use orthant_resident::batch::{RowWrites, TextureRow, TlasAction};
use orthant_resident::check::Resident;
use orthant_resident::environment::EnvironmentMap;
use orthant_resident::rows::{EmitterRow, EmitterTriangle, LightRow, MaterialRow, MeshDesc, RenderNodeRow, VertexRow};
use orthant_resident::{Environment, SceneBatch};
use std::sync::Arc;
use std::time::Instant;
use tlas::Tlas;

/// A model scene on the device.
pub(crate) struct ResidentScene {
    device: Arc<Device>,
    positions: Arena,
    vertices: Arena,
    indices: Arena,
    tangents: Arena,
    mesh_descs: Arena,
    textures: Arena,
    materials: Arena,
    light_rows: Arena,
    emitter_triangles: Arena,
    emitters: Arena,
    render_nodes: Arena,
    constants: Arena,
    pub images: ImageTable,
    blas: BlasSet,
    tlas: Tlas,
    mirror: Mirror,
    lights: Lights,
    revision: u64,
}

/// Bytes of acceleration structures and of what belongs to them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AccelerationBytes {
    /// All BLAS.
    pub blas: u64,
    /// The TLAS, which the driver lays out.
    pub tlas: u64,
    /// Its instances, 64 bytes each, and the addresses of the BLAS.
    pub instances: u64,
    /// Scratch memory, which is kept for the next build.
    pub scratch: u64,
}

/// What a batch did on the device.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Applied {
    pub report: ApplyReport,
    /// Bytes that went through the staging ring for what the batch names, images apart; and for what follows from it:
    /// images, tables, where things go.
    pub uploaded: u64,
    pub overhead: u64,
    /// The TLAS is another structure now.
    pub tlas_replaced: bool,
}

impl ResidentScene {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let input = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        let none = vk::BufferUsageFlags::empty();
        let pages = Pages::new();
        Ok(Self {
            positions: Arena::new("positions", 12, input),
            vertices: Arena::new("vertices", size_of::<VertexRow>(), none),
            indices: Arena::new("indices", 4, input),
            tangents: Arena::new("tangents", 4, none),
            mesh_descs: Arena::new("mesh descriptions", size_of::<MeshDesc>(), none),
            textures: Arena::new("textures", size_of::<TextureRow>(), none),
            materials: Arena::new("materials", size_of::<MaterialRow>(), none),
            light_rows: Arena::new("lights", size_of::<LightRow>(), none),
            emitter_triangles: Arena::new("emitter triangles", size_of::<EmitterTriangle>(), none),
            emitters: Arena::new("emitters", size_of::<EmitterRow>(), none),
            render_nodes: Arena::new("render nodes", size_of::<RenderNodeRow>(), none),
            constants: Arena::new("constant tables", size_of::<Constants>(), none),
            images: ImageTable::new(device)?,
            blas: BlasSet::new(device, &pages),
            tlas: Tlas::new(device, &pages)?,
            mirror: Mirror::default(),
            lights: Lights::new(),
            revision: 0,
            device: device.clone(),
        })
    }

    /// What batches are held against.
    pub fn lengths(&self) -> Resident<'_> {
        Resident {
            revision: self.revision,
            positions: self.positions.len as usize,
            vertices: self.vertices.len as usize,
            indices: self.indices.len as usize,
            tangents: self.tangents.len as usize,
            mesh_descs: &self.mirror.mesh_descs,
            textures: self.textures.len as usize,
            materials: self.materials.len as usize,
            lights: self.light_rows.len as usize,
            emitter_triangles: self.emitter_triangles.len as usize,
            emitters: self.emitters.len as usize,
            render_nodes: self.render_nodes.len as usize,
            images: self.images.len() as usize,
        }
    }

    /// The TLAS, if there is one.
    pub fn tlas(&self) -> Option<vk::AccelerationStructureKHR> {
        self.tlas.raw()
    }

    /// Follows a batch that has been checked. An error leaves the scene in no state at all: it has to be loaded again.
    pub fn apply(&mut self, queue: &mut Queue, staging: &mut Staging, batch: &SceneBatch) -> Result<Applied> {
        let loading = batch.expected_revision == 0;
        let mut applied = Applied::default();
        let mut uploads = Uploads::begin(queue, staging)?;
        let (u, device) = (&mut uploads, &self.device.clone());

        // Rows and streams
        u.rows(device, &mut self.positions, &batch.positions)?;
        u.rows(device, &mut self.vertices, &batch.vertices)?;
        u.rows(device, &mut self.indices, &batch.indices)?;
        u.rows(device, &mut self.tangents, &batch.tangents)?;
        u.rows(device, &mut self.mesh_descs, &batch.mesh_descs)?;
        self.images.follow(u, &batch.images)?;
        u.rows(device, &mut self.textures, &batch.textures)?;
        u.rows(device, &mut self.materials, &batch.materials)?;
        u.rows(device, &mut self.light_rows, &batch.lights)?;
        u.rows(device, &mut self.emitter_triangles, &batch.emitter_triangles)?;
        u.rows(device, &mut self.emitters, &batch.emitters)?;
        u.rows(device, &mut self.render_nodes, &batch.render_nodes)?;

        // Lights
        let changes = self.mirror.light_changes(batch);
        self.mirror.follow(batch);
        self.lights.follow(device, u, &self.mirror, &changes)?;

        // BLAS
        let start = Instant::now();
        let streams = Streams { positions: self.positions.address(), indices: self.indices.address() };
        let descs = &self.mirror.mesh_descs;
        let mut moved = false;
        if batch.tlas == TlasAction::Rebuild {
            moved |= self.blas.compact_pending(u)?;
        }
        let (frees, builds, updates) = (&batch.blas_frees, &batch.blas_builds, &batch.blas_updates);
        let work = self.blas.follow(u, streams, descs, frees, builds, updates, loading)?;
        moved |= work.moved;
        applied.report.blas_built = work.built;
        if work.built + work.updated > 0 {
            applied.report.blas_time = start.elapsed();
        }

        // TLAS
        let start = Instant::now();
        let len = batch.render_nodes.len;
        let all = [(0, len)];
        let written: Vec<(u32, u32)> =
            batch.render_nodes.ranges.iter().map(|range| (range.first, range.rows.len() as u32)).collect();
        let spans = if moved { &all[..] } else { &written };
        self.tlas.write_instances(u, self.render_nodes.address(), &self.blas.addresses, len, spans)?;
        let action = if moved || loading { TlasAction::Rebuild } else { batch.tlas };
        applied.tlas_replaced = self.tlas.follow(u, action, len)?;
        applied.report.tlas_time = start.elapsed();

        applied.overhead = uploads.extra;
        applied.uploaded = uploads.finish()?.1;
        applied.report.bytes = batch.upload_bytes();
        self.revision = batch.new_revision;
        Ok(applied)
    }

    /// Takes over what surrounds the scene. A scene begins with this.
    pub fn set_environment(
        &mut self,
        queue: &mut Queue,
        staging: &mut Staging,
        environment: &Environment,
    ) -> Result<()> {
        let mut uploads = Uploads::begin(queue, staging)?;
        if self.constants.len == 0 {
            let constants = RowWrites::whole(vec![Constants::new()]);
            uploads.overhead(|u| u.rows(&self.device, &mut self.constants, &constants))?;
        }
        self.lights.set_environment(&self.device, &mut uploads, environment)?;
        uploads.finish()?;
        Ok(())
    }

    /// Where everything is, for shaders.
    pub fn table(&self) -> SceneTable {
        SceneTable {
            positions: self.positions.address(),
            vertices: self.vertices.address(),
            indices: self.indices.address(),
            tangents: self.tangents.address(),
            mesh_descs: self.mesh_descs.address(),
            materials: self.materials.address(),
            textures: self.textures.address(),
            images: self.images.rows.address(),
            lights: self.light_rows.address(),
            emitter_triangles: self.emitter_triangles.address(),
            emitters: self.emitters.address(),
            render_nodes: self.render_nodes.address(),
            constants: self.constants.address(),
            material_count: self.materials.len,
            texture_count: self.textures.len,
            image_count: self.images.len(),
            emitter_count: self.emitters.len,
            emitter_triangle_count: self.emitter_triangles.len,
            tangent_count: self.tangents.len,
        }
    }

    /// How lights are chosen, for shaders.
    pub fn light_table(&self) -> crate::abi::LightTable {
        self.lights.table()
    }

    /// Rows of the render-node buffer.
    pub fn render_node_count(&self) -> u32 {
        self.render_nodes.len
    }

    /// The environment's map, if there is one.
    pub fn environment_map(&self) -> Option<&Arc<EnvironmentMap>> {
        self.lights.tables.map.as_ref()
    }

    /// What acceleration structures take, by what they are.
    pub fn acceleration_bytes(&self) -> AccelerationBytes {
        let (tlas, instances, scratch) = self.tlas.bytes();
        let (blas, addresses, more_scratch) = self.blas.bytes();
        AccelerationBytes { blas, tlas, instances: instances + addresses, scratch: scratch + more_scratch }
    }

    /// What is resident.
    pub fn resident_bytes(&self) -> ResidentBytes {
        let AccelerationBytes { blas, tlas, instances, scratch } = self.acceleration_bytes();
        let rows = [&self.mesh_descs, &self.textures, &self.materials, &self.light_rows, &self.emitter_triangles];
        let more = [&self.emitters, &self.render_nodes, &self.images.rows];
        ResidentBytes {
            geometry: [&self.positions, &self.vertices, &self.indices, &self.tangents].map(Arena::bytes).iter().sum(),
            acceleration: blas + tlas + instances + scratch,
            images: self.images.bytes(),
            rows: rows.into_iter().chain(more).map(Arena::bytes).sum::<u64>() + self.lights.bytes(),
        }
    }
}
