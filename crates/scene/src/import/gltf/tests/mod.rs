//! Small documents, one per feature and per refusal.

mod containers;
mod draco;
mod extensions;
mod features;
mod limits;
mod nodes;
mod refusals;

use super::{GLB_MAGIC, import_document};
use crate::Scene;
use crate::import::budget::Budget;
use crate::import::files::Files;
use crate::import::{ImportOptions, Imported, import_slice};
use serde_json::{Value, json};
use std::path::Path;

/// Imports a document; the error as the user sees it. Reading its nodes apart, as those of long documents are, has to make
/// no difference.
fn import(document: &Value) -> Result<Imported, String> {
    both_ways(document.to_string().as_bytes(), None);
    import_slice(document.to_string(), None, "a.gltf", &ImportOptions::default()).map_err(|e| e.to_string())
}

/// Imports a document with its nodes among the rest and apart from it, and compares what comes of it.
fn both_ways(bytes: &[u8], folder: Option<&Path>) {
    let [whole, split] = [usize::MAX, 0].map(|min_node_bytes| {
        let budget = Budget::new(8 << 30);
        let files = Files::new(folder, false, &budget);
        let imported = import_document(bytes.to_vec(), bytes.starts_with(GLB_MAGIC), &files, &budget, min_node_bytes);
        imported.map_err(|(place, fault)| format!("{place}{fault}"))
    });
    match (whole, split) {
        (Ok((whole, warnings)), Ok((split, split_warnings))) => {
            assert_eq!(warnings, split_warnings);
            whole.same_document(&split).unwrap_or_else(|difference| panic!("{difference}"));
            for (a, b) in whole.nodes().iter().zip(split.nodes().iter()) {
                assert_eq!(a, b, "ids, parents and what is stated");
            }
        }
        (Err(whole), Err(split)) => assert_eq!(whole, split),
        (whole, split) => panic!("{:?} and {:?}", whole.map(|_| ()), split.map(|_| ())),
    }
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
