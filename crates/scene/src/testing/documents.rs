//! Small glTF documents.

use base64::Engine;
use serde_json::{Value, json};

pub fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

pub const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
const NORMALS: [f32; 9] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];

/// A triangle with normals (accessors 0 and 1), with these members in place of its own.
pub fn triangle(members: Value) -> Value {
    let bytes = [floats(&TRIANGLE), floats(&NORMALS)].concat();
    let mut document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1 } }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC3" },
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": 72 }],
        "buffers": [{ "byteLength": 72, "uri": data_uri(&bytes) }],
    });
    for (key, value) in members.as_object().unwrap() {
        document[key] = value.clone();
    }
    document
}

/// A triangle that is skinned to a joint at (0, 0, 5), whose bind pose is at (0, 0, 2), under a node that is elsewhere.
pub fn skinned() -> Value {
    let mut matrix = [0.0f32; 16];
    (matrix[0], matrix[5], matrix[10], matrix[15], matrix[14]) = (1.0, 1.0, 1.0, 1.0, -2.0);
    let weights = [[1.0f32, 0.0, 0.0, 0.0]; 3];
    let parts = [floats(&TRIANGLE), floats(&NORMALS), vec![0; 12], floats(weights.as_flattened()), floats(&matrix)];
    let bytes = parts.concat();
    let mut document = triangle(json!({
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [{ "mesh": 0, "skin": 0, "translation": [100, 0, 0] }, { "translation": [0, 0, 5] }],
        "skins": [{ "joints": [1], "inverseBindMatrices": 4 }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 72 }, { "buffer": 0, "byteOffset": 72, "byteLength": 12 },
            { "buffer": 0, "byteOffset": 84, "byteLength": 48 }, { "buffer": 0, "byteOffset": 132, "byteLength": 64 },
        ],
        "buffers": [{ "byteLength": bytes.len(), "uri": data_uri(&bytes) }],
    }));
    let more = [
        json!({ "bufferView": 1, "componentType": 5121, "count": 3, "type": "VEC4" }),
        json!({ "bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC4" }),
        json!({ "bufferView": 3, "componentType": 5126, "count": 1, "type": "MAT4" }),
    ];
    document["accessors"].as_array_mut().unwrap().extend(more);
    document["meshes"][0]["primitives"][0]["attributes"] =
        json!({ "POSITION": 0, "NORMAL": 1, "JOINTS_0": 2, "WEIGHTS_0": 3 });
    document
}
