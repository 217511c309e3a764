//! A crowd of walking figures: one skinned mesh, a skin with joints of its own for each, and animation clips.

use super::document::{Document, Index, Node};
use super::random::Random;
use super::shapes::{Geometry, capsule, ground};
use super::textures::{opaque, paint, tiling_noise};
use glam::{Affine3A, Mat4, Quat, Vec3};
use serde_json::{Value, json};
use std::f32::consts::{PI, TAU};

/// A bone: its parent, its joint in the rest frame of the figure, the end of its capsule, radii there, and how it swings.
struct Bone {
    name: &'static str,
    parent: Option<usize>,
    joint: [f32; 3],
    end: [f32; 3],
    radii: [f32; 2],
    /// Amplitude of the swing about X in radians, its phase in turns, and a constant bend.
    swing: [f32; 3],
}

const fn bone(
    name: &'static str,
    parent: Option<usize>,
    joint: [f32; 3],
    end: [f32; 3],
    radii: [f32; 2],
    swing: [f32; 3],
) -> Bone {
    Bone { name, parent, joint, end, radii, swing }
}

/// The figure stands at the origin, 1.75 m tall, and faces +Z; its left is +X.
#[rustfmt::skip]
const BONES: [Bone; 12] = [
    bone("hips", None, [0.0, 0.95, 0.0], [0.0, 1.02, 0.0], [0.15, 0.14], [0.0, 0.0, 0.0]),
    bone("spine", Some(0), [0.0, 1.05, 0.0], [0.0, 1.38, 0.0], [0.13, 0.17], [0.04, 0.25, 0.06]),
    bone("head", Some(1), [0.0, 1.50, 0.0], [0.0, 1.64, 0.01], [0.07, 0.115], [0.03, 0.5, 0.0]),
    bone("upper arm left", Some(1), [0.21, 1.42, 0.0], [0.25, 1.15, 0.0], [0.06, 0.05], [0.55, 0.5, 0.0]),
    bone("forearm left", Some(3), [0.25, 1.14, 0.0], [0.26, 0.88, 0.0], [0.05, 0.04], [0.25, 0.55, -0.35]),
    bone("upper arm right", Some(1), [-0.21, 1.42, 0.0], [-0.25, 1.15, 0.0], [0.06, 0.05], [0.55, 0.0, 0.0]),
    bone("forearm right", Some(5), [-0.25, 1.14, 0.0], [-0.26, 0.88, 0.0], [0.05, 0.04], [0.25, 0.05, -0.35]),
    bone("thigh left", Some(0), [0.10, 0.92, 0.0], [0.10, 0.52, 0.0], [0.095, 0.07], [0.5, 0.0, -0.08]),
    bone("shin left", Some(7), [0.10, 0.50, 0.0], [0.10, 0.09, 0.0], [0.068, 0.05], [0.4, 0.72, 0.45]),
    bone("thigh right", Some(0), [-0.10, 0.92, 0.0], [-0.10, 0.52, 0.0], [0.095, 0.07], [0.5, 0.5, -0.08]),
    bone("shin right", Some(9), [-0.10, 0.50, 0.0], [-0.10, 0.09, 0.0], [0.068, 0.05], [0.4, 0.22, 0.45]),
    bone("chest", Some(1), [0.0, 1.36, 0.0], [0.0, 1.41, 0.0], [0.18, 0.16], [0.0, 0.0, 0.0]),
];

/// Phases of the walk that clips exist for.
const PHASES: usize = 8;
/// Key frames of a clip.
const KEYS: usize = 17;
/// Duration of one walk cycle in seconds.
const PERIOD: f32 = 1.1;

/// Builds a crowd of `count` figures.
pub fn animated_crowd(count: u32, seed: u64) -> Document {
    let mut doc = Document::default();
    let meshes = figures(&mut doc);
    let bind = BONES.map(|b| Mat4::from_translation(-Vec3::from(b.joint)).to_cols_array());
    let bind = doc.floats(&bind, false);
    let clips = clips(&mut doc);

    let mut random = Random::new(seed);
    let rows = (count as f32 / 1.6).sqrt().ceil().max(1.0) as u32;
    let columns = count.div_ceil(rows).max(1);
    let mut channels: Vec<Value> = Vec::new();
    for i in 0..count {
        let (column, row) = (i % columns, i / columns);
        let jitter = Vec3::new(random.range(-0.4, 0.4), 0.0, random.range(-0.45, 0.45));
        let at = Vec3::new((column as f32 - (columns - 1) as f32 * 0.5) * 1.35, 0.0, -(row as f32) * 1.5) + jitter;
        let phase = random.below(PHASES);
        let figure = Node::named(format!("figure {i}"))
            .at(at)
            .turned(Quat::from_rotation_y(random.range(-0.25, 0.25)))
            .scaled(Vec3::splat(random.range(0.92, 1.07)));
        let figure = doc.root(figure);
        let mut joints: Vec<Index> = Vec::with_capacity(BONES.len());
        for (b, bone) in BONES.iter().enumerate() {
            let origin = bone.parent.map_or(Vec3::ZERO, |p| Vec3::from(BONES[p].joint));
            let parent = bone.parent.map_or(figure, |p| joints[p]);
            let node = Node::named(bone.name).at(Vec3::from(bone.joint) - origin).turned(swing(b, phase, 0.0));
            joints.push(doc.child(parent, node));
            channels.push(
                json!({ "sampler": phase * BONES.len() + b, "target": { "node": joints[b], "path": "rotation" } }),
            );
        }
        let skin = doc.skin(&joints, joints[0], bind);
        let mut node = Node::mesh(meshes[random.below(meshes.len())]);
        node.skin = Some(skin);
        // A skinned mesh is placed by its joints: its own node stays at the root.
        doc.root(node);
    }
    if !channels.is_empty() {
        drop_unused_samplers(&mut doc, channels, &clips);
    }
    square(&mut doc, columns.max(rows) as f32 * 1.5);
    let width = columns as f32 * 1.35;
    let eye = Vec3::new(width * 0.18, 2.1 + width * 0.06, 4.2 + width * 0.16);
    doc.look_at("camera", eye, Vec3::new(0.0, 0.85, -2.0 - rows as f32 * 0.25), 38.0);
    doc
}

/// The rotation of a bone at a time in 0..1 of the cycle.
fn swing(bone: usize, phase: usize, time: f32) -> Quat {
    let [amplitude, offset, bend] = BONES[bone].swing;
    let turn = (time + offset + phase as f32 / PHASES as f32).fract();
    Quat::from_rotation_x(bend + amplitude * (turn * TAU).sin())
}

/// Samplers (input, output) of every bone at every phase: `phase * BONES.len() + bone`.
fn clips(doc: &mut Document) -> Vec<(Index, Index)> {
    let times: Vec<[f32; 1]> = (0..KEYS).map(|k| [PERIOD * k as f32 / (KEYS - 1) as f32]).collect();
    let input = doc.floats(&times, true);
    let mut samplers = Vec::new();
    for phase in 0..PHASES {
        for bone in 0..BONES.len() {
            let keys: Vec<[f32; 4]> = (0..KEYS)
                .map(|k| swing(bone, phase, (k % (KEYS - 1)) as f32 / (KEYS - 1) as f32).normalize().to_array())
                .collect();
            samplers.push((input, doc.floats(&keys, false)));
        }
    }
    samplers
}

/// Adds the clip with those samplers only that a channel uses, renumbered.
fn drop_unused_samplers(doc: &mut Document, mut channels: Vec<Value>, clips: &[(Index, Index)]) {
    let mut numbers = vec![None; clips.len()];
    let mut samplers: Vec<Value> = Vec::new();
    for channel in &mut channels {
        let old = channel["sampler"].as_u64().expect("set by the caller") as usize;
        let new = *numbers[old].get_or_insert_with(|| {
            let (input, output) = clips[old];
            samplers.push(json!({ "input": input, "output": output, "interpolation": "LINEAR" }));
            samplers.len() - 1
        });
        channel["sampler"] = json!(new);
    }
    doc.animation(json!({ "name": "walk", "channels": channels, "samplers": samplers }));
}

/// The figure in a few colours: clothes and skin, one geometry each, shared.
fn figures(doc: &mut Document) -> Vec<Index> {
    let (mut clothes, mut skin) = (Geometry::default(), Geometry::default());
    for (b, bone) in BONES.iter().enumerate() {
        let (from, to) = (Vec3::from(bone.joint), Vec3::from(bone.end));
        let axis = to - from;
        let mut limb = capsule(bone.radii[0], bone.radii[1], axis.length(), 16, 5);
        // The cap at the joint follows the parent by a third, so that the skin stretches over the bend. glTF wants
        // joint 0 where the weight is 0.
        for p in &limb.positions {
            let shared = bone.parent.map_or(0.0, |_| (-p[1] / bone.radii[0]).clamp(0.0, 1.0) / 3.0);
            let parent = bone.parent.filter(|_| shared > 0.0).unwrap_or(0);
            limb.joints.push([b as u8, parent as u8, 0, 0]);
            limb.weights.push([1.0 - shared, shared, 0.0, 0.0]);
        }
        let bare = bone.name == "head" || bone.name.starts_with("forearm");
        let trousers = ["hips", "thigh", "shin"].iter().any(|n| bone.name.starts_with(n));
        if !bare {
            // The vertex colour darkens the colour of the clothes to trousers.
            limb = limb.coloured(|_| if trousers { [0.16, 0.17, 0.20] } else { [1.0; 3] });
        }
        let map = Affine3A::from_rotation_translation(Quat::from_rotation_arc(Vec3::Y, axis.normalize()), from);
        (if bare { &mut skin } else { &mut clothes }).append(&limb, map);
    }
    let colours = [[0.62, 0.10, 0.08], [0.06, 0.24, 0.42], [0.80, 0.52, 0.10], [0.12, 0.34, 0.20], [0.70, 0.70, 0.68]];
    let skin_material = doc.plain_material("skin", [0.62, 0.40, 0.29], 0.0, 0.55);
    let mut meshes: Vec<Index> = Vec::new();
    for rgb in colours {
        let material = doc.plain_material("clothes", rgb, 0.0, 0.7);
        let mesh = match meshes.first() {
            Some(&first) => doc.recoloured_mesh("figure", first, material),
            None => doc.mesh("figure", &[(&clothes, material), (&skin, skin_material)]),
        };
        meshes.push(mesh);
    }
    meshes
}

/// A paved square under the crowd.
fn square(doc: &mut Document, extent: f32) {
    let slabs = paint(256, 256, |u, v| {
        let (x, y) = (u * 4.0, v * 4.0 + if (u * 4.0) as u32 % 2 == 1 { 0.5 } else { 0.0 });
        let joint = x.fract() < 0.04 || y.fract() < 0.04;
        let shade = 0.58 + 0.16 * tiling_noise(101, u, v, 16.0) + 0.05 * ((x.floor() * 2.0 + y.floor()) * PI).sin();
        opaque(if joint { [0.36, 0.35, 0.34] } else { [shade, shade * 0.98, shade * 0.95] })
    });
    let slabs = doc.texture("slabs", 256, 256, &slabs, false);
    let material = doc.material(json!({ "name": "slabs", "pbrMetallicRoughness": {
        "baseColorTexture": { "index": slabs }, "metallicFactor": 0.0, "roughnessFactor": 0.8 } }));
    let size = extent * 2.0 + 80.0;
    let mesh = doc.mesh("square", &[(&ground(size, size).tiled(size / 4.0, size / 4.0), material)]);
    doc.root(Node::mesh(mesh).called("square"));
}
