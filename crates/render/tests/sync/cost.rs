//! What following an edit costs, in rows, bytes and nodes: the same whatever the size of the scene.

use crate::{Live, scenes};
use orthant_render::derived::sync::SyncReport;
use serde_json::{Value, json};

fn costs(size: usize, operations: &[Value]) -> Vec<SyncReport> {
    let mut live = Live::new(scenes::wide(size));
    operations
        .iter()
        .map(|operation| {
            live.edit_json(operation.clone());
            live.sync()
        })
        .collect()
}

#[test]
fn following_an_edit_costs_the_same_in_a_small_scene_and_in_a_large_one() {
    let operations = [
        json!({"op": "set_transform", "node": 7, "translation": [1, 2, 3]}),
        json!({"op": "set_visible", "node": 7, "visible": false}),
        json!({"op": "set_visible", "node": 7, "visible": true}),
        json!({"op": "delete", "node": 8}),
        json!({"op": "undo"}),
        json!({"op": "reparent", "node": 7, "parent": 9}),
        json!({"op": "split_mesh", "node": 10}),
        json!({"op": "rename", "node": 7, "name": "x"}),
        json!({"op": "set_material", "material": 1, "set": {"pbrMetallicRoughness": {"metallicFactor": 0}}}),
        json!({"op": "add_node", "parent": 0}),
    ];
    let (small, large) = (costs(500, &operations), costs(20_000, &operations));
    for ((operation, small), large) in operations.iter().zip(&small).zip(&large) {
        assert_eq!(small, large, "{operation}");
        assert!(small.upload_bytes <= 1024 && small.visited < 20, "{operation}: {small:?}");
    }
    assert_eq!((small[7].upload_bytes, small[9].upload_bytes), (0, 0), "a name and an empty node are nowhere resident");
}

#[test]
fn a_duplicate_writes_its_own_rows() {
    let report = &costs(1000, &[json!({"op": "duplicate", "node": 10})])[0];
    assert_eq!((report.render_nodes, report.blas_built), (2, 0));
    assert_eq!(report.upload_bytes, 2 * 128 + 32, "two rows, one of which emits");
}

#[test]
fn following_the_deletion_of_a_thousand_of_a_hundred_thousand_touches_these() {
    let (groups, size) = (100, 1000);
    let mut nodes = vec![json!({"children": (1..=groups).collect::<Vec<_>>()})];
    let first = |group: usize| 1 + groups + group * (size - 1);
    nodes.extend((0..groups).map(|g| json!({"mesh": 2, "children": (first(g)..first(g + 1)).collect::<Vec<_>>()})));
    nodes.extend((0..groups * (size - 1)).map(|i| json!({"mesh": 2, "translation": [i, 0, 0]})));
    let members = json!({"scene": 0, "scenes": [{"nodes": [0]}]});
    let mut live = Live::new(scenes::parts(nodes.into(), members).import());
    assert_eq!(live.derived.render_nodes.len(), groups * size);
    for operation in [json!({"op": "delete", "node": 50}), json!({"op": "undo"}), json!({"op": "redo"})] {
        live.edit_json(operation.clone());
        let report = live.sync();
        assert_eq!(report.render_nodes as usize, size, "{operation}");
        assert!(report.visited <= 2 * size as u64, "{operation}: {} nodes", report.visited);
        assert!(report.upload_bytes <= (size * 128 * 5 / 4) as u64, "{operation}: {} bytes", report.upload_bytes);
        assert_eq!((report.blas_built, report.whole), (0, false), "{operation}");
    }
    live.check().unwrap();
}
