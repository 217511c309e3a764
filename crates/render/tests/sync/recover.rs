//! What follows a sync that failed.

use crate::{Live, scenes};
use orthant_render::DeriveError;
use orthant_resident::batch::TlasAction;
use orthant_scene::Scene;
use orthant_scene::edit::ops::MergedFile;
use orthant_scene::edit::{Edit, Grouping};
use serde_json::json;
use std::sync::Arc;

/// A mesh that can be decoded and one that cannot: an index leads past its vertices.
fn half_broken() -> Scene {
    let mut document = scenes::parts(
        json!([{"mesh": 1, "children": [1]}, {"mesh": 3}]),
        json!({"scene": 0, "scenes": [{"nodes": [0]}]}),
    );
    let (triangle, indices) = (document.triangle(), document.indices(&[0, 1, 7]));
    let meshes = document.json["meshes"].as_array_mut().unwrap();
    meshes.push(json!({"primitives": [{"attributes": {"POSITION": triangle}, "indices": indices, "material": 3}]}));
    document.import()
}

fn failed(live: &mut Live) -> DeriveError {
    let changes = live.scene.change_log().take(&mut live.cursor).expect("the log reaches back far enough");
    live.derived.sync(&live.scene, &live.pose, &changes).map(|_| ()).unwrap_err()
}

#[test]
fn the_sync_after_one_that_failed_brings_scene_and_backend_to_the_document() {
    let mut live = Live::new(scenes::skinned());
    live.run(json!({"op": "delete", "node": 4}));
    live.run(json!({"op": "add_shape", "shape": "cube", "parent": 0, "material": 3}));
    let revision = live.derived.revision();
    // Others go before the one that fails, and new geometry.
    live.edit_json(json!({"op": "add_shape", "shape": "sphere", "parent": 2}));
    live.edit_json(json!({"op": "set_transform", "node": 2, "translation": [1, 2, 3]}));
    let scene = Some(Arc::new(half_broken()));
    let file = MergedFile { path: "broken.glb".to_owned(), blake3: String::new(), scene };
    live.session.history.apply(&mut live.scene, Edit::MergeScene { file, parent: None }, Grouping::Alone).unwrap();
    let error = failed(&mut live);
    assert!(!error.what.is_empty() && !error.remedy.is_empty(), "{error}");
    // As long as the document is what it is.
    assert_eq!(failed(&mut live), error);
    let refused = live.derived.close_holes(&live.scene, 10).map(|_| ()).unwrap_err();
    assert!(refused.what.contains("the last sync failed"), "{refused}");
    assert_eq!(live.derived.revision(), revision, "the backend is still at the last batch");

    // What could be decoded stays, though no sync has said it.
    live.edit_json(json!({"op": "undo"}));
    let report = live.sync();
    live.check().unwrap();
    assert_eq!(live.derived.revision(), revision + 1);
    assert_eq!((report.whole, report.tlas), (true, TlasAction::Rebuild));
    assert_eq!(report.render_nodes as usize, live.derived.render_nodes.len());

    // From here on as ever.
    let report = live.run(json!({"op": "set_visible", "node": 8, "visible": false}));
    assert!(!report.whole && !report.primitives_changed);
    live.run(json!({"op": "undo", "count": 5}));
}
