//! Nodes in world space.

use super::geometry::Meshes;
use super::images::Images;
use super::materials::Materials;
use super::{Result, Writer, finite};
use crate::Scene;
use crate::accessor;
use crate::export::ExportFault;
use crate::import::crts::disney::Disney;
use crate::import::crts::lights::{self, QuadLight};
use crate::import::crts::schema::{LightEmits, LightOrigin, Object, ObjectKind};
use crate::import::crts::{fit, written_fov_y};
use crate::model::*;
use glam::{DAffine3, DQuat, DVec3, DVec4};
use std::collections::HashSet;

/// A node that is shown, and where it is: world from node.
pub struct Placed {
    node: NodeId,
    world: DAffine3,
}

/// The nodes of the default scene (the first, if none is named; without scenes, all roots), parents first.
pub fn flatten(scene: &Scene) -> Vec<Placed> {
    let shown = scene.default_scene().or_else(|| scene.scenes().ids().next());
    let roots: Vec<NodeId> = match shown {
        Some(shown) => scene.scenes()[shown].roots.iter().collect(),
        None => scene.nodes().iter().filter(|(_, n)| n.parent.is_none()).map(|(id, _)| id).collect(),
    };
    let mut placed = Vec::new();
    let mut open: Vec<(NodeId, DAffine3)> = roots.into_iter().rev().map(|id| (id, DAffine3::IDENTITY)).collect();
    while let Some((id, parent)) = open.pop() {
        let node = &scene.nodes()[id];
        if node.visible == Some(false) {
            continue;
        }
        let local = node.transform.to_affine();
        // A root's matrix stays what it is, to the bit.
        let world = if node.parent.is_none() { local } else { parent * local };
        placed.push(Placed { node: id, world });
        let first = open.len();
        open.extend(node.children.iter().map(|child| (child, world)));
        open[first..].reverse();
    }
    placed
}

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
    let materials = |mesh: &Mesh| mesh.primitives.iter().filter_map(|p| p.material).collect::<Vec<_>>();
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

impl Writer<'_> {
    pub(super) fn objects(&mut self, placed: &[Placed], meshes: &Meshes, materials: Materials) -> Result<()> {
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
            let pointer = format!("/nodes/{}", Store::<NodeId, Node>::slot(p.node));
            if let Some(light) = QuadLight::of_node(node) {
                self.light(node, light, p.world)?;
            } else if let Some(mesh) = node.mesh {
                if node.weights.is_some() {
                    self.note(pointer.clone(), "CRTS has no morph targets; the base shape is written");
                }
                for world in self.instances(node, p.world, pointer.clone())? {
                    let parts = meshes.get(&mesh).map_or(&[][..], Vec::as_slice);
                    for (primitive, index) in scene.meshes()[mesh].primitives.iter().zip(parts) {
                        let Some(index) = *index else { continue };
                        let material = match primitive.material {
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

    /// Where a node's mesh appears (EXT_mesh_gpu_instancing).
    fn instances(&self, node: &Node, world: DAffine3, pointer: String) -> Result<Vec<DAffine3>> {
        let Some(instancing) = node.instancing.as_deref() else { return Ok(vec![world]) };
        let fault = |fault| ExportFault::Geometry { pointer: pointer.clone(), fault: Box::new(fault) };
        let (t, r, s) = (instancing.translation, instancing.rotation, instancing.scale);
        let Some(any) = t.or(r).or(s) else { return Ok(vec![world]) };
        let count = self.scene.accessors()[any].count;
        let three =
            |id: Option<AccessorId>| id.map(|id| accessor::read_f32::<3>(self.scene, id)).transpose().map_err(fault);
        let (t, s) = (three(t)?, three(s)?);
        let r = r.map(|id| accessor::read_f32::<4>(self.scene, id)).transpose().map_err(fault)?;
        let vector = |list: &Option<Vec<[f32; 3]>>, i: usize, or: f64| {
            list.as_ref().and_then(|l| l.get(i)).map_or(DVec3::splat(or), |&v| glam::Vec3::from(v).as_dvec3())
        };
        let rotation = |i: usize| {
            let r = r.as_ref().and_then(|l| l.get(i)).map_or(DVec4::W, |&v| glam::Vec4::from(v).as_dvec4());
            r.try_normalize().map_or(DQuat::IDENTITY, DQuat::from_vec4)
        };
        let local = |i| DAffine3::from_scale_rotation_translation(vector(&s, i, 1.0), rotation(i), vector(&t, i, 0.0));
        Ok((0..count).map(|i| world * local(i)).collect())
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
        let material = node.mesh.and_then(|m| self.scene.meshes()[m].primitives.first()?.material);
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
fn finite_matrix(matrix: [f64; 16]) -> Result<[Option<f64>; 16]> {
    let mut out = [None; 16];
    for (to, from) in out.iter_mut().zip(matrix) {
        *to = Some(finite(f64::from(from as f32), "matrix")?);
    }
    Ok(out)
}
