//! What each edit means beyond the obvious.

use super::*;
use crate::accessor;

fn ids(scene: &Scene, slots: &[usize]) -> Vec<NodeId> {
    slots.iter().map(|&i| scene.nodes.id_in_slot(i).unwrap()).collect()
}

#[test]
fn deleting_a_joint_keeps_its_skin_consistent() {
    let mut scene = scenes::skinned();
    let mut session = session();
    // The arm (joint 2 of 4) goes with the hand (joint 3).
    run(&mut session, &mut scene, json!({"op": "delete", "node": 4})).unwrap();
    check(&scene);
    let skin = scene.skins.values().next().unwrap();
    assert_eq!(skin.joints, ids(&scene, &[2, 3]));
    let matrices = accessor::read_f32::<16>(&scene, skin.inverse_bind_matrices.unwrap()).unwrap();
    assert_eq!(matrices.iter().map(|m| m[12]).collect::<Vec<_>>(), [0.0, -1.0]);

    // The statue shows the same mesh without the skin: the body has a mesh of its own now.
    let body = &scene.meshes[node(&scene, 1).mesh.unwrap()];
    assert_ne!(node(&scene, 1).mesh, node(&scene, 6).mesh);
    let read = |semantic: &str| body.primitives[0].attributes.get(semantic).unwrap();
    let joints = accessor::read_joints(&scene, read("JOINTS_0")).unwrap();
    let weights = accessor::read_f32::<4>(&scene, read("WEIGHTS_0")).unwrap();
    // What followed the arm or the hand follows the spine (1), their nearest ancestor in the skin.
    let influences = |v: usize| {
        let mut of = [0.0; 2];
        joints[v].iter().zip(weights[v]).for_each(|(&joint, weight)| of[usize::from(joint)] += weight);
        of
    };
    let expected = [[0.25, 0.75], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0]];
    assert_eq!((0..6).map(influences).collect::<Vec<_>>(), expected);
    for v in 0..6 {
        let used: Vec<u16> = joints[v].iter().zip(weights[v]).filter(|(_, w)| *w > 0.0).map(|(&j, _)| j).collect();
        let distinct: std::collections::HashSet<_> = used.iter().collect();
        assert_eq!(used.len(), distinct.len(), "a joint influences a vertex once");
    }
}

#[test]
fn a_joint_without_an_ancestor_in_the_skin_leaves_its_weight_to_the_others() {
    let mut scene = scenes::skinned();
    let mut session = session();
    // The spine goes up to the root, and then the hip, which is above no joint any more, goes.
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 3, "parent": 0, "keep_world": true})).unwrap();
    run(&mut session, &mut scene, json!({"op": "delete", "node": 2})).unwrap();
    check(&scene);
    let skin = scene.skins.values().next().unwrap();
    assert_eq!((skin.joints.len(), skin.skeleton), (3, None));
    let body = &scene.meshes[node(&scene, 1).mesh.unwrap()];
    let weights = body.primitives[0].attributes.get("WEIGHTS_0").unwrap();
    let weights = accessor::read_f32::<4>(&scene, weights).unwrap();
    let first = weights[0];
    assert!((first.iter().sum::<f32>() - 1.0).abs() < 1e-6);
    assert_eq!(first.iter().filter(|&&w| (w - 1.0 / 3.0).abs() < 1e-6).count(), 3, "{first:?}");
}

#[test]
fn a_skin_that_loses_all_joints_goes() {
    let mut scene = scenes::skinned();
    let mut session = session();
    run(&mut session, &mut scene, json!({"op": "delete", "node": 2})).unwrap();
    check(&scene);
    assert_eq!(scene.skins.len(), 0);
    assert_eq!(node(&scene, 1).skin, None);
    // Both animations moved nothing but joints.
    assert_eq!(scene.animations.len(), 0);
}

#[test]
fn deleting_a_node_takes_the_channels_that_move_it() {
    let mut scene = scenes::skinned();
    run(&mut session(), &mut scene, json!({"op": "delete", "node": 5})).unwrap();
    let animations: Vec<&Animation> = scene.animations.values().collect();
    assert_eq!(animations.len(), 2);
    assert_eq!(animations[0].channels.len(), 1);
    assert_eq!((animations[0].samplers.len(), animations[0].channels[0].sampler), (1, 0));
    assert_eq!(animations[0].samplers[0].interpolation, Interpolation::Linear);
    // The pointer leads to the arm; both are there still.
    assert_eq!(animations[1].channels.len(), 1);
}

#[test]
fn deleting_what_an_animation_pointer_leads_to_takes_the_channel() {
    let mut scene = scenes::skinned();
    run(&mut session(), &mut scene, json!({"op": "delete", "node": 4})).unwrap();
    check(&scene);
    // Of the first animation the hand's channel is gone with the hand; the second led to the arm.
    assert_eq!(scene.animations.len(), 1);
    assert_eq!(scene.animations.values().next().unwrap().channels.len(), 1);
}

#[test]
fn deleting_a_root_takes_it_out_of_every_scene_and_undo_puts_it_back_in_its_place() {
    let mut scene = scenes::skinned();
    let mut session = session();
    run(&mut session, &mut scene, json!({"op": "delete", "node": 0})).unwrap();
    assert_eq!((roots(&scene, 0), roots(&scene, 1)), (vec![], vec![6]));
    check(&scene);
    session.history.undo(&mut scene, 1).unwrap();
    assert_eq!((roots(&scene, 0), roots(&scene, 1)), (vec![0], vec![0, 6]));
    assert_eq!((scene.skins.len(), scene.animations.len()), (1, 2));
}

#[test]
fn a_scene_may_lose_its_last_root() {
    let mut scene = scenes::wide(3);
    run(&mut session(), &mut scene, json!({"op": "delete", "node": 0})).unwrap();
    assert_eq!((scene.nodes.len(), roots(&scene, 0).len()), (0, 0));
    bytes(&scene);
}

#[test]
fn undo_restores_under_the_same_ids_so_that_older_history_still_applies() {
    let mut scene = scenes::wide(3);
    let mut session = session();
    let start = bytes(&scene);
    run(&mut session, &mut scene, json!({"op": "rename", "node": 2, "name": "old"})).unwrap();
    run(&mut session, &mut scene, json!({"op": "delete", "node": 2})).unwrap();
    run(&mut session, &mut scene, json!({"op": "add_node", "parent": 0})).unwrap();
    session.history.undo(&mut scene, 2).unwrap();
    assert_eq!(node(&scene, 2).name.as_deref(), Some("old"));
    assert_eq!(children(&scene, 0), [1, 2, 3]);
    session.history.undo(&mut scene, 1).unwrap();
    assert!(bytes(&scene) == start);
}

#[test]
fn a_copy_of_a_skinned_figure_moves_by_itself() {
    let mut scene = scenes::skinned();
    run(&mut session(), &mut scene, json!({"op": "duplicate", "node": 0, "as": "copy"})).unwrap();
    check(&scene);
    assert_eq!(roots(&scene, 0).len(), 2);
    assert_eq!(roots(&scene, 1).len(), 3);
    let copy = roots(&scene, 0)[1];
    assert_eq!(roots(&scene, 1)[1], copy, "beside the original in each scene");
    assert_eq!(node(&scene, copy).name.as_deref(), Some("copy"));
    let [body, hip] = children(&scene, copy)[..] else { panic!() };
    assert_eq!(node(&scene, body).mesh, node(&scene, 1).mesh, "the mesh is shared");
    let skin = &scene.skins[node(&scene, body).skin.unwrap()];
    assert_eq!(slot(skin.joints[0]), hip);
    assert!(skin.joints.iter().all(|&joint| slot(joint) > 6), "no joint of the original");
    let animations: Vec<&Animation> = scene.animations.values().collect();
    assert_eq!((animations[0].channels.len(), animations[0].samplers.len()), (4, 2));
    assert_eq!(animations[0].channels[2].node, Some(skin.joints[1]));
    let link = animations[1].channels[1].target_extra.links()[0].target;
    assert_eq!(link, skin.joints[2].into(), "the pointer leads to the copy");
}

#[test]
fn a_copy_shares_skins_whose_joints_are_elsewhere() {
    let mut scene = scenes::skinned();
    run(&mut session(), &mut scene, json!({"op": "duplicate", "node": 1})).unwrap();
    assert_eq!(scene.skins.len(), 1);
    assert_eq!(children(&scene, 0), [1, 7, 2]);
    assert_eq!(node(&scene, 7).name.as_deref(), Some("body copy"));
}

#[test]
fn reparenting_keeps_the_place_in_the_world_or_says_why_it_cannot() {
    let mut scene = scenes::skinned();
    let mut session = session();
    let world = |scene: &Scene, slot: usize| {
        let mut at = scene.nodes.id_in_slot(slot);
        let mut world = glam::DAffine3::IDENTITY;
        while let Some(id) = at {
            world = scene.nodes[id].transform.to_affine() * world;
            at = scene.nodes[id].parent;
        }
        world
    };
    let turn = json!({"op": "set_transform", "node": 3, "rotation": [0, 0, 0.6, 0.8], "scale": [2, 2, 2]});
    run(&mut session, &mut scene, turn).unwrap();
    let before = world(&scene, 5);
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 5, "parent": 0, "index": 1, "keep_world": true}))
        .unwrap();
    assert!(world(&scene, 5).abs_diff_eq(before, 1e-12));
    assert_eq!(children(&scene, 0), [1, 5, 2]);
    session.history.undo(&mut scene, 1).unwrap();
    // An uneven scale above a rotation is a shear.
    run(&mut session, &mut scene, json!({"op": "set_transform", "node": 2, "scale": [1, 3, 1]})).unwrap();
    let error = run(&mut session, &mut scene, json!({"op": "reparent", "node": 5, "parent": null, "keep_world": true}));
    assert!(error.unwrap_err().to_string().contains("sheared"));
    run(&mut session, &mut scene, json!({"op": "set_skin", "node": 1, "skin": null})).unwrap();
    run(&mut session, &mut scene, json!({"op": "reparent", "node": 2, "parent": null})).unwrap();
    assert_eq!(node(&scene, 2).parent, None);
    assert_eq!(roots(&scene, 0), [0, 2]);
}

#[test]
fn a_split_mesh_is_its_own_and_merging_takes_that_back() {
    let mut scene = scenes::wide(30);
    let mut session = session();
    let start = bytes(&scene);
    run(&mut session, &mut scene, json!({"op": "split_mesh", "node": 10})).unwrap();
    let (own, shared) = (node(&scene, 10).mesh.unwrap(), node(&scene, 20).mesh.unwrap());
    assert_ne!(own, shared);
    let (a, b) = (&scene.meshes[own].primitives[0], &scene.meshes[shared].primitives[0]);
    assert_eq!(a.attributes, b.attributes, "the geometry is shared");
    assert_ne!(a.material, b.material, "the material is its own");
    run(&mut session, &mut scene, json!({"op": "merge_mesh", "node": 10})).unwrap();
    check(&scene);
    assert!(bytes(&scene) == start, "the orphans are gone");
    // An own material that looks different is not given up silently.
    run(&mut session, &mut scene, json!({"op": "split_mesh", "node": 10})).unwrap();
    run(&mut session, &mut scene, json!({"op": "set_material", "material": 2, "set": {"doubleSided": true}})).unwrap();
    assert!(run(&mut session, &mut scene, json!({"op": "merge_mesh", "node": 10})).is_err());
}

#[test]
fn a_shape_is_real_geometry() {
    let mut scene = scenes::wide(1);
    for shape in ["plane", "cube", "sphere"] {
        run(&mut session(), &mut scene, json!({"op": "add_shape", "shape": shape, "parent": 1})).unwrap();
    }
    check(&scene);
    for (mesh, triangles, area) in [(1, 2, 4.0), (2, 12, 24.0), (3, 64 * 31 * 2, 4.0 * std::f64::consts::PI)] {
        let primitive = &scene.meshes.values().nth(mesh).unwrap().primitives[0];
        let positions = accessor::read_f32::<3>(&scene, primitive.attributes.get("POSITION").unwrap()).unwrap();
        let normals = accessor::read_f32::<3>(&scene, primitive.attributes.get("NORMAL").unwrap()).unwrap();
        let indices = accessor::read_indices(&scene, primitive.indices.unwrap()).unwrap();
        assert_eq!(indices.len(), triangles * 3);
        let mut sum = 0.0;
        for corners in indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|i| glam::Vec3::from(positions[corners[i] as usize]).as_dvec3());
            let normal = (b - a).cross(c - a);
            sum += 0.5 * normal.length();
            for &i in corners {
                assert!(normal.dot(glam::Vec3::from(normals[i as usize]).as_dvec3()) > 0.0, "faces outward");
            }
        }
        assert!((sum / area - 1.0).abs() < 0.01, "area {sum}, should be {area}");
    }
}

#[test]
fn a_merged_file_hangs_below_a_node_of_its_name_with_all_that_it_refers_to() {
    let folder = tempfile::tempdir().unwrap();
    let other = crate::testing::every_slot_scene();
    std::fs::write(folder.path().join("other file.glb"), bytes(&other)).unwrap();
    let mut scene = crate::testing::every_slot_scene();
    let start = bytes(&scene);
    let mut session = Session::new(folder.path(), ImportOptions::default());
    let merge = json!({"op": "merge_scene", "path": "other file.glb", "parent": 5, "as": "m"});
    run(&mut session, &mut scene, merge).unwrap();
    check(&scene);
    let wrapper = children(&scene, 5)[0];
    assert_eq!(node(&scene, wrapper).name.as_deref(), Some("other file"));
    assert_eq!(children(&scene, wrapper), [6 + 4], "the roots of the scene that it shows");
    for kind in Kind::ALL {
        let expected = match kind {
            Kind::Node => other.count(*kind) * 2 + 1,
            // Of the same names; one scene is what is below the wrapper.
            Kind::Variant => other.count(*kind),
            Kind::Scene => other.count(*kind) * 2 - 1,
            // Export has made one of them.
            Kind::Buffer => scene.count(*kind),
            _ => other.count(*kind) * 2,
        };
        assert_eq!(scene.count(*kind), expected, "{kind:?}");
    }
    // It is the same document once more: what belongs together still does.
    let there = node(&scene, 6 + 1);
    assert_eq!(slot(there.skin.unwrap()), other.skins.len());
    assert_eq!(slot(there.mesh.unwrap()), other.meshes.len());
    assert_eq!(there.extra.links()[0].target.slot(), 6 + 2);
    // And a second time.
    run(&mut session, &mut scene, json!({"op": "merge_scene", "path": "other file.glb"})).unwrap();
    check(&scene);
    session.history.undo(&mut scene, 2).unwrap();
    assert!(bytes(&scene) == start);
    assert!(import_again(&scene).same_document(&crate::testing::every_slot_scene()).is_ok());
}

/// A document whose mesh has features in a table at the root, and the table's values.
fn with_features(value: u8, table: &str) -> Value {
    json!({
        "asset": {"version": "2.0", "copyright": "(c) somebody"},
        "extensionsUsed": ["EXT_structural_metadata", "EXT_mesh_features"],
        "extras": {"made": "by hand"},
        "scene": 0, "scenes": [{"nodes": [0], "extras": 1}], "nodes": [{"name": "n"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "extensions": {
            "EXT_mesh_features": {"featureIds": [{"featureCount": 1, "attribute": 0, "propertyTable": 0}]}}}]}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]}],
        "extensions": {"EXT_structural_metadata": {"propertyTables": [
            {"name": table, "properties": {"p": {"values": 0}}}]}},
        "bufferViews": [{"buffer": 0, "byteLength": 1}],
        "buffers": [{"byteLength": 1, "uri": format!("data:application/octet-stream;base64,{}", ["AA==", "AQ=="][usize::from(value)])}],
    })
}

#[test]
fn what_is_at_the_root_of_a_merged_file_comes_along_or_is_named() {
    let folder = tempfile::tempdir().unwrap();
    for (name, document) in [
        ("a", with_features(0, "t")),
        ("same", with_features(0, "t")),
        ("bytes", with_features(1, "t")),
        ("json", with_features(0, "u")),
    ] {
        std::fs::write(folder.path().join(format!("{name}.gltf")), document.to_string()).unwrap();
    }
    let mut scene = scenes::deep(2);
    let start = bytes(&scene);
    let mut session = Session::new(folder.path(), ImportOptions::default());
    let merge = |session: &mut Session, scene: &mut Scene, name: &str| {
        let operation = json!({"op": "merge_scene", "path": format!("{name}.gltf")});
        match session.run(scene, &Operation::parse(&operation.to_string()).unwrap())? {
            crate::edit::script::Outcome::Edited(mut applied) => Ok::<_, EditError>(applied.remove(0).notes),
            other => panic!("{other:?}"),
        }
    };
    let notes = merge(&mut session, &mut scene, "a").unwrap();
    check(&scene);
    assert!(notes.iter().any(|note| note.contains("copyright") && note.contains("extras of scene 0")), "{notes:?}");
    let wrapper = scene.nodes.values().find(|node| node.name.as_deref() == Some("a")).unwrap();
    assert_eq!(wrapper.extra.extras.as_deref(), Some(&json!({"made": "by hand"})));
    let table = |scene: &Scene| {
        let link = scene.extra.links()[0].target;
        let AnyId::BufferView(view) = link else { panic!("{link:?}") };
        (scene.extra.links().len(), scene.view_bytes(view).unwrap().to_vec())
    };
    assert_eq!(table(&scene), (1, vec![0]));
    let again = import_again(&scene);
    assert_eq!(table(&again), (1, vec![0]), "the table is that of the file, after an export too");
    assert!(again.extensions_used.iter().any(|name| name == "EXT_structural_metadata"));
    // One that says the same is shared: what refers into it by index still means the same.
    merge(&mut session, &mut scene, "same").unwrap();
    check(&scene);
    assert_eq!(table(&scene), (1, vec![0]));
    // One that does not is refused, and nothing has happened.
    let before = bytes(&scene);
    for other in ["bytes", "json"] {
        let error = merge(&mut session, &mut scene, other).unwrap_err().to_string();
        assert!(error.contains("EXT_structural_metadata") && error.contains(other), "{error}");
        check(&scene);
        assert!(bytes(&scene) == before);
    }
    session.history.undo(&mut scene, 2).unwrap();
    assert!(bytes(&scene) == start);
}

#[test]
fn a_log_is_replayed_on_the_document_as_it_was_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.gltf");
    std::fs::write(&other, with_features(0, "t").to_string()).unwrap();
    let fresh = scenes::skinned;
    let mut scene = fresh();
    let mut session = Session::new(folder.path(), ImportOptions::default());
    let operations = [
        json!({"op": "add_shape", "shape": "cube", "as": "cube"}),
        json!({"op": "split_mesh", "node": "$cube"}),
        json!({"op": "merge_scene", "path": "other.gltf", "parent": "$cube", "as": "m"}),
        json!({"op": "duplicate", "node": 0, "as": "copy"}),
        json!({"op": "delete", "node": 4}),
        json!({"op": "reparent", "node": "$m", "parent": "$copy", "index": 0}),
        json!({"op": "rename", "node": "$copy", "name": "renamed"}),
        json!({"op": "set_visible", "node": "$m", "visible": false}),
        json!({"op": "undo", "count": 3}),
        json!({"op": "redo"}),
    ];
    for operation in operations {
        run(&mut session, &mut scene, operation).unwrap();
    }
    let log = serde_json::to_string(&session.history).unwrap();
    assert!(!log.contains("made"), "no content of the merged file is in the log");
    let log: History = serde_json::from_str(&log).unwrap();
    let files = files::Folder::new(folder.path(), ImportOptions::default());
    let mut replayed = fresh();
    let mut history = History::replay(&log, &mut replayed, &mut |file| files.read_again(file)).unwrap();
    check(&replayed);
    assert!(bytes(&replayed) == bytes(&scene));
    // It is the same undo stack.
    assert_eq!((history.done().len(), history.undone()), (session.history.done().len(), 2));
    history.redo(&mut replayed, 2).unwrap();
    session.history.redo(&mut scene, 2).unwrap();
    assert!(bytes(&replayed) == bytes(&scene));
    let all = history.done().len();
    history.undo(&mut replayed, all).unwrap();
    assert!(bytes(&replayed) == bytes(&fresh()));

    // Another content, or none, is an error that names the file and says what to do.
    let replay = || History::replay(&log, &mut fresh(), &mut |file| files.read_again(file)).unwrap_err().to_string();
    std::fs::write(&other, with_features(1, "t").to_string()).unwrap();
    let error = replay();
    assert!(error.starts_with("edit 2 of the log") && error.contains("other.gltf"), "{error}");
    assert!(error.contains("put the old file back"), "{error}");
    std::fs::remove_file(&other).unwrap();
    let error = replay();
    assert!(error.contains("other.gltf") && error.contains("does not exist"), "{error}");
}

#[test]
fn a_log_is_replayed_though_what_it_made_has_other_ids() {
    let mut scene = scenes::deep(2);
    let mut session = session();
    for operation in [
        json!({"op": "add_node", "name": "forgotten"}),
        json!({"op": "undo"}),
        json!({"op": "add_shape", "shape": "cube", "as": "a"}),
        // In the slot of what is forgotten, which the log knows nothing of.
        json!({"op": "add_node", "parent": "$a", "as": "b"}),
        json!({"op": "rename", "node": "$b", "name": "b"}),
        json!({"op": "reparent", "node": "$a", "parent": 1}),
        json!({"op": "split_mesh", "node": "$a"}),
        json!({"op": "undo"}),
    ] {
        run(&mut session, &mut scene, operation).unwrap();
    }
    let said = |scene: &Scene| {
        let parent = |node: &Node| node.parent.and_then(|id| scene.nodes[id].name.clone());
        let mut nodes: Vec<_> =
            scene.nodes.values().map(|node| (node.name.clone(), parent(node), node.mesh.is_some())).collect();
        nodes.sort();
        (nodes, scene.meshes.len(), scene.buffers.len())
    };
    let log: History = serde_json::from_str(&serde_json::to_string(&session.history).unwrap()).unwrap();
    let mut replayed = scenes::deep(2);
    let mut history = History::replay(&log, &mut replayed, &mut |_| panic!("nothing is merged")).unwrap();
    check(&replayed);
    assert_eq!(said(&replayed), said(&scene));
    let shape = |scene: &Scene| scene.nodes.iter().find(|(_, n)| n.name.as_deref() == Some("cube")).map(|(id, _)| id);
    assert_ne!(shape(&replayed), shape(&scene), "under another id");
    history.redo(&mut replayed, 1).unwrap();
    session.history.redo(&mut scene, 1).unwrap();
    assert_eq!(said(&replayed), said(&scene));
}

#[test]
fn a_log_that_has_lost_its_beginning_is_not_replayed() {
    let mut scene = scenes::deep(2);
    let mut history = History::new(1);
    for _ in 0..3 {
        history.apply(&mut scene, Edit::RemoveUnused, Grouping::Alone).unwrap();
    }
    let error = History::replay(&history, &mut scenes::deep(2), &mut |_| panic!("no file")).unwrap_err();
    assert_eq!(error, ReplayError::Forgotten(2));
}

fn import_again(scene: &Scene) -> Scene {
    crate::import::import_slice(bytes(scene), None, "a.glb", &ImportOptions::default()).unwrap().scene
}

#[test]
fn what_is_not_used_is_removed_in_one_pass() {
    let mut scene = crate::testing::every_slot_scene();
    run(&mut session(), &mut scene, json!({"op": "delete", "node": 0})).unwrap();
    run(&mut session(), &mut scene, json!({"op": "remove_unused"})).unwrap();
    check(&scene);
    assert!(visit::unused(&scene).is_empty());
    import_again(&scene).same_document(&scene).unwrap();
}

#[test]
fn what_a_used_joint_hangs_below_is_used_and_places_it() {
    let json = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"children": [2, 4], "translation": [0, 5, 0]}, {"children": [3]}, {}, {}, {}],
        "skins": [{"joints": [3]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}}]}],
        "accessors": [
            {"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]},
            {"componentType": 5121, "count": 3, "type": "VEC4"},
            {"componentType": 5126, "count": 3, "type": "VEC4"},
        ],
    });
    let imported = crate::import::import_slice(json.to_string(), None, "a.gltf", &ImportOptions::default());
    let mut scene = imported.unwrap().scene;
    let before = bytes(&scene);
    let mut session = session();
    run(&mut session, &mut scene, json!({"op": "remove_unused"})).unwrap();
    check(&scene);
    let left: Vec<usize> = scene.nodes.ids().map(slot).collect();
    assert!([0, 1, 2, 3].iter().all(|used| left.contains(used)), "{left:?}");
    assert!(!left.contains(&5), "a root that no scene and nothing else has is unused");
    assert_eq!(node(&scene, 3).parent.map(slot), Some(2));
    assert_eq!((node(&scene, 2).parent.map(slot), children(&scene, 1)), (Some(1), vec![2, 4]));
    session.history.undo(&mut scene, 1).unwrap();
    assert!(bytes(&scene) == before);
}

#[test]
fn every_consumer_hears_of_an_edit() {
    let mut scene = scenes::wide(3);
    let mut cursor = scene.change_log().cursor();
    let id = scene.nodes.id_in_slot(2).unwrap();
    scene.apply(Edit::SetVisible { node: id, visible: false }).unwrap();
    let changes = scene.change_log().take(&mut cursor).unwrap();
    assert_eq!(changes.objects(), [(id.into(), Facets::VISIBILITY)]);
}

#[test]
fn the_variant_that_is_shown_reaches_formats_without_variants_and_a_note_says_so() {
    let names = |names: &[&str]| names.iter().map(|name| json!({"name": name})).collect::<Vec<_>>();
    let mut scene = scenes::with_triangle(&json!({
        "extensionsUsed": ["KHR_materials_variants"],
        "extensions": {"KHR_materials_variants": {"variants": names(&["day", "night"])}},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "materials": [{"name": "plain"}, {"name": "dark", "pbrMetallicRoughness": {"baseColorFactor": [0.125, 0.25, 0.5, 1]}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0, "extensions": {
            "KHR_materials_variants": {"mappings": [{"material": 1, "variants": [1]}]}}}]}],
    }));
    let folder = tempfile::tempdir().unwrap();
    let mut session = session();
    for (variant, material, color) in [(json!(null), "plain", 1.0), (json!("night"), "dark", 0.125)] {
        run(&mut session, &mut scene, json!({"op": "select_variant", "variant": variant})).unwrap();
        for format in ["obj", "crts", "glb"] {
            let path = folder.path().join(format!("{material}.{format}"));
            let report = crate::export::export_path(&scene, &path, &ExportOptions::default()).unwrap();
            let said: Vec<&str> =
                report.notes.iter().map(|note| &*note.what).filter(|what| what.contains("variant")).collect();
            let read = crate::import::import_path(&path, &ImportOptions::default()).unwrap().scene;
            if format == "glb" {
                assert_eq!((said.len(), read.variants.len()), (usize::from(material == "dark"), 2), "{said:?}");
                assert!(said.iter().all(|what| what.contains("\"night\"")));
                continue;
            }
            assert_eq!(said.len(), 1, "{said:?}");
            assert_eq!(said[0].contains("\"night\""), material == "dark", "{said:?}");
            let shown = &read.meshes.values().next().unwrap().primitives[0];
            let found = &read.materials[shown.material.unwrap()];
            assert_eq!((found.name.as_deref(), found.base_color[0]), (Some(material), color), "{format}");
        }
    }
}
