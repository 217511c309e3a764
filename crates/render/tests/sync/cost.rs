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
