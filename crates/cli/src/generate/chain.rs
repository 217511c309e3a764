//! A chain of nodes, each the child of the one before: a spring whose every link is turned and moved by its parent.

use super::document::{Document, Node};
use super::shapes::{cuboid, ground};
use super::textures::{opaque, paint};
use glam::{Quat, Vec3};
use serde_json::json;
use std::f32::consts::TAU;

/// Builds a chain that is `depth` nodes deep. Whatever its length, the spring stands 4 m high with a radius of 1 m.
///
/// # Panics
/// If `depth` is 0.
pub fn chain(depth: u32) -> Document {
    assert!(depth > 0, "the command line asks for at least one link");
    let mut doc = Document::default();
    let red = doc.plain_material("lacquer", [0.60, 0.06, 0.04], 0.0, 0.25);
    let steel = doc.plain_material("steel", [0.62, 0.61, 0.60], 1.0, 0.25);

    // Each link repeats one screw motion: a turn about the axis and a rise along it
    let turns = (depth as f32 / 12.0).min(8.0);
    let angle = turns * TAU / depth as f32;
    let rise = 4.0 / depth as f32;
    let radius = 1.0;
    let length = (radius * angle).hypot(rise);
    let size = [0.18f32.min(length * 2.0), 0.18f32.min(length * 2.0), length * 0.85];
    let link = doc.mesh("link", &[(&cuboid(size), red)]);
    let other = doc.recoloured_mesh("other link", link, steel);

    // In the frame of a link the axis passes through (-radius, 0, 0), and the link runs along Z
    let rotation = Quat::from_rotation_y(-angle);
    let axis = Vec3::new(-radius, 0.0, 0.0);
    let step = axis - rotation * axis + Vec3::Y * rise;
    let mut parent = doc.root(Node::mesh(link).called("link 0").at(Vec3::new(radius, 0.2, 0.0)));
    for i in 1..depth {
        let mesh = if i % 8 == 7 { other } else { link };
        parent = doc.child(parent, Node::mesh(mesh).at(step).turned(rotation));
    }

    let texels = paint(64, 64, |u, v| {
        let line = u < 0.03 || v < 0.03;
        opaque(if line { [0.52; 3] } else { [0.68, 0.69, 0.70] })
    });
    let texture = doc.texture("floor tiles", 64, 64, &texels, false);
    let floor = doc.material(json!({ "name": "floor", "pbrMetallicRoughness": {
        "baseColorTexture": { "index": texture }, "metallicFactor": 0.0, "roughnessFactor": 0.5 } }));
    let floor = doc.mesh("floor", &[(&ground(60.0, 60.0).tiled(60.0, 60.0), floor)]);
    doc.root(Node::mesh(floor).called("floor"));
    doc.look_at("camera", Vec3::new(3.6, 3.4, 8.2), Vec3::new(0.0, 2.05, 0.0), 32.0);
    doc
}
