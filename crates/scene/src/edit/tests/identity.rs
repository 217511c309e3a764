//! Undo brings back every byte; a refused edit changes none.

use super::*;
use crate::edit::random::{Choice, Choices, operation};
use proptest::prelude::*;

/// Drives a scene through operations, and back.
fn there_and_back(name: &str, scene: &Scene, choices: &[Choice]) {
    let mut scene = scene.clone();
    let start = bytes(&scene);
    let mut session = session();
    let mut script = String::new();
    for &choice in choices {
        let operation = operation(&scene, choice);
        script.push_str(&format!("{}\n", serde_json::to_string(&operation).unwrap()));
        let before = bytes(&scene);
        let parked = scene.parked_objects();
        let (done, undone) = (session.history.done().len(), session.history.undone());
        if session.run(&mut scene, &operation).is_err() {
            assert!(bytes(&scene) == before, "{name}: a refused edit left its mark:\n{script}");
            assert_eq!(scene.parked_objects(), parked, "{name}: a refused edit left objects:\n{script}");
            assert_eq!((session.history.done().len(), session.history.undone()), (done, undone));
        }
        check(&scene);
        check_joints(&scene);
    }
    let end = bytes(&scene);
    let steps = session.history.done().len();
    session.history.undo(&mut scene, steps).unwrap();
    check(&scene);
    assert!(bytes(&scene) == start, "{name}: undo of everything is not the start:\n{script}");
    session.history.redo(&mut scene, steps).unwrap();
    check(&scene);
    assert!(bytes(&scene) == end, "{name}: redo of everything is not the end:\n{script}");
    session.history.undo(&mut scene, steps).unwrap();
    assert!(bytes(&scene) == start, "{name}: undo after redo is not the start:\n{script}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn undo_of_any_sequence_is_the_identity(
        scene in 0..5usize,
        choices in prop::collection::vec(any::<Choice>(), 0..60),
    ) {
        let (name, scene) = &scenes::all()[scene];
        there_and_back(name, scene, &choices);
    }
}

#[test]
fn undo_of_long_sequences_is_the_identity() {
    for (seed, (name, scene)) in scenes::all().into_iter().enumerate() {
        let choices: Vec<Choice> = Choices(seed as u64).take(400).collect();
        there_and_back(name, &scene, &choices);
    }
}

/// Each kind of edit by itself, undone and done again.
#[test]
fn every_kind_of_edit_is_undone_exactly() {
    let light = json!({"type": "point", "intensity": 3});
    for operation in [
        json!({"op": "set_transform", "node": 1, "translation": [1, 2, 3]}),
        json!({"op": "set_transform", "node": 1, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 2, 3, 1]}),
        json!({"op": "add_node", "parent": 1, "name": "new", "as": "x"}),
        json!({"op": "add_node"}),
        json!({"op": "add_shape", "shape": "sphere", "parent": 2, "material": 0}),
        json!({"op": "add_light", "light": light}),
        json!({"op": "delete", "node": 0}),
        json!({"op": "delete", "node": 2}),
        json!({"op": "duplicate", "node": 0}),
        json!({"op": "reparent", "node": 3, "parent": null, "index": 0, "keep_world": true}),
        json!({"op": "reparent", "node": 4, "parent": 2}),
        json!({"op": "rename", "material": 0, "name": "other"}),
        json!({"op": "rename", "node": 0, "name": null}),
        json!({"op": "set_visible", "node": 0, "visible": false}),
        json!({"op": "set_mesh", "node": 1, "mesh": null}),
        json!({"op": "set_mesh", "node": 2, "mesh": 1}),
        json!({"op": "set_camera", "node": 0, "camera": 0}),
        json!({"op": "set_skin", "node": 1, "skin": null}),
        json!({"op": "assign_material", "mesh": 1, "primitive": 1, "material": null}),
        json!({"op": "duplicate_material", "material": 0}),
        json!({"op": "set_material", "material": 0, "set": {"alphaMode": "MASK", "normalTexture": {"index": 0}}}),
        json!({"op": "set_light", "light": 0, "set": {"intensity": 9, "name": null}}),
        json!({"op": "set_camera_params", "camera": 0, "set": {"name": "lens"}}),
        json!({"op": "split_mesh", "node": 1}),
        json!({"op": "select_variant", "variant": "b"}),
        json!({"op": "remove_unused"}),
    ] {
        let mut scene = crate::testing::every_slot_scene();
        let mut session = session();
        let start = bytes(&scene);
        run(&mut session, &mut scene, operation.clone()).unwrap_or_else(|error| panic!("{operation}: {error}"));
        check(&scene);
        let end = bytes(&scene);
        if operation["op"] != "select_variant" {
            assert!(end != start, "{operation} changed nothing");
        }
        session.history.undo(&mut scene, 1).unwrap();
        check(&scene);
        assert!(bytes(&scene) == start, "{operation}: undo");
        session.history.redo(&mut scene, 1).unwrap();
        assert!(bytes(&scene) == end, "{operation}: redo");
        session.history.undo(&mut scene, 1).unwrap();
        assert!(bytes(&scene) == start, "{operation}: undo after redo");
    }
}

#[test]
fn nonsense_is_refused_and_changes_nothing() {
    for (operation, reason) in [
        (json!({"op": "delete", "node": 99}), "/node: there is no node 99"),
        (json!({"op": "delete", "node": "$x"}), "has set the label"),
        (json!({"op": "delete", "node": "name:x"}), "no node of the name"),
        (json!({"op": "set_mesh", "node": 0}), "the member \"mesh\" is missing"),
        (json!({"op": "rename", "node": 0}), "the member \"name\" is missing"),
        (json!({"op": "delete", "node": -1}), "a reference is an index"),
        (json!({"op": "delete", "node": "x"}), "no reference"),
        (json!({"op": "delete", "nod": 1}), "there is no member \"nod\""),
        (json!({"op": "fly"}), "it cannot be \"fly\""),
        (json!({"op": "set_transform", "node": 0, "rotation": [0, 0, 0, 0]}), "/rotation: a quaternion of length 0"),
        (
            json!({"op": "set_transform", "node": 0, "matrix": [1,1,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}),
            "/matrix: it shears",
        ),
        (json!({"op": "set_transform", "node": 0, "matrix": [1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]}), "the last row"),
        (
            json!({"op": "set_transform", "node": 0, "scale": [1,1,1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}),
            "not both",
        ),
        (json!({"op": "reparent", "node": 0, "parent": 0}), "its own parent"),
        (json!({"op": "reparent", "node": 0, "parent": 1}), "which is below it"),
        (json!({"op": "reparent", "node": 0}), "/parent: it is missing"),
        (json!({"op": "set_skin", "node": 2, "skin": 0}), "it shows no mesh"),
        (json!({"op": "set_skin", "node": 3, "skin": 0}), "without JOINTS_0"),
        (json!({"op": "assign_material", "mesh": 0, "primitive": 7, "material": 0}), "no primitive 7; it has 1"),
        (json!({"op": "set_material", "material": 0, "set": {"alphaMode": "FOG"}}), "/set/alphaMode"),
        (json!({"op": "set_material", "material": 0, "set": {"doubleSided": 1}}), "/set/doubleSided"),
        (
            json!({"op": "set_material", "material": 0, "set": {"pbrMetallicRoughness": {"metallicFactor": 2}}}),
            "/set/pbrMetallicRoughness/metallicFactor: it has to be from 0 to 1",
        ),
        (
            json!({"op": "set_material", "material": 0, "set": {"emissiveTexture": {"index": 77}}}),
            "/set/emissiveTexture/index: there is no texture 77",
        ),
        (json!({"op": "set_material", "material": 0, "set": 3}), "/set: it must be an object"),
        (json!({"op": "set_light", "light": 0, "set": {"type": "laser"}}), "/set/type"),
        (json!({"op": "set_camera_params", "camera": 0, "set": {"type": "fisheye"}}), "/set/type"),
        (json!({"op": "add_light", "light": {"type": "spot", "intensity": "much"}}), "/light"),
        (json!({"op": "merge_mesh", "node": 1}), "no other mesh has the same geometry"),
        (json!({"op": "split_mesh", "node": 2}), "it shows no mesh"),
        (json!({"op": "select_variant", "variant": "zzz"}), "there are: a, b"),
        (json!({"op": "merge_scene", "path": "no/such/file.glb"}), "no/such/file.glb"),
        (json!({"op": "undo"}), "cannot undo 1 edits: the history holds 0"),
        (json!({"op": "redo", "count": 3}), "cannot redo 3 edits"),
    ] {
        let mut scene = crate::testing::every_slot_scene();
        let before = bytes(&scene);
        let error = run(&mut session(), &mut scene, operation.clone()).expect_err(&operation.to_string()).to_string();
        assert!(error.contains(reason), "{operation}: {error}");
        assert!(bytes(&scene) == before, "{operation} left its mark");
        assert_eq!(scene.parked_objects(), 0, "{operation} left objects");
        check(&scene);
    }
}

#[test]
fn a_step_back_is_forgotten_when_another_way_is_taken() {
    let mut scene = scenes::wide(4);
    let mut session = session();
    for _ in 0..3 {
        run(&mut session, &mut scene, json!({"op": "duplicate", "node": 1})).unwrap();
        run(&mut session, &mut scene, json!({"op": "undo"})).unwrap();
    }
    assert_eq!(scene.parked_objects(), 1, "only the last redo is kept");
    run(&mut session, &mut scene, json!({"op": "rename", "node": 1, "name": "x"})).unwrap();
    assert_eq!((scene.parked_objects(), session.history.undone()), (0, 0));
}

#[test]
fn a_history_over_its_budget_forgets_its_oldest_edits_and_their_objects() {
    let mut scene = scenes::wide(300);
    let mut history = History::new(20_000);
    for i in 1..=200 {
        let node = scene.nodes.id_in_slot(i).unwrap();
        history.apply(&mut scene, Edit::Delete { node }, Grouping::Alone).unwrap();
    }
    assert!(history.bytes() <= 20_000, "{} bytes", history.bytes());
    let kept = history.done().len();
    assert!(kept < 100 && kept > 5, "{kept} steps");
    assert_eq!(scene.parked_objects(), kept);
    history.undo(&mut scene, kept).unwrap();
    assert_eq!(scene.nodes.len(), 301 - 200 + kept);
    check(&scene);
}

#[test]
fn a_drag_is_one_step() {
    use std::time::Duration;
    let mut scene = scenes::wide(3);
    let mut history = History::default();
    let start = bytes(&scene);
    let [one, two] = [1, 2].map(|i| scene.nodes.id_in_slot(i).unwrap());
    let mut drag = |node, at: u64| {
        let transform =
            Transform::Trs { translation: [at as f64, 0.0, 0.0], rotation: [0., 0., 0., 1.], scale: [1.; 3] };
        let grouping = Grouping::Drag(Duration::from_millis(at));
        history.apply(&mut scene, Edit::SetTransform { node, transform }, grouping).unwrap();
        history.done().len()
    };
    assert_eq!(drag(one, 0), 1);
    assert_eq!(drag(one, 400), 1);
    assert_eq!(drag(one, 900), 1);
    // Later than half a second, or another node: another step.
    assert_eq!(drag(one, 1401), 2);
    assert_eq!(drag(two, 1500), 3);
    assert_eq!(drag(one, 1600), 4);
    history.undo(&mut scene, 3).unwrap();
    let Transform::Trs { translation, .. } = scene.nodes[one].transform else { panic!() };
    assert_eq!(translation[0], 900.0);
    history.undo(&mut scene, 1).unwrap();
    assert!(bytes(&scene) == start);
}

#[test]
fn edits_and_inverses_survive_json() {
    let mut scene = scenes::skinned();
    let mut texts = Vec::new();
    let mut states = vec![bytes(&scene)];
    for choice in Choices(7).take(300) {
        let operation = operation(&scene, choice);
        if matches!(operation, Operation::Undo { .. } | Operation::Redo { .. }) {
            continue;
        }
        let mut session = session();
        if session.run(&mut scene, &operation).is_err() {
            continue;
        }
        let entry = session.history.done().next().unwrap();
        let text = serde_json::to_string(&entry.inverse).unwrap();
        let again: Edit = serde_json::from_str(&text).unwrap();
        assert_eq!(again, entry.inverse, "{text}");
        let edit: Edit = serde_json::from_str(&serde_json::to_string(&entry.edit).unwrap()).unwrap();
        assert_eq!(edit, entry.edit);
        texts.push(text);
        states.push(bytes(&scene));
    }
    assert!(texts.len() > 100);
    for text in texts.iter().rev() {
        assert!(bytes(&scene) == states.pop().unwrap());
        scene.apply(serde_json::from_str(text).unwrap()).unwrap();
    }
    assert!(bytes(&scene) == states[0]);
}
