//! Which extensions a document uses.

use super::{At, Visitor, links, visit};
use crate::Scene;
use crate::model::{Accessor, Attributes, ComponentType, Extra, Id};
use serde_json::Value;
use std::collections::BTreeSet;

#[derive(Default)]
struct Names(BTreeSet<String>);

impl Names {
    fn add(&mut self, name: &str) {
        if !self.0.contains(name) {
            self.0.insert(name.to_owned());
        }
    }

    /// The extensions inside of what is kept as JSON. The nesting is bounded by that of the parser.
    fn add_nested(&mut self, value: &Value) {
        match value {
            Value::Array(values) => values.iter().for_each(|value| self.add_nested(value)),
            Value::Object(members) => {
                for (key, value) in members {
                    if let ("extensions", Value::Object(extensions)) = (key.as_str(), value) {
                        extensions.keys().for_each(|name| self.add(name));
                    }
                    if key != "extras" {
                        self.add_nested(value);
                    }
                }
            }
            _ => {}
        }
    }
}

impl Visitor for Names {
    fn slot<K: Id>(&mut self, _: K, _: &At<'_>) {}

    fn extension(&mut self, name: &'static str) {
        self.add(name);
    }

    fn extra(&mut self, extra: &Extra, at: &At<'_>) {
        for (name, value) in extra.extensions.iter().flat_map(|extensions| extensions.iter()) {
            self.add(name);
            self.add_nested(value);
        }
        links(self, extra, at);
    }
}

/// The names of the extensions that objects of the document have, and of KHR_mesh_quantization where an accessor shows its
/// use: no object has it.
pub fn extensions_in_use(scene: &Scene) -> BTreeSet<String> {
    let mut names = Names::default();
    visit(scene, &mut names);
    if is_quantized(scene) {
        names.add("KHR_mesh_quantization");
    }
    names.0
}

fn is_quantized(scene: &Scene) -> bool {
    let primitives = scene.meshes.values().flat_map(|mesh| &mesh.primitives);
    let beyond_core = |attributes: &Attributes| {
        let accessor = |id| scene.accessors.get(id);
        attributes.0.iter().any(|(semantic, id)| accessor(*id).is_some_and(|a| needs_quantization(semantic, a)))
    };
    primitives.flat_map(|p| p.targets.iter().chain([&p.attributes])).any(beyond_core)
}

/// Component types that glTF 2.0, section 3.7.2.1, does not have.
fn needs_quantization(semantic: &str, accessor: &Accessor) -> bool {
    use ComponentType::{F32, U8, U16};
    let component = accessor.component_type;
    match semantic.trim_end_matches(|c: char| c.is_ascii_digit()) {
        "POSITION" | "NORMAL" | "TANGENT" => component != F32,
        "TEXCOORD_" => component != F32 && !(accessor.normalized && matches!(component, U8 | U16)),
        _ => false,
    }
}

/// `extensionsUsed` and `extensionsRequired`: what is in use, in the order in which it was declared, then what has been
/// added; what the file declared although nothing in it showed a use stays.
pub(crate) fn declared_extensions(scene: &Scene) -> (Vec<String>, Vec<String>) {
    let in_use = extensions_in_use(scene);
    let is_used = |name: &String| in_use.contains(name) || scene.extensions_declared_only.contains(name);
    let mut used: Vec<String> = scene.extensions_used.iter().filter(|name| is_used(name)).cloned().collect();
    used.extend(in_use.iter().filter(|name| !scene.extensions_used.contains(name)).cloned());
    let mut required: Vec<String> =
        scene.extensions_required.iter().filter(|name| used.contains(name)).cloned().collect();
    // A reader that does not know it would misread the geometry.
    let quantization = "KHR_mesh_quantization";
    if in_use.contains(quantization) && !scene.extensions_used.iter().any(|name| name == quantization) {
        required.push(quantization.to_owned());
    }
    (used, required)
}
