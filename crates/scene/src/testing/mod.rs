//! A document that fills every slot that refers to an object, and an independent way to renumber it.

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
