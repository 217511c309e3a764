//! A small writer of glTF 2.0 documents.
//!
//! Objects are appended and referred to by their index; the writer keeps the binary buffer, its views and accessors,
//! and writes `.glb`, or `.gltf` with a `.bin` beside it. The same calls give the same bytes.

use super::shapes::Geometry;
use crate::failure::Failure;
use crate::output::write_atomically;
use glam::{Mat3, Quat, Vec3};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

/// Index of an object in one of the document's arrays.
pub type Index = u32;

/// A node.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Node {
    /// `name`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub translation: Option<[f32; 3]>,
    /// Unit quaternion, x y z w.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<[f32; 4]>,
    /// Factors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<[f32; 3]>,
    /// The mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<Index>,
    /// The skin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<Index>,
    /// The camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<Index>,
    /// Child nodes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub children: Vec<Index>,
    /// Extensions by name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extensions: Option<Value>,
}

impl Node {
    /// A node with a name.
    pub fn named(name: impl Into<String>) -> Self {
        Self { name: Some(name.into()), ..Self::default() }
    }

    /// A node with a mesh.
    pub fn mesh(mesh: Index) -> Self {
        Self { mesh: Some(mesh), ..Self::default() }
    }

    /// Places it.
    #[must_use]
    pub fn at(mut self, translation: Vec3) -> Self {
        self.translation = Some(translation.to_array());
        self
    }

    /// Turns it. The quaternion is normalised.
    #[must_use]
    pub fn turned(mut self, rotation: Quat) -> Self {
        self.rotation = Some(rotation.normalize().to_array());
        self
    }

    /// Scales it.
    #[must_use]
    pub fn scaled(mut self, scale: Vec3) -> Self {
        self.scale = Some(scale.to_array());
        self
    }

    /// Names it.
    #[must_use]
    pub fn called(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }
}

/// What a buffer view is for (`bufferView.target`).
#[derive(Clone, Copy)]
enum Target {
    Vertices = 34962,
    Indices = 34963,
}

/// A document under construction.
#[derive(Default)]
pub struct Document {
    nodes: Vec<Node>,
    roots: Vec<Index>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    samplers: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    cameras: Vec<Value>,
    skins: Vec<Value>,
    animations: Vec<Value>,
    lights: Vec<Value>,
    extensions_used: BTreeSet<&'static str>,
    extensions_required: BTreeSet<&'static str>,
    buffer: Vec<u8>,
}

fn push<T>(list: &mut Vec<T>, value: T) -> Index {
    list.push(value);
    (list.len() - 1) as Index
}

impl Document {
    /// Nodes so far.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Adds a node that has no parent yet.
    pub fn node(&mut self, node: Node) -> Index {
        push(&mut self.nodes, node)
    }

    /// Adds a root node of the scene.
    pub fn root(&mut self, node: Node) -> Index {
        let index = self.node(node);
        self.roots.push(index);
        index
    }

    /// Adds a child of a node.
    pub fn child(&mut self, parent: Index, node: Node) -> Index {
        let index = self.node(node);
        self.nodes[parent as usize].children.push(index);
        index
    }

    /// Places a node that was added before.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn set_transform(&mut self, node: Index, translation: Vec3, rotation: Quat, scale: Vec3) {
        let node = &mut self.nodes[node as usize];
        node.translation = Some(translation.to_array());
        node.rotation = Some(rotation.normalize().to_array());
        node.scale = Some(scale.to_array());
    }

    /// Notes that an extension is used; a required one too.
    pub fn extension(&mut self, name: &'static str, required: bool) {
        self.extensions_used.insert(name);
        if required {
            self.extensions_required.insert(name);
        }
    }

    /// Adds a material, given as glTF JSON. Extensions in it are noted.
    pub fn material(&mut self, material: Value) -> Index {
        for name in ["KHR_materials_unlit", "KHR_materials_emissive_strength", "KHR_texture_transform"] {
            // The JSON text names an extension only where it is used.
            if material.to_string().contains(name) {
                self.extension(name, false);
            }
        }
        push(&mut self.materials, material)
    }

    /// Adds a metallic-roughness material of one colour (linear).
    pub fn plain_material(&mut self, name: &str, rgb: [f32; 3], metallic: f32, roughness: f32) -> Index {
        let [r, g, b] = rgb;
        self.material(json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness,
            },
        }))
    }

    /// Adds a black material that emits `rgb * strength`; the channels of `rgb` are at most 1.
    pub fn emissive_material(&mut self, name: &str, rgb: [f32; 3], strength: f32) -> Index {
        self.material(json!({
            "name": name,
            "pbrMetallicRoughness": { "baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 0.0 },
            "emissiveFactor": rgb,
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": strength } },
        }))
    }

    /// Adds a texture with a sampler of its own from RGBA texels, embedded as a PNG.
    ///
    /// # Panics
    /// If `texels` are not `width * height`.
    pub fn texture(&mut self, name: &str, width: u32, height: u32, texels: &[[u8; 4]], nearest: bool) -> Index {
        assert_eq!(texels.len() as u64, u64::from(width) * u64::from(height), "four bytes a texel");
        let mut png = Vec::new();
        image::ImageEncoder::write_image(
            image::codecs::png::PngEncoder::new(&mut png),
            texels.as_flattened(),
            width,
            height,
            image::ExtendedColorType::Rgba8,
        )
        .expect("an image in memory of a matching size can be encoded");
        let view = self.view(&png, None);
        let image = push(&mut self.images, json!({ "name": name, "mimeType": "image/png", "bufferView": view }));
        let (mag, min) = if nearest { (9728, 9986) } else { (9729, 9987) };
        let sampler = json!({ "magFilter": mag, "minFilter": min, "wrapS": 10497, "wrapT": 10497 });
        let sampler = match self.samplers.iter().position(|s| *s == sampler) {
            Some(at) => at as Index,
            None => push(&mut self.samplers, sampler),
        };
        push(&mut self.textures, json!({ "name": name, "sampler": sampler, "source": image }))
    }

    /// Adds a mesh of one or more geometries, each with its material.
    pub fn mesh(&mut self, name: &str, parts: &[(&Geometry, Index)]) -> Index {
        let primitives: Vec<Value> = parts
            .iter()
            .map(|(geometry, material)| {
                let mut primitive = self.primitive(geometry);
                primitive["material"] = json!(material);
                primitive
            })
            .collect();
        push(&mut self.meshes, json!({ "name": name, "primitives": primitives }))
    }

    /// Adds a mesh with the geometry of another one, whose accessors it shares, its first primitive in another material.
    pub fn recoloured_mesh(&mut self, name: &str, mesh: Index, material: Index) -> Index {
        let mut primitives = self.meshes[mesh as usize]["primitives"].clone();
        primitives[0]["material"] = json!(material);
        push(&mut self.meshes, json!({ "name": name, "primitives": primitives }))
    }

    fn primitive(&mut self, geometry: &Geometry) -> Value {
        let mut attributes = serde_json::Map::new();
        let g = geometry;
        attributes.insert("POSITION".into(), json!(self.vertices(&g.positions, "VEC3", true)));
        if !g.normals.is_empty() {
            attributes.insert("NORMAL".into(), json!(self.vertices(&g.normals, "VEC3", false)));
        }
        if !g.uvs.is_empty() {
            attributes.insert("TEXCOORD_0".into(), json!(self.vertices(&g.uvs, "VEC2", false)));
        }
        if !g.uvs1.is_empty() {
            attributes.insert("TEXCOORD_1".into(), json!(self.vertices(&g.uvs1, "VEC2", false)));
        }
        if !g.colours.is_empty() {
            attributes.insert("COLOR_0".into(), json!(self.vertices(&g.colours, "VEC3", false)));
        }
        if !g.joints.is_empty() {
            let view = self.view(g.joints.as_flattened(), Some(Target::Vertices));
            let joints = self.accessor(view, 5121, "VEC4", g.joints.len(), None);
            attributes.insert("JOINTS_0".into(), json!(joints));
            attributes.insert("WEIGHTS_0".into(), json!(self.vertices(&g.weights, "VEC4", false)));
        }
        let indices = self.indices(&g.indices);
        json!({ "attributes": attributes, "indices": indices })
    }

    fn indices(&mut self, indices: &[u32]) -> Index {
        // 65535 restarts a primitive and may not be an index.
        if indices.iter().all(|&i| i < 0xffff) {
            let bytes: Vec<u8> = indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect();
            let view = self.view(&bytes, Some(Target::Indices));
            return self.accessor(view, 5123, "SCALAR", indices.len(), None);
        }
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(Target::Indices));
        self.accessor(view, 5125, "SCALAR", indices.len(), None)
    }

    fn vertices<const N: usize>(&mut self, values: &[[f32; N]], kind: &str, bounds: bool) -> Index {
        let view = self.view(&float_bytes(values.as_flattened()), Some(Target::Vertices));
        self.accessor(view, 5126, kind, values.len(), bounds.then(|| min_max(values)))
    }

    /// Adds an accessor of floats that are not vertex attributes: key frames, matrices, instance transforms.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]], bounds: bool) -> Index {
        let kind = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            16 => "MAT4",
            _ => panic!("glTF has no element of {N} floats that generators use"),
        };
        let view = self.view(&float_bytes(values.as_flattened()), None);
        self.accessor(view, 5126, kind, values.len(), bounds.then(|| min_max(values)))
    }

    fn accessor(
        &mut self,
        view: Index,
        component: u32,
        kind: &str,
        count: usize,
        bounds: Option<(Vec<f32>, Vec<f32>)>,
    ) -> Index {
        let mut accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        if let Some((min, max)) = bounds {
            accessor["min"] = json!(min);
            accessor["max"] = json!(max);
        }
        push(&mut self.accessors, accessor)
    }

    fn view(&mut self, bytes: &[u8], target: Option<Target>) -> Index {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let offset = self.buffer.len();
        self.buffer.extend_from_slice(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target as u32);
        }
        push(&mut self.views, view)
    }

    /// Adds a skin.
    pub fn skin(&mut self, joints: &[Index], skeleton: Index, inverse_bind_matrices: Index) -> Index {
        let skin = json!({ "inverseBindMatrices": inverse_bind_matrices, "joints": joints, "skeleton": skeleton });
        push(&mut self.skins, skin)
    }

    /// Adds an animation, given as glTF JSON.
    pub fn animation(&mut self, animation: Value) -> Index {
        push(&mut self.animations, animation)
    }

    /// Adds a root node with a camera that looks from `eye` to `target`, +Y up.
    pub fn look_at(&mut self, name: &str, eye: Vec3, target: Vec3, fov_y_degrees: f32) -> Index {
        let yfov = fov_y_degrees.to_radians();
        let near = (eye.distance(target) * 1e-3).max(1e-3);
        let camera = json!({ "name": name, "type": "perspective", "perspective": { "yfov": yfov, "znear": near } });
        let camera = push(&mut self.cameras, camera);
        let mut node = Node::named(name).at(eye).turned(looking(target - eye));
        node.camera = Some(camera);
        self.root(node)
    }

    /// Adds a KHR_lights_punctual light, given as glTF JSON.
    pub fn light(&mut self, light: Value) -> Index {
        self.extension("KHR_lights_punctual", false);
        push(&mut self.lights, light)
    }

    /// The `extensions` object of a node that carries a light.
    pub fn light_reference(light: Index) -> Option<Value> {
        Some(json!({ "KHR_lights_punctual": { "light": light } }))
    }

    fn json(&self, buffer_uri: Option<&str>) -> Result<Vec<u8>, serde_json::Error> {
        #[derive(Serialize)]
        #[serde(rename_all = "camelCase")]
        struct Root<'a> {
            asset: Value,
            #[serde(skip_serializing_if = "BTreeSet::is_empty")]
            extensions_used: &'a BTreeSet<&'static str>,
            #[serde(skip_serializing_if = "BTreeSet::is_empty")]
            extensions_required: &'a BTreeSet<&'static str>,
            #[serde(skip_serializing_if = "Option::is_none")]
            extensions: Option<Value>,
            scene: u32,
            scenes: Value,
            nodes: &'a [Node],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            cameras: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            meshes: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            skins: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            animations: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            materials: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            textures: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            images: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            samplers: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            accessors: &'a [Value],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            buffer_views: &'a [Value],
            buffers: Value,
        }
        let mut buffer = json!({ "byteLength": self.buffer.len() });
        if let Some(uri) = buffer_uri {
            buffer["uri"] = json!(uri);
        }
        let lights =
            (!self.lights.is_empty()).then(|| json!({ "KHR_lights_punctual": { "lights": self.lights.clone() } }));
        serde_json::to_vec(&Root {
            asset: json!({ "version": "2.0", "generator": "orthant generate" }),
            extensions_used: &self.extensions_used,
            extensions_required: &self.extensions_required,
            extensions: lights,
            scene: 0,
            scenes: json!([{ "nodes": self.roots }]),
            nodes: &self.nodes,
            cameras: &self.cameras,
            meshes: &self.meshes,
            skins: &self.skins,
            animations: &self.animations,
            materials: &self.materials,
            textures: &self.textures,
            images: &self.images,
            samplers: &self.samplers,
            accessors: &self.accessors,
            buffer_views: &self.views,
            buffers: json!([buffer]),
        })
    }

    /// Writes the document: `.glb`, or `.gltf` with the buffer as `STEM.bin` beside it.
    ///
    /// # Errors
    /// Another extension, a document too large for a GLB (4 GiB), or an I/O error.
    pub fn write(mut self, path: &Path) -> Result<(), Failure> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let io = |e: std::io::Error| Failure::io(path, "write the file", &e);
        let json_error = |e: serde_json::Error| Failure::bad_input(path, format!("cannot write the JSON: {e}"));
        match extension.as_str() {
            "glb" => {
                let mut json = self.json(None).map_err(json_error)?;
                json.resize(json.len().next_multiple_of(4), b' ');
                let total = 12 + 8 + json.len() + 8 + self.buffer.len();
                let total = u32::try_from(total).map_err(|_| {
                    Failure::bad_input(path, "the scene exceeds the 4 GiB of a GLB").remedy("write a .gltf instead")
                })?;
                write_atomically(path, |file| {
                    let mut write = |bytes: &[u8]| file.write_all(bytes).map_err(io);
                    write(b"glTF")?;
                    write(&2u32.to_le_bytes())?;
                    write(&total.to_le_bytes())?;
                    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.buffer)] {
                        // Both are shorter than the total, which fits.
                        write(&(chunk.len() as u32).to_le_bytes())?;
                        write(kind)?;
                        write(chunk)?;
                    }
                    Ok(())
                })
            }
            "gltf" => {
                let bin = path.with_extension("bin");
                let name = bin.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                // The buffer goes first: whoever sees the document finds its buffer.
                crate::output::write_bytes(&bin, &self.buffer)?;
                let json = self.json(Some(&encode_uri(&name))).map_err(json_error)?;
                crate::output::write_bytes(path, &json)
            }
            _ => Err(Failure::usage(format!("{}: generated scenes are .glb or .gltf", path.display()))),
        }
    }
}

/// The rotation of a camera or light that looks along `direction`, +Y up (or +Z up where it looks straight up or down).
pub fn looking(direction: Vec3) -> Quat {
    let forward = direction.normalize_or(Vec3::NEG_Z);
    let up = if forward.y.abs() > 0.999 { Vec3::Z } else { Vec3::Y };
    let right = forward.cross(up).normalize();
    Quat::from_mat3(&Mat3::from_cols(right, right.cross(forward), -forward))
}

fn float_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn min_max<const N: usize>(values: &[[f32; N]]) -> (Vec<f32>, Vec<f32>) {
    let fold = |f: fn(f32, f32) -> f32, start: f32| -> Vec<f32> {
        (0..N).map(|c| values.iter().map(|v| v[c]).fold(start, f)).collect()
    };
    (fold(f32::min, f32::INFINITY), fold(f32::max, f32::NEG_INFINITY))
}

/// Percent-encodes what may not stand in the path of a URI (RFC 3986, unreserved characters stay).
fn encode_uri(name: &str) -> String {
    let mut uri = String::new();
    for byte in name.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => uri.push(char::from(byte)),
            _ => uri.push_str(&format!("%{byte:02X}")),
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_looks_somewhere_has_its_minus_z_there() {
        for direction in [Vec3::new(1.0, 2.0, 3.0), Vec3::Z, Vec3::NEG_Y, Vec3::NEG_Z] {
            let seen = looking(direction) * Vec3::NEG_Z;
            assert!((seen - direction.normalize()).length() < 1e-5, "{direction}");
        }
        assert!((looking(Vec3::X) * Vec3::Y - Vec3::Y).length() < 1e-6);
    }

    #[test]
    fn names_with_blanks_make_valid_uris() {
        assert_eq!(encode_uri("my scene é.bin"), "my%20scene%20%C3%A9.bin");
    }

    #[test]
    fn a_gltf_names_its_buffer_and_a_glb_holds_it() {
        let folder = tempfile::tempdir().expect("folder");
        for name in ["a b.gltf", "c.GLB"] {
            let mut document = Document::default();
            let material = document.plain_material("m", [0.5; 3], 0.0, 1.0);
            let mesh = document.mesh("box", &[(&super::super::shapes::cuboid([1.0; 3]), material)]);
            document.root(Node::mesh(mesh));
            document.write(&folder.path().join(name)).expect("write");
        }
        let text = std::fs::read_to_string(folder.path().join("a b.gltf")).expect("JSON");
        let json: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(json["buffers"][0]["uri"], "a%20b.bin");
        let bin = std::fs::metadata(folder.path().join("a b.bin")).expect("buffer").len();
        assert_eq!(json["buffers"][0]["byteLength"], bin);
        let glb = std::fs::read(folder.path().join("c.GLB")).expect("GLB");
        assert_eq!(&glb[..8], b"glTF\x02\0\0\0");
        assert_eq!(u32::from_le_bytes(glb[8..12].try_into().expect("4 bytes")) as usize, glb.len());
    }
}
