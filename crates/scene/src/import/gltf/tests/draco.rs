//! Compressed primitives become plain ones.

use super::*;
use crate::accessor::{read_f32, read_indices};
use crate::codec::draco::fixtures::{self, bytes};
use crate::model::*;

const DRACO: &str = "KHR_draco_mesh_compression";

/// Ids of the attributes in the fixtures.
const GENERIC: u32 = 7;
const TEXCOORD: u32 = 8;
const NORMAL: u32 = 9;
const POSITION: u32 = 10;

/// The box of the fixtures, compressed.
fn compressed_box(hex: &str) -> Value {
    let data = bytes(hex);
    document(json!({
        "extensionsUsed": [DRACO],
        "extensionsRequired": [DRACO],
        "buffers": [{ "byteLength": data.len(), "uri": data_uri(&data) }],
        "bufferViews": [{ "buffer": 0, "byteLength": data.len() }],
        "accessors": [
            { "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [1, 2, 4] },
            { "componentType": 5126, "count": 8, "type": "VEC3" },
            { "componentType": 5126, "count": 8, "type": "VEC2" },
            { "componentType": 5121, "count": 8, "type": "VEC4", "normalized": true },
            { "componentType": 5123, "count": 36, "type": "SCALAR" },
        ],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3 },
            "indices": 4,
            "extensions": { DRACO: {
                "bufferView": 0,
                "attributes": { "POSITION": POSITION, "NORMAL": NORMAL, "TEXCOORD_0": TEXCOORD, "COLOR_0": GENERIC },
            } },
        }] }],
    }))
}

const EXTENSION: &str = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";

fn first_primitive(scene: &Scene) -> &Primitive {
    &scene.meshes().iter().next().unwrap().1.primitives[0]
}

fn positions(scene: &Scene, primitive: &Primitive) -> Vec<[f32; 3]> {
    read_f32::<3>(scene, primitive.attributes.get("POSITION").unwrap()).unwrap()
}

/// The corner of the box that each vertex is, from the colours.
fn corners(scene: &Scene, primitive: &Primitive) -> Vec<u8> {
    let id = primitive.attributes.get("COLOR_0").unwrap();
    let colors = scene.view_bytes(scene.accessors()[id].view.unwrap()).unwrap();
    colors.chunks(4).map(|c| c[0]).collect()
}

#[test]
fn a_compressed_primitive_becomes_a_plain_one_and_the_extension_goes() {
    for hex in fixtures::ALL {
        let imported = import(&compressed_box(hex)).unwrap();
        assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
        let scene = &imported.scene;
        assert!(scene.extensions_used().is_empty() && scene.extensions_required().is_empty());
        let primitive = first_primitive(scene);
        assert!(primitive.extra.extensions.is_none());
        assert_eq!(scene.accessors().len(), 5);
        assert!(scene.accessors().iter().all(|(_, a)| a.view.is_some()));

        let (positions, corners) = (positions(scene, primitive), corners(scene, primitive));
        for (p, &i) in positions.iter().zip(&corners) {
            let expected = [f32::from(i >> 2 & 1), 2.0 * f32::from(i >> 1 & 1), 4.0 * f32::from(i & 1)];
            assert!(p.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.001), "{p:?} is corner {i}");
        }
        let indices = read_indices(scene, primitive.indices.unwrap()).unwrap();
        let mut first: Vec<u8> = indices.iter().map(|&v| corners[v as usize]).collect();
        first.sort_unstable();
        let mut expected = fixtures::TRIANGLES.as_flattened().to_vec();
        expected.sort_unstable();
        assert_eq!(first, expected);
    }
}

#[test]
fn the_view_of_the_compressed_bytes_becomes_that_of_the_indices_unless_it_has_other_uses() {
    let scene = load(&compressed_box(fixtures::SEQUENTIAL));
    let indices = scene.accessors()[first_primitive(&scene).indices.unwrap()].view.unwrap();
    assert_eq!(scene.buffer_views().ids().next(), Some(indices));
    assert_eq!((scene.buffer_views().len(), scene.buffers().len()), (5, 2));
    assert_eq!(scene.view_bytes(indices).unwrap()[..8], [0, 0, 1, 0, 3, 0, 0, 0]);

    let image =
        with(compressed_box(fixtures::SEQUENTIAL), "/images", json!([{ "bufferView": 0, "mimeType": "image/png" }]));
    let scene = load(&image);
    assert_eq!(scene.view_bytes(scene.buffer_views().ids().next().unwrap()).unwrap(), bytes(fixtures::SEQUENTIAL));
    assert_eq!(scene.buffer_views().len(), 6);
}

#[test]
fn an_export_has_the_decoded_bytes_and_not_the_compressed_ones() {
    let scene = load(&compressed_box(fixtures::SEQUENTIAL));
    let held: usize = scene.buffers().iter().map(|(_, buffer)| buffer.data.len()).sum();
    let files = crate::export::gltf::to_gltf(&scene, "a", &crate::export::ExportOptions::default()).unwrap();
    let views: usize = scene.buffer_views().iter().map(|(_, view)| view.length.next_multiple_of(4)).sum();
    let bin = &files.others[0].1;
    assert!(bin.len() <= views && bin.len() + bytes(fixtures::SEQUENTIAL).len() <= held.next_multiple_of(4));
    let found = bin.windows(32).any(|window| window == &bytes(fixtures::SEQUENTIAL)[..32]);
    assert!(!found, "the compressed bytes are not written");
}

#[test]
fn bounds_are_those_of_the_decoded_elements() {
    let scene = load(&compressed_box(fixtures::SEQUENTIAL));
    let (_, position) = scene.accessors().iter().next().unwrap();
    let max = position.max.as_ref().unwrap();
    // 1 and 2 are no steps of 4 / 2047.
    assert_eq!(max, &[f64::from(1.000_488_5_f32), f64::from(2.000_977_f32), 4.0]);
    assert_eq!(position.min, Some(vec![0.0; 3]));
    // Undeclared bounds stay so.
    assert!(scene.accessors().iter().skip(1).all(|(_, a)| a.min.is_none() && a.max.is_none()));
}

#[test]
fn elements_are_converted_to_what_the_accessor_declares() {
    let mut converted = compressed_box(fixtures::SEQUENTIAL);
    converted["accessors"][2]["componentType"] = json!(5123);
    converted["accessors"][2]["normalized"] = json!(true);
    converted["accessors"][3] = json!({ "componentType": 5126, "count": 8, "type": "VEC4" });
    converted["accessors"][4]["componentType"] = json!(5121);
    let scene = load(&converted);
    let primitive = first_primitive(&scene);
    let uv = read_f32::<2>(&scene, primitive.attributes.get("TEXCOORD_0").unwrap()).unwrap();
    assert!((uv[3][0] - 0.375).abs() < 1e-4 && (uv[3][1] - 0.625).abs() < 1e-4, "{uv:?}");
    let colors = read_f32::<4>(&scene, primitive.attributes.get("COLOR_0").unwrap()).unwrap();
    assert_eq!(colors[3], [3.0, 0.0, 6.0, 255.0]);
    assert_eq!(read_indices(&scene, primitive.indices.unwrap()).unwrap()[..6], [0, 1, 3, 0, 3, 2]);
}

#[test]
fn vertex_elements_of_three_bytes_are_four_bytes_apart() {
    let mut odd = compressed_box(fixtures::SEQUENTIAL);
    // Normals as bytes: what a float stands for, rounded.
    odd["accessors"][1] = json!({ "componentType": 5120, "normalized": true, "count": 8, "type": "VEC3" });
    let scene = load(&odd);
    let id = first_primitive(&scene).attributes.get("NORMAL").unwrap();
    let view = &scene.buffer_views()[scene.accessors()[id].view.unwrap()];
    assert_eq!((view.stride, view.length), (Some(4), 32));
    let normals = read_f32::<3>(&scene, id).unwrap();
    assert!(normals[7].iter().zip([0.218, 0.436, 0.873]).all(|(a, b)| (a - b).abs() < 0.01), "{:?}", normals[7]);
}

#[test]
fn data_besides_the_compressed_form_is_used_as_it_is() {
    let extension = json!({ DRACO: { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    let scene = load(&triangle_with("/meshes/0/primitives/0/extensions", extension));
    let primitive = first_primitive(&scene);
    assert!(primitive.extra.extensions.is_none());
    assert_eq!(positions(&scene, primitive), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(scene.buffers().len(), 1);
}

#[test]
fn primitives_of_the_same_compressed_bytes_share_their_elements() {
    let mut shared = compressed_box(fixtures::EDGEBREAKER_STANDARD);
    let primitive = shared["meshes"][0]["primitives"][0].clone();
    shared["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    let scene = load(&shared);
    assert_eq!((scene.accessors().len(), scene.buffer_views().len()), (5, 5));
}

#[test]
fn an_accessor_of_two_compressed_meshes_is_split() {
    let mut split = compressed_box(fixtures::EDGEBREAKER_STANDARD);
    let data = bytes(fixtures::SEQUENTIAL);
    split["buffers"].as_array_mut().unwrap().push(json!({ "byteLength": data.len(), "uri": data_uri(&data) }));
    split["bufferViews"].as_array_mut().unwrap().push(json!({ "buffer": 1, "byteLength": data.len() }));
    let mut primitive = split["meshes"][0]["primitives"][0].clone();
    primitive["extensions"][DRACO]["bufferView"] = json!(1);
    split["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    let scene = load(&split);
    assert_eq!((scene.accessors().len(), scene.buffer_views().len()), (10, 10));
    let primitives = &scene.meshes().iter().next().unwrap().1.primitives;
    assert_eq!(corners(&scene, &primitives[0]), [5, 4, 7, 6, 2, 0, 1, 3]);
    assert_eq!(corners(&scene, &primitives[1]), [0, 1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn triangles_without_an_index_accessor_are_not_lost() {
    let mut bare = compressed_box(fixtures::SEQUENTIAL);
    bare["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    let scene = load(&bare);
    let indices = read_indices(&scene, first_primitive(&scene).indices.unwrap()).unwrap();
    assert_eq!(indices.len(), 36);
    assert_eq!(indices[..6], [0, 1, 3, 0, 3, 2]);
}

#[test]
fn what_does_not_agree_with_the_document_is_refused_with_its_place() {
    let extension = format!("a.gltf: {EXTENSION}");
    for (at, value, place, what) in [
        ("/accessors/4/count", json!(33), "", "has 36 indices, but accessor 4 declares 33"),
        ("/accessors/0/count", json!(9), "/attributes/POSITION", "has 8 vertices, but accessor 0 declares 9"),
        ("/accessors/1/type", json!("VEC2"), "/attributes/NORMAL", "has 3 components, but accessor 1 declares 2"),
        ("/accessors/0/componentType", json!(5121), "/attributes/POSITION", "does not fit the accessor's U8"),
        ("/accessors/4/componentType", json!(5126), "", "indices cannot be F32"),
        (&format!("{EXTENSION}/attributes/POSITION"), json!(77), "/attributes/POSITION", "no attribute 77"),
        (&format!("{EXTENSION}/bufferView"), json!(7), "/bufferView", "there is no buffer view 7"),
        ("/bufferViews/0/byteLength", json!(200), "", "cannot be decoded: Draco data, byte "),
        ("/bufferViews/0/byteLength", json!(4), "", "byte 4: the data ends in the magic"),
        ("/bufferViews/0/byteOffset", json!(1), "", "ends at byte"),
    ] {
        let message = refusal(&with(compressed_box(fixtures::EDGEBREAKER_VALENCE), at, value));
        let is_place =
            message.starts_with(&format!("{extension}{place}: ")) || message.starts_with("a.gltf: /bufferViews/0: ");
        assert!(is_place && message.contains(what), "{at}: {message}");
    }
    let strip = with(compressed_box(fixtures::SEQUENTIAL), "/meshes/0/primitives/0/mode", json!(5));
    let message = refusal(&strip);
    assert!(message.starts_with("a.gltf: /meshes/0/primitives/0/mode: "), "{message}");
}

#[test]
fn memory_is_charged_before_it_is_taken() {
    let document = compressed_box(fixtures::EDGEBREAKER_STANDARD).to_string();
    let mut options = ImportOptions::default();
    let whole = import_slice(document.clone(), None, "a.gltf", &options).unwrap().charged_bytes;
    // The result: positions, normals, UVs, colours and indices.
    let result = 8 * (12 + 12 + 8 + 4) + 36 * 2;
    let before = whole - result;
    options.max_memory = before + 1000;
    let message = import_slice(document.clone(), None, "a.gltf", &options).unwrap_err().to_string();
    assert!(
        message.starts_with(&format!("a.gltf: {EXTENSION}: ")) && message.contains("raise --max-memory"),
        "{message}"
    );
    // Decoding needs more than it leaves.
    options.max_memory = before + 20_000;
    assert_eq!(import_slice(document, None, "a.gltf", &options).unwrap().charged_bytes, whole);
}
