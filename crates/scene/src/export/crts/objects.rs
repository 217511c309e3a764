//! Nodes in world space.

use super::geometry::Meshes;
use super::images::Images;
use super::materials::Materials;
use super::rectangles::Rectangles;
use super::{Result, Writer, finite};
use crate::Scene;
use crate::export::ExportFault;
use crate::export::placed::{Placed, Pose, Poses, instances};
use crate::import::crts::disney::Disney;
use crate::import::crts::lights::{self, QuadLight};
use crate::import::crts::schema::{LightEmits, LightOrigin, Object, ObjectKind};
use crate::import::crts::{fit, written_fov_y};
use crate::model::*;
use glam::DAffine3;
use std::collections::{HashMap, HashSet};

/// Meshes and materials that only stand for quad lights.
#[derive(Default)]
pub struct LightParts {
    pub meshes: HashSet<MeshId>,
    pub materials: HashSet<MaterialId>,
}

pub fn light_parts(scene: &Scene, placed: &[Placed]) -> LightParts {
    let mut parts = LightParts::default();
    let mut of_lights: HashSet<NodeId> = HashSet::new();
    for p in placed {
        let node = &scene.nodes()[p.node];
        if let Some(mesh) = node.mesh.filter(|_| QuadLight::of_node(node).is_some()) {
            of_lights.insert(p.node);
            parts.meshes.insert(mesh);
        }
    }
    for (_, node) in scene.nodes().iter().filter(|(id, _)| !of_lights.contains(id)) {
        if let Some(mesh) = node.mesh {
            parts.meshes.remove(&mesh);
        }
    }
    let materials = |mesh: &Mesh| mesh.primitives.iter().filter_map(|p| scene.shown_material(p)).collect::<Vec<_>>();
    let is_light = |id: &MeshId| parts.meshes.contains(id);
    let mut found: HashSet<MaterialId> = parts.meshes.iter().flat_map(|&id| materials(&scene.meshes()[id])).collect();
    for (_, mesh) in scene.meshes().iter().filter(|(id, _)| !is_light(id)) {
        for material in materials(mesh) {
            found.remove(&material);
        }
    }
    parts.materials = found;
    parts
}

/// The nodes that deform their mesh, and the meshes that no node shows as they are stored.
#[derive(Default)]
pub struct Posed {
    nodes: HashMap<NodeId, Pose>,
    pub meshes: HashSet<MeshId>,
}

impl Posed {
    pub fn has(&self, node: NodeId) -> bool {
        self.nodes.contains_key(&node)
    }
}

pub fn posed(scene: &Scene, placed: &[Placed]) -> Result<Posed> {
    let mut posed = Posed::default();
    let mut poses = Poses::new(scene);
    let mut plain = HashSet::new();
    for p in placed {
        let node = &scene.nodes()[p.node];
        let Some(mesh) = node.mesh else { continue };
        let fault = |fault| ExportFault::Geometry { pointer: pointer(p.node), fault: Box::new(fault) };
        match poses.of(node).map_err(fault)? {
            Some(pose) => {
                posed.nodes.insert(p.node, pose);
                posed.meshes.insert(mesh);
            }
            None => {
                plain.insert(mesh);
            }
        }
    }
    posed.meshes.retain(|mesh| !plain.contains(mesh));
    Ok(posed)
}

fn pointer(node: NodeId) -> String {
    format!("/nodes/{}", Store::<NodeId, Node>::slot(node))
}

impl Writer<'_> {
    pub(super) fn objects(
        &mut self,
        placed: &[Placed],
        posed: &Posed,
        rectangles: &Rectangles,
        meshes: &Meshes,
        materials: Materials,
    ) -> Result<()> {
        let scene = self.scene;
        if placed.len() < scene.nodes().len() {
            self.note(
                "/nodes".to_owned(),
                "CRTS shows every object; nodes that are hidden or in no scene are left out",
            );
        }
        let mut default = None;
        for p in placed {
            let node = &scene.nodes()[p.node];
            let pointer = pointer(p.node);
            if let Some(light) = QuadLight::of_node(node) {
                self.light(node, light, p.world)?;
            } else if let Some(mesh) = node.mesh {
                let pose = posed.nodes.get(&p.node);
                let own;
                let parts = match pose {
                    Some(pose) => {
                        own = self.posed_mesh(mesh, pose)?;
                        &own[..]
                    }
                    None => meshes.get(&mesh).map_or(&[][..], Vec::as_slice),
                };
                // A skin has put the vertices into the world.
                let worlds = if pose.is_some_and(|pose| !pose.joints.is_empty()) {
                    vec![DAffine3::IDENTITY]
                } else {
                    let fault = |fault| ExportFault::Geometry { pointer: pointer.clone(), fault: Box::new(fault) };
                    instances(scene, node, p.world).map_err(fault)?
                };
                for world in worlds {
                    for (k, (primitive, index)) in scene.meshes()[mesh].primitives.iter().zip(parts).enumerate() {
                        if let Some(rectangle) = rectangles.get(&(mesh, k)) {
                            self.rectangle(node, rectangle, world, &pointer)?;
                            continue;
                        }
                        let Some(index) = *index else { continue };
                        let material = match scene.shown_material(primitive) {
                            Some(id) => materials.get(&id).copied(),
                            None => None,
                        };
                        let material = match (material, default) {
                            (Some(material), _) | (None, Some(material)) => material,
                            (None, None) => {
                                // glTF's default material is not that of this format.
                                let (disney, _) = Disney::of_material(&Material::default());
                                *default.insert(self.material(&disney, None, &Images::new())?)
                            }
                        };
                        let mut object = object(node, ObjectKind::Mesh, world)?;
                        (object.mesh, object.material) = (Some(index), Some(material));
                        self.header.objects.push(object);
                    }
                }
            }
            if let Some(camera) = node.camera {
                self.camera(node, &scene.cameras()[camera], p.world, pointer)?;
            }
        }
        Ok(())
    }

    /// Adds the primitives of a mesh as a pose deforms them.
    fn posed_mesh(&mut self, id: MeshId, pose: &Pose) -> Result<Vec<Option<i64>>> {
        let scene = self.scene;
        let mesh = &scene.meshes()[id];
        let mut indices = Vec::with_capacity(mesh.primitives.len());
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let pointer = format!("/meshes/{}/primitives/{p}", Store::<MeshId, Mesh>::slot(id));
            indices.push(match self.positions(primitive, &pointer) {
                Some(positions) => Some(self.geometry(mesh, primitive, positions, Some(pose), pointer)?),
                None => None,
            });
        }
        Ok(indices)
    }

    fn light(&mut self, node: &Node, light: QuadLight, world: DAffine3) -> Result<()> {
        // The quad grows with its node.
        let scale = [world.matrix3.x_axis.length(), world.matrix3.y_axis.length()];
        let is_unit = |s: f64| (s - 1.0).abs() <= 1e-6 || node.mesh.is_none();
        let size = std::array::from_fn(|k| light.size[k] * if is_unit(scale[k]) { 1.0 } else { scale[k] });
        let matrix = columns(world);
        let (corner, emits) = (Some(LightOrigin::Corner), Some(LightEmits::Negative));
        let (matrix, size) = lights::frame(&matrix, size, corner, emits).unwrap_or((matrix, size));
        // The mark says the colour, unless the material has been changed since.
        let primitive = node.mesh.and_then(|m| self.scene.meshes()[m].primitives.first());
        let material = primitive.and_then(|primitive| self.scene.shown_material(primitive));
        let material = material.map(|m| &self.scene.materials()[m]);
        let marked = light.material();
        let (color, energy) = match material {
            Some(m) if (m.emissive, m.emissive_strength) != (marked.emissive, marked.emissive_strength) => {
                (m.emissive, m.emissive_strength.unwrap_or(1.0))
            }
            _ => (light.color, light.energy),
        };
        let mut object = object(node, ObjectKind::Light, world)?;
        object.matrix = finite_matrix(matrix)?;
        for value in color.into_iter().chain(size).chain([energy]) {
            finite(value, "light")?;
        }
        (object.color, object.energy, object.size) = (Some(color), Some(energy), Some(size));
        self.header.objects.push(object);
        Ok(())
    }

    fn camera(&mut self, node: &Node, camera: &Camera, world: DAffine3, pointer: String) -> Result<()> {
        let CameraProjection::Perspective { aspect_ratio, yfov, .. } = camera.projection else {
            self.note(pointer, "CRTS has no orthographic cameras");
            return Ok(());
        };
        let fov_y = written_fov_y(camera).unwrap_or_else(|| {
            let aspect = aspect_ratio.filter(|&a| a > 0.0).unwrap_or(1.5);
            (2.0 * ((0.5 * yfov).tan() / fit(aspect)).atan()).to_degrees()
        });
        let mut object = object(node, ObjectKind::Camera, world)?;
        object.fov_y = Some(finite(fov_y, "fov_y")?);
        self.header.objects.push(object);
        Ok(())
    }
}

fn object(node: &Node, kind: ObjectKind, world: DAffine3) -> Result<Object> {
    Ok(Object {
        name: Some(node.name.clone().unwrap_or_default()),
        kind,
        matrix: finite_matrix(columns(world))?,
        mesh: None,
        material: None,
        color: None,
        energy: None,
        size: None,
        fov_y: None,
    })
}

fn columns(world: DAffine3) -> [f64; 16] {
    glam::DMat4::from(world).to_cols_array()
}

/// As the f32 that readers make of it, written so that they do.
pub(super) fn finite_matrix(matrix: [f64; 16]) -> Result<[Option<f64>; 16]> {
    let mut out = [None; 16];
    for (to, from) in out.iter_mut().zip(matrix) {
        *to = Some(finite(f64::from(from as f32), "matrix")?);
    }
    Ok(out)
}
