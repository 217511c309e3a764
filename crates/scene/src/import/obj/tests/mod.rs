//! Whole files, made by hand.

mod features;
mod files;
mod hostile;
mod normals;
mod refusals;

use crate::Scene;
use crate::accessor;
use crate::import::{ImportError, ImportOptions, Imported, import_slice};
use crate::model::*;

fn try_import(text: impl AsRef<[u8]>) -> Result<Imported, ImportError> {
    import_slice(text.as_ref(), None, "folder/thing.obj", &ImportOptions::default())
}

fn import(text: impl AsRef<[u8]>) -> Scene {
    try_import(text).unwrap().scene
}

fn warnings(text: impl AsRef<[u8]>) -> Vec<String> {
    try_import(text).unwrap().warnings.iter().map(ToString::to_string).collect()
}

/// The primitives of the one mesh.
fn primitives(scene: &Scene) -> &[Primitive] {
    assert_eq!((scene.meshes().len(), scene.nodes().len(), scene.scenes().len()), (1, 1, 1));
    &scene.meshes().iter().next().unwrap().1.primitives
}

fn indices(scene: &Scene, primitive: &Primitive) -> Vec<u32> {
    accessor::read_indices(scene, primitive.indices.unwrap()).unwrap()
}

fn attribute<const N: usize>(scene: &Scene, primitive: &Primitive, semantic: &str) -> Option<Vec<[f32; N]>> {
    primitive.attributes.get(semantic).map(|id| accessor::read_f32(scene, id).unwrap())
}

fn positions(scene: &Scene, primitive: &Primitive) -> Vec<[f32; 3]> {
    attribute(scene, primitive, "POSITION").unwrap()
}

fn material_names(scene: &Scene) -> Vec<Option<&str>> {
    scene.materials().iter().map(|(_, m)| m.name.as_deref()).collect()
}

/// Three positions.
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
