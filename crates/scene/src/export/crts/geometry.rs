//! Meshes: one for each distinct geometry.

use super::objects::LightParts;
use super::{Result, Writer};
use crate::accessor;
use crate::export::ExportFault;
use crate::import::crts::schema::{Dtype, Mesh};
use crate::model::*;
use std::collections::HashMap;

/// The mesh of the file that shows each primitive: by mesh, then by the number of the primitive. `None` has no triangles.
pub type Meshes = HashMap<MeshId, Vec<Option<i64>>>;

impl Writer<'_> {
    pub(super) fn meshes(&mut self, lights: &LightParts) -> Result<Meshes> {
        let scene = self.scene;
        let mut known = HashMap::new();
        let mut meshes = Meshes::new();
        for (id, mesh) in scene.meshes().iter() {
            if lights.meshes.contains(&id) {
                continue;
            }
            let slot = Store::<MeshId, Mesh>::slot(id);
            let mut indices = Vec::with_capacity(mesh.primitives.len());
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let pointer = format!("/meshes/{slot}/primitives/{p}");
                let is_surface = matches!(
                    primitive.mode,
                    PrimitiveMode::Triangles | PrimitiveMode::TriangleStrip | PrimitiveMode::TriangleFan
                );
                let Some(positions) = primitive.attributes.get("POSITION").filter(|_| is_surface) else {
                    self.note(pointer, "CRTS has no points or lines, and nothing without positions");
                    indices.push(None);
                    continue;
                };
                // Two materials on one geometry are two meshes of the scene and one of the file.
                let key = (&mesh.name, &primitive.attributes, primitive.indices, primitive.mode);
                if let Some(&index) = known.get(&key) {
                    indices.push(Some(index));
                    continue;
                }
                let index = self.geometry(mesh, primitive, positions, pointer)?;
                known.insert(key, index);
                indices.push(Some(index));
            }
            meshes.insert(id, indices);
        }
        Ok(meshes)
    }

    fn geometry(
        &mut self,
        mesh: &crate::model::Mesh,
        primitive: &Primitive,
        positions: AccessorId,
        pointer: String,
    ) -> Result<i64> {
        let scene = self.scene;
        let fault = |fault| ExportFault::Geometry { pointer: pointer.clone(), fault: Box::new(fault) };
        if !primitive.targets.is_empty() {
            self.note(pointer.clone(), "CRTS has no morph targets; the base shape is written");
        }
        if primitive.attributes.0.iter().any(|(s, _)| !matches!(s.as_str(), "POSITION" | "NORMAL" | "TEXCOORD_0")) {
            self.note(
                pointer.clone(),
                "CRTS has only positions, normals and one set of texture coordinates; other attributes are left out",
            );
        }
        let positions = accessor::read_f32::<3>(scene, positions).map_err(fault)?;
        let mut indices = Vec::new();
        match primitive.indices {
            Some(id) => {
                accessor::read_vertex_indices_into(scene, id, positions.len(), &mut indices).map_err(fault)?;
            }
            None => indices.extend(0..positions.len() as u32),
        }
        let triangles = triangles(primitive.mode, indices);
        let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let read_normals = primitive.attributes.get("NORMAL").map(|id| accessor::read_f32::<3>(scene, id));
        let normals = read_normals.transpose().map_err(fault)?.filter(|n| n.len() == positions.len());
        let read_texcoords = primitive.attributes.get("TEXCOORD_0").map(|id| accessor::read_f32::<2>(scene, id));
        let texcoords = read_texcoords.transpose().map_err(fault)?.filter(|t| t.len() == positions.len());

        let mesh = Mesh {
            name: Some(mesh.name.clone().unwrap_or_default()),
            positions: self.view(Dtype::VEC3_F32, floats(positions.as_flattened())),
            indices: self.view(Dtype::VEC3_U32, triangles.into_iter().flat_map(u32::to_le_bytes)),
            // CRTS measures v from the bottom.
            texcoords: texcoords.map(|mut t| {
                t.iter_mut().for_each(|uv| uv[1] = 1.0 - uv[1]);
                self.view(Dtype::VEC2_F32, floats(t.as_flattened()))
            }),
            normals: normals.map(|n| self.view(Dtype::VEC3_F32, floats(n.as_flattened()))),
        };
        self.header.meshes.push(mesh);
        Ok(self.header.meshes.len() as i64 - 1)
    }
}

/// Strips and fans as triangles (glTF 2.0, section 3.7.2.1); an incomplete triangle at the end is dropped.
fn triangles(mode: PrimitiveMode, mut indices: Vec<u32>) -> Vec<u32> {
    match mode {
        PrimitiveMode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .flat_map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        PrimitiveMode::TriangleFan => {
            let Some((&first, rest)) = indices.split_first() else { return Vec::new() };
            rest.windows(2).flat_map(|w| [w[0], w[1], first]).collect()
        }
        _ => {
            indices.truncate(indices.len() / 3 * 3);
            indices
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        assert_eq!(triangles(PrimitiveMode::TriangleStrip, vec![0, 1, 2, 3]), [0, 1, 2, 1, 3, 2]);
        assert_eq!(triangles(PrimitiveMode::TriangleFan, vec![0, 1, 2, 3]), [1, 2, 0, 2, 3, 0]);
        assert_eq!(triangles(PrimitiveMode::Triangles, vec![0, 1, 2, 3]), [0, 1, 2]);
    }
}
