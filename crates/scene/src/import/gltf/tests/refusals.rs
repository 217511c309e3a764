//! What is refused says where and why; what is tolerated says so.

use super::*;

/// The document is refused, and the message names this place and holds these words.
#[track_caller]
fn refused(document: &Value, place: &str, words: &str) {
    let message = refusal(document);
    assert!(message.starts_with(&format!("a.gltf: {place}: ")), "not at {place}: {message}");
    assert!(message.contains(words), "no \"{words}\": {message}");
}

#[track_caller]
fn tolerated(document: &Value, place: &str, words: &str) {
    let list = warnings(document);
    assert!(list.iter().any(|w| w.starts_with(&format!("{place}: ")) && w.contains(words)), "{list:?}");
}

#[test]
fn an_index_out_of_range_is_refused_in_every_slot() {
    for (at, kind) in [
        ("/accessors/0/bufferView", "buffer view"),
        ("/bufferViews/0/buffer", "buffer"),
        ("/meshes/0/primitives/0/indices", "accessor"),
        ("/meshes/0/primitives/0/material", "material"),
        ("/meshes/0/primitives/0/attributes/POSITION", "accessor"),
        ("/nodes/0/mesh", "mesh"),
        ("/nodes/0/skin", "skin"),
        ("/nodes/0/camera", "camera"),
        ("/scenes/0/nodes/0", "node"),
        ("/scene", "scene"),
    ] {
        refused(&triangle_with(at, json!(7)), at, &format!("there is no {kind} 7; the document has "));
    }
    let light = json!({ "KHR_lights_punctual": { "light": 0 } });
    refused(
        &triangle_with("/nodes/0/extensions", light),
        "/nodes/0/extensions/KHR_lights_punctual/light",
        "there is no light 0; the document has 0",
    );
    let instancing = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "SCALE": 9 } } });
    refused(
        &triangle_with("/nodes/0/extensions", instancing),
        "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/SCALE",
        "there is no accessor 9",
    );
    refused(&triangle_with("/nodes/0/children", json!([1])), "/nodes/0/children/0", "there is no node 1");
    refused(&triangle_with("/skins", json!([{ "joints": [5] }])), "/skins/0/joints/0", "there is no node 5");
    let texture = json!([{ "normalTexture": { "index": 0 } }]);
    refused(&triangle_with("/materials", texture), "/materials/0/normalTexture/index", "there is no texture 0");
}

#[test]
fn wrong_json_types_name_their_place() {
    refused(&triangle_with("/nodes/0/mesh", json!("0")), "/nodes/0/mesh", "a non-negative integer");
    refused(&triangle_with("/nodes/0/mesh", json!(-1)), "/nodes/0/mesh", "-1");
    refused(&triangle_with("/nodes/0/mesh", json!(0.5)), "/nodes/0/mesh", "0.5");
    refused(&triangle_with("/nodes/0/scale", json!([1, 2])), "/nodes/0/scale", "it has 2 elements");
    refused(&triangle_with("/accessors/0/type", json!("VEC5")), "/accessors/0/type", "VEC5");
    refused(&triangle_with("/accessors/0/componentType", json!(5124)), "/accessors/0/componentType", "5124");
    refused(&triangle_with("/meshes/0/primitives/0/mode", json!(7)), "/meshes/0/primitives/0/mode", "7");
    refused(&triangle_with("/accessors/1", json!({})), "/accessors/1", "is missing");
    let light = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }, { "type": "area" }] } });
    refused(&triangle_with("/extensions", light), "/extensions/KHR_lights_punctual/lights/1/type", "area");
}

#[test]
fn what_is_no_json_names_line_and_column() {
    let text =
        |text: &str| import_slice(text, None, "a.gltf", &ImportOptions::default()).map(|_| ()).unwrap_err().to_string();
    assert!(text("{\n \"asset\": }").starts_with("a.gltf: line 2, column 11: this is not valid JSON"));
    assert!(text("{").starts_with("a.gltf: line 1, column 1: this is not valid JSON: EOF"));
    assert!(
        text("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"scale\":[1e999,1,1]}]}").contains("number out of range")
    );
    assert!(text("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"scale\":[NaN,1,1]}]}").contains("not valid JSON"));
    let latin = import_slice(b"{\"a\": \"\xe4\"}".to_vec(), None, "a.gltf", &ImportOptions::default());
    assert_eq!(latin.map(|_| ()).unwrap_err().to_string(), "a.gltf: byte 7: the JSON is not valid UTF-8");
}

#[test]
fn views_and_accessors_must_lie_where_they_say() {
    refused(&triangle_with("/buffers/0/byteLength", json!(43)), "/buffers/0", "there are only 42 bytes");
    refused(&triangle_with("/bufferViews/1/byteLength", json!(7)), "/bufferViews/1", "ends at byte 43");
    refused(&triangle_with("/bufferViews/1/byteOffset", json!(u64::MAX)), "/bufferViews/1", "ends at byte");
    refused(
        &triangle_with("/accessors/0/count", json!(4)),
        "/accessors/0",
        "need 48 bytes of buffer view 0, which has 36",
    );
    refused(&triangle_with("/accessors/0/byteOffset", json!(u64::MAX)), "/accessors/0", "which has 36");
    refused(&triangle_with("/accessors/0/count", json!(u64::MAX)), "/accessors/0", "which has 36");
    refused(&triangle_with("/bufferViews/0/byteStride", json!(8)), "/accessors/0", "byteStride of 8");
    let sparse = json!({
        "count": 2, "indices": { "bufferView": 1, "componentType": 5121 }, "values": { "bufferView": 0 },
    });
    refused(&triangle_with("/accessors/0/sparse", sparse), "/accessors/0", "sparse index 1 is 0");
    refused(&triangle_with("/buffers/0", json!({ "byteLength": 42 })), "/bufferViews/0", "has no data");
}

#[test]
fn attributes_must_fit_each_other() {
    let short = json!({ "bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3" });
    let doc = triangle_with("/accessors/-", short);
    let primitive = "/meshes/0/primitives/0";
    let normal = format!("{primitive}/attributes/NORMAL");
    refused(&with(doc.clone(), &normal, json!(2)), &normal, "has 2 elements, but POSITION has 3");
    let targets = format!("{primitive}/targets");
    let target = json!([{ "POSITION": 2 }]);
    refused(&with(doc, &targets, target), &format!("{targets}/0/POSITION"), "has 2 elements, but POSITION has 3");
    refused(&triangle_with(&normal, json!(1)), &normal, "NORMAL cannot be Scalar of U16");
    let indices = format!("{primitive}/indices");
    refused(&triangle_with(&indices, json!(0)), &indices, "indices cannot be Vec3 of F32");
    let joints = json!({ "componentType": 5121, "count": 3, "type": "VEC4" });
    let doc = with(triangle_with("/accessors/-", joints), &format!("{primitive}/attributes/JOINTS_0"), json!(2));
    refused(&doc, &format!("{primitive}/attributes"), "each JOINTS_n needs its WEIGHTS_n");
    let second = json!({ "attributes": { "POSITION": 0 }, "targets": [{ "POSITION": 0 }] });
    refused(&triangle_with("/meshes/0/primitives/-", second), "/meshes/0/primitives/1", "1 morph targets");
}

#[test]
fn the_hierarchy_must_be_a_forest() {
    let nodes = |nodes: Value| document(json!({ "nodes": nodes }));
    refused(
        &nodes(json!([{ "children": [2] }, { "children": [2] }, { "name": "arm" }])),
        "/nodes/1/children/0",
        "node 2 (\"arm\") is a child of node 0 and of node 1",
    );
    refused(&nodes(json!([{ "children": [1, 1] }, {}])), "/nodes/0/children/1", "node 1 is a child of node 0 and of");
    refused(
        &nodes(json!([{}, { "children": [2], "name": "loop" }, { "children": [1] }])),
        "/nodes/1",
        "node 1 (\"loop\") is its own ancestor",
    );
    refused(&nodes(json!([{ "children": [0] }])), "/nodes/0", "its own ancestor");
    let rooted = json!({ "nodes": [{ "children": [1] }, {}], "scenes": [{ "nodes": [0, 1] }] });
    refused(&document(rooted), "/scenes/0/nodes/1", "node 1 cannot be a root: it is a child of node 0");
    refused(&triangle_with("/scenes/0/nodes", json!([0, 0])), "/scenes/0/nodes/1", "twice");
}

#[test]
fn transforms_must_be_affine() {
    let mut matrix = [0.0; 16];
    matrix[3] = 0.5;
    refused(&triangle_with("/nodes/0/matrix", json!(matrix)), "/nodes/0/matrix", "last row");
    tolerated(&triangle_with("/nodes/0/rotation", json!([0, 0, 0, 2])), "/nodes/0/rotation", "normalised");
    let zero = load(&triangle_with("/nodes/0/rotation", json!([0, 0, 0, 0])));
    assert!(zero.nodes().iter().next().unwrap().1.transform.to_affine().is_finite());
}

#[test]
fn other_versions_are_refused_and_later_minor_ones_load() {
    let asset = |asset: Value| json!({ "asset": asset });
    load(&asset(json!({ "version": "2.1" })));
    load(&asset(json!({ "version": "2.1", "minVersion": "2.0" })));
    for (bad, place) in [
        (json!({ "version": "1.0" }), "/asset/version"),
        (json!({ "version": "2" }), "/asset/version"),
        (json!({ "version": "3.0" }), "/asset/version"),
        (json!({ "version": "2.1", "minVersion": "2.1" }), "/asset/minVersion"),
    ] {
        refused(&asset(bad), place, "export the scene as glTF 2.0");
    }
    refused(&json!({}), "document root", "the member \"asset\" is missing");
}

#[test]
fn skins_must_have_matrices_for_their_joints() {
    let skin = |skin: Value| triangle_with("/skins", json!([skin]));
    refused(&skin(json!({ "joints": [] })), "/skins/0/joints", "at least one joint");
    let place = "/skins/0/inverseBindMatrices";
    refused(&skin(json!({ "joints": [0], "inverseBindMatrices": 0 })), place, "cannot be Vec3 of F32");
    let matrices = json!({ "componentType": 5126, "count": 1, "type": "MAT4" });
    let doc = with(triangle_with("/accessors/-", matrices), "/nodes/-", json!({}));
    let short = with(doc, "/skins", json!([{ "joints": [0, 1], "inverseBindMatrices": 2 }]));
    refused(&short, place, "1 inverse bind matrices for 2 joints");
}

#[test]
fn harmless_violations_load_with_a_warning() {
    let zero_stride = triangle_with("/bufferViews/0/byteStride", json!(0));
    tolerated(&zero_stride, "/bufferViews/0/byteStride", "taken as none");
    let no_position = triangle_with("/meshes/0/primitives/0/attributes", json!({ "_FOO": 0 }));
    tolerated(&no_position, "/meshes/0/primitives/0/attributes", "without POSITION is not shown");
    let texture = triangle_with("/textures", json!([{ "source": 3, "sampler": 4 }]));
    tolerated(&texture, "/textures/0/source", "no such image");
    tolerated(&texture, "/textures/0/sampler", "no such sampler");
    let path = json!([{
        "samplers": [{ "input": 1, "output": 1 }],
        "channels": [{ "sampler": 0, "target": { "path": "colour" } }],
    }]);
    tolerated(&triangle_with("/animations", path), "/animations/0/channels/0/target/path", "it is dropped");
    let sampler = triangle_with("/samplers", json!([{ "wrapS": 0 }]));
    tolerated(&sampler, "/samplers/0/wrapS", "the default is used");
    let factor = json!([{ "pbrMetallicRoughness": { "metallicFactor": 1.5 } }]);
    let place = "/materials/0/pbrMetallicRoughness/metallicFactor";
    tolerated(&triangle_with("/materials", factor), place, "outside its range");
    let broken = triangle_with("/images", json!([{ "uri": "data:image/png;base64,****" }]));
    tolerated(&broken, "/images/0/uri", "not valid base64");
}

#[test]
fn equal_warnings_are_counted() {
    let nodes: Vec<Value> = (0..1000).map(|_| json!({ "rotation": [0, 0, 0, 2] })).collect();
    let list = warnings(&document(json!({ "nodes": nodes })));
    let expected = "/nodes/0/rotation: the rotation is not of unit length; it is normalised (and in 999 more places)";
    assert_eq!(list, [expected]);
}
