//! Files made by hand, one per rule of the format.

mod features;
mod from_gltf;
mod refusals;
mod round_trip;

use crate::import::{ImportOptions, Imported, import_slice};
use crate::model::*;
use crate::{Scene, accessor};
use serde_json::{Value, json};

/// A file that is being made: header and blob.
#[derive(Clone)]
pub struct File {
    pub header: Value,
    pub blob: Vec<u8>,
}

impl File {
    pub fn new() -> Self {
        let header = json!({ "buffer_views": [], "meshes": [], "images": [], "materials": [], "objects": [] });
        Self { header, blob: Vec::new() }
    }

    /// Adds an element to a list; its index.
    pub fn add(&mut self, list: &str, value: Value) -> usize {
        let list = self.header[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    pub fn view(&mut self, dtype: &str, bytes: &[u8]) -> usize {
        let view = json!({ "byte_offset": self.blob.len(), "byte_length": bytes.len(), "type": dtype });
        self.blob.extend_from_slice(bytes);
        self.add("buffer_views", view)
    }

    pub fn floats(&mut self, dtype: &str, values: &[f32]) -> usize {
        self.view(dtype, &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>())
    }

    /// A mesh of one triangle, with texture coordinates and normals.
    pub fn triangle(&mut self, name: &str) -> usize {
        let positions = self.floats("VEC3_F32", &POSITIONS);
        let indices = [0u32, 1, 2].map(u32::to_le_bytes);
        let indices = self.view("VEC3_U32", indices.as_flattened());
        let texcoords = self.floats("VEC2_F32", &TEXCOORDS);
        let normals = self.floats("VEC3_F32", &NORMALS);
        let mesh = json!({
            "name": name, "positions": positions, "indices": indices, "texcoords": texcoords, "normals": normals,
        });
        self.add("meshes", mesh)
    }

    pub fn object(&mut self, mesh: usize, material: i64) -> usize {
        let name = format!("object {}", self.header["objects"].as_array().unwrap().len());
        let object = json!({ "name": name, "type": "MESH", "matrix": IDENTITY, "mesh": mesh, "material": material });
        self.add("objects", object)
    }

    /// An image of one row of texels or more, PNG.
    pub fn image(&mut self, texels: &[[u8; 4]], width: u32, color_space: &str) -> usize {
        let height = texels.len() as u32 / width;
        let png = super::packing::png(texels.as_flattened(), width, height, image::ExtendedColorType::Rgba8);
        let view = self.view("UINT_8", &png);
        let name = format!("image {view}");
        self.add("images", json!({ "name": name, "view": view, "type": "PNG", "color_space": color_space }))
    }

    pub fn bytes(&self) -> Vec<u8> {
        self.bytes_of(&self.header.to_string())
    }

    /// With another text as header.
    pub fn bytes_of(&self, header: &str) -> Vec<u8> {
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend_from_slice(header.as_bytes());
        bytes.extend_from_slice(&self.blob);
        bytes
    }

    /// With one place changed: `at` is a JSON pointer, whose last member may be new.
    pub fn with(mut self, at: &str, value: Value) -> Self {
        let (parent, key) = at.rsplit_once('/').unwrap();
        match self.header.pointer_mut(parent).unwrap_or_else(|| panic!("no {parent}")) {
            Value::Array(a) => a[key.parse::<usize>().unwrap()] = value,
            Value::Object(o) => drop(o.insert(key.to_owned(), value)),
            other => panic!("{other} has no members"),
        }
        self
    }

    pub fn import(&self) -> Result<Imported, String> {
        import(self.bytes())
    }

    pub fn load(&self) -> Scene {
        let imported = self.import().unwrap();
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
        imported.scene
    }

    pub fn warnings(&self) -> Vec<String> {
        self.import().unwrap().warnings.iter().map(ToString::to_string).collect()
    }
}

pub const POSITIONS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
pub const TEXCOORDS: [f32; 6] = [0.0, 0.0, 1.0, 0.25, 0.5, 1.0];
pub const NORMALS: [f32; 9] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
pub const IDENTITY: [f64; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

pub fn import(bytes: Vec<u8>) -> Result<Imported, String> {
    import_slice(bytes, None, "a.crts", &ImportOptions::default()).map_err(|e| e.to_string())
}

/// A triangle that an object shows with a material.
pub fn triangle() -> File {
    let mut file = File::new();
    let mesh = file.triangle("triangle");
    let material = file.add("materials", json!({ "name": "paint", "base_color": [0.5, 0.25, 0.125] }));
    file.object(mesh, material as i64);
    file
}

/// What of a light or camera is common.
pub fn placed(kind: &str, matrix: [f64; 16], members: Value) -> Value {
    let mut object = json!({ "name": kind, "type": kind, "matrix": matrix });
    object.as_object_mut().unwrap().extend(members.as_object().unwrap().clone());
    object
}

pub fn nth_node(scene: &Scene, index: usize) -> &Node {
    scene.nodes().iter().nth(index).unwrap().1
}

pub fn nth_material(scene: &Scene, index: usize) -> &Material {
    scene.materials().iter().nth(index).unwrap().1
}

pub fn primitive_of<'s>(scene: &'s Scene, node: &Node) -> &'s Primitive {
    &scene.meshes()[node.mesh.unwrap()].primitives[0]
}

pub fn read<const N: usize>(scene: &Scene, primitive: &Primitive, semantic: &str) -> Vec<[f32; N]> {
    accessor::read_f32(scene, primitive.attributes.get(semantic).unwrap()).unwrap()
}

/// The texels of a texture, from top to bottom.
pub fn texels(scene: &Scene, info: &Option<TextureInfo>) -> Vec<[u8; 4]> {
    let source = scene.textures()[info.as_ref().unwrap().texture].source.unwrap();
    let data = scene.images()[source].data.clone().unwrap();
    super::images::decode(&data).unwrap().into_rgba8().pixels().map(|p| p.0).collect()
}
