//! Scenes of glTF files as CRTS.

use super::round_trip::{said, written};
use super::*;
use crate::export::{ExportOptions, gltf};
use crate::testing::documents::{data_uri, floats, skinned, triangle as gltf_triangle};
use base64::Engine;

fn load_gltf(document: &Value) -> Scene {
    import_slice(document.to_string(), None, "a.gltf", &ImportOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// Writes a scene, reads it, and checks that writing what was read gives the same file.
fn through(scene: &Scene) -> (Scene, Vec<String>) {
    let (bytes, notes) = written(scene);
    let read = import(bytes.clone()).unwrap();
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    let (again, _) = written(&read.scene);
    assert_eq!(again, bytes, "what was read is written as the same file");
    assert_eq!(said(&import(again).unwrap().scene), said(&read.scene));
    (read.scene, notes)
}

fn positions(scene: &Scene, node: usize) -> Vec<[f32; 3]> {
    read(scene, primitive_of(scene, nth_node(scene, node)), "POSITION")
}

fn place(scene: &Scene, node: usize) -> [f64; 3] {
    nth_node(scene, node).transform.to_affine().translation.to_array()
}

#[test]
fn objects_are_where_the_hierarchy_puts_them() {
    let (scene, notes) = through(&load_gltf(&gltf_triangle(json!({
        "scenes": [{ "nodes": [1] }],
        "nodes": [{ "name": "a", "mesh": 0, "translation": [1, 0, 0] }, { "children": [0], "scale": [2, 2, 2] }],
    }))));
    assert_eq!((scene.nodes().len(), place(&scene, 0)), (1, [2.0, 0.0, 0.0]));
    assert_eq!(nth_node(&scene, 0).name.as_deref(), Some("a"));
    assert_eq!(positions(&scene, 0).as_flattened(), POSITIONS);
    assert_eq!(read::<3>(&scene, primitive_of(&scene, nth_node(&scene, 0)), "NORMAL").as_flattened(), NORMALS);
    assert!(notes.iter().any(|note| note.contains("no hierarchy")), "{notes:?}");
}

#[test]
fn a_skinned_mesh_is_written_where_its_joints_put_it() {
    let (scene, notes) = through(&load_gltf(&skinned()));
    assert_eq!((scene.nodes().len(), scene.meshes().len()), (1, 1), "the mesh as it is stored is not shown");
    assert_eq!(positions(&scene, 0), [[0., 0., 3.], [1., 0., 3.], [0., 1., 3.]]);
    assert_eq!(place(&scene, 0), [0.0; 3]);
    assert!(notes.iter().any(|note| note.contains("no skins")), "{notes:?}");
    assert!(!notes.iter().any(|note| note.contains("other attributes")), "{notes:?}");
}

#[test]
fn two_nodes_may_pose_one_mesh_each_in_its_way() {
    let mut document = gltf_triangle(json!({
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [{ "mesh": 0, "weights": [1.0] }, { "mesh": 0, "weights": [2.0], "translation": [0, 0, 7] }, { "mesh": 0 }],
    }));
    document["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 1 }]);
    let (scene, notes) = through(&load_gltf(&document));
    let heights: Vec<f32> = (0..3).map(|node| positions(&scene, node)[0][2]).collect();
    assert_eq!((heights, place(&scene, 1)), (vec![1.0, 2.0, 0.0], [0.0, 0.0, 7.0]));
    assert!(notes.iter().any(|note| note.contains("no morph targets")), "{notes:?}");
}

#[test]
fn every_instance_is_an_object_and_the_geometry_is_there_once() {
    let mut document = gltf_triangle(json!({
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "nodes": [{ "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 1 } } } }],
    }));
    document["meshes"][0]["primitives"][0]["attributes"] = json!({ "POSITION": 0 });
    let (scene, _) = through(&load_gltf(&document));
    assert_eq!((scene.nodes().len(), scene.accessors().len()), (3, 2));
    assert_eq!(place(&scene, 2), [0.0, 0.0, 1.0]);
}

#[test]
fn points_and_lines_are_left_out_with_a_note() {
    for mode in 0..4 {
        let mut document = gltf_triangle(json!({}));
        document["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        let (scene, notes) = through(&load_gltf(&document));
        assert!(scene.nodes().is_empty() && scene.meshes().is_empty());
        assert!(
            notes.iter().any(|n| n.starts_with("/meshes/0/primitives/0: CRTS has no points or lines")),
            "{notes:?}"
        );
    }
}

#[test]
fn images_are_kept_as_they_are_encoded_and_what_a_texture_loses_is_noted() {
    let png = super::super::packing::png(&[1, 2, 3, 255], 1, 1, image::ExtendedColorType::Rgba8);
    let uri = format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(&png));
    let transform = json!({ "KHR_texture_transform": { "scale": [2, 2] } });
    let mut document = gltf_triangle(json!({
        "extensionsUsed": ["KHR_texture_transform"],
        "images": [{ "uri": uri, "name": "wood" }],
        "textures": [{ "source": 0 }],
        "materials": [{
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": transform } },
            "normalTexture": { "index": 0 },
            "emissiveFactor": [1, 1, 1],
        }],
    }));
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    let (scene, notes) = through(&load_gltf(&document));
    let image = scene.images().iter().next().unwrap().1;
    assert_eq!((image.name.as_deref(), image.data.as_deref()), (Some("wood"), Some(&png[..])));
    assert!(nth_material(&scene, 0).base_color_texture.is_some());
    for what in ["texture transforms", "normal maps", "emission of surfaces"] {
        assert_eq!(notes.iter().filter(|note| note.contains(what)).count(), 1, "{what}: {notes:?}");
    }
}

#[test]
fn a_rectangle_that_shines_is_a_light_with_the_same_front() {
    let points = [0.0f32, 0., 0., 2., 0., 0., 2., 1., 0., 0., 1., 0.];
    let bytes = [floats(&points), vec![0, 1, 2, 0, 2, 3]].concat();
    for (scale, corner) in [([1, 1, 1], [0.0, 0.0, 7.0]), ([-1, 1, 1], [-2.0, 0.0, 7.0])] {
        let document = gltf_triangle(json!({
            "extensionsUsed": ["KHR_materials_emissive_strength"],
            "nodes": [{ "name": "lamp", "mesh": 0, "translation": [0, 0, 7], "scale": scale }],
            "materials": [{
                "emissiveFactor": [1, 0.5, 0.25],
                "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 20 } },
            }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [2, 1, 0] },
                { "bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR" },
            ],
            "bufferViews": [{ "buffer": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 6 }],
            "buffers": [{ "byteLength": 54, "uri": data_uri(&bytes) }],
        }));
        let (scene, notes) = through(&load_gltf(&document));
        assert!(notes.iter().any(|note| note.contains("is a light in CRTS")), "{notes:?}");
        assert!(!notes.iter().any(|note| note.contains("emission of surfaces")), "{notes:?}");
        let node = nth_node(&scene, 0);
        assert_eq!((scene.nodes().len(), scene.materials().len()), (1, 1));
        assert_eq!(node.name.as_deref(), Some("lamp"));
        let light = crate::import::crts::lights::QuadLight::of_node(node).unwrap();
        assert_eq!((light.color, light.energy), ([1.0, 0.5, 0.25], 20.0));
        // Where its corners are, and which way its front looks.
        let map = node.transform.to_affine();
        let place = |p: &[f32; 3]| map.transform_point3(glam::Vec3::from(*p).as_dvec3());
        let points: Vec<glam::DVec3> = positions(&scene, 0).iter().map(place).collect();
        let low = points.iter().copied().reduce(glam::DVec3::min).unwrap();
        assert_eq!(low.to_array(), corner);
        let front = (points[1] - points[0]).cross(points[2] - points[0]).normalize();
        assert!((front - glam::DVec3::Z).length() < 1e-6, "{front}");
    }
}

#[test]
fn a_light_that_went_through_gltf_is_a_light_again() {
    let mut file = triangle();
    let matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 3.0, 4.0, 5.0, 1.0];
    file.add("objects", placed("LIGHT", matrix, json!({ "color": [1, 0.5, 0.25], "energy": 20, "size": [2, 3] })));
    file.add("objects", placed("CAMERA", matrix, json!({ "fov_y": 40 })));
    let first = file.load();
    let glb = gltf::to_glb(&first, &ExportOptions::default()).unwrap().document;
    let second = import_slice(glb, None, "a.glb", &ImportOptions::default()).unwrap().scene;
    assert_eq!(written(&second), written(&first));
    assert_eq!(said(&through(&second).0), said(&through(&first).0));
}
