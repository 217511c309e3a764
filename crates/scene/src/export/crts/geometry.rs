//! Meshes: one for each distinct geometry.

use super::objects::LightParts;
use super::rectangles::Rectangles;
use super::{Result, Writer};
use crate::export::ExportFault;
use crate::export::placed::Pose;
use crate::export::surface::{Surface, is_surface, triangles};
use crate::import::crts::schema::{Dtype, Mesh};
use crate::model::*;
use std::collections::{HashMap, HashSet};

/// The mesh of the file that shows each primitive: by mesh, then by the number of the primitive. `None` has no triangles.
pub type Meshes = HashMap<MeshId, Vec<Option<i64>>>;

impl Writer<'_> {
    /// Writes all meshes but those of lights and those that are only shown `posed`.
    pub(super) fn meshes(
        &mut self,
        lights: &LightParts,
        posed: &HashSet<MeshId>,
        rectangles: &Rectangles,
    ) -> Result<Meshes> {
        let scene = self.scene;
        let mut known = HashMap::new();
        let mut meshes = Meshes::new();
        for (id, mesh) in scene.meshes().iter() {
            if lights.meshes.contains(&id) || posed.contains(&id) {
                continue;
            }
            let slot = Store::<MeshId, Mesh>::slot(id);
            let mut indices = Vec::with_capacity(mesh.primitives.len());
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let pointer = format!("/meshes/{slot}/primitives/{p}");
                if rectangles.contains_key(&(id, p)) {
                    indices.push(None);
                    continue;
                }
                let Some(positions) = self.positions(primitive, &pointer) else {
                    indices.push(None);
                    continue;
                };
                // Two materials on one geometry are two meshes of the scene and one of the file.
                let key = (&mesh.name, &primitive.attributes, primitive.indices, primitive.mode);
                if let Some(&index) = known.get(&key) {
                    indices.push(Some(index));
                    continue;
                }
                let index = self.geometry(mesh, primitive, positions, None, pointer)?;
                known.insert(key, index);
                indices.push(Some(index));
            }
            meshes.insert(id, indices);
        }
        Ok(meshes)
    }

    /// The positions of a primitive that has triangles.
    pub(super) fn positions(&mut self, primitive: &Primitive, pointer: &str) -> Option<AccessorId> {
        let positions = primitive.attributes.get("POSITION").filter(|_| is_surface(primitive.mode));
        if positions.is_none() {
            self.note(pointer.to_owned(), "CRTS has no points or lines, and nothing without positions");
        }
        positions
    }

    /// Adds the geometry of a primitive, deformed by a pose; its index.
    pub(super) fn geometry(
        &mut self,
        mesh: &crate::model::Mesh,
        primitive: &Primitive,
        positions: AccessorId,
        pose: Option<&Pose>,
        pointer: String,
    ) -> Result<i64> {
        let scene = self.scene;
        let fault = |fault| ExportFault::Geometry { pointer: pointer.clone(), fault: Box::new(fault) };
        if !primitive.targets.is_empty() {
            self.note(pointer.clone(), "CRTS has no morph targets; the shape of the default weights is written");
        }
        if primitive.attributes.0.iter().any(|(s, _)| !is_held(s)) {
            self.note(
                pointer.clone(),
                "CRTS has only positions, normals and one set of texture coordinates; other attributes are left out",
            );
        }
        let mut surface = Surface::read(scene, primitive, positions).map_err(fault)?;
        if let Some(pose) = pose {
            surface.deform(scene, primitive, pose).map_err(fault)?;
        }
        let triangles = triangles(primitive.mode, surface.indices);
        let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let mesh = Mesh {
            name: Some(mesh.name.clone().unwrap_or_default()),
            positions: self.view(Dtype::VEC3_F32, floats(surface.positions.as_flattened())),
            indices: self.view(Dtype::VEC3_U32, triangles.into_iter().flat_map(u32::to_le_bytes)),
            // CRTS measures v from the bottom.
            texcoords: surface.texcoords.map(|mut t| {
                t.iter_mut().for_each(|uv| uv[1] = 1.0 - uv[1]);
                self.view(Dtype::VEC2_F32, floats(t.as_flattened()))
            }),
            normals: surface.normals.map(|n| self.view(Dtype::VEC3_F32, floats(n.as_flattened()))),
        };
        self.header.meshes.push(mesh);
        Ok(self.header.meshes.len() as i64 - 1)
    }
}

/// What skins read of a vertex is in its position once it is posed.
fn is_held(semantic: &str) -> bool {
    matches!(semantic, "POSITION" | "NORMAL" | "TEXCOORD_0")
        || semantic.starts_with("JOINTS_")
        || semantic.starts_with("WEIGHTS_")
}
