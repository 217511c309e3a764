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

/// A document of meshes over one geometry, each shown by a node; `material` makes the material of each.
fn meshes(count: usize, material: impl Fn(usize) -> Value) -> Scene {
    let mesh = |i: usize| json!({"primitives": [{"attributes": {"POSITION": 0}, "material": i}]});
    scenes::with_triangle(&json!({
        "scene": 0,
        "scenes": [{"nodes": (0..count).collect::<Vec<_>>()}],
        "nodes": (0..count).map(|i| json!({"mesh": i})).collect::<Vec<_>>(),
        "meshes": (0..count).map(mesh).collect::<Vec<_>>(),
        "materials": (0..count).map(material).collect::<Vec<_>>(),
    }))
}

fn color(i: usize) -> Value {
    json!({"name": format!("{i}"), "pbrMetallicRoughness": {"roughnessFactor": 1.0 / (i + 2) as f64}})
}

#[test]
fn merging_a_mesh_costs_the_same_among_few_meshes_and_among_many() {
    let edit = json!({"op": "set_material", "material": 4, "set": {"doubleSided": true}});
    let merge = |node: usize| json!({"op": "merge_mesh", "node": node});
    let cost = |count: usize, material: fn(usize) -> Value, operations: &[Value], node: usize| {
        let mut scene = meshes(count, material);
        scene.prepare_edits();
        let mut session = session();
        for operation in operations {
            run(&mut session, &mut scene, operation.clone()).unwrap();
        }
        let operation = Operation::parse(&merge(node).to_string()).unwrap();
        match session.run(&mut scene, &operation) {
            Ok(Outcome::Edited(applied)) => Some(applied[0].visited),
            Ok(_) => panic!("merge_mesh sets no time"),
            Err(EditError::NoEqualMesh(_)) => None,
            Err(error) => panic!("{error}"),
        }
    };
    // Among equal ones, among different ones after a split, and after an edit of a material.
    let split = json!({"op": "split_mesh", "node": 5});
    for (material, operations, node) in [
        ((|_| json!({})) as fn(usize) -> Value, vec![], 3),
        (color, vec![split.clone()], 5),
        (|_| json!({}), vec![edit.clone()], 6),
    ] {
        let (few, many) = (cost(8, material, &operations, node), cost(5000, material, &operations, node));
        assert!(few.is_some_and(|visited| visited < 20), "{few:?} for {operations:?}");
        assert_eq!(few, many, "{operations:?}");
    }
    // Whoever else shows the mesh, or has its material, is not asked one by one.
    let shared = |count: usize| {
        let mesh = json!({"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]});
        let scene = scenes::with_triangle(&json!({
            "scene": 0,
            "scenes": [{"nodes": (0..count).collect::<Vec<_>>()}],
            "nodes": vec![json!({"mesh": 0}); count],
            "meshes": [mesh, mesh],
        }));
        super::cost::cost(&scene, &[merge(2)])
    };
    assert_eq!(shared(8), shared(5000));
    // Without an equal one there is nothing to compare with.
    let alone = std::slice::from_ref(&edit);
    let (few, many) = (cost(8, color, alone, 6), cost(5000, color, alone, 6));
    assert_eq!((few, many), (None, None));
}

#[test]
fn a_refused_merge_compares_with_no_mesh_that_differs() {
    let mut scene = meshes(2000, color);
    scene.prepare_edits();
    let node = scene.nodes.id_in_slot(9).unwrap();
    let mut twins = super::super::twins::Twins::of(&scene);
    assert_eq!(twins.refresh(&scene, scene.reference_index().unwrap()), 0);
    assert_eq!(twins.like(scene.nodes[node].mesh.unwrap()).count(), 1);
    assert_eq!(scene.apply(Edit::MergeMesh { node }).unwrap_err(), EditError::NoEqualMesh(node));
}

#[test]
fn equal_meshes_are_found_whatever_happened_to_them_before() {
    let mut scene = meshes(4, |_| json!({}));
    let mut session = session();
    let mut apply = |operation: Value| run(&mut session, &mut scene, operation);
    let paint = |material: usize, double: bool| json!({"op": "set_material", "material": material, "set": {"doubleSided": double}});
    let merge = |node: usize| json!({"op": "merge_mesh", "node": node});
    for material in [0, 1, 2] {
        apply(paint(material, true)).unwrap();
    }
    // Mesh 3 is alone now; an undo brings its twin back, and a redo takes it again.
    assert!(apply(merge(3)).is_err());
    apply(json!({"op": "undo"})).unwrap();
    apply(merge(3)).unwrap();
    apply(json!({"op": "undo", "count": 1})).unwrap();
    apply(json!({"op": "redo", "count": 1})).unwrap();
    assert!(apply(merge(3)).is_err(), "it shows mesh 2, which nothing is equal to");
    // A deleted mesh is nobody's twin; what it was merged into stays.
    apply(merge(1)).unwrap();
    assert!(apply(merge(0)).is_err(), "mesh 1 is gone");
    apply(json!({"op": "undo"})).unwrap();
    apply(merge(0)).unwrap();
    assert_eq!(node(&scene, 0).mesh, node(&scene, 1).mesh);
    check(&scene);
}
