//! Scenes that are edited.

use crate::Scene;
use crate::import::{ImportOptions, import_slice};
use crate::testing::every_slot_scene;
use base64::Engine;
use serde_json::{Value, json};

pub fn import(document: &Value) -> Scene {
    import_slice(document.to_string(), None, "a.gltf", &ImportOptions::default()).unwrap().scene
}

fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

/// Four joints in a chain (nodes 2 to 5), six vertices that follow them, a second mesh user without the skin, and
/// animations of two joints and of a node's visibility by pointer.
pub fn skinned() -> Scene {
    let mut bin: Vec<u8> = Vec::new();
    for i in 0..6u8 {
        [f32::from(i), 0.5, 0.0].iter().for_each(|v| bin.extend(v.to_le_bytes()));
    }
    let joints = bin.len();
    for vertex in [[0, 1, 2, 3], [1, 2, 0, 0], [2, 3, 0, 0], [3, 0, 0, 0], [2, 0, 0, 0], [1, 3, 0, 0]] {
        bin.extend(vertex.map(|v: u8| v));
    }
    let weights = bin.len();
    let all = [
        [0.25f32; 4],
        [0.5, 0.5, 0., 0.],
        [0.75, 0.25, 0., 0.],
        [1., 0., 0., 0.],
        [1., 0., 0., 0.],
        [0.5, 0.5, 0., 0.],
    ];
    all.iter().flatten().for_each(|v| bin.extend(v.to_le_bytes()));
    let matrices = bin.len();
    for joint in 0..4u8 {
        let mut matrix = [0.0f32; 16];
        (0..4).for_each(|i| matrix[i * 5] = 1.0);
        matrix[12] = -f32::from(joint);
        matrix.iter().for_each(|v| bin.extend(v.to_le_bytes()));
    }
    let times = bin.len();
    [0.0f32, 1.0].iter().for_each(|v| bin.extend(v.to_le_bytes()));
    let values = bin.len();
    [0.0f32, 0., 0., 1., 2., 3.].iter().for_each(|v| bin.extend(v.to_le_bytes()));
    let end = bin.len();
    let view = |from: usize, to: usize| json!({"buffer": 0, "byteOffset": from, "byteLength": to - from});
    import(&json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_animation_pointer", "KHR_node_visibility"],
        "scene": 0,
        "scenes": [{"nodes": [0]}, {"nodes": [0, 6]}],
        "nodes": [
            {"children": [1, 2]},
            {"mesh": 0, "skin": 0, "name": "body"},
            {"children": [3], "translation": [0, 1, 0], "name": "hip"},
            {"children": [4], "translation": [1, 0, 0], "name": "spine"},
            {"children": [5], "translation": [1, 0, 0], "name": "arm"},
            {"translation": [1, 0, 0], "name": "hand"},
            {"mesh": 0, "name": "statue"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}]}],
        "skins": [{"joints": [2, 3, 4, 5], "inverseBindMatrices": 3, "skeleton": 2}],
        "animations": [
            {
                "samplers": [{"input": 4, "output": 5}, {"input": 4, "output": 5, "interpolation": "STEP"}],
                "channels": [
                    {"sampler": 0, "target": {"node": 3, "path": "translation"}},
                    {"sampler": 1, "target": {"node": 5, "path": "scale"}},
                ],
            },
            {
                "samplers": [{"input": 4, "output": 5}],
                "channels": [{"sampler": 0, "target": {"path": "pointer", "extensions": {
                    "KHR_animation_pointer": {"pointer": "/nodes/4/translation"}}}}],
            },
        ],
        "buffers": [{"byteLength": end, "uri": data_uri(&bin)}],
        "bufferViews": [
            view(0, joints), view(joints, weights), view(weights, matrices), view(matrices, times),
            view(times, values), view(values, end),
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3", "min": [0, 0.5, 0], "max": [5, 0.5, 0]},
            {"bufferView": 1, "componentType": 5121, "count": 6, "type": "VEC4"},
            {"bufferView": 2, "componentType": 5126, "count": 6, "type": "VEC4"},
            {"bufferView": 3, "componentType": 5126, "count": 4, "type": "MAT4"},
            {"bufferView": 4, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
            {"bufferView": 5, "componentType": 5126, "count": 2, "type": "VEC3"},
        ],
    }))
}

/// A root with many children; every tenth shows a mesh.
pub fn wide(count: usize) -> Scene {
    let mut nodes = vec![json!({"children": (1..=count).collect::<Vec<_>>()})];
    nodes.extend((1..=count).map(|i| {
        let translation = [i as f64, 0.0, 0.0];
        if i % 10 == 0 { json!({"translation": translation, "mesh": 0}) } else { json!({"translation": translation}) }
    }));
    with_triangle(&json!({"scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes}))
}

/// A chain of nodes, each below the one before, each with a mesh.
pub fn deep(count: usize) -> Scene {
    let link = |i: usize| if i + 1 < count { json!({"children": [i + 1], "mesh": 0}) } else { json!({"mesh": 0}) };
    with_triangle(&json!({"scene": 0, "scenes": [{"nodes": [0]}], "nodes": (0..count).map(link).collect::<Vec<_>>()}))
}

/// A document with one mesh and one material.
pub fn with_triangle(members: &Value) -> Scene {
    let positions: Vec<u8> = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut document = json!({
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"name": "plain"}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": data_uri(&positions)}],
    });
    for (key, value) in members.as_object().unwrap() {
        document[key] = value.clone();
    }
    import(&document)
}

/// One of each sort.
pub fn all() -> Vec<(&'static str, Scene)> {
    vec![
        ("every slot", every_slot_scene()),
        ("skinned", skinned()),
        ("wide", wide(400)),
        ("deep", deep(40)),
        ("empty", with_triangle(&json!({}))),
    ]
}
