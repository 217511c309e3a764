//! Random operations: what oracle tests and soak runs drive scenes with. The same choices on the same scene give the same
//! operations, so a failure is a script that can be replayed.

use super::ops::Shape;
use super::script::{Operation, Reference, VariantReference};
use crate::Scene;
use crate::model::Kind;
use serde_json::{Value, json};

/// What one random operation is chosen by: four numbers, for a property test to shrink.
pub type Choice = (u8, u32, u32, u32);

/// Choices from a seed (SplitMix64: Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub struct Choices(pub u64);

impl Iterator for Choices {
    type Item = Choice;

    fn next(&mut self) -> Option<Choice> {
        let mut next = || {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        let (a, b) = (next(), next());
        Some((a as u8, (a >> 32) as u32, b as u32, (b >> 32) as u32))
    }
}

/// A number in -1..1.
fn signed(bits: u32) -> f64 {
    f64::from(bits as i32) / f64::from(i32::MAX)
}

fn one_of<T: Copy>(things: [T; 3], choice: u32) -> T {
    things[choice as usize % 3]
}

/// Spheres are seldom: each full derivation that a scene is compared with builds all of their triangles anew.
fn shape(choice: u32) -> Shape {
    match choice % 16 {
        0 => Shape::Sphere,
        1..=8 => Shape::Cube,
        _ => Shape::Plane,
    }
}

/// The operation of a choice. Some are refused: these have to change nothing.
pub fn operation(scene: &Scene, (op, a, b, c): Choice) -> Operation {
    let pick = |kind: Kind, choice: u32| {
        let ids = scene.ids_of(kind);
        let id = ids.get(choice as usize % ids.len().max(1));
        Reference::Index(id.map_or(0, |id| id.slot()))
    };
    // One choice in eight is nothing, where nothing is allowed.
    let maybe = |kind: Kind, choice: u32| (!choice.is_multiple_of(8)).then(|| pick(kind, choice / 8));
    let node = |choice: u32| pick(Kind::Node, choice);
    let vector = |x: u32, y: u32, z: u32| [signed(x), signed(y), signed(z)].map(|v| (v * 64.0).round() / 16.0);
    match op % 40 {
        0..=4 => Operation::SetTransform {
            node: node(a),
            translation: (b % 4 != 0).then(|| vector(b, c, b ^ c)),
            rotation: (c % 3 == 0).then(|| [signed(b), signed(c), signed(a), 0.5]),
            // Uniform most of the time: what is scaled unevenly shears what hangs below it.
            scale: (c % 5 == 0).then(|| if b % 3 == 0 { [1.0, -2.0, 0.5] } else { [1.0 + f64::from(b % 3); 3] }),
            matrix: None,
        },
        5 => Operation::AddNode {
            parent: maybe(Kind::Node, a),
            name: Some(format!("added {}", b % 10)),
            translation: Some(vector(a, b, c)),
            rotation: None,
            scale: None,
            matrix: None,
            label: None,
        },
        6 => Operation::AddShape {
            shape: shape(c),
            parent: maybe(Kind::Node, a),
            material: maybe(Kind::Material, b),
            label: None,
        },
        7 => Operation::AddLight {
            parent: maybe(Kind::Node, a),
            light: json!({"type": one_of(["point", "spot", "directional"], b), "intensity": c % 100}),
            label: None,
        },
        8..=10 => Operation::Delete { node: node(a) },
        11..=13 => Operation::Duplicate { node: node(a), label: None },
        14..=16 => Operation::Reparent {
            node: node(a),
            parent: Some(maybe(Kind::Node, b)),
            index: (c % 2 == 0).then_some(c as usize % 5),
            keep_world: c % 3 == 0,
        },
        17 => Operation::Rename {
            node: Some(node(a)),
            mesh: None,
            material: None,
            light: None,
            name: (b % 4 != 0).then(|| format!("renamed {}", b % 10)),
        },
        18..=19 => Operation::SetVisible { node: node(a), visible: b % 2 == 0 },
        20 => Operation::SetMesh { node: node(a), mesh: maybe(Kind::Mesh, b) },
        21 => match b % 3 {
            0 => Operation::SetCamera { node: node(a), camera: maybe(Kind::Camera, c) },
            1 => Operation::SetSkin { node: node(a), skin: maybe(Kind::Skin, c) },
            _ => Operation::SetCameraParams { camera: pick(Kind::Camera, a), set: json!({"name": "camera"}) },
        },
        22 => Operation::AssignMaterial {
            mesh: pick(Kind::Mesh, a),
            primitive: b as usize % 2,
            material: maybe(Kind::Material, c),
        },
        23 => Operation::DuplicateMaterial { material: pick(Kind::Material, a), label: None },
        24..=25 => Operation::SetMaterial { material: pick(Kind::Material, a), set: material(b, c) },
        26 => Operation::SetLight {
            light: pick(Kind::Light, a),
            set: json!({"intensity": b % 50, "color": [1, 0.5, 0.25]}),
        },
        27 => Operation::SplitMesh { node: node(a) },
        28 => Operation::MergeMesh { node: node(a) },
        29 => {
            let variants = scene.count(Kind::Variant);
            let variant = (variants > 0 && b % 3 != 0).then(|| match pick(Kind::Variant, a) {
                Reference::Index(index) => VariantReference::Index(index),
                Reference::Text(name) => VariantReference::Name(name),
            });
            if b % 7 == 6 { Operation::RemoveUnused {} } else { Operation::SelectVariant { variant } }
        }
        30..=31 => Operation::SetTransform {
            node: node(a),
            translation: None,
            rotation: None,
            scale: None,
            matrix: Some(matrix(a >> 16, b, c)),
        },
        32 => {
            let name = (b % 4 != 0).then(|| format!("renamed {}", b % 10));
            let (mut mesh, mut material, mut light) = (None, None, None);
            match c % 3 {
                0 => mesh = Some(pick(Kind::Mesh, a)),
                1 => material = Some(pick(Kind::Material, a)),
                _ => light = Some(pick(Kind::Light, a)),
            }
            Operation::Rename { node: None, mesh, material, light, name }
        }
        33 => Operation::SetCameraParams { camera: pick(Kind::Camera, a), set: camera(b, c) },
        // The same few nodes again and again: what is hidden twice, and shown below what is hidden.
        34..=35 => Operation::SetVisible { node: node(a % 3), visible: b % 2 == 0 },
        36 => Operation::SetLight { light: pick(Kind::Light, a), set: light(b, c) },
        37 => Operation::AddNode {
            parent: maybe(Kind::Node, a),
            name: None,
            translation: None,
            rotation: None,
            scale: None,
            matrix: Some(matrix(a >> 16, b, c)),
            label: None,
        },
        38 => Operation::Undo { count: 1 + a as usize % 3 },
        _ => Operation::Redo { count: 1 + a as usize % 3 },
    }
}

/// A file that is merged, of those at some paths.
pub fn merge(scene: &Scene, paths: &[String], (_, a, b, c): Choice) -> Option<Operation> {
    let path = paths.get(a as usize % paths.len().max(1))?.clone();
    let nodes = scene.ids_of(Kind::Node);
    let parent = nodes.get(b as usize % nodes.len().max(1)).filter(|_| c.is_multiple_of(2));
    Some(Operation::MergeScene { path, parent: parent.map(|id| Reference::Index(id.slot())), label: None })
}

/// Another time, mostly; else the rest pose. It is no edit, and goes between them.
pub fn time(scene: &Scene, (_, _, b, c): Choice) -> Operation {
    let animations: Vec<usize> = scene.ids_of(Kind::Animation).into_iter().map(|id| id.slot()).collect();
    let animation = animations.get(b as usize % animations.len().max(1)).filter(|_| !b.is_multiple_of(7));
    Operation::SetTime {
        seconds: f64::from(c % 64) / 16.0 - 0.5,
        animation: Some(animation.map(|&index| Reference::Index(index))),
    }
}

fn material(b: u32, c: u32) -> Value {
    match b % 9 {
        0 => json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, f64::from(c % 5) / 4.0]}}),
        1 => json!({"alphaMode": one_of(["OPAQUE", "MASK", "BLEND"], c)}),
        2 => json!({"doubleSided": c.is_multiple_of(2)}),
        3 => json!({"emissiveFactor": if c.is_multiple_of(2) { json!([1, 0.5, 0]) } else { Value::Null }}),
        4 => json!({"extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": c % 20}}}),
        5 => json!({"pbrMetallicRoughness": {"roughnessFactor": f64::from(c % 9) / 8.0}, "normalTexture": null}),
        6 => json!({"normalTexture": {"index": c % 3, "scale": 0.5}}),
        7 => json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": c % 4, "texCoord": c / 4 % 2,
            "extensions": {"KHR_texture_transform": {"offset": [0.25, f64::from(c % 8) / 8.0], "rotation": 0.5}}}}}),
        _ => json!({"alphaMode": "MASK", "alphaCutoff": f64::from(c % 5) / 4.0, "emissiveTexture": null}),
    }
}

/// A transform as a column-major matrix: turned and moved, mirrored, flat, scaled unevenly, or sheared (which is refused).
fn matrix(a: u32, b: u32, c: u32) -> [f64; 16] {
    let angle = signed(c) * std::f64::consts::PI;
    let (sin, cos) = angle.sin_cos();
    let [x, y, z] = match b % 6 {
        0 => [1.0, -1.0, 1.0],
        1 => [1.0, 0.0, 1.0],
        2 => [0.5, 1.0, 2.0],
        _ => [1.0 + f64::from(b % 3); 3],
    };
    let shear = if a.is_multiple_of(5) { 0.5 } else { 0.0 };
    let [tx, ty, tz] = [b, c, a].map(|bits| (signed(bits) * 64.0).round() / 16.0);
    [x * cos, 0.0, -x * sin, 0.0, shear, y, 0.0, 0.0, z * sin, 0.0, z * cos, 0.0, tx, ty, tz, 1.0]
}

/// Some of it is out of range, and refused.
fn camera(b: u32, c: u32) -> Value {
    let near = f64::from(1 + c % 7) / 16.0;
    match b % 6 {
        0 => {
            json!({"type": "perspective", "orthographic": null, "perspective": {"yfov": f64::from(c % 4), "znear": near}})
        }
        1 => json!({"perspective": {"zfar": if c.is_multiple_of(2) { json!(near + 100.0) } else { Value::Null }}}),
        2 => json!({"perspective": {"aspectRatio": f64::from(c % 3)}}),
        3 => json!({"type": "orthographic", "perspective": null,
            "orthographic": {"xmag": 2, "ymag": 1 + c % 3, "znear": near, "zfar": near + f64::from(c % 5)}}),
        4 => json!({"name": if c.is_multiple_of(2) { json!(format!("camera {}", c % 10)) } else { Value::Null }}),
        _ => json!({"perspective": {"znear": near - 0.0625, "yfov": 0.75}}),
    }
}

/// Some of it is out of range, and refused.
fn light(b: u32, c: u32) -> Value {
    match b % 5 {
        0 => json!({"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": f64::from(c % 8) / 4.0}}),
        1 => json!({"type": one_of(["point", "directional", "point"], c), "spot": null}),
        2 => json!({"range": if c.is_multiple_of(3) { Value::Null } else { json!(f64::from(c % 40) / 4.0) }}),
        3 => json!({"color": [f64::from(c % 3) / 2.0, 1, 0], "intensity": null}),
        _ => json!({"intensity": f64::from(c % 9) - 1.0}),
    }
}
