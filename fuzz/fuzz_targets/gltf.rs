//! glTF and GLB files, whole.
#![no_main]

use orthant_fuzz::{exercise, import};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let name = if bytes.starts_with(b"glTF") { "a.glb" } else { "a.gltf" };
    if let Some(scene) = import(bytes, name) {
        exercise(&scene, true);
    }
});
