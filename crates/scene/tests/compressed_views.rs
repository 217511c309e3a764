//! Import of compressed buffer views: EXT_meshopt_compression and KHR_meshopt_compression.

use base64::Engine;
use orthant_scene::Scene;
use orthant_scene::import::{ImportOptions, import_slice};
use serde_json::{Value, json};

/// Three indices 0, 1, 2 of mode INDICES.
const INDICES: [u8; 8] = [0xd1, 0x00, 0x04, 0x04, 0, 0, 0, 0];

fn uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

/// A positions view whose elements are all the baseline (1.0, 2.0, 3.0): version 0, one header byte a byte position.
fn constant_positions() -> Vec<u8> {
    let mut stream = vec![0xa0];
    stream.extend([0; 12]);
    stream.extend([0; 20]);
    stream.extend([1.0f32, 2.0, 3.0].iter().flat_map(|v| v.to_le_bytes()));
    stream
}

fn document(extension: &str) -> Value {
    let positions = constant_positions();
    let compressed = [&positions[..], &INDICES].concat();
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": [extension, "KHR_mesh_quantization"],
        "extensionsRequired": [extension],
        "buffers": [
            { "byteLength": 1000, "extensions": { extension: { "fallback": true } } },
            { "byteLength": compressed.len(), "uri": uri(&compressed) },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 500, "byteLength": 60, "byteStride": 12, "extensions": { extension: {
                "buffer": 1, "byteLength": positions.len(), "byteStride": 12, "count": 5, "mode": "ATTRIBUTES" } } },
            { "buffer": 0, "byteLength": 6, "extensions": { extension: {
                "buffer": 1, "byteOffset": positions.len(), "byteLength": INDICES.len(), "byteStride": 2, "count": 3,
                "mode": "INDICES", "filter": "NONE" } } },
        ],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3" }],
    })
}

fn import(document: &Value, max_memory: u64) -> Result<(Scene, Vec<String>), String> {
    let mut options = ImportOptions::default();
    options.max_memory = max_memory;
    import_slice(document.to_string(), None, "a.gltf", &options)
        .map(|i| (i.scene, i.warnings.iter().map(ToString::to_string).collect()))
        .map_err(|e| e.to_string())
}

fn views(scene: &Scene) -> Vec<&[u8]> {
    scene.buffer_views().ids().map(|id| scene.view_bytes(id).expect("views lie in their buffers")).collect()
}

fn refusal(document: &Value) -> String {
    import(document, 1 << 20).map(|_| ()).expect_err("the document is refused")
}

#[test]
fn a_compressed_view_becomes_a_plain_one_and_the_extension_goes() {
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let (scene, warnings) = import(&document(extension), 1 << 20).expect("the document loads");
        assert_eq!(warnings, Vec::<String>::new());
        let position: Vec<u8> = [1.0f32, 2.0, 3.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(views(&scene), [&position.repeat(5)[..], &[0, 0, 1, 0, 2, 0]]);
        assert!(scene.buffer_views().iter().all(|(_, v)| v.extra.extensions.is_none()));
        assert!(scene.buffers().iter().all(|(_, b)| b.extra.extensions.is_none()));
        assert_eq!(scene.extensions_used(), ["KHR_mesh_quantization"]);
        assert!(scene.extensions_required().is_empty());
        // The fallback's 1000 bytes were declared, not needed.
        assert!(scene.buffers().iter().all(|(_, b)| b.data.len() < 100));
    }
}

#[test]
fn a_fallback_file_is_not_read() {
    let mut with_file = document("EXT_meshopt_compression");
    with_file["buffers"][0]["uri"] = json!("there/is/no/such.bin");
    let (scene, _) = import(&with_file, 1 << 20).expect("the file is not needed");
    assert_eq!(views(&scene)[1], [0, 0, 1, 0, 2, 0]);
}

#[test]
fn a_view_in_a_buffer_with_other_uses_goes_to_a_buffer_of_its_own() {
    let mut mixed = document("EXT_meshopt_compression");
    mixed["buffers"][0] = json!({ "byteLength": 1000, "uri": uri(&[7; 1000]) });
    mixed["bufferViews"].as_array_mut().unwrap().push(json!({ "buffer": 0, "byteOffset": 998, "byteLength": 2 }));
    let (scene, _) = import(&mixed, 1 << 20).expect("the document loads");
    assert_eq!(scene.buffers().len(), 3);
    assert_eq!(views(&scene)[1..], [&[0, 0, 1, 0, 2, 0][..], &[7, 7]]);
    // Without elements, it is an empty one.
    mixed["bufferViews"][1]["extensions"]["EXT_meshopt_compression"]["count"] = json!(0);
    mixed["bufferViews"].as_array_mut().unwrap().remove(0);
    mixed["accessors"] = json!([]);
    mixed["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["byteLength"] = json!(5);
    let (scene, _) = import(&mixed, 1 << 20).expect("a stream of nothing is a header and a tail");
    assert_eq!(views(&scene), [&[][..], &[7, 7]]);
}

#[test]
fn a_damaged_view_is_refused_with_its_place() {
    let extension = "EXT_meshopt_compression";
    let place = format!("a.gltf: /bufferViews/0/extensions/{extension}");
    for (key, value, what) in [
        ("byteLength", json!(46), "all elements are decoded"),
        ("byteLength", json!(20), "compressed bytes or more"),
        ("byteLength", json!(5000), "ends behind its buffer"),
        ("byteOffset", json!(1), "the first byte is 0x00"),
        ("byteOffset", json!(u64::MAX), "ends behind its buffer"),
        ("buffer", json!(9), "there is no buffer 9"),
        ("byteStride", json!(6), "a multiple of 4"),
        ("mode", json!("MESHES"), "no mode that is known"),
        ("filter", json!("SEPIA"), "no filter that is known"),
        ("filter", json!("OCTAHEDRAL"), "must be 4 or 8"),
        ("count", json!(1u64 << 40), "compressed bytes or more"),
        ("count", json!(u64::MAX), "too large for this machine"),
    ] {
        let mut damaged = document(extension);
        damaged["bufferViews"][0]["extensions"][extension][key] = value;
        let message = refusal(&damaged);
        assert!(message.starts_with(&place) && message.contains(what), "{key}: {message}");
    }
}

#[test]
fn what_views_decode_to_is_charged_before_it_is_taken() {
    let extension = "KHR_meshopt_compression";
    // All differences are zero by two control bits a byte position: 1 byte a block becomes 1024.
    let mut stream = vec![0xa1];
    stream.extend([0b1010_1010; 1000]);
    stream.extend([0; 24]);
    let mut bomb = document(extension);
    bomb["buffers"][1] = json!({ "byteLength": stream.len(), "uri": uri(&stream) });
    bomb["bufferViews"] = json!([{ "buffer": 0, "byteLength": 1_024_000, "extensions": { extension: {
        "buffer": 1, "byteLength": stream.len(), "byteStride": 4, "count": 256_000, "mode": "ATTRIBUTES" } } }]);
    bomb["accessors"] = json!([]);
    let message = import(&bomb, 1_000_000).map(|_| ()).expect_err("over the limit");
    assert!(message.contains("raise --max-memory"), "{message}");
    let (scene, _) = import(&bomb, 2_000_000).expect("within the limit");
    assert_eq!(views(&scene), [&[0; 1_024_000][..]]);
}
