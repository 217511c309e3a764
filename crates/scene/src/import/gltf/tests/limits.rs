//! Input that would take too much memory, stack or time.

use super::*;
use crate::import::ImportFault;
use crate::model::{NodeId, Store};
use std::time::{Duration, Instant};

fn options(max_memory: u64) -> ImportOptions {
    ImportOptions { max_memory, ..ImportOptions::default() }
}

#[test]
fn a_billion_zeros_are_refused_before_they_are_made() {
    let doc = document(json!({ "accessors": [
        { "componentType": 5126, "count": 1_000_000_000u64, "type": "VEC3" },
    ] }));
    let error = import_slice(doc.to_string(), None, "a.gltf", &ImportOptions::default()).unwrap_err();
    assert!(matches!(error.fault, ImportFault::OverBudget(_)));
    let message = error.to_string();
    assert!(message.starts_with("a.gltf: /accessors/0: ") && message.contains("raise --max-memory"), "{message}");
}

#[test]
fn many_accessors_of_zeros_are_charged_together() {
    let zeros = json!({ "componentType": 5126, "count": 100_000, "type": "MAT4" });
    let doc = document(json!({ "accessors": vec![zeros; 100] })).to_string();
    assert!(import_slice(doc.as_str(), None, "a.gltf", &options(100 << 20)).is_err());
    import_slice(doc, None, "a.gltf", &options(1 << 30)).unwrap();
}

#[test]
fn a_text_that_would_grow_beyond_the_budget_is_refused_before_it_is_parsed() {
    let doc = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}{{}}]}}", "{},".repeat(1_000_000));
    assert!(import_slice(doc.as_str(), None, "a.gltf", &options(64 << 20)).is_err());
    assert_eq!(import_slice(doc, None, "a.gltf", &options(4 << 30)).unwrap().scene.nodes().len(), 1_000_001);
}

#[test]
fn the_file_itself_and_data_uris_are_charged() {
    let doc = triangle().to_string();
    let length = doc.len() as u64;
    let error = import_slice(doc.as_str(), None, "a.gltf", &options(length - 1)).unwrap_err();
    assert!(matches!(error.fault, ImportFault::OverBudget(_)));
    let charged = import_slice(doc, None, "a.gltf", &options(1 << 20)).unwrap().charged_bytes;
    assert!(charged > length, "{charged}");
    let long = triangle_with("/images", json!([{ "uri": format!("data:,{}", "a".repeat(100_000)) }])).to_string();
    let all = import_slice(long.as_str(), None, "a.gltf", &options(1 << 30)).unwrap().charged_bytes;
    let error = import_slice(long, None, "a.gltf", &options(all - 1)).unwrap_err();
    assert!(error.to_string().contains("/images/0/uri: "), "{error}");
}

#[test]
fn deep_json_is_refused_and_does_not_exhaust_the_stack() {
    for deep in ["[".repeat(1_000_000), "{\"a\":".repeat(1_000_000)] {
        for member in ["\"extras\"", "\"nodes\"", "\"extensions\":{\"X\"", "\"unknown\""] {
            let doc = format!("{{\"asset\":{{\"version\":\"2.0\"}},{member}:{deep}");
            assert!(import_slice(doc, None, "a.gltf", &options(4 << 30)).is_err());
        }
    }
    let closed =
        format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{}{}}}", "[".repeat(100_000), "]".repeat(100_000));
    let error = import_slice(closed, None, "a.gltf", &options(4 << 30)).unwrap_err().to_string();
    assert!(error.contains("/extras: ") && error.contains("recursion limit"), "{error}");
}

#[test]
fn a_chain_of_a_hundred_thousand_nodes_loads_and_drops() {
    let count = 100_000;
    let nodes: Vec<String> = (0..count)
        .map(|i| if i + 1 < count { format!("{{\"children\":[{}]}}", i + 1) } else { "{}".to_owned() })
        .collect();
    let doc = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}]}}", nodes.join(","));
    let scene = import_slice(doc, None, "a.gltf", &ImportOptions::default()).unwrap().scene;
    let mut depth = 0;
    let mut node = scene.nodes().ids().last().unwrap();
    while let Some(parent) = scene.nodes()[node].parent {
        node = parent;
        depth += 1;
    }
    assert_eq!((depth, node), (count - 1, Store::<NodeId, ()>::nth_id(0)));
}

#[test]
fn a_long_cycle_is_found_in_linear_time() {
    let count = 100_000;
    let nodes: Vec<String> = (0..count).map(|i| format!("{{\"children\":[{}]}}", (i + 1) % count)).collect();
    let doc = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}]}}", nodes.join(","));
    let start = Instant::now();
    let message = import_slice(doc, None, "a.gltf", &ImportOptions::default()).unwrap_err().to_string();
    assert!(message.contains("its own ancestor"), "{message}");
    assert!(start.elapsed() < Duration::from_secs(10));
}
