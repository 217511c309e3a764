//! A document that fills every slot that refers to an object, and an independent way to renumber it.

pub mod documents;

use crate::Scene;
use crate::import::{ImportOptions, import_slice};
use crate::model::Kind;
use serde_json::Value;

/// A reference of [`every_slot`]: where it is, and to what.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Reference {
    pub pointer: String,
    pub kind: Kind,
    pub index: usize,
}

/// The document, with every index sent through `map`, and all references as they were before that. In the source of the
/// document an index is marked as such: `"@node:3"`, and in a JSON pointer `"@pointer:node:3:/translation"`.
pub fn every_slot(map: impl Fn(Kind, usize) -> usize) -> (Value, Vec<Reference>) {
    let mut document = serde_json::from_str(include_str!("every_slot.json")).unwrap();
    let mut references = Vec::new();
    replace(&mut document, &mut String::new(), &map, &mut references);
    references.sort();
    (document, references)
}

/// [`every_slot`], imported.
pub fn every_slot_scene() -> Scene {
    let (document, _) = every_slot(|_, index| index);
    import_slice(document.to_string(), None, "every_slot.gltf", &ImportOptions::default()).unwrap().scene
}

fn replace(
    value: &mut Value,
    pointer: &mut String,
    map: &impl Fn(Kind, usize) -> usize,
    references: &mut Vec<Reference>,
) {
    let length = pointer.len();
    match value {
        Value::Object(members) => {
            for (key, value) in members {
                pointer.push('/');
                pointer.push_str(&key.replace('~', "~0").replace('/', "~1"));
                replace(value, pointer, map, references);
                pointer.truncate(length);
            }
        }
        Value::Array(values) => {
            for (i, value) in values.iter_mut().enumerate() {
                pointer.push_str(&format!("/{i}"));
                replace(value, pointer, map, references);
                pointer.truncate(length);
            }
        }
        Value::String(text) if text.starts_with("@pointer:") => {
            let parts: Vec<&str> = text.splitn(4, ':').collect();
            let (array, kind) = kind(parts[1]);
            let index = parts[2].parse().unwrap();
            references.push(Reference { pointer: pointer.clone(), kind, index });
            *value = format!("{array}/{}{}", map(kind, index), parts[3]).into();
        }
        Value::String(text) if text.starts_with('@') => {
            let (name, index) = text[1..].split_once(':').unwrap();
            let (kind, index) = (kind(name).1, index.parse().unwrap());
            references.push(Reference { pointer: pointer.clone(), kind, index });
            *value = map(kind, index).into();
        }
        _ => {}
    }
}

fn kind(name: &str) -> (&'static str, Kind) {
    match name {
        "scene" => ("/scenes", Kind::Scene),
        "node" => ("/nodes", Kind::Node),
        "mesh" => ("/meshes", Kind::Mesh),
        "material" => ("/materials", Kind::Material),
        "texture" => ("/textures", Kind::Texture),
        "image" => ("/images", Kind::Image),
        "sampler" => ("/samplers", Kind::Sampler),
        "accessor" => ("/accessors", Kind::Accessor),
        "bufferView" => ("/bufferViews", Kind::BufferView),
        "buffer" => ("/buffers", Kind::Buffer),
        "skin" => ("/skins", Kind::Skin),
        "camera" => ("/cameras", Kind::Camera),
        "light" => ("/extensions/KHR_lights_punctual/lights", Kind::Light),
        "variant" => ("", Kind::Variant),
        "packet" => ("", Kind::Packet),
        other => panic!("no kind {other}"),
    }
}

/// Where two JSON documents differ, if they do: numbers by value, members in any order.
pub fn json_difference(a: &Value, b: &Value, pointer: &str) -> Option<String> {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            if let Some(key) = a.keys().find(|key| !b.contains_key(*key)).or(b.keys().find(|key| !a.contains_key(*key)))
            {
                return Some(format!("{pointer}/{key} is on one side only"));
            }
            a.iter().find_map(|(key, a)| json_difference(a, &b[key], &format!("{pointer}/{key}")))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().find_map(|(i, (a, b))| json_difference(a, b, &format!("{pointer}/{i}")))
        }
        (Value::Number(x), Value::Number(y)) if x.as_f64() == y.as_f64() => None,
        (a, b) => (a != b).then(|| format!("{pointer}: {a} and {b}")),
    }
}

/// A document without what says where in which buffer bytes are.
pub fn but_for_buffers(mut document: Value) -> Value {
    let members = document.as_object_mut().unwrap();
    members.shift_remove("buffers");
    for view in members.get_mut("bufferViews").and_then(Value::as_array_mut).into_iter().flatten() {
        let view = view.as_object_mut().unwrap();
        view.shift_remove("buffer");
        view.shift_remove("byteOffset");
    }
    document
}
