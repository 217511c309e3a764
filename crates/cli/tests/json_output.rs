//! JSON on stdout: one document, with the keys that the reference lists.

mod common;

use common::{folder_with_box, json, succeed};
use serde_json::Value;

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

#[test]
fn info_counts_what_the_document_has() {
    let (_guard, f) = folder_with_box();
    let info = json(&succeed(&f, &["info", "box.glb", "--json"]));
    let expected = [
        "format",
        "scenes",
        "nodes",
        "meshes",
        "primitives",
        "triangles",
        "instanced_triangles",
        "vertices",
        "materials",
        "textures",
        "images",
        "animations",
        "skins",
        "cameras",
        "lights",
        "render_primitives",
        "render_nodes",
        "extensions_used",
        "bounds",
        "bytes",
        "warnings",
    ];
    for key in expected {
        assert!(info.get(key).is_some(), "no {key}");
    }
    assert!(info.get("mesh_descs").is_none());
    assert_eq!(info["format"], "glb");
    // Five walls and a lamp of 2 triangles, two blocks of 10
    assert_eq!(
        (&info["meshes"], &info["triangles"], &info["instanced_triangles"]),
        (&8.into(), &32.into(), &32.into())
    );
    assert_eq!((&info["render_nodes"], &info["cameras"], &info["vertices"]), (&8.into(), &1.into(), &64.into()));
    assert_eq!(info["extensions_used"], serde_json::json!(["KHR_materials_emissive_strength"]));
    let height = info["bounds"]["max"][1].as_f64().expect("a number");
    assert!((height - 0.5488).abs() < 1e-4, "{height}");
    assert_eq!(keys(&info["bytes"]), ["geometry", "images"]);
}

#[test]
fn info_counts_instances_and_shared_geometry() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    succeed(f, &["generate", "instances", "--count", "100", "-o", "i.gltf"]);
    let info = json(&succeed(f, &["info", "i.gltf", "--json", "--mesh-descs"]));
    assert_eq!(info["format"], "gltf");
    assert_eq!(info["render_nodes"], 101, "100 beads and the floor");
    assert_eq!(info["render_primitives"], 2, "all beads share one geometry");
    let descs = info["mesh_descs"].as_array().expect("a list");
    assert_eq!(descs.len(), 2);
    let expected = ["mesh", "primitive", "first_vertex", "vertex_count", "first_index", "index_count", "has"];
    assert_eq!(keys(&descs[0]), expected);
    assert_eq!(descs[0]["has"], serde_json::json!(["normal", "uv0"]));
    assert_eq!(descs[1]["first_vertex"], descs[0]["vertex_count"], "ranges follow one another");
    let bead = descs[0]["index_count"].as_u64().expect("a number") / 3;
    assert_eq!(info["instanced_triangles"], 100 * bead + 2);
}

#[test]
fn info_of_a_crowd_has_a_deformed_geometry_for_every_figure() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    succeed(f, &["generate", "animated-crowd", "--count", "3", "-o", "c.glb"]);
    let info = json(&succeed(f, &["info", "c.glb", "--json", "--mesh-descs"]));
    assert_eq!((&info["skins"], &info["animations"]), (&3.into(), &1.into()));
    let deformed = info["mesh_descs"].as_array().expect("a list").iter().filter(|d| d.get("deformed_by").is_some());
    assert_eq!(deformed.count(), 6, "clothes and skin of three figures");
}

#[test]
fn compare_and_devices_are_one_document_each() {
    let (_guard, f) = folder_with_box();
    succeed(&f, &["render", "box.glb", "-o", "a.exr", "--size", "8x8", "--spp", "1"]);
    let result = json(&succeed(&f, &["compare", "a.exr", "a.exr", "--json"]));
    let expected = [
        "a",
        "b",
        "width",
        "height",
        "rmse",
        "rel_mse",
        "rel_mse_epsilon",
        "max",
        "flip",
        "flip_kind",
        "values",
        "exceeded",
    ];
    assert_eq!(keys(&result), expected);
    assert_eq!((&result["rmse"], &result["flip"], &result["flip_kind"]), (&0.0.into(), &0.0.into(), &"hdr".into()));
    let devices = json(&succeed(&f, &["devices", "--json"]));
    assert_eq!(keys(&devices["devices"][0]), ["index", "backend", "name", "threads", "memory_bytes", "unfit"]);
    assert_eq!(devices["devices"][0]["backend"], "cpu");
}

#[test]
fn stats_have_times_rays_and_memory() {
    let (_guard, f) = folder_with_box();
    succeed(
        &f,
        &["render", "box.glb", "-o", "a.png", "--size", "8x4", "--spp", "3", "--stats", "s.json", "--validate"],
    );
    let stats = json(&std::fs::read_to_string(f.join("s.json")).expect("stats"));
    for key in ["load_s", "derive_s", "environment_s", "upload_s", "blas_s", "tlas_s", "render_s", "mrays_s"] {
        assert!(stats[key].as_f64().is_some_and(|v| v >= 0.0), "{key}");
    }
    assert_eq!((&stats["samples"], &stats["rays"]["camera"]), (&96.into(), &96.into()));
    let rays = &stats["rays"];
    let sum = ["camera", "bounce", "shadow"].map(|k| rays[k].as_u64().expect("a count")).iter().sum::<u64>();
    assert_eq!(rays["total"], sum);
    assert!(stats["memory"]["total"].as_u64() > Some(1000));
    assert_eq!((&stats["backend"], &stats["discarded_contributions"]), (&"cpu".into(), &0.into()));
}
