//! The derived scene against what the document says.

#[allow(dead_code, reason = "shared by test binaries that need different parts of it")]
mod common;

use common::Document;
use glam::{DVec3, Vec3};
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::rows::{MeshFlags, NONE, NodeFlags, RenderNodeRow};
use orthant_scene::import::{ImportOptions, import_slice};
use serde_json::{Value, json};

fn translation(row: &RenderNodeRow) -> [f32; 3] {
    row.world.rows.map(|r| r[3])
}

/// One triangle mesh shown by nodes.
fn triangles(nodes: Value, roots: Value) -> Document {
    let mut document = Document::new(json!({ "scene": 0, "scenes": [{ "nodes": roots }], "nodes": nodes }));
    let position = document.triangle();
    document.json["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": position } }] }]);
    document
}

#[test]
fn primitives_are_registered_by_mesh_then_by_primitive_whatever_the_hierarchy() {
    let mut document = Document::new(json!({ "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 1 }] }));
    let (a, b, c) = (document.triangle(), document.triangle(), document.triangle());
    let primitive = |position: usize| json!({ "attributes": { "POSITION": position } });
    document.json["meshes"] =
        json!([{ "primitives": [primitive(b), primitive(a)] }, { "primitives": [primitive(c), primitive(b)] }]);
    let (scene, derived) = document.derive();
    let meshes: Vec<_> = scene.meshes().ids().collect();
    let order: Vec<_> = derived.primitives.iter().map(|p| (p.mesh, p.primitive)).collect();
    // The last one has the same accessor as the first, and shares its slot.
    assert_eq!(order, [(meshes[0], 0), (meshes[0], 1), (meshes[1], 0)]);
    assert_eq!(derived.render_nodes.iter().map(|r| r.primitive).collect::<Vec<_>>(), [2, 0]);
}

#[test]
fn spans_of_the_streams_follow_each_other_without_gaps() {
    let mut document = Document::new(json!({ "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }] }));
    let quad = document.floats("VEC3", &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    let triangle = document.triangle();
    let indices = document.indices(&[2, 1, 0]);
    document.json["meshes"] = json!([{ "primitives": [
        { "attributes": { "POSITION": quad }, "mode": 5 },
        { "attributes": { "POSITION": triangle }, "indices": indices },
        { "attributes": { "POSITION": triangle }, "mode": 0 },
    ] }]);
    let (_, mut derived) = document.derive();
    let ranges: Vec<_> = derived
        .mesh_descs
        .iter()
        .map(|d| (d.first_vertex, d.vertex_count, d.first_index, d.index_count, d.flags))
        .collect();
    assert_eq!(ranges, [(0, 4, 0, 6, MeshFlags::FLAT), (4, 3, 6, 3, MeshFlags::FLAT)]);
    assert_eq!(derived.warnings.len(), 1, "points are skipped with one warning that counts them");
    let batch = derived.load_batch();
    assert_eq!(batch.indices.ranges[0].rows, [0, 1, 2, 1, 3, 2, 2, 1, 0]);
    assert_eq!(batch.positions.ranges[0].rows.len(), 7);
    assert_eq!(batch.blas_builds, [0, 1]);
}

#[test]
fn instances_are_placed_by_world_times_instance() {
    let mut document = triangles(json!([{ "mesh": 0, "scale": [2, 2, 2], "translation": [10, 0, 0] }]), json!([0]));
    let offsets = document.floats("VEC3", &[[1.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
    document.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    document.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": offsets } } });
    let (scene, derived) = document.derive();
    let world = |row| (derived.origin + DVec3::from_array(translation(row).map(f64::from))).to_array();
    assert_eq!(derived.render_nodes.iter().map(world).collect::<Vec<_>>(), [[12.0, 0.0, 0.0], [10.0, 6.0, 0.0]]);
    let node = scene.nodes().ids().next().expect("one node");
    assert_eq!(derived.render_nodes_of(node), 0..2);
    assert_eq!(derived.node_of(1), Some(node));
}

#[test]
fn the_inverse_undoes_the_world_matrix() {
    let nodes = json!([
        { "children": [1], "rotation": [0.5, 0.5, 0.5, 0.5], "scale": [1, -2, 3], "translation": [5, 6, 7] },
        { "mesh": 0, "rotation": [0, 0.6, 0, 0.8], "scale": [0.1, 1, 10] },
    ]);
    let (_, derived) = triangles(nodes, json!([0])).derive();
    let row = derived.render_nodes[0];
    assert_ne!(row.flags & NodeFlags::MIRRORED, 0);
    for p in [Vec3::ZERO, Vec3::X, Vec3::new(-3.0, 2.0, 9.0)] {
        let back = row.inverse.transform_point(row.world.transform_point(p));
        assert!((back - p).length() < 1e-4, "{back}");
    }
}

#[test]
fn visibility_is_inherited() {
    let hidden = json!({ "KHR_node_visibility": { "visible": false } });
    let nodes = json!([
        { "children": [1, 2], "mesh": 0 },
        { "mesh": 0, "children": [3], "extensions": hidden },
        { "mesh": 0 },
        { "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": true } } },
    ]);
    let mut document = triangles(nodes, json!([0]));
    document.json["extensionsUsed"] = json!(["KHR_node_visibility"]);
    let (_, derived) = document.derive();
    let visible: Vec<_> = derived.render_nodes.iter().map(|r| (r.node, r.flags & NodeFlags::VISIBLE != 0)).collect();
    assert_eq!(visible, [(0, true), (1, false), (2, true), (3, false)]);
}

#[test]
fn a_chain_of_100_000_nodes_needs_no_stack() {
    let depth = 100_000;
    let mut nodes: Vec<Value> = (1..depth).map(|i| json!({ "children": [i], "translation": [0.001, 0, 0] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    let (_, derived) = triangles(json!(nodes), json!([0])).derive();
    assert_eq!(derived.hierarchy.nodes.len(), depth);
    let x = derived.origin.x + f64::from(translation(&derived.render_nodes[0])[0]);
    assert!((x - 99.999).abs() < 1e-3, "{x}");
}

#[test]
fn a_matrix_that_flattens_its_object_hides_it() {
    let (_, derived) = triangles(json!([{ "mesh": 0, "scale": [1, 0, 1] }]), json!([0])).derive();
    assert_eq!(derived.render_nodes[0].flags & NodeFlags::VISIBLE, 0);
    assert_eq!(derived.bounds(), None);
}

#[test]
fn a_scene_far_from_zero_is_stored_about_itself() {
    let nodes = json!([
        { "mesh": 0, "translation": [1.0e7, 2.0e7, 0.25] },
        { "mesh": 0, "translation": [1.0e7 + 0.125, 2.0e7, 0.25] },
    ]);
    let (_, derived) = triangles(nodes, json!([0, 1])).derive();
    let [a, b] = [0, 1].map(|i| translation(&derived.render_nodes[i]));
    assert_eq!(b[0] - a[0], 0.125, "an f32 has steps of one metre there");
    assert_eq!(derived.origin + DVec3::from_array(a.map(f64::from)), DVec3::new(1.0e7, 2.0e7, 0.25));
}

#[test]
fn a_light_follows_its_own_node() {
    // Light 1 is on node 0, light 0 on nodes 1 and 2: ids of lights and of nodes differ, and two nodes share a light.
    let on = |light: usize, x: f64| json!({ "translation": [x, 0, 0], "extensions": { "KHR_lights_punctual": { "light": light } } });
    let document = Document::new(json!({
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "point", "intensity": 10 },
            { "type": "directional", "color": [1, 0.5, 0] },
        ] } },
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [on(1, 1.0), on(0, 2.0), on(0, 3.0)],
    }));
    let (_, derived) = document.derive();
    let rows: Vec<_> = derived.lights.iter().map(|l| (l.kind, l.position[0], l.color, l.node)).collect();
    assert_eq!(rows, [(1, 1.0, [1.0, 0.5, 0.0], 0), (2, 2.0, [10.0; 3], 1), (2, 3.0, [10.0; 3], 2)]);
    assert!(derived.has_lights());
}

#[test]
fn a_variant_changes_materials_and_no_geometry() {
    let mut document = triangles(json!([{ "mesh": 0 }]), json!([0]));
    document.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    document.json["materials"] = json!([{ "name": "red" }, { "name": "blue" }]);
    document.json["extensions"] =
        json!({ "KHR_materials_variants": { "variants": [{ "name": "a" }, { "name": "b" }] } });
    let primitive = &mut document.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    primitive["extensions"] = json!({ "KHR_materials_variants": { "mappings": [{ "material": 1, "variants": [1] }] } });
    let scene = document.import();
    let variants: Vec<_> = scene.variants().ids().collect();
    let derive = |variant| {
        DerivedScene::derive(&scene, &DeriveOptions { variant, ..DeriveOptions::default() }).expect("it can be derived")
    };
    let (none, a, b) = (derive(None), derive(Some(variants[0])), derive(Some(variants[1])));
    assert_eq!([&none, &a, &b].map(|d| d.render_nodes[0].material), [1, 1, 2]);
    assert_eq!(none.mesh_descs, b.mesh_descs);
}

#[test]
fn a_skinned_mesh_is_placed_by_its_joints_and_not_by_its_node() {
    let mut document = Document::new(json!({
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [
            { "mesh": 0, "skin": 0, "translation": [100, 100, 100] },
            { "children": [2], "translation": [0, 5, 0] },
            { "translation": [0, 0, 2] },
        ],
        "skins": [{ "joints": [1, 2] }],
    }));
    let position = document.triangle();
    let joints = document.joints(&[[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]]);
    let weights = document.floats("VEC4", &[[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]]);
    let bind = |t: [f32; 3]| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, t[0], t[1], t[2], 1.0];
    let inverse_bind = document.floats("MAT4", &[bind([0.0, 0.0, 0.0]), bind([0.0, -1.0, 0.0])]);
    document.json["skins"][0]["inverseBindMatrices"] = json!(inverse_bind);
    document.json["meshes"] = json!([{ "primitives": [{ "attributes": {
        "POSITION": position, "JOINTS_0": joints, "WEIGHTS_0": weights } }] }]);
    let (scene, mut derived) = document.derive();
    assert_eq!(derived.primitives.len(), 1, "an undeformed span would never be shown");
    assert_eq!(derived.primitives[0].deformed_by, scene.nodes().ids().next());
    assert_ne!(derived.mesh_descs[0].flags & MeshFlags::DEFORMED, 0);
    let row = derived.render_nodes[0];
    let batch = derived.load_batch();
    let world: Vec<_> = batch.positions.ranges[0]
        .rows
        .iter()
        .map(|p| (row.world.transform_point(Vec3::from_array(*p)).as_dvec3() + derived.origin).to_array())
        .collect();
    // Joint 0 stands at (0, 5, 0), joint 1 at (0, 5, 2) and is bound one metre lower.
    assert_eq!(world, [[0.0, 5.0, 0.0], [1.0, 4.0, 2.0], [0.0, 5.5, 1.0]]);
}

#[test]
fn two_nodes_with_one_morphed_mesh_hold_two_poses() {
    let mut document = triangles(json!([{ "mesh": 0, "weights": [0.5] }, { "mesh": 0 }]), json!([0, 1]));
    let delta = document.floats("VEC3", &[[0.0, 0.0, 4.0]; 3]);
    document.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": delta }]);
    document.json["meshes"][0]["weights"] = json!([1.0]);
    let (_, mut derived) = document.derive();
    assert_eq!(derived.render_nodes.iter().map(|r| r.primitive).collect::<Vec<_>>(), [0, 1]);
    let heights: Vec<_> = derived.load_batch().positions.ranges[0].rows.iter().map(|p| p[2]).collect();
    assert_eq!(heights, [2.0, 2.0, 2.0, 4.0, 4.0, 4.0]);
}

#[test]
fn emitters_know_their_areas_and_powers() {
    let mut document =
        triangles(json!([{ "mesh": 0 }, { "mesh": 0, "scale": [2, 2, 2] }, { "mesh": 1 }]), json!([0, 1, 2]));
    let dark = document.triangle();
    document.json["extensionsUsed"] = json!(["KHR_materials_emissive_strength"]);
    document.json["materials"] = json!([{ "emissiveFactor": [1, 1, 1], "extensions": {
        "KHR_materials_emissive_strength": { "emissiveStrength": 10 } } }]);
    document.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let meshes = document.json["meshes"].as_array_mut().expect("an array");
    meshes.push(json!({ "primitives": [{ "attributes": { "POSITION": dark } }] }));
    let (_, mut derived) = document.derive();
    assert_eq!(derived.emitters.len(), 2);
    assert_eq!(derived.render_nodes.iter().map(|r| r.emitter).collect::<Vec<_>>(), [0, 1, NONE]);
    let [a, b] = [derived.emitters[0], derived.emitters[1]];
    assert_eq!(a.area, 0.5);
    assert!((a.power - 10.0 * 0.5 * std::f32::consts::PI).abs() < 1e-4);
    assert!((b.power - 4.0 * a.power).abs() < 1e-3, "twice the size is four times the area");
    assert_eq!(derived.mesh_descs[1].first_emitter_triangle, NONE);
    assert_eq!(derived.load_batch().emitter_triangles.ranges[0].rows[0].cumulative, 1.0);
}

#[test]
fn without_scenes_every_root_is_shown() {
    let mut document = triangles(json!([{ "children": [1] }, { "mesh": 0 }, { "mesh": 0 }]), json!([0]));
    for key in ["scene", "scenes"] {
        document.json.as_object_mut().expect("an object").remove(key);
    }
    let (_, derived) = document.derive();
    assert_eq!(derived.render_nodes.len(), 2);
}

#[test]
fn an_index_out_of_range_is_an_error_that_names_the_primitive() {
    let mut document = triangles(json!([{ "mesh": 0 }]), json!([0]));
    let indices = document.indices(&[0, 1, 3]);
    document.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    let scene = document.import();
    let error = DerivedScene::derive(&scene, &DeriveOptions::default()).expect_err("the index is out of range");
    assert_eq!(error.place, "/meshes/0/primitives/0");
    assert!(error.what.contains("vertex index 3"), "{error}");
}

#[test]
fn a_billion_declared_instances_are_refused_before_memory_is_taken() {
    let mut document = triangles(json!([{ "mesh": 0 }]), json!([0]));
    // No view: a billion zeros in a hundred bytes of JSON.
    let accessors = document.json["accessors"].as_array_mut().expect("an array");
    accessors.push(json!({ "componentType": 5126, "count": 1_000_000_000, "type": "VEC3" }));
    let count = accessors.len() - 1;
    document.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    document.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": count } } });
    // The importer has a bound of its own; either may refuse.
    let Ok(imported) = import_slice(document.glb(), None, "test.glb", &ImportOptions::default()) else { return };
    let options = DeriveOptions { max_bytes: 1 << 30, ..DeriveOptions::default() };
    let error = DerivedScene::derive(&imported.scene, &options).expect_err("132 GB do not fit 1 GiB");
    assert_eq!(error.place, "/nodes");
    assert!(error.remedy.contains("--max-memory"), "{error}");
}

#[test]
fn meshes_over_the_budget_are_refused() {
    let scene = triangles(json!([{ "mesh": 0 }]), json!([0])).import();
    let derive = |max_bytes| DerivedScene::derive(&scene, &DeriveOptions { max_bytes, ..DeriveOptions::default() });
    // Three vertices of 44 bytes, three indices; then one row of 128 bytes and its owner.
    assert_eq!(derive(143).expect_err("144 bytes of streams").place, "/meshes");
    assert_eq!(derive(144 + 131).expect_err("132 bytes of rows").place, "/nodes");
    assert!(derive(144 + 132).is_ok());
}
