//! What an edit leads to is a valid document, and what it does not name is not judged.

use super::*;

#[test]
fn what_a_material_had_before_is_not_judged_and_stays() {
    let mut scene = scenes::with_triangle(&json!({"materials": [{"emissiveFactor": [0, 2, 0]}]}));
    let mut session = session();
    let material = |scene: &Scene| scene.materials.values().next().unwrap().clone();
    let set = |set: Value| json!({"op": "set_material", "material": 0, "set": set});
    run(&mut session, &mut scene, set(json!({"doubleSided": true}))).unwrap();
    assert_eq!((material(&scene).double_sided, material(&scene).emissive), (true, [0., 2., 0.]));
    let error = run(&mut session, &mut scene, set(json!({"emissiveFactor": [0, 2, 0]}))).unwrap_err().to_string();
    assert!(error.starts_with("/set/emissiveFactor"), "{error}");
    let error = run(&mut session, &mut scene, set(json!({"alphaMode": "SOLID"}))).unwrap_err().to_string();
    assert!(error.starts_with("/set/alphaMode"), "{error}");
}

#[test]
fn a_shape_takes_only_materials_that_its_texture_coordinates_fit() {
    let mut scene = scenes::with_triangle(&json!({
        "textures": [{}],
        "materials": [{}, {"emissiveTexture": {"index": 0, "texCoord": 1}}, {"emissiveTexture": {"index": 0}}],
    }));
    let before = bytes(&scene);
    let add = |material: usize| json!({"op": "add_shape", "shape": "cube", "material": material});
    let error = run(&mut session(), &mut scene, add(1)).unwrap_err().to_string();
    assert!(error.contains("material 1") && error.contains("TEXCOORD_1"), "{error}");
    assert!(bytes(&scene) == before);
    run(&mut session(), &mut scene, add(2)).unwrap();
}

/// Node 0 has a mesh with a morph target, whose weight two animations move; one of them moves its place as well.
fn morphed() -> Scene {
    let floats: Vec<u8> = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|v| v.to_le_bytes()).collect();
    let uri = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, floats);
    let accessor = |count: usize, kind: &str| {
        let width = if kind == "VEC3" { 3 } else { 1 };
        json!({"bufferView": 0, "componentType": 5126, "count": count, "type": kind, "min": vec![0; width], "max": vec![1; width]})
    };
    let position = json!({"POSITION": 0});
    let weights = json!({"sampler": 0, "target": {"node": 0, "path": "weights"}});
    scenes::import(&json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "weights": [0.5]}],
        "meshes": [
            {"primitives": [{"attributes": position, "targets": [position]}]},
            {"primitives": [{"attributes": position}]},
            {"primitives": [{"attributes": position, "targets": [position]}], "name": "other"},
        ],
        "animations": [
            {"channels": [weights, {"sampler": 1, "target": {"node": 0, "path": "translation"}}],
                "samplers": [{"input": 1, "output": 1}, {"input": 1, "output": 2}]},
            {"channels": [weights], "samplers": [{"input": 1, "output": 1}]},
        ],
        "accessors": [accessor(3, "VEC3"), accessor(1, "SCALAR"), accessor(1, "VEC3")],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": format!("data:application/octet-stream;base64,{uri}")}],
    }))
}

#[test]
fn weights_and_their_channels_go_with_the_morph_targets() {
    for mesh in [json!(null), json!(1)] {
        let mut scene = morphed();
        let mut session = session();
        let start = bytes(&scene);
        run(&mut session, &mut scene, json!({"op": "set_mesh", "node": 0, "mesh": mesh})).unwrap();
        check(&scene);
        assert_eq!(node(&scene, 0).weights, None);
        let animations: Vec<&Animation> = scene.animations.values().collect();
        assert_eq!(animations.len(), 1);
        assert_eq!((animations[0].channels.len(), animations[0].samplers.len()), (1, 1));
        assert_eq!(animations[0].channels[0].path, AnimationPath::Translation);
        let after = bytes(&scene);
        session.history.undo(&mut scene, 1).unwrap();
        check(&scene);
        assert!(bytes(&scene) == start);
        session.history.redo(&mut scene, 1).unwrap();
        assert!(bytes(&scene) == after);
    }
    let mut scene = morphed();
    run(&mut session(), &mut scene, json!({"op": "set_mesh", "node": 0, "mesh": 2})).unwrap();
    assert_eq!(node(&scene, 0).weights, Some(vec![0.5]));
    assert_eq!(scene.animations.values().map(|animation| animation.channels.len()).sum::<usize>(), 3);
}

#[test]
fn joints_keep_a_common_root() {
    let mut scene = scenes::skinned();
    let mut session = session();
    let before = bytes(&scene);
    for (slot, parent) in [(4, json!(null)), (4, json!(6))] {
        let out = json!({"op": "reparent", "node": slot, "parent": parent});
        let error = run(&mut session, &mut scene, out).unwrap_err().to_string();
        assert!(error.contains("skin 0: its joints would have no common root"), "{error}");
        assert!(bytes(&scene) == before);
    }
    // All of them together may go, and any of them below the same root.
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 2, "parent": null})).unwrap();
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 5, "parent": 3})).unwrap();
    check(&scene);
}

#[test]
fn a_wrong_type_is_named_with_its_member() {
    for (line, pointer) in [
        (r#"{"op": "set_time", "seconds": "NaN"}"#, "/seconds: invalid type: string \"NaN\", expected f64"),
        (r#"{"op": "set_transform", "node": 0, "scale": [1, 2]}"#, "/scale: "),
        (r#"{"visible": "yes", "node": 0, "op": "set_visible"}"#, "/visible: "),
        (r#"{"op": "set_visible", "node": 0}"#, "missing field `visible`"),
        (r#"{"op": "set_visible", "node": 0, "visible": true, "junk": 1}"#, "unknown field `junk`"),
    ] {
        let error = Operation::parse(line).unwrap_err().to_string();
        assert!(error.starts_with(pointer), "{error}");
    }
}

#[test]
fn a_byte_order_mark_is_skipped() {
    let line = r#"{"op": "delete", "node": 0}"#;
    assert_eq!(Operation::parse(&format!("\u{feff}{line}")), Operation::parse(line));
}

#[test]
fn a_document_without_variants_says_so() {
    let mut scene = scenes::deep(2);
    let error = run(&mut session(), &mut scene, json!({"op": "select_variant", "variant": "red"})).unwrap_err();
    assert_eq!(error.to_string(), "/variant: there is no such variant: the document has none; null selects none");
}
