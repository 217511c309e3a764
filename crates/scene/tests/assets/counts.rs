//! What is loaded is what the JSON says, and what is refused is what the inventory says cannot be read.

use crate::corpus::*;
use orthant_scene::accessor;
use orthant_scene::import::ImportFault;
use orthant_scene::model::{ComponentType, ElementType};
use orthant_scene::{Scene, import::ImportError};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// Extensions that a file may require and that are not supported. The inventory lists them as `required:`.
const UNSUPPORTED: &[&str] = &["FAKE_materials_quantumRendering"];

/// What a file must be refused for.
enum Refusal {
    Required(String),
    Version(&'static str),
    /// A reference to what is not there.
    Dangling(&'static str),
}

impl Refusal {
    fn is(&self, fault: &ImportFault) -> bool {
        match (self, fault) {
            (Self::Required(name), ImportFault::RequiredExtension(n)) => name == n,
            (Self::Version(version), ImportFault::Version(v)) => version == v,
            (Self::Dangling(what), ImportFault::Index { kind, .. }) => what == kind,
            _ => false,
        }
    }
}

/// Why a file must be refused, by what its JSON says; `None` where it must load.
fn expected_refusal(file: &str, json: &Value) -> Option<Refusal> {
    let required = json["extensionsRequired"].as_array().into_iter().flatten().filter_map(Value::as_str);
    if let Some(name) = required.into_iter().find(|name| UNSUPPORTED.contains(name)) {
        return Some(Refusal::Required(name.to_owned()));
    }
    // The inventory's UNRESOLVED_REFERENCE: variants of materials that were lost.
    if file.ends_with("MaterialsVariantsShoe-broken/shoe.glb") {
        return Some(Refusal::Dangling("material"));
    }
    // "Compatibility: version/extension fallbacks (some must be refused)"
    if file.ends_with("Compatibility/Compatibility_04.gltf") {
        return Some(Refusal::Version("2.1"));
    }
    None
}

#[test]
fn every_model_loads_or_is_refused_for_the_reason_that_its_json_gives() {
    let Some(assets) = assets() else { return };
    let (mut loaded, mut refused) = (0, 0);
    for path in models(&assets) {
        let expected = expected_refusal(&path.display().to_string().replace('\\', "/"), &json(&path));
        match (import(&path), expected) {
            (Ok(_), None) => loaded += 1,
            (Err(error), Some(refusal)) => {
                assert!(refusal.is(&error.fault), "refused for another reason: {error}");
                assert_says_where(&error, &path);
                refused += 1;
            }
            (Ok(_), Some(_)) => panic!("{} loads, but should be refused", path.display()),
            (Err(error), None) => panic!("{error}"),
        }
    }
    println!("{loaded} models loaded, {refused} refused as expected");
    assert!(loaded > 200 && refused == 3, "{loaded} loaded, {refused} refused");
}

fn assert_says_where(error: &ImportError, path: &Path) {
    let message = error.to_string();
    assert!(message.starts_with(&format!("{}: /", path.display())), "no place: {message}");
}

#[test]
fn the_scene_has_as_many_objects_of_each_kind_as_the_json() {
    let Some(assets) = assets() else { return };
    for path in models(&assets) {
        let Ok(imported) = import(&path) else { continue };
        let (json, scene) = (json(&path), &imported.scene);
        let count = |value: &Value| value.as_array().map_or(0, Vec::len);
        let extensions = &json["extensions"];
        let primitives = |mesh: &Value| count(&mesh["primitives"]);
        let decoded = Decoded::of(&json);
        let expected = [
            count(&json["scenes"]),
            count(&json["nodes"]),
            count(&json["meshes"]),
            json["meshes"].as_array().into_iter().flatten().map(primitives).sum(),
            count(&json["materials"]),
            count(&json["textures"]),
            count(&json["images"]),
            count(&json["samplers"]),
            count(&json["accessors"]) + decoded.accessors,
            count(&json["bufferViews"]) + decoded.views,
            count(&json["buffers"]) + decoded.buffers,
            count(&json["skins"]),
            count(&json["animations"]),
            count(&json["cameras"]),
            count(&extensions["KHR_lights_punctual"]["lights"]),
            count(&extensions["KHR_materials_variants"]["variants"]),
        ];
        let found = [
            scene.scenes().len(),
            scene.nodes().len(),
            scene.meshes().len(),
            scene.meshes().iter().map(|(_, m)| m.primitives.len()).sum(),
            scene.materials().len(),
            scene.textures().len(),
            scene.images().len(),
            scene.samplers().len(),
            scene.accessors().len(),
            scene.buffer_views().len(),
            scene.buffers().len(),
            scene.skins().len(),
            scene.animations().len(),
            scene.cameras().len(),
            scene.lights().len(),
            scene.variants().len(),
        ];
        assert_eq!(found, expected, "{}", path.display());
    }
}

/// What compressed primitives add: a buffer, a view for each attribute of each compressed view, of which one takes the
/// place of the compressed one, and a twin for each further attribute that an accessor stands for.
#[derive(Default)]
struct Decoded {
    accessors: usize,
    views: usize,
    buffers: usize,
}

impl Decoded {
    fn of(json: &Value) -> Self {
        let mut outputs = BTreeSet::new();
        let meshes = json["meshes"].as_array().into_iter().flatten();
        for primitive in meshes.flat_map(|m| m["primitives"].as_array().into_iter().flatten()) {
            let Some(draco) = primitive["extensions"].get("KHR_draco_mesh_compression") else { continue };
            let view = draco["bufferView"].as_u64();
            outputs.insert((view, None, primitive["indices"].as_u64()));
            let mapped = draco["attributes"].as_object().into_iter().flatten();
            outputs
                .extend(mapped.map(|(semantic, id)| (view, id.as_u64(), primitive["attributes"][semantic].as_u64())));
        }
        let views: BTreeSet<_> = outputs.iter().map(|(view, _, _)| view).collect();
        let accessors: BTreeSet<_> = outputs.iter().map(|(_, _, accessor)| accessor).collect();
        Self {
            accessors: outputs.len() - accessors.len(),
            views: outputs.len() - views.len(),
            buffers: usize::from(!views.is_empty()),
        }
    }
}

#[test]
fn every_accessor_of_every_model_decodes() {
    let Some(assets) = assets() else { return };
    let mut elements = 0;
    for path in models(&assets) {
        let Ok(imported) = import(&path) else { continue };
        elements += decode_all(&imported.scene, &path);
    }
    println!("{elements} elements decoded");
    assert!(elements > 1_000_000);
}

fn decode_all(scene: &Scene, path: &Path) -> usize {
    let mut elements = 0;
    for (id, a) in scene.accessors().iter() {
        let count = match a.element_type {
            ElementType::Scalar => accessor::read_f32::<1>(scene, id).map(|v| v.len()),
            ElementType::Vec2 => accessor::read_f32::<2>(scene, id).map(|v| v.len()),
            ElementType::Vec3 => accessor::read_f32::<3>(scene, id).map(|v| v.len()),
            ElementType::Vec4 | ElementType::Mat2 => accessor::read_f32::<4>(scene, id).map(|v| v.len()),
            ElementType::Mat3 => accessor::read_f32::<9>(scene, id).map(|v| v.len()),
            ElementType::Mat4 => accessor::read_f32::<16>(scene, id).map(|v| v.len()),
        };
        assert_eq!(count.unwrap_or_else(|e| panic!("{}: {e}", path.display())), a.count);
        let unsigned = matches!(a.component_type, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if a.element_type == ElementType::Scalar && unsigned {
            assert_eq!(accessor::read_indices(scene, id).unwrap().len(), a.count);
        }
        elements += a.count;
    }
    elements
}
