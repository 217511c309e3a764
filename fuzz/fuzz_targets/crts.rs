//! CRTS files. The length of the header is made to fit: else nearly every input would be refused for it alone.
#![no_main]

use orthant_fuzz::{exercise, import};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some(scene) = import(bytes, "a.crts") {
        exercise(&scene, false);
    }
    let header = bytes.iter().rposition(|&b| b == b'}').map_or(bytes.len(), |end| end + 1);
    let file = [&(header as u64).to_le_bytes(), bytes].concat();
    if let Some(scene) = import(&file, "a.crts") {
        exercise(&scene, false);
    }
});
