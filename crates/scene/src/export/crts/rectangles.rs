//! Rectangles that shine: the only light that the format has.

use super::objects::{LightParts, Posed};
use super::{Result, Writer, finite};
use crate::Scene;
use crate::export::ExportFault;
use crate::export::placed::Placed;
use crate::export::surface::{Surface, is_surface, triangles};
use crate::import::crts::schema::{Object, ObjectKind};
use crate::model::*;
use glam::{DAffine3, DVec3};
use std::collections::{HashMap, HashSet};

/// A rectangle in the space of its mesh.
pub struct Rectangle {
    corner: DVec3,
    /// From the corner to its neighbours: `sides[1]` x `sides[0]` points to the front.
    sides: [DVec3; 2],
    material: MaterialId,
}

/// The primitives that are written as lights: by mesh, and the number of the primitive.
pub type Rectangles = HashMap<(MeshId, usize), Rectangle>;

/// Finds the primitives that shine evenly and are a rectangle under every node that shows them. Materials that nothing else
/// has join those of lights.
pub fn find(scene: &Scene, placed: &[Placed], posed: &Posed, lights: &mut LightParts) -> Result<Rectangles> {
    let mut found = Rectangles::new();
    for (id, mesh) in scene.meshes().iter().filter(|(id, _)| !lights.meshes.contains(id)) {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let pointer = || format!("/meshes/{}/primitives/{p}", Store::<MeshId, Mesh>::slot(id));
            let fault = |fault| ExportFault::Geometry { pointer: pointer(), fault: Box::new(fault) };
            let Some((material, positions)) = candidate(scene, primitive) else { continue };
            let surface = Surface::read(scene, primitive, positions).map_err(fault)?;
            if let Some((corner, sides)) = rectangle(&surface, primitive.mode) {
                found.insert((id, p), Rectangle { corner, sides, material });
            }
        }
    }
    if found.is_empty() {
        return Ok(found);
    }
    let mut shown = HashSet::new();
    for p in placed {
        let node = &scene.nodes()[p.node];
        let Some(mesh) = node.mesh else { continue };
        shown.insert(mesh);
        let is_plain = node.instancing.is_none() && !posed.has(p.node);
        found.retain(|(id, _), rectangle| {
            *id != mesh || is_plain && is_right(rectangle.sides.map(|side| p.world.transform_vector3(side)))
        });
    }
    found.retain(|(id, _), _| shown.contains(id));

    let mut materials: HashSet<MaterialId> = found.values().map(|rectangle| rectangle.material).collect();
    for (id, mesh) in scene.meshes().iter().filter(|(id, _)| !lights.meshes.contains(id)) {
        let others = mesh.primitives.iter().enumerate().filter(|(p, _)| !found.contains_key(&(id, *p)));
        for id in others.filter_map(|(_, primitive)| scene.shown_material(primitive)) {
            materials.remove(&id);
        }
    }
    lights.materials.extend(materials);
    Ok(found)
}

/// The material and the positions of a primitive that has the size of a rectangle and shines.
fn candidate(scene: &Scene, primitive: &Primitive) -> Option<(MaterialId, AccessorId)> {
    let positions = primitive.attributes.get("POSITION").filter(|_| is_surface(primitive.mode))?;
    let vertices = scene.accessors()[positions].count;
    let elements = primitive.indices.map_or(vertices, |id| scene.accessors()[id].count);
    let id = scene.shown_material(primitive)?;
    let material = &scene.materials()[id];
    let shines = material.emissive != [0.0; 3] && material.emissive_strength != Some(0.0);
    let is_even = material.emissive_texture.is_none() && material.alpha_mode == AlphaMode::Opaque;
    ((4..=6).contains(&vertices) && (4..=6).contains(&elements) && shines && is_even).then_some((id, positions))
}

/// The corner and sides of two triangles that make a rectangle, both with the same front.
fn rectangle(surface: &Surface, mode: PrimitiveMode) -> Option<(DVec3, [DVec3; 2])> {
    let triangles = triangles(mode, surface.indices.clone());
    let [first, second] = triangles.as_chunks::<3>().0 else { return None };
    let point = |i: u32| glam::Vec3::from(surface.positions[i as usize]).as_dvec3();
    let (first, second) = (first.map(point), second.map(point));
    for k in 0..3 {
        let [corner, a, b] = [0, 1, 2].map(|i| first[(k + i) % 3]);
        for j in 0..3 {
            let [opposite, b2, a2] = [0, 1, 2].map(|i| second[(j + i) % 3]);
            // They share the diagonal a b, which each goes along in its own direction.
            if (a, b) != (a2, b2) {
                continue;
            }
            let sides = [b - corner, a - corner];
            let is_parallelogram = (corner + opposite - a - b).length() <= TOLERANCE * (a - b).length();
            if is_parallelogram && is_right(sides) {
                return Some((corner, sides));
            }
        }
    }
    None
}

const TOLERANCE: f64 = 1e-4;

/// Whether two sides span an area and stand at a right angle.
fn is_right([a, b]: [DVec3; 2]) -> bool {
    let area = a.length() * b.length();
    area > 0.0 && area.is_finite() && a.dot(b).abs() <= TOLERANCE * area
}

impl Writer<'_> {
    /// Writes a rectangle as a light, in the frame of [`crate::import::crts::lights`].
    pub(super) fn rectangle(
        &mut self,
        node: &Node,
        rectangle: &Rectangle,
        world: DAffine3,
        pointer: &str,
    ) -> Result<()> {
        let material = &self.scene.materials()[rectangle.material];
        if material.double_sided || material.base_color[..3] != [0.0; 3] {
            let what = "a rectangle that shines is a light in CRTS, which is black besides and shines to the front";
            self.note(pointer.to_owned(), what);
        }
        let [mut first, mut second] = rectangle.sides.map(|side| world.transform_vector3(side));
        // A map that mirrors turns the product of the sides, and not the front.
        if world.matrix3.determinant() < 0.0 {
            std::mem::swap(&mut first, &mut second);
        }
        let corner = world.transform_point3(rectangle.corner);
        let size = [first.length(), second.length()];
        let (x, y) = (first / size[0], second / size[1]);
        let column = |v: DVec3, w: f64| [v.x, v.y, v.z, w];
        let columns = [column(x, 0.0), column(y, 0.0), column(x.cross(y), 0.0), column(corner, 1.0)];
        let matrix = super::objects::finite_matrix(std::array::from_fn(|i| columns[i / 4][i % 4]))?;
        let (color, energy) = (material.emissive, material.emissive_strength.unwrap_or(1.0));
        for value in color.into_iter().chain(size).chain([energy]) {
            finite(value, "light")?;
        }
        self.header.objects.push(Object {
            name: Some(node.name.clone().unwrap_or_default()),
            kind: ObjectKind::Light,
            matrix,
            mesh: None,
            material: None,
            color: Some(color),
            energy: Some(energy),
            size: Some(size),
            fov_y: None,
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(positions: &[[f32; 3]], indices: &[u32]) -> Surface {
        let indices = indices.to_vec();
        Surface { positions: positions.to_vec(), normals: None, texcoords: None, colors: None, indices }
    }

    const SQUARE: [[f32; 3]; 4] = [[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.]];

    #[test]
    fn two_triangles_that_make_a_rectangle_are_one_however_they_are_listed() {
        for indices in [[0, 1, 2, 0, 2, 3], [1, 2, 0, 3, 0, 2], [2, 3, 1, 1, 3, 0]] {
            let (corner, [a, b]) = rectangle(&surface(&SQUARE, &indices), PrimitiveMode::Triangles).unwrap();
            assert_eq!(b.cross(a).normalize(), DVec3::Z, "the front is +Z");
            assert_eq!(a.cross(b).length(), 2.0);
            let opposite = (corner + a + b).as_vec3().to_array();
            assert!(SQUARE.contains(&opposite) && opposite != corner.as_vec3().to_array());
        }
        let strip = [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]];
        assert!(rectangle(&surface(&strip, &[0, 1, 2, 3]), PrimitiveMode::TriangleStrip).is_some());
        let apart = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[0], SQUARE[2], SQUARE[3]];
        assert!(rectangle(&surface(&apart, &[0, 1, 2, 3, 4, 5]), PrimitiveMode::Triangles).is_some());
    }

    #[test]
    fn what_is_no_rectangle_is_none() {
        let none = |positions: &[[f32; 3]], indices: &[u32]| {
            assert!(rectangle(&surface(positions, indices), PrimitiveMode::Triangles).is_none(), "{indices:?}");
        };
        none(&SQUARE, &[0, 1, 2, 0, 3, 2]);
        none(&SQUARE, &[0, 1, 2, 0, 1, 2]);
        none(&SQUARE, &[0, 1, 2]);
        none(&[[0., 0., 0.], [2., 0., 0.], [3., 1., 0.], [1., 1., 0.]], &[0, 1, 2, 0, 2, 3]);
        none(&[[0., 0., 0.], [2., 0., 0.], [2., 1., 1.], [0., 1., 0.]], &[0, 1, 2, 0, 2, 3]);
        none(&[[0., 0., 0.]; 4], &[0, 1, 2, 0, 2, 3]);
        none(&[[f32::NAN; 3]; 4], &[0, 1, 2, 0, 2, 3]);
    }
}
