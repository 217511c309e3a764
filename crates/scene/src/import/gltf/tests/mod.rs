//! Small documents, one per feature and per refusal.

mod containers;
mod draco;
mod extensions;
mod features;
mod limits;
mod refusals;

use crate::Scene;
use crate::import::{ImportOptions, Imported, import_slice};
use serde_json::{Value, json};

/// Imports a document; the error as the user sees it.
fn import(document: &Value) -> Result<Imported, String> {
    import_slice(document.to_string(), None, "a.gltf", &ImportOptions::default()).map_err(|e| e.to_string())
}

fn load(document: &Value) -> Scene {
    import(document).unwrap().scene
}

fn refusal(document: &Value) -> String {
    import(document).map(|_| ()).unwrap_err()
}

fn warnings(document: &Value) -> Vec<String> {
    import(document).unwrap().warnings.iter().map(ToString::to_string).collect()
}

/// A document of glTF 2.0 with these members besides.
fn document(members: Value) -> Value {
    let mut document = json!({ "asset": { "version": "2.0" } });
    merge(&mut document, members);
    document
}

fn merge(into: &mut Value, members: Value) {
    let Value::Object(members) = members else { panic!("not an object") };
    into.as_object_mut().unwrap().extend(members);
}

fn data_uri(bytes: &[u8]) -> String {
    use base64::Engine;
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A triangle: accessor 0 is its positions, 1 its indices, and mesh 0 and node 0 show it.
fn triangle() -> Value {
    let mut bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    bytes.extend([0, 0, 1, 0, 2, 0]);
    document(json!({
        "buffers": [{ "byteLength": 42, "uri": data_uri(&bytes) }],
        "bufferViews": [
            { "buffer": 0, "byteLength": 36, "target": 34962 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 6, "target": 34963 },
        ],
        "accessors": [
            {
                "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                "min": [0, 0, 0], "max": [1, 1, 0],
            },
            { "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" },
        ],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "nodes": [{ "mesh": 0 }],
        "scenes": [{ "nodes": [0] }],
        "scene": 0,
    }))
}

/// [`triangle`] with one place changed: `at` is a JSON pointer, whose last member may be new.
fn triangle_with(at: &str, value: Value) -> Value {
    with(triangle(), at, value)
}

fn with(mut document: Value, at: &str, value: Value) -> Value {
    let (parent, key) = at.rsplit_once('/').unwrap();
    match document.pointer_mut(parent).unwrap_or_else(|| panic!("no {parent}")) {
        Value::Array(a) if key == "-" => a.push(value),
        Value::Array(a) => a[key.parse::<usize>().unwrap()] = value,
        Value::Object(o) => drop(o.insert(key.to_owned(), value)),
        other => panic!("{other} has no members"),
    }
    document
}
