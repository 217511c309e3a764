//! Rows as they are on the device: explicit readback, for validation and tests. It waits.

use super::ResidentScene;
use crate::error;
use crate::memory::{Arena, Buffer, Place, Queue, Stage};
use ash::vk;
use orthant_resident::batch::TextureRow;
use orthant_resident::compare::Rows;
use orthant_resident::rows::{
    EmitterRow, EmitterTriangle, LightRow, MaterialRow, MeshDesc, NodeFlags, RenderNodeRow, VertexRow,
};
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

impl ResidentRows {
    /// The rows that are compared with derived ones.
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

    /// Checks that every TLAS instance is that of its row: transform, RenderPrimitive, mask, flags, address of the BLAS.
    ///
    /// # Errors
    /// The first that is not, with the field.
    pub fn check_instances(&self) -> Result<(), String> {
        let (instances, nodes) = (self.instances.len(), self.render_nodes.len());
        if instances != nodes {
            return Err(format!("the TLAS has {instances} instances, of {nodes} render nodes"));
        }
        for (row, (instance, node)) in self.instances.iter().zip(&self.render_nodes).enumerate() {
            let expected = self.instance(node);
            let fields = [
                ("transform", 0..12),
                ("RenderPrimitive and mask", 12..13),
                ("flags", 13..14),
                ("address of the BLAS", 14..16),
            ];
            if let Some((field, words)) = fields.into_iter().find(|(_, w)| instance[w.clone()] != expected[w.clone()]) {
                let (is, should) = (&instance[words.clone()], &expected[words]);
                return Err(format!("TLAS instance {row}: {field} is {is:x?}, and should be {should:x?}"));
            }
        }
        Ok(())
    }

    /// `VkAccelerationStructureInstanceKHR` of a row.
    fn instance(&self, node: &RenderNodeRow) -> [u32; 16] {
        const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
        let is_seen = node.flags & SEEN == SEEN;
        let blas = self.blas.get(node.primitive as usize).copied().filter(|_| is_seen).unwrap_or(0);
        use vk::GeometryInstanceFlagsKHR as Flags;
        let mut flags = Flags::empty();
        if node.flags & NodeFlags::DOUBLE_SIDED != 0 {
            flags |= Flags::TRIANGLE_FACING_CULL_DISABLE;
        }
        flags |= if node.flags & NodeFlags::OPAQUE != 0 { Flags::FORCE_OPAQUE } else { Flags::FORCE_NO_OPAQUE };
        let mut words = [0; 16];
        words[..12].copy_from_slice(bytemuck::cast_slice(&node.world.rows));
        words[12] = node.primitive & 0xff_ffff | if blas == 0 { 0 } else { 0xff << 24 };
        words[13] = flags.as_raw() << 24;
        (words[14], words[15]) = (blas as u32, (blas >> 32) as u32);
        words
    }
}

impl ResidentScene {
    /// Copies all rows back.
    pub fn read_back(&self, queue: &mut Queue) -> error::Result<ResidentRows> {
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

    fn read<T: bytemuck::Pod>(&self, queue: &mut Queue, arena: &Arena) -> error::Result<Vec<T>> {
        let bytes = u64::from(arena.len) * arena.stride();
        if bytes == 0 {
            return Ok(Vec::new());
        }
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let buffer = Buffer::new(&self.device, "a readback buffer", bytes, usage, Place::Readback)?;
        let mut commands = queue.begin()?;
        commands.full_barrier();
        commands.stage(Stage::Readback);
        commands.copy(arena.raw(), buffer.raw, &[vk::BufferCopy { src_offset: 0, dst_offset: 0, size: bytes }]);
        commands.host_barrier();
        let number = queue.submit(commands)?;
        // SYNC: an explicit readback, which nobody does on the frame path.
        queue.wait(number, Duration::MAX)?;
        Ok(bytemuck::pod_collect_to_vec(&buffer.mapped()[..bytes as usize]))
    }
}
