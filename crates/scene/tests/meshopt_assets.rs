//! Real files, decoded view by view, against the reference decoder.
//!
//! The figures are from the JavaScript package `meshoptimizer`: for each file, every buffer view with the extension went
//! through `MeshoptDecoder.decodeGltfBuffer` in order, and the 64-bit FNV-1a hash of all their bytes together is what
//! stands here. All hold to the last bit, filtered views too.

use orthant_scene::codec::meshopt::{Filter, Mode, View, decode};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// File, compressed views, decoded bytes, FNV-1a.
const GOLDEN: [(&str, usize, usize, u64); 8] = [
    ("gltf-ext/meshopt-BoxMeshopt/BoxMeshopt.gltf", 3, 360, 0x9b3f_adaa_17f1_5e4d),
    ("gltf-ext/meshopt-BoxTextured/BoxTextured_meshopt.glb", 4, 456, 0x1997_ca2a_c5ba_bb5d),
    ("gltf-ext/meshopt-fallback-EXT/meshopt-fallback.gltf", 3, 960, 0xca82_c7e9_3f8a_9dc1),
    ("gltf-ext/meshopt-nofallback-EXT/meshopt-no-fallback.gltf", 3, 960, 0xca82_c7e9_3f8a_9dc1),
    ("gltf-ext/meshopt-pirate/pirate.glb", 3, 64_704, 0xe4e6_6c42_5ca7_9e8a),
    ("gltf-ext/ktx2-meshopt-box-textured/box-textured-ktx2.glb", 4, 552, 0x17eb_5012_53cd_cfdd),
    ("gltf-scenes/dream-apartment/dream-apartment.glb", 3, 4_661_940, 0x60fe_41f8_854b_d6af),
    ("gltf-scenes/nasa-ingenuity/Ingenuity.glb", 4, 277_304, 0x0527_4410_acac_ff6f),
];

fn read(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The document and its buffers; a buffer without bytes (a fallback) is empty.
fn load(path: &Path) -> (Value, Vec<Vec<u8>>) {
    let file = read(path);
    let (json, bin) = if file.starts_with(b"glTF") {
        let n = u32::from_le_bytes(file[12..16].try_into().expect("four bytes")) as usize;
        (file[20..20 + n].to_vec(), file[28 + n..].to_vec())
    } else {
        (file, Vec::new())
    };
    let document: Value = serde_json::from_slice(&json).expect("the document is JSON");
    let buffers = document["buffers"].as_array().expect("there are buffers");
    let data = buffers.iter().enumerate().map(|(i, buffer)| match buffer["uri"].as_str() {
        Some(uri) => read(&path.with_file_name(uri)),
        None if i == 0 => bin.clone(),
        None => Vec::new(),
    });
    let data = data.collect();
    (document, data)
}

#[test]
fn every_compressed_view_of_the_assets_decodes_to_the_bytes_of_the_reference() {
    let Some(assets) = std::env::var_os("ORTHANT_ASSETS").map(PathBuf::from) else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    for (file, views, length, golden) in GOLDEN {
        let (document, buffers) = load(&assets.join(file));
        let (mut count, mut total, mut hash) = (0, 0, 0xcbf2_9ce4_8422_2325u64);
        for view in document["bufferViews"].as_array().expect("there are views") {
            let extension = &view["extensions"]["EXT_meshopt_compression"];
            if extension.is_null() {
                continue;
            }
            let number = |key: &str| extension[key].as_u64().unwrap_or(0) as usize;
            let view = View {
                mode: Mode::from_name(extension["mode"].as_str().expect("a mode")).expect("a known mode"),
                filter: Filter::from_name(extension["filter"].as_str().unwrap_or("NONE")).expect("a known filter"),
                count: number("count"),
                stride: number("byteStride"),
            };
            let start = number("byteOffset");
            let data = &buffers[number("buffer")][start..start + number("byteLength")];
            let decoded = decode(view, data, 1 << 24).unwrap_or_else(|e| panic!("{file}: {e}"));
            count += 1;
            total += decoded.len();
            hash = decoded.iter().fold(hash, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
        }
        assert_eq!((count, total), (views, length), "{file}");
        assert_eq!(hash, golden, "{file}: {hash:#018x}");
    }
}
