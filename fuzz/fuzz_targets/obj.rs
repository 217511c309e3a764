//! OBJ files.
#![no_main]

use orthant_fuzz::{exercise, import};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some(scene) = import(bytes, "a.obj") {
        exercise(&scene, false);
    }
});
