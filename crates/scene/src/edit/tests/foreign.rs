//! Steps that do not come from `apply`: made by hand, saved for another state, or broken on the way. They are carried out if
//! they lead to a document, and refused without a trace if not.

use super::*;
use crate::edit::random::{Choice, Choices, operation};
use proptest::prelude::*;

/// Numbers of a JSON value, in its order.
fn numbers<'v>(value: &'v mut Value, found: &mut Vec<&'v mut Value>) {
    match value {
        Value::Number(_) => found.push(value),
        Value::Array(list) => list.iter_mut().for_each(|value| numbers(value, found)),
        Value::Object(members) => members.values_mut().for_each(|value| numbers(value, found)),
        _ => {}
    }
}

/// Breaks steps: one is left out, comes twice, changes places, or a number in it (an id, an index) is another.
fn mutate(steps: &mut Value, (how, a, b, _): Choice) {
    let Some(list) = steps["steps"].as_array_mut().filter(|list| !list.is_empty()) else { return };
    let (at, other) = (a as usize % list.len(), b as usize % list.len());
    match how % 8 {
        0 => drop(list.remove(at)),
        1 => list.insert(other, list[at].clone()),
        2 => list.swap(at, other),
        _ => {
            let mut found = Vec::new();
            numbers(&mut list[at], &mut found);
            let count = found.len().max(1);
            if let Some(number) = found.into_iter().nth(b as usize % count) {
                *number = json!((how / 8) % 16);
            }
        }
    }
}

/// Applies steps of any origin. Returns whether they were carried out.
fn apply_any(scene: &mut Scene, edit: Edit) -> bool {
    let (before, parked) = (bytes(scene), scene.parked_objects());
    let text = serde_json::to_string(&edit).unwrap();
    let is_applied = match scene.apply(edit) {
        Ok(applied) => {
            check(scene);
            let after = bytes(scene);
            let again = scene.apply(applied.inverse).unwrap_or_else(|error| panic!("{error}: the inverse of {text}"));
            assert!(bytes(scene) == before, "{text}");
            scene.apply(again.inverse).unwrap();
            assert!(bytes(scene) == after, "{text}");
            true
        }
        Err(error) => {
            assert!(bytes(scene) == before, "{error}: {text} left its mark");
            assert_eq!(scene.parked_objects(), parked, "{text}");
            false
        }
    };
    check(scene);
    is_applied
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn broken_inverses_are_refused_or_lead_to_a_document(
        scene in 0..4usize,
        choices in prop::collection::vec(any::<Choice>(), 1..12),
        mutations in prop::collection::vec(any::<Choice>(), 1..4),
    ) {
        let mut scene = scenes::all().swap_remove(scene).1;
        let mut session = session();
        for choice in choices {
            let operation = operation(&scene, choice);
            drop(session.run(&mut scene, &operation));
        }
        let inverses: Vec<Edit> = session.history.done().map(|entry| entry.inverse.clone()).collect();
        for inverse in inverses.into_iter().rev().take(3) {
            let mut steps = serde_json::to_value(&inverse).unwrap();
            mutations.iter().for_each(|&mutation| mutate(&mut steps, mutation));
            if let Ok(edit) = serde_json::from_value(steps) {
                apply_any(&mut scene, edit);
            }
            // An inverse of an older state, as it is.
            apply_any(&mut scene, inverse);
        }
    }
}

#[test]
fn an_inverse_fits_once() {
    let mut refused = 0;
    for (_, mut scene) in scenes::all() {
        for choice in Choices(5).take(60) {
            let operation = operation(&scene, choice);
            let mut session = session();
            if session.run(&mut scene, &operation).is_err() {
                continue;
            }
            let Some(entry) = session.history.done().next() else { continue };
            let inverse = entry.inverse.clone();
            assert!(apply_any(&mut scene, inverse.clone()), "{operation:?}");
            refused += usize::from(!apply_any(&mut scene, inverse));
        }
    }
    assert!(refused > 50, "{refused}");
}

#[test]
fn a_refusal_says_which_step_does_not_fit() {
    let mut scene = scenes::deep(6);
    let id = |slot: usize| scene.nodes.id_in_slot(slot).unwrap();
    let [top, low, stale] = [id(1), id(4), crate::model::Store::<NodeId, ()>::nth_id(99)];
    let hang = |node, parent| Step::Attach { node, place: Place::Under(parent), index: 0 };
    let take = |node, parent| Step::Detach { node, place: Place::Under(parent) };
    let nan = Transform::Trs { translation: [f64::NAN; 3], rotation: [0., 0., 0., 1.], scale: [1.; 3] };
    for (steps, reason) in [
        (vec![take(top, id(0)), hang(top, low)], "step 1: node 1 would be its own ancestor"),
        (vec![hang(top, low)], "step 0: node 1 has a parent already"),
        (vec![take(top, low)], "step 0: node 1 does not hang there"),
        (vec![Step::Node(stale, NodeField::Name(None))], "step 0: there is no node 99"),
        (vec![Step::Park(vec![top.into()])], "node 1 goes, and node"),
        (vec![Step::Park(vec![top.into(), top.into()])], "step 0: node 1 comes twice"),
        (vec![Step::Unpark(vec![top.into()])], "node 1 is not among what was taken out"),
        (vec![Step::Node(low, NodeField::Transform(nan))], "every number must be finite"),
        (vec![Step::Park(vec![scene.meshes.ids().next().unwrap().into()])], "refers to mesh 0, which goes"),
    ] {
        let mut scene = scene.clone();
        let before = bytes(&scene);
        let error = scene.apply(Edit::Steps { steps }).unwrap_err().to_string();
        assert!(error.contains(reason), "{error}");
        assert!(bytes(&scene) == before, "{reason}");
        check(&scene);
    }
    scene.prepare_edits();
}

#[test]
fn a_history_that_does_not_fit_any_more_keeps_its_entries() {
    let mut scene = scenes::wide(3);
    let mut session = session();
    run(&mut session, &mut scene, json!({"op": "delete", "node": 1})).unwrap();
    let inverse = session.history.done().next().unwrap().inverse.clone();
    scene.apply(inverse).unwrap();
    assert!(matches!(session.history.undo(&mut scene, 1), Err(EditError::Steps { step: Some(0), .. })));
    assert_eq!((session.history.done().len(), session.history.undone()), (1, 0));
}
