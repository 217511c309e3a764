//! Poses: an overlay that is followed like edits, and that edits do not see.

use crate::{Live, scenes};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use orthant_resident::batch::TlasAction;
use orthant_resident::rows::NodeFlags;
use serde_json::json;

fn world(live: &Live, node: usize) -> DAffine3 {
    let id = live.scene.nodes().id_in_slot(node).unwrap();
    live.derived.world_of(id).expect("it is shown")
}

fn assert_near(found: DAffine3, expected: DAffine3) {
    assert!(found.abs_diff_eq(expected, 1e-6), "{found} and {expected}");
}

#[test]
fn one_node_of_ten_thousand_costs_its_subtree() {
    let costs = |size: usize| {
        let mut live = Live::new(scenes::wide(size));
        // Animation 2 moves node 3 alone.
        let mut reports = Vec::new();
        for seconds in [0.5, 0.75, 1.5] {
            live.edit_json(json!({"op": "set_time", "seconds": seconds, "animation": 2}));
            reports.push(live.sync());
        }
        live.check().unwrap();
        reports
    };
    let (small, large) = (costs(100), costs(10_000));
    assert_eq!(small, large);
    for report in &small {
        assert_eq!((report.tlas, report.render_nodes, report.blas_built), (TlasAction::Update, 1, 0));
        assert_eq!((report.upload_bytes, report.primitives_changed), (128, false));
        assert!(report.visited < 10, "{report:?}");
    }
}

#[test]
fn a_node_is_where_its_channels_say_under_what_the_document_says() {
    let mut live = Live::new(scenes::deep(24));
    live.run(json!({"op": "set_time", "seconds": 0.5, "animation": "name:move"}));
    // Node 0: its translation is half-way to (1, 2, 3), its rotation that of the document.
    let rest = DQuat::from_xyzw(0.0, 0.0, 0.1, 0.995).normalize();
    let parent = DAffine3::from_rotation_translation(rest, DVec3::new(0.5, 1.0, 1.5));
    assert_near(world(&live, 0), parent);
    // Node 1: half the angle of (0, 0.6, 0, 0.8); scale by the spline of 1 and 2 whose tangents are 0.
    let half = DQuat::from_axis_angle(DVec3::Y, 0.6f64.asin());
    let scale = DVec3::new(1.5, 1.0, 1.0);
    let local = DAffine3::from_scale_rotation_translation(scale, half, DVec3::new(0.5, 0.25, 0.0));
    assert_near(world(&live, 1), parent * local);
}

#[test]
fn edits_change_the_values_below_a_pose_and_the_pose_stays() {
    let mut live = Live::new(scenes::deep(24));
    live.run(json!({"op": "set_time", "seconds": 9, "animation": 0}));
    live.run(json!({"op": "set_transform", "node": 0, "translation": [7, 7, 7], "scale": [3, 3, 3]}));
    let posed = world(&live, 0);
    assert_eq!(posed.translation, DVec3::new(4.0, -2.0, 0.5));
    assert!((posed.matrix3.x_axis.length() - 3.0).abs() < 1e-9);
    live.run(json!({"op": "set_time", "seconds": 0, "animation": null}));
    assert_eq!(world(&live, 0).translation, DVec3::splat(7.0));
    live.run(json!({"op": "undo"}));
    assert_eq!(world(&live, 0).translation, DVec3::new(0.5, 0.25, 0.0));
    live.run(json!({"op": "set_time", "seconds": 9, "animation": 0}));
    live.run(json!({"op": "redo"}));
    assert_eq!(world(&live, 0).translation, DVec3::new(4.0, -2.0, 0.5), "redo does not touch the pose");
}

#[test]
fn a_node_that_is_posed_can_be_deleted_and_comes_back_posed() {
    let mut live = Live::new(scenes::skinned());
    live.run(json!({"op": "set_time", "seconds": 1, "animation": "name:bend"}));
    let bounds = |live: &Live| {
        [1, 5, 8].map(|node| {
            let node = live.scene.nodes().id_in_slot(node).unwrap();
            let row = live.derived.render_nodes[live.derived.render_nodes_of(node).start as usize];
            let desc = live.derived.mesh_descs[row.primitive as usize];
            (desc.bounds_min, desc.bounds_max)
        })
    };
    let before = bounds(&live);
    // A joint, its figure's node, and the morphed node.
    for node in [3, 1, 8] {
        live.run(json!({"op": "delete", "node": node}));
        live.run(json!({"op": "set_time", "seconds": 1.5, "animation": "name:bend"}));
        live.run(json!({"op": "undo"}));
        live.run(json!({"op": "set_time", "seconds": 1, "animation": "name:bend"}));
        assert_eq!(bounds(&live), before, "node {node}");
    }
}

#[test]
fn joints_and_weights_that_move_build_what_they_deform() {
    let mut live = Live::new(scenes::skinned());
    let report = live.run(json!({"op": "set_time", "seconds": 0.5, "animation": "name:bend"}));
    assert_eq!((report.blas_updated, report.tlas), (3, TlasAction::Update), "two figures and a morphed mesh");
    let node = live.scene.nodes().id_in_slot(8).unwrap();
    let row = live.derived.render_nodes[live.derived.render_nodes_of(node).start as usize];
    let desc = live.derived.mesh_descs[row.primitive as usize];
    assert_eq!(desc.bounds_max[2], 0.25, "a quarter of the target's metre");
    let positions = desc.first_vertex as usize..(desc.first_vertex + desc.vertex_count) as usize;
    let highest = live.copy.positions[positions].iter().fold(0.0f32, |z, p| z.max(p[2]));
    assert_eq!(highest, 0.25, "the copy has the deformed vertices");
    let again = live.run(json!({"op": "set_time", "seconds": 0.5, "animation": "name:bend"}));
    assert_eq!((again.upload_bytes, again.visited), (0, 0), "the same time is nothing");
}

#[test]
fn what_pointers_name_is_shown_and_the_document_is_as_before() {
    let mut live = Live::new(scenes::many_scenes());
    let document = live.scene.clone();
    let report = live.run(json!({"op": "set_time", "seconds": 1, "animation": "name:look"}));
    assert_eq!(report.lights, 2, "two nodes carry the light");
    assert_eq!(live.derived.lights[0].color, [8.0; 3]);
    assert_eq!(live.derived.materials[1].base_color, [0.0, 1.0, 0.0, 0.5]);
    assert_eq!(live.derived.materials[3].emissive, [1.0, 0.5, 0.0]);
    let id = |i: usize| document.materials().id_in_slot(i).unwrap();
    assert_eq!(live.scene.materials()[id(0)], document.materials()[id(0)]);
    assert_eq!(live.scene.change_log().revision(), 0, "playing is no edit");
    live.run(json!({"op": "set_time", "seconds": 0, "animation": "name:look"}));
    assert!(live.derived.lights.iter().all(|row| row.color == [0.0; 3]), "an intensity of 0 is no light");
}

#[test]
fn a_node_that_an_animation_hides_makes_the_tlas_anew() {
    let mut live = Live::new(scenes::deep(24));
    // Animation 1 hides node 1, and all below it, from 1 s to 3 s.
    let report = live.run(json!({"op": "set_time", "seconds": 1, "animation": 1}));
    assert_eq!(report.tlas, TlasAction::Rebuild);
    let seen = |live: &Live| live.derived.render_nodes.iter().filter(|r| r.flags & NodeFlags::VISIBLE != 0).count();
    let hidden = seen(&live);
    live.run(json!({"op": "set_time", "seconds": 0.999, "animation": 1}));
    assert!(hidden == 1 && seen(&live) > 24, "{hidden} rows are seen");
}

#[test]
fn a_joint_that_the_scene_does_not_show_deforms_all_the_same() {
    let mut document = crate::common::Document::new(json!({
        "scene": 0, "scenes": [{"nodes": [0]}, {"nodes": [1]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"children": [2]}, {}],
        "skins": [{"joints": [1, 2]}],
    }));
    let positions = document.triangle();
    let joints = document.joints(&[[1, 0, 0, 0]; 3]);
    let weights = document.floats("VEC4", &[[1.0, 0.0, 0.0, 0.0]; 3]);
    let times = document.floats("SCALAR", &[[0.0], [1.0]]);
    let up = document.floats("VEC3", &[[0.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
    document.json["meshes"] = json!([{"primitives": [
        {"attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}},
    ]}]);
    document.json["animations"] = json!([{
        "samplers": [{"input": times, "output": up}],
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}],
    }]);
    let mut live = Live::new(document.import());
    let report = live.run(json!({"op": "set_time", "seconds": 0.5}));
    assert_eq!((report.blas_built, report.blas_updated), (0, 1));
    assert_eq!(Vec3::from_array(live.derived.mesh_descs[0].bounds_max), Vec3::new(1.0, 3.0, 0.0));
}
