//! Real files, decoded view by view, against the reference decoder.
//!
//! The figures are from the JavaScript package `meshoptimizer`: for each file, every buffer view with the extension went
//! through `MeshoptDecoder.decodeGltfBuffer` in order, and the 64-bit FNV-1a hash of all their bytes together is what
//! stands here. All hold to the last bit, filtered views too.

use orthant_scene::import::{ImportOptions, import_path};
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

fn fnv1a(hash: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(hash, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

/// Which views of a document are compressed, by a reader of its own.
fn compressed_views(path: &Path) -> Vec<usize> {
    let file = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let json = if file.starts_with(b"glTF") {
        let n = u32::from_le_bytes(file[12..16].try_into().expect("four bytes")) as usize;
        &file[20..20 + n]
    } else {
        &file[..]
    };
    let document: Value = serde_json::from_slice(json).expect("the document is JSON");
    let views = document["bufferViews"].as_array().expect("there are views").iter().enumerate();
    views.filter(|(_, v)| !v["extensions"]["EXT_meshopt_compression"].is_null()).map(|(i, _)| i).collect()
}

#[test]
fn every_compressed_view_of_the_assets_decodes_to_the_bytes_of_the_reference() {
    let Some(assets) = std::env::var_os("ORTHANT_ASSETS").map(PathBuf::from) else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    for (file, count, length, golden) in GOLDEN {
        let path = assets.join(file);
        let compressed = compressed_views(&path);
        let imported = import_path(&path, &ImportOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let views: Vec<_> = imported.scene.buffer_views().ids().collect();
        let bytes: Vec<_> = compressed
            .iter()
            .map(|&i| imported.scene.view_bytes(views[i]).expect("views lie in their buffers"))
            .collect();
        assert_eq!((bytes.len(), bytes.iter().map(|b| b.len()).sum()), (count, length), "{file}");
        let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, bytes| fnv1a(hash, bytes));
        assert_eq!(hash, golden, "{file}: {hash:#018x}");
    }
}
