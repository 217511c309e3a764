//! What is refused says where and why, and no damage is more than a refusal.

use super::*;

#[track_caller]
fn refused(file: &File, place: &str, words: &str) {
    let message = file.import().map(|_| ()).unwrap_err();
    assert!(message.starts_with(&format!("a.crts: {place}: ")), "not at {place}: {message}");
    assert!(message.contains(words), "no \"{words}\": {message}");
}

#[test]
fn a_header_beyond_the_file_is_refused() {
    for length in [1u64 << 20, u64::MAX, 1 << 63] {
        let mut bytes = triangle().bytes();
        bytes[..8].copy_from_slice(&length.to_le_bytes());
        let message = import(bytes).unwrap_err();
        assert!(
            message.starts_with(&format!("a.crts: byte 0: the header is said to have {length} bytes")),
            "{message}"
        );
    }
    let message = import(vec![1, 2, 3]).unwrap_err();
    assert!(message.contains("begins with a length of 8 bytes, and this one has 3"), "{message}");
}

#[test]
fn a_header_that_is_no_json_is_refused_at_its_byte() {
    let message = import(File::new().bytes_of("{\"meshes\": [}")).unwrap_err();
    assert!(message.starts_with("a.crts: byte 20: the header is not valid JSON"), "{message}");
    let nan = import(File::new().bytes_of("{\"objects\":[{\"fov_y\": NaN}]}")).unwrap_err();
    assert!(nan.contains("not valid JSON"), "{nan}");
    let deep = "[".repeat(1_000_000);
    assert!(import(File::new().bytes_of(&format!("{{\"x\":{deep}"))).unwrap_err().contains("not valid JSON"));
}

#[test]
fn a_view_that_does_not_lie_in_the_blob_is_refused() {
    refused(
        &triangle().with("/buffer_views/3/byte_offset", json!(1 << 20)),
        "/buffer_views/3",
        "the view ends at byte",
    );
    let overflowing = triangle().with("/buffer_views/3/byte_offset", json!(u64::MAX));
    refused(&overflowing, "/buffer_views/3", "overflow");
    let negative = triangle().with("/buffer_views/3/byte_offset", json!(-1));
    refused(&negative, "/buffer_views/3/byte_offset", "a whole number, 0 or more, and is -1");
}

#[test]
fn a_view_of_a_wrong_type_or_length_is_refused() {
    let odd = triangle().with("/buffer_views/0/byte_length", json!(35));
    refused(&odd, "/buffer_views/0/byte_length", "35 is no multiple of the 12 bytes of VEC3_F32");
    refused(
        &triangle().with("/buffer_views/0/type", json!("VEC3")),
        "/buffer_views/0/type",
        "\"VEC3\" is no element type",
    );
    for (key, view, words) in [
        ("positions", 2, "buffer view 2 is VEC2_F32, but positions must be VEC3_F32"),
        ("indices", 0, "must be VEC3_U32"),
        ("texcoords", 0, "must be VEC2_F32"),
    ] {
        refused(&triangle().with(&format!("/meshes/0/{key}"), json!(view)), &format!("/meshes/0/{key}"), words);
    }
    let fewer = triangle().with("/buffer_views/2/byte_length", json!(16));
    refused(&fewer, "/meshes/0/texcoords", "there are 2 texture coordinates, but 3 positions");
    let mut image = triangle();
    image.add("images", json!({ "name": "x", "view": 0, "color_space": "sRGB" }));
    refused(&image, "/images/0/view", "view must be UINT_8");
}

#[test]
fn an_index_out_of_range_is_refused_in_every_slot() {
    for (at, kind) in [
        ("/meshes/0/positions", "buffer view"),
        ("/meshes/0/indices", "buffer view"),
        ("/meshes/0/texcoords", "buffer view"),
        ("/meshes/0/normals", "buffer view"),
        ("/objects/0/mesh", "mesh"),
        ("/objects/0/material", "material"),
        ("/materials/0/base_color_texture", "image"),
    ] {
        refused(&triangle().with(at, json!(99)), at, &format!("there is no {kind} 99; the document has"));
        refused(&triangle().with(at, json!(-2)), at, &format!("-2 is no index of a {kind}"));
    }
    let scalar = triangle().with("/materials/0/sheen_texture", json!({ "texture": 0, "channel": 0 }));
    refused(&scalar, "/materials/0/sheen_texture/texture", "there is no image 0; the document has 0");
    let mut channel = triangle();
    channel.image(&[[0; 4]], 1, "LINEAR");
    let channel = channel.with("/materials/0/sheen_texture", json!({ "texture": 0, "channel": 4 }));
    refused(&channel, "/materials/0/sheen_texture/channel", "4 is no channel; it must be 0 to 3");
    let mut vertex = triangle();
    vertex.blob[36 + 4..36 + 8].copy_from_slice(&7u32.to_le_bytes());
    refused(&vertex, "/meshes/0/indices", "index 1 is 7, but there are 3 vertices");
}

#[test]
fn a_matrix_that_is_not_finite_or_not_affine_is_refused() {
    for value in [json!(null), json!(1e39), json!(-1e300)] {
        refused(&triangle().with("/objects/0/matrix/5", value), "/objects/0/matrix", "not finite");
    }
    refused(&triangle().with("/objects/0/matrix/3", json!(1)), "/objects/0/matrix", "last row");
    refused(&triangle().with("/objects/0/matrix", json!([1, 2])), "/objects/0/matrix", "it has 2 elements");
}

#[test]
fn an_object_that_lacks_something_is_refused() {
    refused(&triangle().with("/objects/0/type", json!("CURVE")), "/objects/0/type", "it cannot be \"CURVE\"");
    for (kind, key) in [("LIGHT", "color"), ("CAMERA", "fov_y")] {
        refused(&triangle().with("/objects/0/type", json!(kind)), "/objects/0", &format!("the object has no {key}"));
    }
    let camera = triangle().with("/objects/0/type", json!("CAMERA")).with("/objects/0/fov_y", json!(180));
    refused(&camera, "/objects/0/fov_y", "must be between 0 and 180");
    refused(&triangle().with("/light_origin", json!("middle")), "/light_origin", "it cannot be \"middle\"");
}

#[test]
fn another_format_is_not_taken_for_crts() {
    let gltf = import(br#"{"asset":{"version":"2.0"}}"#.to_vec()).unwrap_err();
    assert!(gltf.contains("the extension says crts, but the content is gltf"), "{gltf}");
    let renamed = import_slice(triangle().bytes(), None, "a.glb", &ImportOptions::default()).unwrap_err().to_string();
    assert!(renamed.contains("the extension says glb, but the content is crts"), "{renamed}");
}

/// A file with one of everything.
pub fn everything() -> File {
    let mut file = triangle();
    let image = file.image(&[[1, 2, 3, 4], [5, 6, 7, 8]], 2, "LINEAR");
    let texture = json!({ "texture": image, "channel": 0 });
    file.add("materials", json!({ "base_color_texture": image, "metallic_texture": texture, "sheen": 0.5 }));
    file.object(0, 1);
    file.object(0, -1);
    file.add("objects", placed("LIGHT", IDENTITY, json!({ "color": [1, 1, 1], "energy": 3, "size": [1, 1] })));
    file.add("objects", placed("CAMERA", IDENTITY, json!({ "fov_y": 45 })));
    file
}

#[test]
fn a_file_that_is_cut_anywhere_is_refused_or_read() {
    let bytes = everything().bytes();
    assert!(import(bytes.clone()).is_ok());
    for end in 0..bytes.len() {
        // Padding behind the last view is nothing that is missed; every other cut is.
        assert!(import(bytes[..end].to_vec()).is_err(), "cut at {end} of {}", bytes.len());
    }
}

#[test]
fn a_file_with_any_byte_changed_does_no_harm() {
    let bytes = everything().bytes();
    let options = ImportOptions { max_memory: 64 << 20, ..ImportOptions::default() };
    let (mut read, mut refused) = (0, 0);
    for position in 0..bytes.len() {
        for change in [0x01, 0x10, 0x80, 0xff] {
            let mut damaged = bytes.clone();
            damaged[position] ^= change;
            match import_slice(damaged, None, "a.crts", &options) {
                Ok(imported) => {
                    assert!(imported.charged_bytes <= options.max_memory);
                    read += 1;
                }
                Err(_) => refused += 1,
            }
        }
    }
    assert!(read > 100 && refused > 100, "{read} read, {refused} refused");
}

#[test]
fn a_file_that_does_not_fit_the_budget_is_refused() {
    let mut file = triangle();
    // A PNG that says it is huge: only its header is there.
    let mut png = crate::import::crts::packing::png(&[0; 3], 1, 1, image::ExtendedColorType::Rgb8);
    png[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    let view = file.view("UINT_8", &png);
    file.add("images", json!({ "name": "bomb", "view": view, "color_space": "sRGB" }));
    let options = ImportOptions { max_memory: 100 << 20, ..ImportOptions::default() };
    let message = import_slice(file.bytes(), None, "a.crts", &options).unwrap_err().to_string();
    assert!(message.starts_with("a.crts: /images/0/view: ") && message.contains("--max-memory"), "{message}");
    let options = ImportOptions { max_memory: 4000, ..ImportOptions::default() };
    assert!(
        import_slice(triangle().bytes(), None, "a.crts", &options).unwrap_err().to_string().contains("--max-memory")
    );
}

/// As PNG has it (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}
