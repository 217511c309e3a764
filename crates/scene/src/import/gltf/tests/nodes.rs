//! Nodes that are read apart from the rest of a document are the nodes that it has.

use super::*;
use std::path::PathBuf;

/// A document of plain nodes, nodes with extensions and nodes that are worth a warning.
fn long_document() -> Value {
    let mut document = triangle();
    let mut nodes = Vec::new();
    for i in 0..3000 {
        let (a, b) = (2 * i + 1, 2 * i + 2);
        let children: Vec<usize> = [a, b].into_iter().filter(|&child| child < 3000).collect();
        let mut node = json!({ "name": format!("node {i}"), "translation": [i, 0.5, -1e-3] });
        match i % 5 {
            0 => merge(&mut node, json!({ "extras": { "i": i }, "mesh": 0 })),
            1 => merge(&mut node, json!({ "extensions": { "KHR_node_visibility": { "visible": false } } })),
            2 => merge(&mut node, json!({ "rotation": [0, 0, 0, 2] })),
            3 => merge(&mut node, json!({ "name": "escaped \"name\"", "mesh": 0 })),
            _ => merge(&mut node, json!({ "weights": [1] })),
        }
        if !children.is_empty() {
            merge(&mut node, json!({ "children": children }));
        }
        nodes.push(node);
    }
    document["nodes"] = Value::Array(nodes);
    document
}

#[test]
fn a_long_document_has_the_nodes_that_it_says() {
    let imported = import(&long_document()).unwrap();
    assert_eq!(imported.scene.nodes().len(), 3000);
    let warnings: Vec<usize> = imported.warnings.iter().map(|w| w.count).collect();
    assert_eq!(warnings, [600, 600]);
}

#[test]
fn a_fault_in_a_long_document_is_said_as_in_a_short_one() {
    for (at, value, expected) in [
        ("/nodes/2999/mesh", json!(7), "/nodes/2999/mesh: "),
        ("/nodes/2500/children", json!([2999]), "/nodes/2500/children/0: "),
        ("/nodes/2999/children", json!([0]), "/nodes/0: "),
        ("/nodes/1234/translation", json!([0, 0]), "/nodes/1234/translation: "),
        ("/nodes/1234/extensions", json!({ "KHR_node_visibility": 3 }), "/nodes/1234/extensions/KHR_node_visibility: "),
        ("/nodes/77", json!(3), "/nodes/77: "),
    ] {
        let error = refusal(&with(long_document(), at, value));
        assert!(error.contains(expected), "{error}");
    }
    let text = long_document().to_string().replace("\"node 2999\"", "\"node 2999");
    both_ways(text.as_bytes(), None);
}

#[test]
fn every_asset_is_the_same_both_ways() {
    let Some(folder) = std::env::var_os("ORTHANT_ASSETS") else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    let mut found = 0;
    let mut folders = vec![PathBuf::from(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
                both_ways(&std::fs::read(&path).unwrap(), Some(&folder));
                found += 1;
            }
        }
    }
    assert!(found > 50, "{found} files");
}
