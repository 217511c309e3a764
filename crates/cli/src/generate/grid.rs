//! A rolling landscape as one mesh of N x N vertices: for loading and tracing big geometry.

use super::document::{Document, Node};
use super::random::fractal_noise;
use super::shapes::Geometry;
use glam::Vec3;

/// Edge of the landscape in metres.
const SIZE: f32 = 20.0;

/// Builds a height field of `side * side` vertices: `2 (side - 1)^2` triangles.
pub fn grid(side: u32, seed: u64) -> Document {
    let mut doc = Document::default();
    let step = SIZE / (side - 1) as f32;
    let height = |x: f32, z: f32| 1.6 * fractal_noise(seed, x * 0.35, z * 0.35);
    let mut geometry = Geometry::default();
    let vertices = (side * side) as usize;
    geometry.positions.reserve(vertices);
    geometry.normals.reserve(vertices);
    geometry.uvs.reserve(vertices);
    for z in 0..side {
        for x in 0..side {
            let at = |i: u32| i as f32 * step - 0.5 * SIZE;
            let (px, pz) = (at(x), at(z));
            // The slope over a fixed distance, so that the shading does not depend on the number of vertices.
            let h = 0.02;
            let slope = |dx: f32, dz: f32| height(px + dx, pz + dz) - height(px - dx, pz - dz);
            let normal = Vec3::new(-slope(h, 0.0), 2.0 * h, -slope(0.0, h)).normalize();
            geometry.positions.push([px, height(px, pz), pz]);
            geometry.normals.push(normal.to_array());
            geometry.uvs.push([x as f32 / (side - 1) as f32, z as f32 / (side - 1) as f32]);
        }
    }
    for z in 0..side - 1 {
        for x in 0..side - 1 {
            let a = z * side + x;
            geometry.indices.extend([a, a + side, a + 1, a + 1, a + side, a + side + 1]);
        }
    }
    let clay = doc.plain_material("clay", [0.52, 0.36, 0.25], 0.0, 0.9);
    let mesh = doc.mesh("landscape", &[(&geometry, clay)]);
    doc.root(Node::mesh(mesh).called("landscape"));
    doc.look_at("camera", Vec3::new(0.0, 7.0, 15.0), Vec3::new(0.0, 0.3, 0.0), 38.0);
    doc
}
