//! What edits may set: the schemas' bounds, and materials that primitives can have.

use super::*;

fn document() -> Value {
    json!({
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [{"mesh": 0}, {"camera": 0}, {"camera": 1}],
        "textures": [{}],
        "materials": [{"name": "plain"}, {"name": "mapped", "emissiveTexture": {"index": 0, "texCoord": 1}}],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1, "zfar": 10}},
            {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 10}},
        ],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {"outerConeAngle": 0.5}}]}},
    })
}

#[test]
fn numbers_out_of_the_bounds_of_the_schemas_are_refused() {
    let extension = |name: &str, member: &str, value: f64| json!({"extensions": {name: {member: value}}});
    let material = |set: Value| json!({"op": "set_material", "material": 0, "set": set});
    let light = |set: Value| json!({"op": "set_light", "light": 0, "set": set});
    let camera = |camera: usize, set: Value| json!({"op": "set_camera_params", "camera": camera, "set": set});
    for (operation, pointer) in [
        (material(json!({"emissiveFactor": [0, 2, 0]})), "/set/emissiveFactor"),
        (material(json!({"alphaCutoff": -1})), "/set/alphaCutoff"),
        (material(extension("KHR_materials_ior", "ior", 0.5)), "/set/extensions/KHR_materials_ior"),
        (
            material(extension("KHR_materials_volume", "attenuationDistance", 0.0)),
            "/set/extensions/KHR_materials_volume",
        ),
        (
            material(extension("KHR_materials_dispersion", "dispersion", -1.0)),
            "/set/extensions/KHR_materials_dispersion",
        ),
        (
            material(extension("KHR_materials_iridescence", "iridescenceIor", 0.9)),
            "/set/extensions/KHR_materials_iridescence",
        ),
        (
            material(extension("KHR_materials_emissive_strength", "emissiveStrength", 1e39)),
            "/set/extensions/KHR_materials_emissive_strength",
        ),
        (light(json!({"intensity": -1})), "/set/intensity: it has to be 0 or more"),
        (light(json!({"intensity": 1e39})), "/set/intensity"),
        (light(json!({"color": [1, 1, 2]})), "/set/color"),
        (light(json!({"range": 0})), "/set/range"),
        (light(json!({"spot": {"outerConeAngle": 2}})), "/set/spot/outerConeAngle"),
        (light(json!({"spot": {"innerConeAngle": 0.75}})), "/set/spot/innerConeAngle"),
        (json!({"op": "add_light", "light": {"type": "point", "intensity": -3}}), "/light/intensity"),
        (camera(0, json!({"perspective": {"yfov": 0}})), "/set/perspective/yfov"),
        (camera(0, json!({"perspective": {"znear": 20}})), "/set/perspective/znear"),
        (camera(0, json!({"perspective": {"zfar": 0.01}})), "/set/perspective/zfar"),
        (camera(0, json!({"perspective": {"aspectRatio": -1}})), "/set/perspective/aspectRatio"),
        (camera(1, json!({"orthographic": {"znear": -1}})), "/set/orthographic/znear"),
        (camera(1, json!({"orthographic": {"xmag": 0}})), "/set/orthographic/xmag"),
    ] {
        let mut scene = scenes::with_triangle(&document());
        let before = bytes(&scene);
        let error = run(&mut session(), &mut scene, operation.clone()).expect_err(&operation.to_string()).to_string();
        assert!(error.starts_with(pointer), "{operation}: {error}");
        assert!(bytes(&scene) == before, "{operation}");
    }
}

#[test]
fn what_a_file_has_does_not_stand_in_the_way_of_other_edits() {
    let mut document = document();
    document["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = json!(-2);
    let mut scene = scenes::with_triangle(&document);
    let set = json!({"op": "set_light", "light": 0, "set": {"color": [1, 0, 0], "spot": {"innerConeAngle": 0.25}}});
    run(&mut session(), &mut scene, set).unwrap();
    check(&scene);
}

#[test]
fn a_material_goes_where_its_texture_coordinates_are() {
    let mut scene = scenes::with_triangle(&document());
    let assign = json!({"op": "assign_material", "mesh": 0, "primitive": 0, "material": 1});
    let error = run(&mut session(), &mut scene, assign).unwrap_err().to_string();
    assert!(error.contains("TEXCOORD_1, which primitive 0 of mesh 0 does not have"), "{error}");
    let map = json!({"op": "set_material", "material": 0, "set": {"normalTexture": {"index": 0}}});
    let error = run(&mut session(), &mut scene, map).unwrap_err().to_string();
    assert!(error.contains("/set: a texture would be mapped by TEXCOORD_0"), "{error}");
    // Nobody has that one.
    let map = json!({"op": "set_material", "material": 1, "set": {"normalTexture": {"index": 0}}});
    run(&mut session(), &mut scene, map).unwrap();
}

#[test]
fn meshes_that_carry_other_extras_are_not_equal() {
    let mut scene = scenes::wide(10);
    let mut session = session();
    run(&mut session, &mut scene, json!({"op": "split_mesh", "node": 10})).unwrap();
    let own = node(&scene, 10).mesh.unwrap();
    scene.meshes.get_mut(own).unwrap().extra.extras = Some(Box::new(json!({"weight": 3})));
    scene.nodes.get_mut(scene.nodes.id_in_slot(9).unwrap()).unwrap().mesh = None;
    let error = run(&mut session, &mut scene, json!({"op": "merge_mesh", "node": 10})).unwrap_err();
    assert!(matches!(error, EditError::NoEqualMesh(_)), "{error}");
}

#[test]
fn what_the_document_itself_refers_to_is_mended() {
    let mut scene = scenes::with_triangle(&json!({
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{}, {}],
        "extensionsUsed": ["KHR_animation_pointer"],
        "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/1/translation"}},
    }));
    let start = bytes(&scene);
    let mut session = session();
    run(&mut session, &mut scene, json!({"op": "delete", "node": 1})).unwrap();
    check(&scene);
    assert!(scene.extra.links().is_empty());
    session.history.undo(&mut scene, 1).unwrap();
    check(&scene);
    assert!(bytes(&scene) == start);
}

#[test]
fn channels_that_go_are_all_that_an_undo_keeps_of_an_animation() {
    let count = 500;
    let channels: Vec<Value> =
        (1..=count).map(|i| json!({"sampler": i - 1, "target": {"node": i, "path": "translation"}})).collect();
    let samplers: Vec<Value> = (0..count).map(|_| json!({"input": 1, "output": 2})).collect();
    let floats: Vec<u8> = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|v| v.to_le_bytes()).collect();
    let uri = base64::Engine::encode(&base64::engine::general_purpose::STANDARD, floats);
    let accessor = |count: usize, kind: &str| {
        json!({"bufferView": 0, "componentType": 5126, "count": count, "type": kind, "min": vec![0; if kind == "VEC3" { 3 } else { 1 }],
            "max": vec![1; if kind == "VEC3" { 3 } else { 1 }]})
    };
    let mut scene = scenes::import(&json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": std::iter::once(json!({"children": (1..=count).collect::<Vec<_>>()}))
            .chain((0..count).map(|_| json!({})))
            .collect::<Vec<_>>(),
        "animations": [{"channels": channels, "samplers": samplers}],
        "accessors": [accessor(3, "VEC3"), accessor(1, "SCALAR"), accessor(1, "VEC3")],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": format!("data:application/octet-stream;base64,{uri}")}],
    }));
    let start = bytes(&scene);
    let mut session = session();
    for operation in [json!({"op": "delete", "node": 250}), json!({"op": "duplicate", "node": 1})] {
        run(&mut session, &mut scene, operation).unwrap();
        check(&scene);
        let entry = session.history.done().last().unwrap();
        assert!(entry.bytes < 4096, "{} bytes", entry.bytes);
    }
    let animation = scene.animations.values().next().unwrap();
    assert_eq!((animation.channels.len(), animation.samplers.len()), (count, count - 1));
    session.history.undo(&mut scene, 2).unwrap();
    check(&scene);
    assert!(bytes(&scene) == start);
}

#[test]
fn a_history_counts_what_it_holds() {
    let mut scene = scenes::with_triangle(&document());
    let mut session = session();
    let text = "x".repeat(10_000);
    let set = json!({"op": "set_material", "material": 0, "set": {"extras": {"note": text}}});
    run(&mut session, &mut scene, set).unwrap();
    assert!(session.history.bytes() > 10_000, "{}", session.history.bytes());
    // What is undone is parked: the new geometry is held by the redo.
    run(&mut session, &mut scene, json!({"op": "add_shape", "shape": "sphere"})).unwrap();
    let before = session.history.bytes();
    session.history.undo(&mut scene, 1).unwrap();
    assert!(session.history.bytes() > before + 50_000, "{} and {before}", session.history.bytes());
    session.history.redo(&mut scene, 1).unwrap();
    assert_eq!(session.history.bytes(), before);
}
