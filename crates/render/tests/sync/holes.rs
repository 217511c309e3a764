//! Holes in the render-node buffer, and closing them.

use crate::{Live, scenes};
use orthant_resident::batch::TlasAction;
use orthant_resident::rows::NodeFlags;
use serde_json::json;

#[test]
fn holes_are_closed_within_a_budget_when_they_are_due() {
    let mut live = Live::new(scenes::wide(400));
    let rows = live.derived.render_nodes.len();
    // The first 240 go, without those that emit.
    for node in 1..=240 {
        live.edit_json(json!({"op": "delete", "node": node}));
    }
    live.sync();
    assert_eq!(live.derived.render_nodes.len(), rows, "an edit closes no hole");
    assert!(live.derived.holes_are_due());
    let holes = live.derived.free_render_nodes();

    let report = live.close_holes(50);
    live.check().unwrap();
    let moved = holes - live.derived.free_render_nodes();
    assert!((1..=50).contains(&moved), "{moved}");
    // What moves is written in both places, but for what is beyond the new end.
    assert!(report.instances_written <= 100 && report.tlas == TlasAction::Rebuild, "{report:?}");

    while live.derived.free_render_nodes() > 0 {
        live.close_holes(50);
        live.check().unwrap();
    }
    assert_eq!(live.derived.render_nodes.len() as u32, rows as u32 - holes);
    assert!(live.derived.render_nodes.iter().all(|row| row.flags & NodeFlags::OCCUPIED != 0));
    let report = live.close_holes(50);
    assert_eq!((report.instances_written, report.tlas), (0, TlasAction::None));
    live.run(json!({"op": "undo", "count": 240}));
}

#[test]
fn a_node_too_large_for_every_hole_slides_down() {
    let mut live = Live::new(scenes::instanced());
    // Node 1 has six rows; node 2, before or after it, one.
    let before = live.derived.render_nodes_of(live.scene.nodes().id_in_slot(1).unwrap());
    live.run(json!({"op": "duplicate", "node": 1, "as": "copy"}));
    live.run(json!({"op": "delete", "node": 2}));
    if before.start == 0 {
        live.run(json!({"op": "set_mesh", "node": 1, "mesh": 0}));
    }
    assert!(live.derived.free_render_nodes() > 0);
    let rows = live.derived.render_nodes.len() as u32 - live.derived.free_render_nodes();
    // One node's rows move however small the budget is.
    for _ in 0..4 {
        live.close_holes(1);
        live.check().unwrap();
    }
    assert_eq!((live.derived.free_render_nodes(), live.derived.render_nodes.len() as u32), (0, rows));
    live.run(json!({"op": "undo", "count": 2}));
}
