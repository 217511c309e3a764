//! Simple geometry, made here.

use super::applicable;
use super::joints::add_accessor;
use crate::edit::plan::{Plan, Result};
use crate::model::*;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// A shape about the origin, with normals and UVs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// Two by two metres in the XZ plane, facing +Y.
    Plane,
    /// Edges of two metres.
    Cube,
    /// Radius one metre, 64 by 32 faces.
    Sphere,
}

impl Shape {
    /// As the command line names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Cube => "cube",
            Self::Sphere => "sphere",
        }
    }
}

#[derive(Default)]
struct Triangles {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<u16>,
}

impl Triangles {
    fn vertex(&mut self, position: DVec3, normal: DVec3, uv: [f64; 2]) -> u16 {
        self.positions.push(position.as_vec3().to_array());
        self.normals.push(normal.as_vec3().to_array());
        self.uvs.push(uv.map(|v| v as f32));
        (self.positions.len() - 1) as u16
    }

    /// A square of two metres whose middle is `normal` times `distance`. `right` and `up` span it, counter-clockwise.
    fn square(&mut self, normal: DVec3, right: DVec3, distance: f64) {
        let up = normal.cross(right);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let [a, b, c, d] = corners
            .map(|(u, v)| self.vertex(normal * distance + right * u + up * v, normal, [0.5 + 0.5 * u, 0.5 - 0.5 * v]));
        self.indices.extend([a, b, c, a, c, d]);
    }

    fn sphere(&mut self, columns: u16, rows: u16) {
        for row in 0..=rows {
            let polar = PI * f64::from(row) / f64::from(rows);
            for column in 0..=columns {
                let u = f64::from(column) / f64::from(columns);
                let (sin, cos) = (TAU * u).sin_cos();
                let ring = if row == 0 || row == rows { 0.0 } else { polar.sin() };
                let at = DVec3::new(-cos * ring, polar.cos(), sin * ring);
                self.vertex(at, at, [u, f64::from(row) / f64::from(rows)]);
            }
        }
        let width = columns + 1;
        for row in 0..rows {
            for column in 0..columns {
                let (a, b) = (row * width + column, row * width + column + 1);
                let (c, d) = (a + width, b + width);
                // At the poles one of the two triangles has no area.
                if row > 0 {
                    self.indices.extend([a, d, b]);
                }
                if row + 1 < rows {
                    self.indices.extend([a, c, d]);
                }
            }
        }
    }
}

fn triangles(shape: Shape) -> Triangles {
    let mut out = Triangles::default();
    match shape {
        Shape::Plane => out.square(DVec3::Y, DVec3::X, 0.0),
        Shape::Cube => {
            let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
            for (normal, right) in [(z, x), (-z, -x), (x, -z), (-x, z), (y, x), (-y, x)] {
                out.square(normal, right, 1.0);
            }
        }
        Shape::Sphere => out.sphere(64, 32),
    }
    out
}

const ARRAY_BUFFER: Option<u32> = Some(34962);
const ELEMENT_ARRAY_BUFFER: Option<u32> = Some(34963);

pub fn add(p: &mut Plan<'_>, shape: Shape, parent: Option<NodeId>, material: Option<MaterialId>) -> Result<()> {
    material.map(|material| p.material(material).map(|_| ())).transpose()?;
    let Triangles { positions, normals, uvs, indices } = triangles(shape);
    let bytes = |values: &[[f32; 3]]| values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let count = positions.len();
    let f32s = ComponentType::F32;
    let position = add_accessor(p, bytes(&positions), f32s, ElementType::Vec3, count, ARRAY_BUFFER);
    if let Some(accessor) = p.scene.accessors.get_any_mut(position) {
        let bound = |pick: fn(f32, f32) -> f32, start: f32| {
            let fold = |axis: usize| f64::from(positions.iter().fold(start, |bound, v| pick(bound, v[axis])));
            Some([0, 1, 2].map(fold).to_vec())
        };
        (accessor.min, accessor.max) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
    }
    let normal = add_accessor(p, bytes(&normals), f32s, ElementType::Vec3, count, ARRAY_BUFFER);
    let uv = uvs.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let uv = add_accessor(p, uv, f32s, ElementType::Vec2, count, ARRAY_BUFFER);
    let triangles = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
    let indices =
        add_accessor(p, triangles, ComponentType::U16, ElementType::Scalar, indices.len(), ELEMENT_ARRAY_BUFFER);
    let attributes = [("POSITION", position), ("NORMAL", normal), ("TEXCOORD_0", uv)];
    let primitive = Primitive {
        attributes: Attributes(attributes.map(|(semantic, id)| (semantic.to_owned(), id)).to_vec()),
        indices: Some(indices),
        mode: PrimitiveMode::Triangles,
        targets: Vec::new(),
        material,
        variants: Vec::new(),
        extra: Extra::default(),
    };
    if let Some(material) = material {
        applicable::to_new(p, material, &primitive)?;
    }
    let name = Some(shape.name().to_owned());
    let mesh = p.add_mesh(Mesh { name: name.clone(), primitives: vec![primitive], ..Mesh::default() });
    let node = p.add_node(Node { name, mesh: Some(mesh), ..Node::default() });
    p.made = Some(node.into());
    p.attach_last(node, parent)
}
