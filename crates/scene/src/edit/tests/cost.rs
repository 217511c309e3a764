//! What edits cost, as objects that they look at: the same whatever the size of the scene.

use super::*;
use crate::edit::script::Outcome;

/// Objects that an operation, and its undo, look at.
fn cost(scene: &Scene, operations: &[Value]) -> Vec<(u64, u64)> {
    let mut scene = scene.clone();
    scene.prepare_edits();
    let mut session = session();
    let visited = |applied: &[Applied]| applied.iter().map(|applied| applied.visited).sum::<u64>();
    let mut costs = Vec::new();
    for operation in operations {
        let operation = Operation::parse(&operation.to_string()).unwrap();
        let Outcome::Edited(applied) = session.run(&mut scene, &operation).unwrap() else { panic!() };
        let back = session.history.undo(&mut scene, 1).unwrap();
        costs.push((visited(&applied), visited(&back)));
    }
    costs
}

#[test]
fn an_edit_costs_the_same_in_a_small_scene_and_in_a_large_one() {
    let operations = [
        json!({"op": "set_transform", "node": 7, "translation": [1, 2, 3]}),
        json!({"op": "set_visible", "node": 7, "visible": false}),
        json!({"op": "delete", "node": 7}),
        json!({"op": "duplicate", "node": 7}),
        json!({"op": "reparent", "node": 7, "parent": 9, "keep_world": true}),
        json!({"op": "add_node", "parent": 0}),
        json!({"op": "add_shape", "shape": "cube", "parent": 0}),
        json!({"op": "set_material", "material": 0, "set": {"doubleSided": true}}),
        json!({"op": "split_mesh", "node": 10}),
        json!({"op": "rename", "node": 7, "name": "x"}),
    ];
    let (small, large) = (cost(&scenes::wide(100), &operations), cost(&scenes::wide(50_000), &operations));
    assert_eq!(small, large);
    assert!(small.iter().all(|&(there, back)| there < 50 && back < 50), "{small:?}");
}

#[test]
fn deleting_a_thousand_of_a_hundred_thousand_touches_these() {
    // A hundred groups of a thousand.
    let mut nodes = vec![json!({"children": (1..=100).collect::<Vec<_>>()})];
    nodes.extend((0..100).map(|i| json!({"children": (101 + i * 1000..101 + (i + 1) * 1000).collect::<Vec<_>>()})));
    nodes.extend((0..100_000).map(|_| json!({"mesh": 0})));
    let scene = scenes::with_triangle(&json!({"scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes}));
    let [(there, back)] = cost(&scene, &[json!({"op": "delete", "node": 50})])[..] else { panic!() };
    assert!(there <= 2 * 1001 + 10, "{there} objects");
    assert!(back <= 1001 + 10, "{back} objects");
}
