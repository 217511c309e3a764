//! Rows as they are on the device: explicit readback, for validation and tests. It waits.

use super::ResidentScene;
use crate::error::Result;
use crate::memory::{Arena, Buffer, Place, Queue};
use ash::vk;
use orthant_resident::batch::TextureRow;
use orthant_resident::rows::{EmitterRow, EmitterTriangle, LightRow, MaterialRow, MeshDesc, RenderNodeRow, VertexRow};
use std::time::Duration;

/// Everything that is resident, as the device has it.
#[derive(Clone, Debug, Default, PartialEq)]
#[expect(missing_docs, reason = "the names are those of SceneBatch")]
pub struct ResidentRows {
    pub positions: Vec<[f32; 3]>,
    pub vertices: Vec<VertexRow>,
    pub indices: Vec<u32>,
    pub tangents: Vec<u32>,
    pub mesh_descs: Vec<MeshDesc>,
    pub textures: Vec<TextureRow>,
    pub materials: Vec<MaterialRow>,
    pub lights: Vec<LightRow>,
    pub emitter_triangles: Vec<EmitterTriangle>,
    pub emitters: Vec<EmitterRow>,
    pub render_nodes: Vec<RenderNodeRow>,
    /// TLAS instances (`VkAccelerationStructureInstanceKHR`) as sixteen words each.
    pub instances: Vec<[u32; 16]>,
    /// Device addresses of the BLAS, by RenderPrimitive.
    pub blas: Vec<u64>,
}

impl ResidentScene {
    /// Copies all rows back.
    pub fn read_back(&self, queue: &mut Queue) -> Result<ResidentRows> {
        Ok(ResidentRows {
            positions: self.read(queue, &self.positions)?,
            vertices: self.read(queue, &self.vertices)?,
            indices: self.read(queue, &self.indices)?,
            tangents: self.read(queue, &self.tangents)?,
            mesh_descs: self.read(queue, &self.mesh_descs)?,
            textures: self.read(queue, &self.textures)?,
            materials: self.read(queue, &self.materials)?,
            lights: self.read(queue, &self.light_rows)?,
            emitter_triangles: self.read(queue, &self.emitter_triangles)?,
            emitters: self.read(queue, &self.emitters)?,
            render_nodes: self.read(queue, &self.render_nodes)?,
            instances: self.read(queue, &self.tlas.instances)?,
            blas: self.read(queue, &self.blas.addresses)?,
        })
    }

    fn read<T: bytemuck::Pod>(&self, queue: &mut Queue, arena: &Arena) -> Result<Vec<T>> {
        let bytes = u64::from(arena.len) * arena.stride();
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let buffer = Buffer::new(&self.device, "a readback buffer", bytes, usage, Place::Readback)?;
        let mut commands = queue.begin()?;
        commands.full_barrier();
        commands.copy(arena.raw(), buffer.raw, &[vk::BufferCopy { src_offset: 0, dst_offset: 0, size: bytes }]);
        commands.to_host();
        let number = queue.submit(commands)?;
        // SYNC: an explicit readback, which nobody does on the frame path.
        queue.wait(number, Duration::MAX)?;
        Ok(bytemuck::pod_collect_to_vec(&buffer.mapped()[..bytes as usize]))
    }
}
