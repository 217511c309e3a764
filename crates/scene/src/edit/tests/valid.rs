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
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 1, "parent": null})).unwrap();
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 2, "parent": null})).unwrap();
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 5, "parent": 3})).unwrap();
    check(&scene);
}

#[test]
fn no_scene_shows_what_a_skin_deforms_without_the_joints() {
    // Nodes 0 (above the body, 1, and the joints, 2 to 5) and 6 are in the second scene, 0 alone in the first.
    let mut scene = scenes::skinned();
    let mut session = session();
    let mut apply = |operation: Value| run(&mut session, &mut scene, operation);
    let reparent = |node: usize, parent: Value| json!({"op": "reparent", "node": node, "parent": parent});
    let refused = |result: Result<(), EditError>| {
        let error = result.unwrap_err().to_string();
        assert!(error.contains("skin 0: a scene would show node 1, which it deforms, without its joints"), "{error}");
    };
    refused(apply(reparent(2, json!(null))));
    refused(apply(reparent(2, json!(6))));
    // The body alone may leave a scene, but come to none that the joints are not in.
    apply(reparent(1, json!(6))).unwrap();
    refused(apply(reparent(0, json!(null))));
    apply(json!({"op": "undo"})).unwrap();
    apply(reparent(1, json!(null))).unwrap();
    apply(reparent(2, json!(null))).unwrap();
    refused(apply(reparent(1, json!(6))));
    refused(apply(reparent(1, json!(0))));
    // Nor by the skin: the statue, 6, has the same mesh.
    let error = apply(json!({"op": "set_skin", "node": 6, "skin": 0})).unwrap_err().to_string();
    assert!(error.contains("node 6, which it deforms, without its joints"), "{error}");
    // Without it, the body goes where it likes.
    apply(json!({"op": "set_skin", "node": 1, "skin": null})).unwrap();
    apply(reparent(1, json!(6))).unwrap();
    apply(reparent(2, json!(6))).unwrap();
    apply(json!({"op": "set_skin", "node": 1, "skin": 0})).unwrap();
    check(&scene);
    check_joints(&scene);
}

#[test]
fn what_merging_a_file_takes_the_joints_from_is_in_no_scene_any_more() {
    let folder = tempfile::tempdir().unwrap();
    // One skeleton, 2, in both scenes, and in each a body of its own: 0 and 1; below 1, the joints of a third, 3.
    let accessor = |kind: &str, component: u32| json!({"componentType": component, "count": 3, "type": kind, "min": [0, 0, 0], "max": [0, 0, 0]});
    let mut document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 2]}, {"nodes": [1, 2, 3, 5]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"mesh": 0, "skin": 0, "children": [4]}, {}, {"mesh": 0, "skin": 1}, {}, {}],
        "skins": [{"joints": [2]}, {"joints": [4]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}]}],
        "accessors": [accessor("VEC3", 5126), accessor("VEC4", 5121), accessor("VEC4", 5126)],
    });
    for i in 1..3 {
        let members = document["accessors"][i].as_object_mut().unwrap();
        members.remove("min");
        members.remove("max");
    }
    std::fs::write(folder.path().join("figures.gltf"), document.to_string()).unwrap();
    let mut scene = scenes::deep(2);
    let start = bytes(&scene);
    let mut session = Session::new(folder.path(), ImportOptions::default());
    let merge = Operation::parse(r#"{"op": "merge_scene", "path": "figures.gltf"}"#).unwrap();
    let Outcome::Edited(applied) = session.run(&mut scene, &merge).unwrap() else { panic!("it is an edit") };
    check(&scene);
    check_joints(&scene);
    let note = applied[0].notes.join("; ");
    assert!(note.ends_with("joints that they need are below the new node now: what is below node 3, 5"), "{note}");
    assert_eq!(children(&scene, 8), [2, 4]);
    assert_eq!(roots(&scene, 1), [7], "what needs no joints stays");
    assert!(node(&scene, 3).skin.is_some() && node(&scene, 5).skin.is_some(), "they have their skins still");
    session.history.undo(&mut scene, 1).unwrap();
    assert!(bytes(&scene) == start);
}

#[test]
fn pointers_to_weights_go_with_the_morph_targets_and_those_to_other_things_stay() {
    let by_pointer = |pointers: &[&str]| {
        let channel = |pointer: &&str| json!({"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}});
        let mut document: Value = serde_json::from_slice(
            &crate::export::gltf::to_gltf(&morphed(), "a", &ExportOptions::default()).unwrap().document,
        )
        .unwrap();
        document["extensionsUsed"] = json!(["KHR_animation_pointer"]);
        document["nodes"] = json!([{"mesh": 0}, {"mesh": 0}]);
        document["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{}", "A".repeat(48)));
        document["animations"] = json!([{
            "channels": pointers.iter().map(channel).collect::<Vec<_>>(),
            "samplers": [{"input": 1, "output": 1}],
        }]);
        scenes::import(&document)
    };
    let pointers =
        ["/nodes/0/weights", "/nodes/0/weights/0", "/nodes/0/translation", "/nodes/1/weights", "/meshes/0/weights"];
    let left = |mesh: Value| {
        let mut scene = by_pointer(&pointers);
        let mut session = session();
        let start = bytes(&scene);
        run(&mut session, &mut scene, json!({"op": "set_mesh", "node": 0, "mesh": mesh})).unwrap();
        check(&scene);
        let after = bytes(&scene);
        let of = |c: &AnimationChannel| {
            let extensions = c.target_extra.extensions.as_ref().unwrap();
            extensions["KHR_animation_pointer"]["pointer"].as_str().unwrap().to_owned()
        };
        let left: Vec<String> = scene.animations.values().flat_map(|a| a.channels.iter().map(of)).collect();
        session.history.undo(&mut scene, 1).unwrap();
        assert!(bytes(&scene) == start);
        session.history.redo(&mut scene, 1).unwrap();
        assert!(bytes(&scene) == after);
        left
    };
    assert_eq!(left(json!(1)), pointers[2..]);
    assert_eq!(left(json!(null)), pointers[2..]);
    assert_eq!(left(json!(2)), pointers, "as many targets");
}

#[test]
fn a_skeleton_that_is_above_not_all_joints_any_more_goes() {
    let mut scene = scenes::skinned();
    let mut session = session();
    let skeleton = |scene: &Scene| scene.skins.values().next().unwrap().skeleton.map(slot);
    let start = bytes(&scene);
    assert_eq!(skeleton(&scene), Some(2));
    // Below the hip, and the hip with all of its joints: nothing changes for the skin.
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 1, "parent": null})).unwrap();
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 5, "parent": 2})).unwrap();
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 2, "parent": null})).unwrap();
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 2, "parent": 0})).unwrap();
    assert_eq!(skeleton(&scene), Some(2));
    // Out of the hip, below the root that the joints still have in common.
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 4, "parent": 0})).unwrap();
    assert_eq!(skeleton(&scene), None);
    check(&scene);
    session.history.undo(&mut scene, 5).unwrap();
    assert!(bytes(&scene) == start);
}

#[test]
fn a_texture_in_a_tangent_space_asks_for_one() {
    let texture = json!({"index": 0});
    let coat = |texture: &Value| json!({"KHR_materials_clearcoat": {"clearcoatNormalTexture": texture}});
    let turned = json!({"KHR_materials_anisotropy": {"anisotropyTexture": texture}});
    let attributes = json!({"POSITION": 0, "NORMAL": 0, "TEXCOORD_0": 1});
    let mut with_tangents = attributes.clone();
    with_tangents["TANGENT"] = json!(2);
    let scene = scenes::with_triangle(&json!({
        "textures": [{}],
        "materials": [{}, {"extensions": coat(&texture)}, {"extensions": turned}, {}],
        "meshes": [
            {"primitives": [{"attributes": attributes, "material": 0}]},
            {"primitives": [{"attributes": with_tangents, "material": 3}]},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"componentType": 5126, "count": 3, "type": "VEC2"},
            {"componentType": 5126, "count": 3, "type": "VEC4"},
        ],
    }));
    let assign = |mesh: usize, material: usize| json!({"op": "assign_material", "mesh": mesh, "primitive": 0, "material": material});
    let set = |material: usize, set: Value| json!({"op": "set_material", "material": material, "set": set});
    for (operation, is_valid) in [
        (assign(0, 1), false),
        (assign(0, 2), false),
        (assign(1, 1), true),
        (assign(1, 2), true),
        (set(0, json!({"extensions": coat(&texture)})), false),
        (set(0, json!({"extensions": turned})), false),
        (set(0, json!({"extensions": turned, "normalTexture": texture})), true),
        (set(3, json!({"extensions": coat(&texture)})), true),
        (json!({"op": "add_shape", "shape": "cube", "material": 1}), false),
        (json!({"op": "add_shape", "shape": "cube", "material": 0}), true),
    ] {
        let mut edited = scene.clone();
        match run(&mut session(), &mut edited, operation.clone()) {
            Ok(()) => assert!(is_valid, "{operation}"),
            Err(error) => {
                assert!(!is_valid && error.to_string().contains("tangent space"), "{operation}: {error}");
                assert!(bytes(&edited) == bytes(&scene));
            }
        }
    }
    // A normal map that goes leaves the coat without one.
    let mut scene = scene;
    let mut session = session();
    run(&mut session, &mut scene, set(0, json!({"extensions": coat(&texture), "normalTexture": texture}))).unwrap();
    assert!(run(&mut session, &mut scene, set(0, json!({"normalTexture": null}))).is_err());
}

#[test]
fn a_name_means_the_first_object_that_has_it_now() {
    let mut scene = scenes::wide(20);
    let mut session = session();
    let mut apply = |operation: Value| run(&mut session, &mut scene, operation);
    let rename = |node: Value, name: &str| json!({"op": "rename", "node": node, "name": name});
    apply(rename(json!(7), "x")).unwrap();
    apply(rename(json!(5), "x")).unwrap();
    // The first of two, then the other, then what is made and merged of that name.
    apply(rename(json!("name:x"), "first")).unwrap();
    apply(rename(json!("name:x"), "second")).unwrap();
    assert!(apply(rename(json!("name:x"), "none")).is_err());
    apply(json!({"op": "undo"})).unwrap();
    apply(json!({"op": "set_visible", "node": "name:x", "visible": false})).unwrap();
    apply(json!({"op": "add_node", "name": "new"})).unwrap();
    apply(json!({"op": "delete", "node": "name:new"})).unwrap();
    assert!(apply(json!({"op": "delete", "node": "name:new"})).is_err());
    apply(json!({"op": "undo"})).unwrap();
    apply(json!({"op": "rename", "node": "name:new", "name": "kept"})).unwrap();
    apply(json!({"op": "rename", "material": "name:plain", "name": "paint"})).unwrap();
    apply(json!({"op": "duplicate_material", "material": "name:paint"})).unwrap();
    apply(json!({"op": "set_material", "material": "name:paint copy", "set": {"name": "other"}})).unwrap();
    apply(json!({"op": "set_material", "material": "name:other", "set": {"doubleSided": true}})).unwrap();
    assert_eq!(node(&scene, 5).name.as_deref(), Some("first"));
    assert_eq!((node(&scene, 7).name.as_deref(), node(&scene, 7).visible), (Some("x"), Some(false)));
    assert_eq!(scene.name_of(scene.ids_of(Kind::Node)[21]), Some("kept"));
    assert!(scene.materials.values().nth(1).unwrap().double_sided);
}

#[test]
fn a_label_that_is_set_again_means_the_later_object() {
    let mut scene = scenes::deep(2);
    let mut session = session();
    for name in ["a", "b"] {
        run(&mut session, &mut scene, json!({"op": "add_node", "name": name, "as": "n"})).unwrap();
    }
    run(&mut session, &mut scene, json!({"op": "rename", "node": "$n", "name": "c"})).unwrap();
    let names: Vec<_> = scene.nodes.values().filter_map(|node| node.name.as_deref()).collect();
    assert_eq!(names, ["a", "c"]);
}

#[test]
fn a_wrong_type_is_named_with_its_member() {
    for (line, pointer) in [
        (r#"{"op": "set_time", "seconds": "NaN"}"#, "/seconds: it has to be a number, and is the string \"NaN\""),
        (r#"{"op": "set_transform", "node": 0, "scale": [1, 2]}"#, "/scale: "),
        (r#"{"visible": "yes", "node": 0, "op": "set_visible"}"#, "/visible: "),
        (r#"{"op": "set_visible", "node": 0}"#, "the member \"visible\" is missing"),
        ("[1]", "an operation is an object"),
        ("null", "an operation is an object"),
        (r#"{"op": 5}"#, "/op: it has to be a string, and is 5"),
        (r#"{"op": "delete", "#, "column 17: this is not valid JSON"),
        (r#"{"op": "set_visible", "node": 0, "visible": true, "junk": 1}"#, "there is no member \"junk\""),
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

#[test]
fn a_document_without_scenes_gets_one_that_shows_what_was_shown() {
    let document = json!({"asset": {"version": "2.0"}, "nodes": [{"children": [1]}, {}, {"name": "other"}]});
    let first = |operation: Value| {
        let mut scene = scenes::import(&document);
        let before = bytes(&scene);
        let mut session = session();
        run(&mut session, &mut scene, operation).unwrap();
        check(&scene);
        let shown = roots(&scene, 0);
        session.history.undo(&mut scene, 1).unwrap();
        assert!(bytes(&scene) == before);
        shown
    };
    assert_eq!(first(json!({"op": "add_node"})), [0, 2, 3]);
    assert_eq!(first(json!({"op": "reparent", "node": 1, "parent": null})), [0, 2, 1]);
    assert_eq!(first(json!({"op": "reparent", "node": 0, "parent": null})), [2, 0]);
    assert_eq!(first(json!({"op": "reparent", "node": 0, "parent": null, "index": 0})), [0, 2]);
}

#[test]
fn what_has_been_undone_gives_its_numbers_back() {
    let mut scene = scenes::wide(3);
    let mut session = session();
    let next = scene.nodes.slot_bound();
    let add = |name: &str| json!({"op": "add_node", "name": name});
    for name in ["a", "b", "c"] {
        run(&mut session, &mut scene, add(name)).unwrap();
    }
    run(&mut session, &mut scene, json!({"op": "undo", "count": 3})).unwrap();
    // A refused edit leaves them to be redone.
    assert!(run(&mut session, &mut scene, json!({"op": "delete", "node": 999})).is_err());
    assert!(run(&mut session, &mut scene, json!({"op": "add_node", "parent": 999})).is_err());
    assert_eq!(session.history.undone(), 3);
    for name in ["first", "second", "third"] {
        run(&mut session, &mut scene, add(name)).unwrap();
    }
    for (i, name) in ["first", "second", "third"].into_iter().enumerate() {
        assert_eq!(node(&scene, next + i).name.as_deref(), Some(name));
    }
}

#[test]
fn what_is_given_by_specular_and_glossiness_needs_its_texture_coordinates_too() {
    const NAME: &str = "KHR_materials_pbrSpecularGlossiness";
    let mut scene = scenes::with_triangle(&json!({
        "textures": [{}],
        "materials": [{}, {"extensions": {NAME: {"diffuseTexture": {"index": 0}}}}],
        "extensionsUsed": [NAME],
    }));
    let before = bytes(&scene);
    let mut refused = |operation: Value| run(&mut session(), &mut scene, operation).unwrap_err().to_string();
    let assign = json!({"op": "assign_material", "mesh": 0, "primitive": 0, "material": 1});
    let error = refused(assign);
    assert!(error.contains("TEXCOORD_0"), "{error}");
    let set = |texture: &str, info: Value| json!({"op": "set_material", "material": 0, "set": {"extensions": {NAME: {texture: info}}}});
    for (texture, info, words) in [
        ("diffuseTexture", json!({"index": 0}), "TEXCOORD_0"),
        ("specularGlossinessTexture", json!({"index": 0, "texCoord": 3}), "TEXCOORD_3"),
        (
            "diffuseTexture",
            json!({"texCoord": 0}),
            "/set/extensions/KHR_materials_pbrSpecularGlossiness/diffuseTexture: the member \"index\" is missing",
        ),
    ] {
        let error = refused(set(texture, info));
        assert!(error.contains(words), "{error}");
    }
    assert!(bytes(&scene) == before);
}

#[test]
fn a_camera_takes_the_parameters_of_its_type() {
    let mut scene = scenes::import(&json!({
        "asset": {"version": "2.0"},
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
    }));
    let set = |set: Value| json!({"op": "set_camera_params", "camera": 0, "set": set});
    let other = json!({"xmag": 1, "ymag": 1, "znear": 0, "zfar": 10});
    let error = run(&mut session(), &mut scene, set(json!({"orthographic": other}))).unwrap_err().to_string();
    assert!(error.starts_with("/set/orthographic: the camera's type is \"perspective\""), "{error}");
    run(&mut session(), &mut scene, set(json!({"type": "orthographic", "orthographic": other}))).unwrap();
    let error = run(&mut session(), &mut scene, set(json!({"perspective": {"yfov": 2}}))).unwrap_err().to_string();
    assert!(error.starts_with("/set/perspective"), "{error}");
}

#[test]
fn what_is_merged_counts_with_what_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let part = scenes::with_triangle(&json!({}));
    let size = bytes(&part).len() as u64;
    std::fs::write(folder.path().join("part.glb"), bytes(&part)).unwrap();
    let import = ImportOptions { max_memory: 40 * size, ..ImportOptions::default() };
    let mut session = Session::new(folder.path(), import);
    let mut scene = part;
    let merge = || json!({"op": "merge_scene", "path": "part.glb"});
    let refused = (0..1000).find_map(|_| run(&mut session, &mut scene, merge()).err()).expect("the limit is reached");
    assert!(refused.to_string().contains("--max-memory"), "{refused}");
}
