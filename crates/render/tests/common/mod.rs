//! Small documents, made by hand.

use orthant_render::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use orthant_scene::import::{ImportOptions, import_slice};
use serde_json::{Value, json};

/// A document that is being made: its JSON and its binary chunk.
pub struct Document {
    /// The JSON; `asset`, `buffers`, `bufferViews` and `accessors` are filled in by this type.
    pub json: Value,
    bin: Vec<u8>,
}

impl Document {
    /// An empty document with the given top-level members.
    pub fn new(members: Value) -> Self {
        let mut json = json!({ "asset": { "version": "2.0" }, "bufferViews": [], "accessors": [] });
        let object = json.as_object_mut().expect("an object");
        for (key, value) in members.as_object().expect("an object") {
            object.insert(key.clone(), value.clone());
        }
        Self { json, bin: Vec::new() }
    }

    /// Adds an accessor of floats; `kind` is `VEC3` and so on. Returns its index.
    pub fn floats<const N: usize>(&mut self, kind: &str, values: &[[f32; N]]) -> usize {
        self.accessor(kind, 5126, values.len(), bytemuck::cast_slice(values.as_flattened()))
    }

    /// Adds an accessor of `u16` scalars.
    pub fn indices(&mut self, values: &[u16]) -> usize {
        self.accessor("SCALAR", 5123, values.len(), bytemuck::cast_slice(values))
    }

    /// Adds an accessor of `u8` VEC4s.
    pub fn joints(&mut self, values: &[[u8; 4]]) -> usize {
        self.accessor("VEC4", 5121, values.len(), values.as_flattened())
    }

    fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().expect("an array");
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }));
        let view = views.len() - 1;
        let accessors = self.json["accessors"].as_array_mut().expect("an array");
        let mut accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        // Positions and the times of animations must have bounds; anything else may.
        let width = match (kind, component) {
            ("SCALAR", 5126) => 1,
            ("VEC3", 5126) => 3,
            _ => 0,
        };
        if width > 0 {
            let values: &[f32] = bytemuck::cast_slice(bytes);
            let bound = |pick: fn(f32, f32) -> f32| {
                (0..width).map(|c| values.iter().skip(c).step_by(width).copied().reduce(pick)).collect::<Vec<_>>()
            };
            accessor["min"] = json!(bound(f32::min));
            accessor["max"] = json!(bound(f32::max));
        }
        accessors.push(accessor);
        accessors.len() - 1
    }

    /// Adds a buffer view of any bytes. Returns its index.
    pub fn bytes(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().expect("an array");
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }));
        views.len() - 1
    }

    /// A right triangle in the XY plane with legs of one metre; returns the accessor of its positions.
    pub fn triangle(&mut self) -> usize {
        self.floats("VEC3", &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    }

    /// The document as a GLB.
    pub fn glb(mut self) -> Vec<u8> {
        if !self.bin.is_empty() {
            self.json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        for key in ["bufferViews", "accessors"] {
            if self.json[key].as_array().is_some_and(Vec::is_empty) {
                self.json.as_object_mut().expect("an object").remove(key);
            }
        }
        let mut text = serde_json::to_vec(&self.json).expect("JSON is written to memory");
        text.resize(text.len().next_multiple_of(4), b' ');
        let bin_chunk = if self.bin.is_empty() { 0 } else { 8 + self.bin.len() };
        let mut glb = b"glTF".to_vec();
        glb.extend(2u32.to_le_bytes());
        glb.extend(((12 + 8 + text.len() + bin_chunk) as u32).to_le_bytes());
        glb.extend((text.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(text);
        if !self.bin.is_empty() {
            glb.extend((self.bin.len() as u32).to_le_bytes());
            glb.extend(b"BIN\0");
            glb.extend(self.bin);
        }
        glb
    }

    /// The document, imported.
    pub fn import(self) -> Scene {
        import_slice(self.glb(), None, "test.glb", &ImportOptions::default()).expect("the document is valid").scene
    }

    /// The document, imported and derived.
    pub fn derive(self) -> (Scene, DerivedScene) {
        let scene = self.import();
        let derived = DerivedScene::derive(&scene, &DeriveOptions::default()).expect("the document can be derived");
        (scene, derived)
    }
}
