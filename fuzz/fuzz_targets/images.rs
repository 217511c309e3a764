//! Image files of every kind: the input is the image of a document's only texture, as colours and as data.
#![no_main]

use orthant_fuzz::{exercise, import};
use serde_json::json;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((&kind, image)) = bytes.split_first() else { return };
    let (mime, extension) = match kind % 5 {
        0 => ("image/png", None),
        1 => ("image/jpeg", None),
        2 => ("image/webp", Some("EXT_texture_webp")),
        3 => ("image/ktx2", Some("KHR_texture_basisu")),
        _ => ("image/vnd-ms.dds", Some("MSFT_texture_dds")),
    };
    let texture = match extension {
        None => json!({"source": 0}),
        Some(name) => json!({"extensions": {name: {"source": 0}}}),
    };
    let document = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": extension.iter().collect::<Vec<_>>(),
        "buffers": [{"byteLength": image.len().max(1)}],
        "bufferViews": [{"buffer": 0, "byteLength": image.len().max(1)}],
        "images": [{"bufferView": 0, "mimeType": mime}],
        "textures": [texture],
        "materials": [{
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
            "normalTexture": {"index": 0},
        }],
    });
    if let Some(scene) = import(&glb(&document.to_string(), image), "a.glb") {
        exercise(&scene, true);
    }
});

/// A GLB of a document and its buffer.
fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let json = format!("{json:width$}", width = json.len().next_multiple_of(4));
    let padded = bin.len().max(1).next_multiple_of(4);
    let mut glb = [b"glTF".as_slice(), &2u32.to_le_bytes()].concat();
    for part in [28 + json.len() + padded, json.len()] {
        glb.extend((part as u32).to_le_bytes());
    }
    glb.extend(b"JSON");
    glb.extend(json.as_bytes());
    glb.extend((padded as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(bin);
    glb.resize(28 + json.len() + padded, 0);
    glb
}
