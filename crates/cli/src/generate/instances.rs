//! Beads in a sunflower's spiral, by EXT_mesh_gpu_instancing: a handful of nodes, any number of instances.

use super::document::{Document, Index, Node};
use super::random::fractal_noise;
use super::shapes::{ground, sphere};
use glam::{Quat, Vec3};
use serde_json::json;

/// Kinds of beads: each is one instanced node.
const KINDS: usize = 4;

/// Builds a scene of `count` instances. Whatever the count, the spiral is 10 m wide.
pub fn instances(count: u32) -> Document {
    let mut doc = Document::default();
    let bead = sphere(1.0, 24, 12);
    let materials: [Index; KINDS] = [
        doc.plain_material("gold", [1.0, 0.77, 0.34], 1.0, 0.2),
        doc.plain_material("teal", [0.02, 0.30, 0.33], 0.0, 0.25),
        doc.plain_material("ivory", [0.85, 0.80, 0.70], 0.0, 0.45),
        doc.plain_material("coral", [0.80, 0.18, 0.12], 0.0, 0.3),
    ];
    let first = doc.mesh("bead", &[(&bead, materials[0])]);

    // Vogel's spiral: the n-th bead at radius sqrt(n), turned by the golden angle
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let spacing = 5.0 / (count.max(1) as f32).sqrt();
    let mut groups: [[Vec<Vec3>; 2]; KINDS] = Default::default();
    let mut rotations: [Vec<[f32; 4]>; KINDS] = Default::default();
    for n in 0..count {
        let radius = spacing * (n as f32 + 0.5).sqrt();
        // Reduced in f64: the angle of the millionth bead has lost its fraction in f32.
        let angle = ((f64::from(n) * f64::from(golden)) % std::f64::consts::TAU) as f32;
        let (sin, cos) = angle.sin_cos();
        let dome = 1.5 * (-radius * radius / 9.0).exp();
        let wave = 0.18 * (radius * 3.2).cos();
        let size = spacing * (0.74 + 0.2 * fractal_noise(5, radius * 0.9 * cos, radius * 0.9 * sin));
        let position = Vec3::new(radius * sin, dome + wave + 0.2 + size, radius * cos);
        // Every 21st bead lies on one arm of the spiral: Fibonacci numbers are what the eye sees in it
        let kind = match n % 21 {
            0 | 1 => 0,
            5 | 13 => 2,
            8 | 9 | 16 => 3,
            _ => 1,
        };
        groups[kind][0].push(position);
        groups[kind][1].push(Vec3::new(size, size * 0.7, size));
        rotations[kind].push((Quat::from_rotation_y(angle) * Quat::from_rotation_x(0.35)).to_array());
    }
    doc.extension("EXT_mesh_gpu_instancing", true);
    for (kind, [positions, sizes]) in groups.iter().enumerate() {
        if positions.is_empty() {
            continue;
        }
        let mesh = if kind == 0 { first } else { doc.recoloured_mesh("bead", first, materials[kind]) };
        let arrays = |list: &[Vec3]| list.iter().map(|v| v.to_array()).collect::<Vec<_>>();
        let translation = doc.floats(&arrays(positions), false);
        let rotation = doc.floats(&rotations[kind], false);
        let scale = doc.floats(&arrays(sizes), false);
        let mut node = Node::mesh(mesh).called("beads");
        node.extensions = Some(json!({ "EXT_mesh_gpu_instancing": { "attributes": {
            "TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale } } }));
        doc.root(node);
    }
    let floor = doc.plain_material("floor", [0.30, 0.29, 0.28], 0.0, 0.8);
    let floor = doc.mesh("floor", &[(&ground(80.0, 80.0), floor)]);
    doc.root(Node::mesh(floor).called("floor"));
    doc.look_at("camera", Vec3::new(0.0, 5.4, 9.4), Vec3::new(0.0, 0.35, 0.0), 34.0);
    doc
}
