//! Real files, primitive by primitive, against the C++ library, against what their documents declare, and damaged.
//!
//! The figures are from the Python package `DracoPy` 2.2.0, a binding of the C++ library: for each file, every primitive
//! with the extension went through `DracoPy.decode` in the order of the document; the hash is the 64-bit FNV-1a of, for
//! each of them, the indices (`faces` as little-endian u32), then the `data` of each attribute by ascending `unique_id`, in
//! the type that its `data_type` names. All hold to the last bit.

use orthant_scene::codec::draco::{Component, DecodeLimits, DracoMesh, decode};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// File, primitives, triangles, vertices, FNV-1a.
const GOLDEN: [(&str, usize, usize, usize, u64); 9] = [
    ("gltf-ext/carbon60-sphere-draco/carbon-sphere.glb", 3, 215_579, 161_012, 0xf3d4_913b_a1c9_5861),
    ("gltf-ext/draco-Box/Box_Draco.glb", 1, 12, 24, 0x2dda_3ad4_df18_4525),
    ("gltf-ext/draco-BoxDraco/BoxDraco.gltf", 1, 12, 24, 0xa744_fb58_2a91_b9f4),
    ("gltf-ext/draco-SparseMesh/DracoSparseMesh.gltf", 1, 102, 62, 0x16a5_a54f_3278_8894),
    ("gltf-ext/draco-SubMesh-morph/SubMesh-Draco.gltf", 6, 26, 54, 0x1949_a8f7_248e_a0ad),
    ("gltf-ext/draco-heart/heart_draco.glb", 1, 180, 540, 0x243c_43d3_3361_8cc8),
    ("gltf-khronos/MaterialsVariantsShoe-broken/shoe.glb", 1, 22_700, 13_540, 0x66ab_4501_898b_e548),
    (
        "gltf-scenes/issum-town/issum_the_town_on_capital_isle-transformed.glb",
        161,
        78_127,
        119_653,
        0x57bc_ee91_7ece_379a,
    ),
    ("gltf-scenes/room/room-transformed.glb", 17, 47_402, 30_580, 0xa581_717f_caf5_5b12),
];

fn limits() -> DecodeLimits {
    DecodeLimits::new(1 << 30)
}

fn assets() -> Option<PathBuf> {
    let assets = std::env::var_os("ORTHANT_ASSETS").map(PathBuf::from);
    if assets.is_none() {
        println!("skipped: ORTHANT_ASSETS is not set");
    }
    assets
}

/// A file, by a reader of its own.
struct Document {
    json: Value,
    buffers: Vec<Vec<u8>>,
}

impl Document {
    fn read(path: &Path) -> Self {
        use base64::Engine;
        let file = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let (json, bin) = if file.starts_with(b"glTF") {
            let n = u32::from_le_bytes(file[12..16].try_into().expect("four bytes")) as usize;
            (&file[20..20 + n], &file[28 + n..])
        } else {
            (&file[..], &[][..])
        };
        let json: Value = serde_json::from_slice(json).expect("the document is JSON");
        let buffer = |b: &Value| match b["uri"].as_str() {
            None => bin.to_vec(),
            Some(uri) => match uri.split_once("base64,") {
                Some((_, data)) => base64::engine::general_purpose::STANDARD.decode(data).expect("it is base64"),
                None => std::fs::read(path.with_file_name(uri)).expect("the buffer is beside its file"),
            },
        };
        let buffers = json["buffers"].as_array().expect("there are buffers").iter().map(buffer).collect();
        Self { json, buffers }
    }

    /// Compressed primitives in order: the primitive, and its compressed bytes.
    fn compressed(&self) -> Vec<(&Value, &[u8])> {
        let meshes = self.json["meshes"].as_array().expect("there are meshes");
        let primitives = meshes.iter().flat_map(|m| m["primitives"].as_array().expect("meshes have primitives"));
        let extension = |p: &Value| p["extensions"]["KHR_draco_mesh_compression"]["bufferView"].as_u64();
        primitives.filter_map(|p| Some((p, self.view(extension(p)? as usize)))).collect()
    }

    fn view(&self, index: usize) -> &[u8] {
        let view = &self.json["bufferViews"][index];
        let number = |key: &str| view[key].as_u64().unwrap_or(0) as usize;
        &self.buffers[number("buffer")][number("byteOffset")..][..number("byteLength")]
    }
}

fn fnv1a(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

fn hash_of(mut hash: u64, mesh: &DracoMesh) -> u64 {
    for index in &mesh.indices {
        hash = fnv1a(hash, &index.to_le_bytes());
    }
    let mut attributes: Vec<_> = mesh.attributes.iter().collect();
    attributes.sort_by_key(|a| a.unique_id);
    attributes.iter().fold(hash, |hash, a| fnv1a(hash, &a.data))
}

#[test]
fn every_compressed_primitive_of_the_assets_decodes_to_what_the_reference_decodes() {
    let Some(assets) = assets() else { return };
    for (file, primitives, triangles, vertices, golden) in GOLDEN {
        let document = Document::read(&assets.join(file));
        let meshes: Vec<DracoMesh> = document
            .compressed()
            .iter()
            .map(|(_, data)| decode(data, &limits()).unwrap_or_else(|e| panic!("{file}: {e}")))
            .collect();
        let found = (
            meshes.len(),
            meshes.iter().map(|m| m.indices.len() / 3).sum(),
            meshes.iter().map(|m| m.vertex_count).sum(),
        );
        assert_eq!(found, (primitives, triangles, vertices), "{file}");
        let hash = meshes.iter().fold(0xcbf2_9ce4_8422_2325, hash_of);
        assert_eq!(hash, golden, "{file}: {hash:#018x}");
    }
}

#[test]
fn counts_and_bounds_are_those_that_the_documents_declare() {
    let Some(assets) = assets() else { return };
    for (file, ..) in GOLDEN {
        let document = Document::read(&assets.join(file));
        let accessor = |index: &Value| &document.json["accessors"][index.as_u64().expect("an index") as usize];
        for (primitive, data) in document.compressed() {
            let mesh = decode(data, &limits()).unwrap();
            assert_eq!(accessor(&primitive["indices"])["count"], mesh.indices.len(), "{file}");
            let mapped = &primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"];
            for (semantic, id) in mapped.as_object().expect("attributes are mapped") {
                let declared = accessor(&primitive["attributes"][semantic]);
                let attribute = mesh.attribute(id.as_u64().expect("an id") as u32).expect("the attribute is there");
                assert_eq!(declared["count"], mesh.vertex_count, "{file}");
                let components = match declared["type"].as_str().expect("a type") {
                    "VEC2" => 2,
                    "VEC3" => 3,
                    other => 1 + 3 * usize::from(other == "VEC4"),
                };
                assert_eq!(usize::from(attribute.components), components, "{file}: {semantic}");
                if semantic == "POSITION" {
                    assert_eq!(attribute.component, Component::F32);
                    assert_bounds(&attribute.data, declared, file);
                }
            }
        }
    }
}

/// `min` and `max` are of the positions before they were quantised, at worst to 10 bits of the longest side.
fn assert_bounds(data: &[u8], declared: &Value, file: &str) {
    let values: Vec<f64> = data.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect();
    let bound = |key: &str, c: usize| declared[key][c].as_f64().expect("positions have bounds");
    let longest = (0..3).map(|c| bound("max", c) - bound("min", c)).fold(0.0, f64::max);
    let tolerance = longest * 0.51 / 1023.0 + 1e-6;
    for c in 0..3 {
        let component = values.iter().skip(c).step_by(3).copied();
        let (min, max) = component.fold((f64::MAX, f64::MIN), |(min, max), v| (min.min(v), max.max(v)));
        let off = (min - bound("min", c)).abs().max((max - bound("max", c)).abs());
        assert!(off <= tolerance, "{file}: bounds are off by {off}, {tolerance} is a quantisation step");
    }
}

#[test]
fn damaged_data_gives_an_error_or_a_mesh_at_once() {
    let Some(assets) = assets() else { return };
    let mut random = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random as usize
    };
    let (mut meshes, mut errors, mut slowest) = (0, 0, Duration::ZERO);
    for (file, ..) in &GOLDEN {
        let document = Document::read(&assets.join(file));
        for (_, data) in document.compressed().iter().filter(|(_, data)| data.len() < 8000).take(12) {
            for round in 0..200 {
                let mut damaged = data.to_vec();
                if round % 5 == 0 {
                    damaged.truncate(next() % data.len());
                } else {
                    for _ in 0..=next() % 6 {
                        let reach = if next() % 2 == 0 { data.len().min(80) } else { data.len() };
                        let i = next() % reach;
                        match next() % 3 {
                            0 => damaged[i] ^= 1 << (next() % 8),
                            1 => damaged[i] = next() as u8,
                            _ => damaged[i] = 0xff,
                        }
                    }
                }
                let start = Instant::now();
                match decode(&damaged, &limits()) {
                    Ok(mesh) => {
                        meshes += 1;
                        assert!(mesh.indices.iter().all(|&i| (i as usize) < mesh.vertex_count));
                    }
                    Err(error) => {
                        errors += 1;
                        assert!(!error.to_string().contains("the decoder has failed"), "{file}: {error}");
                    }
                }
                slowest = slowest.max(start.elapsed());
                assert!(start.elapsed() < Duration::from_secs(1), "{file}: {:?}", start.elapsed());
            }
        }
    }
    println!("{meshes} meshes, {errors} errors, the slowest took {slowest:?}");
    assert!(meshes > 200 && errors > 2000, "{meshes} meshes, {errors} errors");
}
