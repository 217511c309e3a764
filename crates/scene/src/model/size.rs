use super::{Extra, Id, Primitive, Scene};
use crate::place::At;
use crate::visit::{self, Visitor};
use serde_json::{Map, Value};

impl Scene {
    /// Bytes of the objects of the document: their slots, names and lists, and what they carry as JSON. Buffers and encoded
    /// images are not counted, nor is what the allocator adds: it is a lower bound.
    pub fn object_bytes(&self) -> u64 {
        let slots = self.scenes.slot_bytes()
            + self.nodes.slot_bytes()
            + self.meshes.slot_bytes()
            + self.materials.slot_bytes()
            + self.textures.slot_bytes()
            + self.images.slot_bytes()
            + self.samplers.slot_bytes()
            + self.accessors.slot_bytes()
            + self.buffer_views.slot_bytes()
            + self.buffers.slot_bytes()
            + self.skins.slot_bytes()
            + self.animations.slot_bytes()
            + self.cameras.slot_bytes()
            + self.lights.slot_bytes()
            + self.variants.slot_bytes()
            + self.packets.slot_bytes();
        let name = |name: &Option<String>| name.as_ref().map_or(0, String::len);
        let nodes = self
            .nodes
            .values()
            .map(|node| name(&node.name) + node.children.heap_bytes() + node.weights.as_deref().map_or(0, size_of_val));
        let meshes = self.meshes.values().map(|mesh| {
            let of = |p: &Primitive| size_of::<Primitive>() + size_of_val(p.attributes.0.as_slice());
            name(&mesh.name) + mesh.primitives.iter().map(of).sum::<usize>()
        });
        let bounds = |bounds: &Option<Vec<f64>>| bounds.as_deref().map_or(0, size_of_val);
        let accessors = self.accessors.values().map(|a| name(&a.name) + bounds(&a.min) + bounds(&a.max));
        let mut extras = Extras(self.packets.values().map(|packet| json_bytes(&packet.0)).sum());
        visit::visit(self, &mut extras);
        (slots + nodes.sum::<usize>() + meshes.sum::<usize>() + accessors.sum::<usize>() + extras.0) as u64
    }
}

/// Bytes of what is kept as JSON.
struct Extras(usize);

impl Visitor for Extras {
    fn slot<K: Id>(&mut self, _: K, _: &At<'_>) {}

    fn extra(&mut self, extra: &Extra, _: &At<'_>) {
        self.0 += extra_bytes(extra);
    }
}

/// Bytes that lie outside an [`Extra`] itself.
pub(crate) fn extra_bytes(Extra { extras, extensions, other, .. }: &Extra) -> usize {
    extras.as_deref().map_or(0, |v| size_of::<Value>() + json_bytes(v))
        + extensions.as_deref().map_or(0, |m| size_of_val(m) + members(m))
        + other.as_deref().map_or(0, |o| size_of_val(o) + members(&o.members))
}

/// Bytes that a value owns. Its nesting is bounded by that of the parser.
pub(crate) fn json_bytes(v: &Value) -> usize {
    match v {
        Value::Null | Value::Bool(_) | Value::Number(_) => 0,
        Value::String(text) => text.len(),
        Value::Array(values) => values.iter().map(|v| size_of::<Value>() + json_bytes(v)).sum(),
        Value::Object(map) => members(map),
    }
}

fn members(map: &Map<String, Value>) -> usize {
    // Each has its key, its value, its hash and its place in the table.
    let member = |(key, v): (&String, &Value)| size_of::<(String, Value)>() + 16 + key.len() + json_bytes(v);
    map.iter().map(member).sum()
}
