//! What has gone wrong in other programs.

use crate::{Live, scenes};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use orthant_render::derived::sync::TlasPolicy;
use orthant_resident::batch::TlasAction;
use orthant_resident::rows::{NodeFlags, RenderNodeRow};
use serde_json::json;

fn rows(live: &Live, node: usize) -> Vec<RenderNodeRow> {
    let id = live.scene.nodes().id_in_slot(node).unwrap();
    live.derived.render_nodes_of(id).map(|row| live.derived.render_nodes[row as usize]).collect()
}

#[test]
fn instances_that_are_moved_later_are_placed_by_world_times_instance() {
    let mut live = Live::new(scenes::instanced());
    live.run(json!({"op": "set_transform", "node": 1, "translation": [0, 0, 7], "rotation": [0, 0, 0.6, 0.8]}));
    let parent = DAffine3::from_quat(DQuat::from_xyzw(0.0, 0.6, 0.0, 0.8));
    let node = DAffine3::from_rotation_translation(DQuat::from_xyzw(0.0, 0.0, 0.6, 0.8), DVec3::new(0.0, 0.0, 7.0));
    let instance =
        DAffine3::from_scale_rotation_translation(DVec3::splat(2.0), DQuat::IDENTITY, DVec3::new(5.0, 0.0, 0.0));
    let expected = (parent * node * instance).transform_point3(DVec3::new(1.0, 2.0, 3.0)).as_vec3();
    // Two primitives an instance: the second instance's first row is the third.
    let found = rows(&live, 1)[2].world.transform_point(Vec3::new(1.0, 2.0, 3.0));
    assert!((found - expected).length() < 1e-4, "{found} and {expected}");
}

#[test]
fn a_light_follows_its_own_node_also_where_two_share_it() {
    let mut live = Live::new(scenes::many_scenes());
    // Nodes 3 and 5 share light 0.
    let report = live.run(json!({"op": "set_transform", "node": 5, "translation": [1, 2, 3]}));
    assert_eq!(report.lights, 1);
    let mut found: Vec<(u32, [f32; 3])> = live.derived.lights.iter().map(|row| (row.node, row.position)).collect();
    found.sort_by_key(|row| row.0);
    assert_eq!(found, [(3, [0.0; 3]), (5, [1.0, 2.0, 3.0])]);
    let report = live.run(json!({"op": "set_light", "light": 0, "set": {"intensity": 3}}));
    assert_eq!((report.lights, report.render_nodes), (2, 0));
}

#[test]
fn hiding_one_and_showing_another_at_once_is_a_rebuild() {
    let mut live = Live::new(scenes::wide(10));
    live.run(json!({"op": "set_visible", "node": 3, "visible": false}));
    live.edit_json(json!({"op": "set_visible", "node": 4, "visible": false}));
    live.edit_json(json!({"op": "set_visible", "node": 3, "visible": true}));
    assert_eq!(live.sync().tlas, TlasAction::Rebuild);
    live.check().unwrap();
}

#[test]
fn a_joint_that_is_not_shown_deforms_what_is() {
    // Node 6 and node 7 below it are the joints of the figure that node 5 shows; node 9 is in a scene that is not shown. No edit
    // takes them there, but files have it.
    let mut document = scenes::skinned_document();
    document.json["nodes"][8].as_object_mut().unwrap().remove("children");
    document.json["nodes"][9]["children"] = json!([6]);
    let mut live = Live::new(document.import());
    let before = live.copy.positions.clone();
    live.run(json!({"op": "set_transform", "node": 7, "translation": [0, 0, 3]}));
    assert!(live.copy.positions != before, "the figure has followed");
    live.run(json!({"op": "undo", "count": 1}));
}

#[test]
fn other_geometry_in_the_slot_of_an_unchanged_row_is_no_unchanged_tlas() {
    let mut live = Live::new(scenes::skinned());
    live.run(json!({"op": "set_transform", "node": 2, "translation": [0, 0, 0]}));
    let before = rows(&live, 1);
    // What node 1 deformed goes, and the mesh as it is takes its slot.
    let report = live.run(json!({"op": "set_skin", "node": 1, "skin": null}));
    let after = rows(&live, 1);
    assert_eq!((before[0].primitive, before[0].world), (after[0].primitive, after[0].world));
    assert_eq!((report.blas_built, report.tlas), (1, TlasAction::Update));
}

#[test]
fn a_zero_that_changes_its_sign_is_written() {
    let mut live = Live::new(scenes::wide(3));
    // The scale has a -1: what was 0 becomes -0.
    for x in [0.0, -0.0] {
        live.run(json!({"op": "set_transform", "node": 1, "translation": [x, 0, 0], "scale": [1, 1, -1]}));
        live.run(json!({"op": "set_transform", "node": 0, "rotation": [0, 0, x, 1]}));
    }
}

#[test]
fn a_move_is_an_update_and_nothing_else() {
    let mut live = Live::new(scenes::wide(1000));
    let report = live.run(json!({"op": "set_transform", "node": 3, "translation": [0, 1, 0]}));
    assert_eq!((report.tlas, report.render_nodes, report.blas_built), (TlasAction::Update, 1, 0));
    assert_eq!(report.upload_bytes, 128);
    assert!(!report.primitives_changed);
}

#[test]
fn a_material_that_becomes_transparent_changes_the_flags_of_all_its_instances() {
    let mut live = Live::new(scenes::wide(90));
    let report = live.run(json!({"op": "set_material", "material": 0, "set": {"alphaMode": "BLEND"}}));
    assert_eq!((report.materials, report.render_nodes, report.tlas), (1, 30, TlasAction::Update));
    assert!(rows(&live, 3).iter().all(|row| row.flags & NodeFlags::OPAQUE == 0));
    let report = live
        .run(json!({"op": "set_material", "material": 0, "set": {"pbrMetallicRoughness": {"roughnessFactor": 0.5}}}));
    assert_eq!((report.materials, report.render_nodes), (1, 0));
}

#[test]
fn removing_one_primitive_and_adding_another_at_once_is_noticed() {
    let mut live = Live::new(scenes::wide(10));
    // No node shows the lone quad any more, and a cube takes its slot.
    for node in [2, 5, 8] {
        live.edit_json(json!({"op": "set_mesh", "node": node, "mesh": 0}));
    }
    live.edit_json(json!({"op": "remove_unused"}));
    live.edit_json(json!({"op": "add_shape", "shape": "cube"}));
    let report = live.sync();
    live.check().unwrap();
    assert!(report.primitives_changed && report.blas_built == 1);
    assert_eq!(report.tlas, TlasAction::Rebuild);
}

#[test]
fn an_edit_before_a_structural_one_in_the_same_frame_is_not_lost() {
    let mut live = Live::new(scenes::wide(10));
    live.edit_json(json!({"op": "set_transform", "node": 7, "translation": [0, 5, 0]}));
    live.edit_json(
        json!({"op": "set_material", "material": 0, "set": {"pbrMetallicRoughness": {"metallicFactor": 0}}}),
    );
    live.edit_json(json!({"op": "delete", "node": 2}));
    live.edit_json(json!({"op": "duplicate", "node": 3}));
    live.sync();
    live.check().unwrap();
    assert_eq!(rows(&live, 7)[0].world.rows[1][3], 5.0);
}

#[test]
fn two_nodes_with_one_mesh_and_two_skins_stay_apart() {
    let mut live = Live::new(scenes::skinned());
    let [a, b] = [1, 5].map(|node| rows(&live, node)[0].primitive);
    assert_ne!(a, b);
    let before = live.derived.mesh_descs.clone();
    // A joint of the second figure.
    let report = live.run(json!({"op": "set_transform", "node": 7, "translation": [0, 5, 0]}));
    assert_eq!((report.blas_built, report.blas_updated), (0, 1));
    assert_eq!(live.derived.mesh_descs[a as usize], before[a as usize]);
    assert_ne!(live.derived.mesh_descs[b as usize].bounds_max, before[b as usize].bounds_max);
}

#[test]
fn moving_a_whole_figure_deforms_nothing() {
    let mut live = Live::new(scenes::skinned());
    live.derived.set_tlas_policy(TlasPolicy { max_updates: 1000, max_growth: f64::INFINITY });
    let report =
        live.run(json!({"op": "set_transform", "node": 0, "translation": [9, 0, 0], "rotation": [0, 0.6, 0, 0.8]}));
    assert_eq!((report.blas_built, report.blas_updated, report.tlas), (0, 0, TlasAction::Update));
}

#[test]
fn a_material_that_gets_a_normal_map_brings_tangents_for_its_uv_set() {
    let mut live = Live::new(scenes::wide(10));
    let report = live.run(json!({"op": "set_material", "material": 1, "set": {"normalTexture": {"index": 1}}}));
    assert_eq!(report.blas_built, 1);
    let report = live.run(json!({"op": "set_material", "material": 1, "set": {"normalTexture": {"texCoord": 1}}}));
    assert_eq!(report.blas_built, 1, "another set, other tangents");
    let report = live.run(json!({"op": "set_material", "material": 1, "set": {"normalTexture": {"scale": 0.5}}}));
    assert_eq!((report.blas_built, report.materials), (0, 1));
}

#[test]
fn slots_that_are_free_are_taken_again() {
    let mut live = Live::new(scenes::wide(40));
    let rows = live.derived.render_nodes.len();
    for _ in 0..20 {
        live.run(json!({"op": "delete", "node": 4}));
        assert!(live.derived.free_render_nodes() > 0);
        live.run(json!({"op": "undo"}));
        assert_eq!((live.derived.render_nodes.len(), live.derived.free_render_nodes()), (rows, 0));
    }
}

#[test]
fn many_updates_end_in_a_rebuild() {
    let mut live = Live::new(scenes::wide(40));
    live.derived.set_tlas_policy(TlasPolicy { max_updates: 3, max_growth: f64::INFINITY });
    let mut actions = Vec::new();
    for i in 0..6 {
        actions.push(live.run(json!({"op": "set_transform", "node": 3, "translation": [0, i + 1, 0]})).tlas);
    }
    let (u, r) = (TlasAction::Update, TlasAction::Rebuild);
    assert_eq!(actions, [u, u, u, r, u, u]);
    live.derived.set_tlas_policy(TlasPolicy { max_updates: 1000, max_growth: 1.5 });
    assert_eq!(live.run(json!({"op": "set_transform", "node": 5, "translation": [0, 1e6, 0]})).tlas, r);
}

#[test]
fn a_scene_that_was_derived_to_be_shown_once_says_so() {
    use orthant_render::{DeriveOptions, DerivedScene};
    let scene = scenes::wide(3);
    let mut derived = DerivedScene::derive(&scene, &DeriveOptions::default()).unwrap();
    let error = derived.sync(&scene, &Default::default(), &Default::default()).unwrap_err();
    assert!(error.to_string().contains("live"), "{error}");
}

/// Two meshes of one geometry; the material of the second has a normal map.
fn two_meshes_of_one_geometry() -> crate::common::Document {
    let mut document = crate::common::Document::new(json!({
        "scene": 0, "scenes": [{"nodes": [0, 1]}], "nodes": [{"mesh": 0}, {"mesh": 1}],
        "materials": [{}, {"normalTexture": {"index": 0}}],
        "textures": [{"source": 0}],
    }));
    let positions = document.triangle();
    let uv = document.floats("VEC2", &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    let image = document.bytes(&scenes::png([128, 128, 255, 255]));
    let mesh = |material: usize| json!({"primitives": [{"attributes": {"POSITION": positions, "TEXCOORD_0": uv}, "material": material}]});
    document.json["meshes"] = json!([mesh(0), mesh(1)]);
    document.json["images"] = json!([{"bufferView": image, "mimeType": "image/png"}]);
    document
}

#[test]
fn two_new_meshes_of_one_geometry_have_the_tangents_that_one_of_them_wants() {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("two_meshes_of_one_geometry.glb");
    std::fs::write(&path, two_meshes_of_one_geometry().glb()).unwrap();
    let mut live = Live::new(scenes::wide(3));
    let report = live.run(json!({"op": "merge_scene", "path": path}));
    assert_eq!(report.blas_built, 1, "the two share it");
}

#[test]
fn geometry_that_comes_back_has_the_tangents_that_a_mesh_wants_which_nothing_shows() {
    let mut live = Live::new(two_meshes_of_one_geometry().import());
    for operation in [
        json!({"op": "add_node", "as": "empty"}),
        json!({"op": "delete", "node": 0}),
        json!({"op": "delete", "node": 1}),
        json!({"op": "remove_unused"}),
        json!({"op": "undo"}),
    ] {
        live.run(operation);
    }
    let report = live.run(json!({"op": "set_mesh", "node": "$empty", "mesh": 0}));
    assert_eq!(report.blas_built, 1);
}
