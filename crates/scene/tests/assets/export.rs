//! Every file that can be read is written again, and is the same.

use crate::corpus::{assets, import, json, models};
use orthant_scene::Scene;
use orthant_scene::export::{ExportOptions, Images, export_path};
use orthant_scene::import::Imported;
use orthant_scene::model::{Primitive, PrimitiveMode};
use serde_json::Value;
use std::path::Path;

/// Where two JSON documents differ, if they do: numbers by value, members in any order.
fn difference(a: &Value, b: &Value, pointer: &str) -> Option<String> {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            if let Some(key) = a.keys().find(|key| !b.contains_key(*key)) {
                return Some(format!("{pointer}/{key} is gone"));
            }
            if let Some(key) = b.keys().find(|key| !a.contains_key(*key)) {
                return Some(format!("{pointer}/{key} is new"));
            }
            a.iter().find_map(|(key, a)| difference(a, &b[key], &format!("{pointer}/{key}")))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().find_map(|(i, (a, b))| difference(a, b, &format!("{pointer}/{i}")))
        }
        (Value::Number(x), Value::Number(y)) if x.as_f64() == y.as_f64() => None,
        (a, b) => (a != b).then(|| format!("{pointer}: {a:.60} and {b:.60}")),
    }
}

/// A document without what export may change: which bytes of which buffer a view has.
fn but_for_buffers(mut document: Value) -> Value {
    let members = document.as_object_mut().unwrap();
    members.shift_remove("buffers");
    for view in members.get_mut("bufferViews").and_then(Value::as_array_mut).into_iter().flatten() {
        let view = view.as_object_mut().unwrap();
        view.shift_remove("buffer");
        view.shift_remove("byteOffset");
    }
    document
}

/// Whether the JSON of an export may be another: compressed data is written plain, and an index that leads nowhere is not
/// written.
fn is_mended(document: &Value, imported: &Imported) -> bool {
    if imported.warnings.iter().any(|warning| warning.to_string().contains("there is no such")) {
        return true;
    }
    let used = document["extensionsUsed"].as_array().into_iter().flatten();
    used.filter_map(Value::as_str).any(|name| {
        ["EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_draco_mesh_compression"].contains(&name)
    })
}

fn round_trips(path: &Path, folder: &Path, failures: &mut Vec<String>) -> bool {
    let Ok(original) = import(path) else { return false };
    let mut fail = |what: String| failures.push(format!("{}: {what}", path.display()));
    let options = ExportOptions::default();
    let mut last = original.scene.clone();
    let mut documents = Vec::new();
    for name in ["a.gltf", "b.glb", "c.gltf"] {
        let target = folder.join(name);
        if let Err(error) = export_path(&last, &target, &options) {
            fail(format!("{name}: {error}"));
            return true;
        }
        match import(&target) {
            Ok(again) => last = again.scene,
            Err(error) => {
                fail(format!("{name} again: {error}"));
                return true;
            }
        }
        if let Err(difference) = original.scene.same_document(&last) {
            fail(format!("{name} again: {difference}"));
        }
        documents.push(but_for_buffers(json(&target)));
    }
    let before = json(path);
    if !is_mended(&before, &original)
        && let Some(difference) = difference(&but_for_buffers(before), &documents[0], "")
    {
        fail(format!("the JSON: {difference}"));
    }
    if let Some(difference) = difference(&documents[0], &documents[2], "") {
        fail(format!("the JSON by way of a GLB: {difference}"));
    }
    true
}

#[test]
fn export_and_load_again_is_the_identity() {
    let Some(assets) = assets() else { return };
    let models = models(&assets);
    let mut failures = Vec::new();
    let mut exported = 0;
    for path in &models {
        let folder = tempfile::tempdir().unwrap();
        exported += usize::from(round_trips(path, folder.path(), &mut failures));
    }
    println!("{exported} of {} models exported", models.len());
    assert!(exported * 10 > models.len() * 9, "only {exported} of {} models were exported", models.len());
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn embedding_images_and_taking_them_out_again_keeps_their_bytes() {
    let Some(assets) = assets() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut checked = 0;
    for path in models(&assets) {
        let Ok(original) = import(&path) else { continue };
        // A file that is not there stays absent.
        if original.scene.images().is_empty() || original.scene.images().iter().any(|(_, i)| i.data.is_none()) {
            continue;
        }
        let folder = tempfile::tempdir_in(folder.path()).unwrap();
        let mut last = original.scene.clone();
        for (name, images) in [("a.glb", Images::Embed), ("b.gltf", Images::External), ("c.glb", Images::Embed)] {
            let mut options = ExportOptions::default();
            options.images = images;
            let target = folder.path().join(name);
            export_path(&last, &target, &options).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            last = import(&target).unwrap_or_else(|e| panic!("{}: {e}", path.display())).scene;
            for ((_, a), (_, b)) in original.scene.images().iter().zip(last.images().iter()) {
                assert_eq!(a.data, b.data, "{}: {name}", path.display());
            }
        }
        checked += 1;
    }
    assert!(checked > 50, "only {checked} models have images");
}

/// Triangles of all objects of a file without hierarchy.
fn shown_triangles(scene: &Scene) -> usize {
    let of_mesh = |id| {
        let triangles = |p: &Primitive| p.indices.filter(|_| p.mode == PrimitiveMode::Triangles);
        let indices = scene.meshes()[id].primitives.iter().filter_map(triangles);
        indices.map(|id| scene.accessors()[id].count / 3).sum::<usize>()
    };
    scene.nodes().iter().filter_map(|(_, node)| node.mesh).map(of_mesh).sum()
}

/// The two formats say the same of what a scene shows, although they are written in different ways.
#[test]
fn every_model_goes_to_obj_and_crts_and_both_show_the_same_triangles() {
    let Some(assets) = assets() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut failures = Vec::new();
    let mut checked = 0;
    for path in models(&assets) {
        let Ok(original) = import(&path) else { continue };
        // Text is long: the largest models would take most of the time.
        let vertices: usize = original.scene.accessors().iter().map(|(_, a)| a.count).sum();
        if vertices > 600_000 {
            continue;
        }
        let folder = tempfile::tempdir_in(folder.path()).unwrap();
        let through = |name: &str| -> Result<usize, String> {
            let target = folder.path().join(name);
            export_path(&original.scene, &target, &ExportOptions::default()).map_err(|e| e.to_string())?;
            let again = import(&target).map_err(|e| e.to_string())?;
            Ok(shown_triangles(&again.scene))
        };
        match (through("a.obj"), through("a.crts")) {
            (Ok(obj), Ok(crts)) if obj == crts => checked += 1,
            found => failures.push(format!("{}: {found:?}", path.display())),
        }
    }
    println!("{checked} models");
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
    assert!(checked > 200, "only {checked} models");
}
