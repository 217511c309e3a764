//! Scenes that are edited.

use crate::common::Document;
use image::{ImageFormat, RgbaImage};
use orthant_scene::Scene;
use serde_json::{Value, json};
use std::io::Cursor;

pub fn png(color: [u8; 4]) -> Vec<u8> {
    let mut bytes = Vec::new();
    RgbaImage::from_pixel(2, 2, image::Rgba(color)).write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
    bytes
}

/// Two meshes (one of two primitives), materials with textures, lights and an emitter: what the others are made of.
pub fn parts(nodes: Value, members: Value) -> Document {
    let mut document = Document::new(members);
    document.json["nodes"] = nodes;
    let triangle = document.triangle();
    let quad = document.floats("VEC3", &[[-1., 0., -1.], [1., 0., -1.], [1., 0., 1.], [-1., 0., 1.]]);
    let uv = document.floats("VEC2", &[[0., 0.], [1., 0.], [1., 1.], [0., 1.]]);
    let indices = document.indices(&[0, 2, 1, 0, 3, 2]);
    let images = [[255, 0, 0, 255], [128, 128, 255, 255], [255, 255, 0, 255]].map(|color| document.bytes(&png(color)));
    document.json["meshes"] = json!([
        {"primitives": [{"attributes": {"POSITION": triangle}, "material": 0}]},
        {"primitives": [
            {"attributes": {"POSITION": quad, "TEXCOORD_0": uv, "TEXCOORD_1": uv}, "indices": indices, "material": 1},
            {"attributes": {"POSITION": triangle}, "material": 2},
        ]},
        {"primitives": [{"attributes": {"POSITION": quad, "TEXCOORD_0": uv, "TEXCOORD_1": uv}, "indices": indices}]},
    ]);
    document.json["images"] = images.iter().map(|view| json!({"bufferView": view, "mimeType": "image/png"})).collect();
    document.json["textures"] = json!([{"source": 0}, {"source": 1}, {"source": 2}]);
    document.json["materials"] = json!([
        {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}},
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "doubleSided": true},
        {"emissiveFactor": [1, 1, 0.5]},
        {"alphaMode": "BLEND", "emissiveTexture": {"index": 2}, "emissiveFactor": [1, 1, 1]},
    ]);
    document.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}},
        {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 10}},
    ]);
    document.json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_animation_pointer", "KHR_node_visibility"]);
    document.json["extensions"]["KHR_lights_punctual"] = json!({"lights": [
        {"type": "point", "intensity": 10}, {"type": "spot", "spot": {}, "intensity": 5},
    ]});
    animate(&mut document);
    document
}

/// Two animations of what all scenes have: nodes (the first two, if there are as many), and what pointers name.
fn animate(document: &mut Document) {
    let nodes = document.json["nodes"].as_array().unwrap().len().min(2);
    let times = document.floats("SCALAR", &[[0.0], [1.0], [3.0]]);
    let translation = document.floats("VEC3", &[[0., 0., 0.], [1., 2., 3.], [4., -2., 0.5]]);
    let rotation = document.floats("VEC4", &[[0., 0., 0., 1.], [0., 0.6, 0., 0.8], [0.6, 0., 0., -0.8]]);
    let scale = document.floats(
        "VEC3",
        &[[0.; 3], [1.; 3], [0.; 3], [0.; 3], [2., 1., 1.], [0.; 3], [0.; 3], [1., -1., 1.], [1., 1., 0.]],
    );
    let color = document.floats("VEC4", &[[1., 0., 0., 1.], [0., 1., 0., 0.5], [0., 0., 1., 1.]]);
    let emissive = document.floats("VEC3", &[[0., 0., 0.], [1., 0.5, 0.], [0., 0., 0.]]);
    let intensity = document.floats("SCALAR", &[[0.0], [8.0], [2.0]]);
    let visible = document.floats("SCALAR", &[[1.0], [0.0], [1.0]]);
    let mut moves = json!({"name": "move", "channels": [], "samplers": [
        {"input": times, "output": translation},
        {"input": times, "output": rotation},
        {"input": times, "output": scale, "interpolation": "CUBICSPLINE"},
    ]});
    for (node, sampler, path) in [(0, 0, "translation"), (1, 1, "rotation"), (1, 2, "scale")] {
        if node < nodes {
            let channels = moves["channels"].as_array_mut().unwrap();
            channels.push(json!({"sampler": sampler, "target": {"node": node, "path": path}}));
        }
    }
    let pointer = |sampler: usize, pointer: &str| {
        json!({"sampler": sampler, "target":
            {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}})
    };
    let looks = json!({"name": "look", "samplers": [
        {"input": times, "output": color},
        {"input": times, "output": emissive},
        {"input": times, "output": intensity},
        {"input": times, "output": visible, "interpolation": "STEP"},
    ], "channels": [
        pointer(0, "/materials/0/pbrMetallicRoughness/baseColorFactor"),
        pointer(1, "/materials/0/emissiveFactor"),
        pointer(1, "/materials/2/emissiveFactor"),
        pointer(2, "/extensions/KHR_lights_punctual/lights/0/intensity"),
        pointer(3, &format!("/nodes/{}/extensions/KHR_node_visibility/visible", nodes - 1)),
    ]});
    document.json["animations"] = json!([moves, looks]);
}

fn light(index: usize) -> Value {
    json!({"KHR_lights_punctual": {"light": index}})
}

/// A chain, each with a mesh, some with lights.
pub fn deep(count: usize) -> Scene {
    let node = |i: usize| {
        let mut node = json!({"mesh": i % 3, "translation": [0.5, 0.25, 0], "rotation": [0, 0, 0.1, 0.995]});
        if i + 1 < count {
            node["children"] = json!([i + 1]);
        }
        if i.is_multiple_of(7) {
            node["extensions"] = light(i % 2);
        }
        node
    };
    let nodes = (0..count).map(node).collect();
    parts(nodes, json!({"scene": 0, "scenes": [{"nodes": [0]}]})).import()
}

/// Many below one.
pub fn wide(count: usize) -> Scene {
    let mut nodes = vec![json!({"children": (1..=count).collect::<Vec<_>>()})];
    nodes.extend((1..=count).map(|i| json!({"mesh": i % 3, "translation": [i, 0, 0], "scale": [1, 1, -1]})));
    let mut document = parts(nodes.into(), json!({"scene": 0, "scenes": [{"nodes": [0]}]}));
    let times = document.floats("SCALAR", &[[0.0], [2.0]]);
    let up = document.floats("VEC3", &[[3., 0., 0.], [3., 5., 0.]]);
    document.json["animations"].as_array_mut().unwrap().push(json!({"name": "up", "samplers": [
        {"input": times, "output": up},
    ], "channels": [{"sampler": 0, "target": {"node": 3, "path": "translation"}}]}));
    document.import()
}

/// EXT_mesh_gpu_instancing below a turned node.
pub fn instanced() -> Scene {
    let mut document = parts(
        json!([
            {"children": [1, 2], "rotation": [0, 0.6, 0, 0.8]},
            {"mesh": 1, "translation": [0, 3, 0]},
            {"mesh": 0, "extensions": light(1)},
        ]),
        json!({"scene": 0, "scenes": [{"nodes": [0]}]}),
    );
    let translation = document.floats("VEC3", &[[0., 0., 0.], [5., 0., 0.], [0., 0., 5.]]);
    let scale = document.floats("VEC3", &[[1., 1., 1.], [2., 2., 2.], [1., -1., 1.]]);
    document.json["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"] =
        json!({"attributes": {"TRANSLATION": translation, "SCALE": scale}});
    document.json["extensionsUsed"] = json!(["KHR_lights_punctual", "EXT_mesh_gpu_instancing"]);
    document.import()
}

/// Two figures with one mesh and two skins, and a morphed node; a second scene, which is not shown.
pub fn skinned() -> Scene {
    skinned_document().import()
}

pub fn skinned_document() -> Document {
    let mut document = parts(
        json!([
            {"children": [1, 2, 5, 8]},
            {"mesh": 3, "skin": 0},
            {"children": [3], "translation": [0, 1, 0]},
            {"children": [4], "translation": [0, 1, 0]},
            {"translation": [0, 1, 0], "mesh": 0},
            {"mesh": 3, "skin": 1},
            {"children": [7], "translation": [4, 0, 0]},
            {"translation": [0, 2, 0]},
            {"mesh": 4, "weights": [0.5], "children": [6]},
            {"name": "elsewhere"},
        ]),
        json!({"scene": 0, "scenes": [{"nodes": [0]}, {"nodes": [9]}]}),
    );
    let positions = document.floats("VEC3", &[[0., 0., 0.], [1., 1., 0.], [0., 2., 0.], [1., 3., 0.]]);
    let joints = document.joints(&[[0, 1, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]]);
    let weights = document.floats("VEC4", &[[1., 0., 0., 0.], [0.5, 0.5, 0., 0.], [1., 0., 0., 0.], [1., 0., 0., 0.]]);
    let target = document.floats("VEC3", &[[0., 0., 1.], [0., 0., 1.], [0., 0., 0.], [0., 0., 0.]]);
    let indices = document.indices(&[0, 1, 2, 2, 1, 3]);
    let meshes = document.json["meshes"].as_array_mut().unwrap();
    meshes.push(json!({"primitives": [
        {"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}, "indices": indices, "material": 0},
    ]}));
    meshes.push(json!({"primitives": [
        {"attributes": {"POSITION": positions}, "indices": indices, "material": 2, "targets": [{"POSITION": target}]},
    ]}));
    document.json["skins"] = json!([{"joints": [2, 3]}, {"joints": [6, 7]}]);
    let times = document.floats("SCALAR", &[[0.0], [2.0]]);
    let weights = document.floats("SCALAR", &[[0.0], [1.0]]);
    let bend = document.floats("VEC4", &[[0., 0., 0., 1.], [0., 0., 0.6, 0.8]]);
    document.json["animations"].as_array_mut().unwrap().push(json!({"name": "bend", "samplers": [
        {"input": times, "output": weights}, {"input": times, "output": bend},
    ], "channels": [
        {"sampler": 0, "target": {"node": 8, "path": "weights"}},
        {"sampler": 1, "target": {"node": 3, "path": "rotation"}},
        {"sampler": 1, "target": {"node": 7, "path": "rotation"}},
    ]}));
    document
}

/// Three scenes that share no root, the second of which is shown.
pub fn many_scenes() -> Scene {
    parts(
        json!([
            {"mesh": 0, "children": [1]}, {"mesh": 1}, {"mesh": 2, "children": [3]}, {"mesh": 1, "extensions": light(0)},
            {"children": [5]}, {"mesh": 0, "extensions": light(0)}, {"mesh": 1},
        ]),
        json!({"scene": 1, "scenes": [{"nodes": [0]}, {"nodes": [2, 4]}, {"nodes": [6]}]}),
    )
    .import()
}

/// Variants that exchange a plain material for one that emits, and for one with a normal map.
pub fn variants() -> Scene {
    let mut document = parts(
        json!([{"mesh": 1, "children": [1]}, {"mesh": 1, "translation": [0, 2, 0]}, {"mesh": 0}]),
        json!({"scene": 0, "scenes": [{"nodes": [0, 2]}]}),
    );
    document.json["extensions"]["KHR_materials_variants"] = json!({"variants": [{"name": "a"}, {"name": "b"}]});
    document.json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_materials_variants"]);
    document.json["meshes"][1]["primitives"][0]["extensions"]["KHR_materials_variants"] =
        json!({"mappings": [{"material": 3, "variants": [0]}, {"material": 4, "variants": [1]}]});
    let materials = document.json["materials"].as_array_mut().unwrap();
    materials.push(json!({"normalTexture": {"index": 1}, "alphaMode": "MASK"}));
    document.import()
}

/// One of each sort.
pub fn all() -> Vec<(&'static str, Scene)> {
    vec![
        ("deep", deep(24)),
        ("wide", wide(40)),
        ("instanced", instanced()),
        ("skinned", skinned()),
        ("many scenes", many_scenes()),
        ("variants", variants()),
    ]
}
