//! Interpolation against values in closed form, targets one by one, and data that makes no sense.

use super::*;
use crate::Scene;
use crate::edit::{Edit, Facets};
use crate::export::gltf::object_text;
use crate::import::{ImportOptions, import_slice};
use crate::model::{AnimationId, MaterialId, NodeId, Store, Transform};
use crate::testing::documents::{data_uri, floats};
use crate::visit::pointer_index;
use serde_json::{Value as Json, json};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

/// A document whose buffer grows by accessors.
struct Maker {
    json: Json,
    bin: Vec<u8>,
}

impl Maker {
    fn new(members: Json) -> Self {
        let mut json = json!({"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []});
        members.as_object().unwrap().iter().for_each(|(key, value)| json[key] = value.clone());
        Self { json, bin: Vec::new() }
    }

    /// One node, moved by one sampler.
    fn moving(path: &str, interpolation: &str, times: &[f32], kind: &str, values: &[f32]) -> Self {
        let mut maker = Self::new(json!({"nodes": [{"translation": [7, 8, 9]}]}));
        let (input, output) = (maker.floats("SCALAR", times), maker.floats(kind, values));
        maker.json["animations"] = json!([{
            "samplers": [{"input": input, "output": output, "interpolation": interpolation}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}],
        }]);
        maker
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}));
        views.len() - 1
    }

    fn accessor(&mut self, accessor: Json) -> usize {
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(accessor);
        accessors.len() - 1
    }

    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let components = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let view = self.view(&floats(values));
        let count = values.len() / components;
        self.accessor(json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind}))
    }

    fn scene(mut self) -> Scene {
        self.json["buffers"] = json!([{"byteLength": self.bin.len(), "uri": data_uri(&self.bin)}]);
        import_slice(self.json.to_string(), None, "a.gltf", &ImportOptions::default()).unwrap().scene
    }
}

fn first(scene: &Scene) -> AnimationId {
    scene.animations().ids().next().unwrap()
}

fn evaluator(scene: &Scene) -> Evaluator {
    Evaluator::new(scene, first(scene), u64::MAX).unwrap()
}

fn node(i: usize) -> NodeId {
    Store::<NodeId, ()>::nth_id(i)
}

fn value(evaluator: &Evaluator, seconds: f64) -> [f64; 4] {
    evaluator.pose(seconds).values()[0].1.numbers()
}

fn assert_near(found: &[f64], expected: &[f64]) {
    let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(near && found.len() >= expected.len(), "{found:?} and {expected:?}");
}

#[test]
fn a_step_holds_each_key_until_the_next() {
    let keys = [1., 0., 0., 2., 0., 0., 3., 0., 0.];
    let scene = Maker::moving("translation", "STEP", &[1.0, 2.0, 4.0], "VEC3", &keys).scene();
    let e = evaluator(&scene);
    for (seconds, x) in [(-1.0, 1.0), (1.0, 1.0), (1.999, 1.0), (2.0, 2.0), (3.999, 2.0), (4.0, 3.0), (99.0, 3.0)] {
        assert_eq!(value(&e, seconds)[0], x, "at {seconds} s");
    }
    assert_eq!(e.duration(), 4.0);
}

#[test]
fn a_line_is_straight_between_keys_and_still_before_and_after() {
    let keys = [0., 10., 0., 4., 20., -8., 4., 0., 0.];
    let scene = Maker::moving("translation", "LINEAR", &[1.0, 2.0, 4.0], "VEC3", &keys).scene();
    let e = evaluator(&scene);
    assert_near(&value(&e, 0.0), &[0.0, 10.0, 0.0]);
    assert_near(&value(&e, 1.25), &[1.0, 12.5, -2.0]);
    assert_near(&value(&e, 2.0), &[4.0, 20.0, -8.0]);
    assert_near(&value(&e, 3.0), &[4.0, 10.0, -4.0]);
    assert_near(&value(&e, 4.5), &[4.0, 0.0, 0.0]);
}

#[test]
fn rotations_turn_evenly_and_the_short_way_round() {
    // From no rotation to a quarter turn about Y, whose quaternion is written with the other sign.
    let (s, c) = (FRAC_1_SQRT_2 as f32, FRAC_1_SQRT_2 as f32);
    let keys = [0., 0., 0., 1., 0., -s, 0., -c];
    let scene = Maker::moving("rotation", "LINEAR", &[0.0, 3.0], "VEC4", &keys).scene();
    let e = evaluator(&scene);
    for i in 0..=6 {
        let half = FRAC_PI_2 * f64::from(i) / 6.0 * 0.5;
        let found = value(&e, f64::from(i) * 0.5);
        let sign = found[3].signum();
        assert_near(&found.map(|v| v * sign), &[0.0, half.sin(), 0.0, half.cos()]);
    }
}

#[test]
fn equal_and_opposite_quaternions_stay_of_length_one() {
    let keys = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., -1., 1., 0., 0., 0.];
    let scene = Maker::moving("rotation", "LINEAR", &[0.0, 1.0, 2.0, 3.0], "VEC4", &keys).scene();
    let e = evaluator(&scene);
    for i in 0..=30 {
        let q = value(&e, f64::from(i) * 0.1);
        assert!((q.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-12, "{q:?}");
    }
}

#[test]
fn a_spline_goes_through_its_keys_with_its_tangents_scaled_by_time() {
    // Two keys, 2 s apart: in-tangent, value, out-tangent each. The first in-tangent and the last out-tangent do nothing.
    let (v0, b0, a1, v1) = (1.0f64, 3.0f64, -2.0f64, 5.0f64);
    let triple = |v: f64| [v as f32, 0.0, 0.0];
    let keys = [triple(99.0), triple(v0), triple(b0), triple(a1), triple(v1), triple(-99.0)].concat();
    let scene = Maker::moving("translation", "CUBICSPLINE", &[1.0, 3.0], "VEC3", &keys).scene();
    let e = evaluator(&scene);
    // The only cubic with these values and slopes at its ends, by its Bezier control points.
    let bezier = [v0, v0 + 2.0 * b0 / 3.0, v1 - 2.0 * a1 / 3.0, v1];
    for i in 0..=10 {
        let t = f64::from(i) / 10.0;
        let u = 1.0 - t;
        let weights = [u * u * u, 3.0 * u * u * t, 3.0 * u * t * t, t * t * t];
        let expected: f64 = bezier.iter().zip(weights).map(|(p, w)| p * w).sum();
        assert_near(&value(&e, 1.0 + 2.0 * t), &[expected, 0.0, 0.0]);
    }
    let slope = (value(&e, 1.0 + 1e-6)[0] - v0) / 1e-6;
    assert!((slope - b0).abs() < 1e-4, "{slope}");
    assert_near(&value(&e, 0.0), &[v0]);
    assert_near(&value(&e, 9.0), &[v1]);
}

#[test]
fn a_spline_of_rotations_is_of_length_one() {
    let (zero, s) = ([0.0f32; 4], FRAC_1_SQRT_2 as f32);
    let keys = [zero, [0., 0., 0., 1.], zero, zero, [0., s, 0., s], zero].concat();
    let scene = Maker::moving("rotation", "CUBICSPLINE", &[0.0, 1.0], "VEC4", &keys).scene();
    // Half-way the spline is the mean of the keys, and its direction that of an eighth of a turn.
    let eighth = FRAC_PI_2 * 0.25;
    assert_near(&value(&evaluator(&scene), 0.5), &[0.0, eighth.sin(), 0.0, eighth.cos()]);
}

#[test]
fn one_key_is_for_ever() {
    for interpolation in ["STEP", "LINEAR", "CUBICSPLINE"] {
        let values =
            if interpolation == "CUBICSPLINE" { vec![9., 9., 9., 1., 2., 3., 9., 9., 9.] } else { vec![1., 2., 3.] };
        let scene = Maker::moving("scale", interpolation, &[5.0], "VEC3", &values).scene();
        for seconds in [-1e30, 0.0, 5.0, 1e30] {
            assert_eq!(value(&evaluator(&scene), seconds)[..3], [1.0, 2.0, 3.0], "{interpolation}");
        }
    }
}

#[test]
fn normalised_integers_and_sparse_keys_are_decoded() {
    let mut maker = Maker::moving("rotation", "LINEAR", &[0.0, 1.0], "VEC4", &[0.; 8]);
    let shorts: Vec<u8> = [0i16, 0, 0, 32767, 0, 32767, 0, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let view = maker.view(&shorts);
    let output = maker
        .accessor(json!({"bufferView": view, "componentType": 5122, "normalized": true, "count": 2, "type": "VEC4"}));
    maker.json["animations"][0]["samplers"][0]["output"] = output.into();
    let scene = maker.scene();
    assert_near(&value(&evaluator(&scene), 0.5), &[0.0, FRAC_1_SQRT_2, 0.0, FRAC_1_SQRT_2]);

    let mut maker = Maker::moving("translation", "LINEAR", &[0.0, 1.0], "VEC3", &[0.; 6]);
    let (indices, values) = (maker.view(&[1]), maker.view(&floats(&[2.0, 4.0, 6.0])));
    let output = maker.accessor(json!({"componentType": 5126, "count": 2, "type": "VEC3", "sparse": {
        "count": 1, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values},
    }}));
    maker.json["animations"][0]["samplers"][0]["output"] = output.into();
    let scene = maker.scene();
    assert_near(&value(&evaluator(&scene), 0.5), &[1.0, 2.0, 3.0]);
}

/// A mesh of one triangle with as many morph targets.
fn morphed(maker: &mut Maker, targets: usize) {
    let positions = maker.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    maker.json["accessors"][positions]["min"] = json!([0, 0, 0]);
    maker.json["accessors"][positions]["max"] = json!([1, 1, 0]);
    maker.json["meshes"] = json!([{"weights": vec![0.25; targets], "primitives": [{
        "attributes": {"POSITION": positions},
        "targets": vec![json!({"POSITION": positions}); targets],
    }]}]);
    maker.json["nodes"][0]["mesh"] = 0.into();
}

#[test]
fn weights_have_one_number_for_each_target() {
    let keys = [0., 1., 2., 10., 11., 12.];
    let mut maker = Maker::moving("weights", "LINEAR", &[0.0, 1.0], "SCALAR", &keys);
    morphed(&mut maker, 3);
    let scene = maker.scene();
    let pose = evaluator(&scene).pose(0.5);
    assert_near(&Posed::new(&scene, &pose).weights(node(0)), &[5.0, 6.0, 7.0]);
    let rest = Pose::default();
    assert_eq!(Posed::new(&scene, &rest).weights(node(0)), [0.25; 3], "those of the mesh");

    // Two targets and a spline: tangents come for all targets before the values do.
    let keys = [9., 9., 1., 2., 0., 0., 0., 0., 3., 6., 9., 9.];
    let mut maker = Maker::moving("weights", "CUBICSPLINE", &[0.0, 1.0], "SCALAR", &keys);
    morphed(&mut maker, 2);
    let scene = maker.scene();
    let pose = evaluator(&scene).pose(0.5);
    assert_near(&Posed::new(&scene, &pose).weights(node(0)), &[2.0, 4.0]);
}

#[test]
fn what_a_pose_does_not_say_is_the_documents() {
    let scene = Maker::moving("scale", "LINEAR", &[0.0], "VEC3", &[2., 3., 4.]).scene();
    let pose = evaluator(&scene).pose(0.0);
    let local = Posed::new(&scene, &pose).local(node(0));
    assert_eq!(local.translation.to_array(), [7.0, 8.0, 9.0]);
    assert_eq!(local.matrix3.to_cols_array(), [2.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 4.0]);
}

#[test]
fn a_matrix_is_taken_apart_to_be_animated_unless_it_shears() {
    let mut maker = Maker::moving("translation", "LINEAR", &[0.0], "VEC3", &[1., 2., 3.]);
    maker.json["nodes"] = json!([{"matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 5, 5, 5, 1]}]);
    let sheared = json!([{"matrix": [1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}]);
    let mut refused = Maker { json: maker.json.clone(), bin: maker.bin.clone() };
    refused.json["nodes"] = sheared;
    let scene = maker.scene();
    let pose = evaluator(&scene).pose(0.0);
    let local = Posed::new(&scene, &pose).local(node(0));
    assert_near(&local.to_cols_array(), &[0., 2., 0., -2., 0., 0., 0., 0., 2., 1., 2., 3.]);
    let scene = refused.scene();
    let error = Evaluator::new(&scene, first(&scene), u64::MAX).unwrap_err();
    assert!(error.place == "/animations/0/channels/0/target" && error.what.contains("shears"), "{error}");
}

/// Everything that pointers may name, each with the numbers that a key of it holds.
fn pointed() -> (Maker, Vec<(&'static str, usize)>) {
    let info = json!({"index": 0, "extensions": {"KHR_texture_transform": {}}});
    let mut maker = Maker::new(json!({
        "nodes": [{}],
        "images": [{"uri": "data:image/png;base64,"}],
        "textures": [{"source": 0}],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}},
            {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 9}},
        ],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}},
        "materials": [{
            "normalTexture": info, "occlusionTexture": info, "emissiveTexture": info,
            "pbrMetallicRoughness": {"baseColorTexture": info, "metallicRoughnessTexture": info},
            "extensions": {
                "KHR_materials_emissive_strength": {}, "KHR_materials_ior": {}, "KHR_materials_dispersion": {},
                "KHR_materials_clearcoat": {"clearcoatNormalTexture": info, "clearcoatTexture": info},
                "KHR_materials_transmission": {"transmissionTexture": info},
                "KHR_materials_diffuse_transmission": {},
                "KHR_materials_volume": {}, "KHR_materials_specular": {"specularColorTexture": info},
                "KHR_materials_sheen": {"sheenColorTexture": info}, "KHR_materials_iridescence": {},
                "KHR_materials_anisotropy": {"anisotropyTexture": info},
            },
        }],
    }));
    let pointers = vec![
        ("/nodes/0/translation", 3),
        ("/nodes/0/rotation", 4),
        ("/nodes/0/scale", 3),
        ("/nodes/0/weights", 2),
        ("/nodes/0/weights/1", 1),
        ("/nodes/0/extensions/KHR_node_visibility/visible", 1),
        ("/meshes/0/weights", 2),
        ("/cameras/0/perspective/yfov", 1),
        ("/cameras/0/perspective/zfar", 1),
        ("/cameras/0/perspective/aspectRatio", 1),
        ("/cameras/1/orthographic/xmag", 1),
        ("/extensions/KHR_lights_punctual/lights/0/color", 3),
        ("/extensions/KHR_lights_punctual/lights/0/intensity", 1),
        ("/extensions/KHR_lights_punctual/lights/0/range", 1),
        ("/extensions/KHR_lights_punctual/lights/0/spot/innerConeAngle", 1),
        ("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", 1),
        ("/materials/0/alphaCutoff", 1),
        ("/materials/0/emissiveFactor", 3),
        ("/materials/0/normalTexture/scale", 1),
        ("/materials/0/occlusionTexture/strength", 1),
        ("/materials/0/pbrMetallicRoughness/baseColorFactor", 4),
        ("/materials/0/pbrMetallicRoughness/metallicFactor", 1),
        ("/materials/0/pbrMetallicRoughness/roughnessFactor", 1),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset", 2),
        ("/materials/0/normalTexture/extensions/KHR_texture_transform/rotation", 1),
        ("/materials/0/extensions/KHR_materials_clearcoat/clearcoatTexture/extensions/KHR_texture_transform/scale", 2),
        ("/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength", 1),
        ("/materials/0/extensions/KHR_materials_ior/ior", 1),
        ("/materials/0/extensions/KHR_materials_dispersion/dispersion", 1),
        ("/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor", 1),
        ("/materials/0/extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", 1),
        ("/materials/0/extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale", 1),
        ("/materials/0/extensions/KHR_materials_transmission/transmissionFactor", 1),
        ("/materials/0/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", 1),
        ("/materials/0/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", 3),
        ("/materials/0/extensions/KHR_materials_volume/thicknessFactor", 1),
        ("/materials/0/extensions/KHR_materials_volume/attenuationDistance", 1),
        ("/materials/0/extensions/KHR_materials_volume/attenuationColor", 3),
        ("/materials/0/extensions/KHR_materials_specular/specularFactor", 1),
        ("/materials/0/extensions/KHR_materials_specular/specularColorFactor", 3),
        ("/materials/0/extensions/KHR_materials_sheen/sheenColorFactor", 3),
        ("/materials/0/extensions/KHR_materials_sheen/sheenRoughnessFactor", 1),
        ("/materials/0/extensions/KHR_materials_iridescence/iridescenceFactor", 1),
        ("/materials/0/extensions/KHR_materials_iridescence/iridescenceIor", 1),
        ("/materials/0/extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", 1),
        ("/materials/0/extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", 1),
        ("/materials/0/extensions/KHR_materials_anisotropy/anisotropyStrength", 1),
        ("/materials/0/extensions/KHR_materials_anisotropy/anisotropyRotation", 1),
    ];
    morphed(&mut maker, 2);
    (maker, pointers)
}

/// The pointer channels of a document: each goes from 0.2 to 0.6 (in all its numbers) in a second.
fn point(maker: &mut Maker, pointers: &[(&str, usize)]) {
    let times = maker.floats("SCALAR", &[0.0, 1.0]);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for &(pointer, width) in pointers {
        let weights = pointer.ends_with("weights");
        let kind = if weights { "SCALAR" } else { ["SCALAR", "VEC2", "VEC3", "VEC4"][width - 1] };
        let output = maker.floats(kind, &[vec![0.2; width], vec![0.6; width]].concat());
        let interpolation = if pointer.ends_with("visible") { "STEP" } else { "LINEAR" };
        samplers.push(json!({"input": times, "output": output, "interpolation": interpolation}));
        channels.push(json!({"sampler": samplers.len() - 1, "target":
            {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}}));
    }
    maker.json["animations"] = json!([{"samplers": samplers, "channels": channels}]);
}

/// What a JSON pointer leads to in the document that a scene is written as.
fn saved(scene: &Scene, pointer: &str) -> Json {
    let (kind, index, path) = pointer_index(pointer).unwrap();
    let id = scene.id_in_slot(kind, index).unwrap();
    let object: Json = serde_json::from_slice(&object_text(scene, id).unwrap()).unwrap();
    object.pointer(path).cloned().unwrap_or(Json::Null)
}

#[test]
fn every_pointer_leads_to_the_property_that_it_names_and_to_no_other() {
    let (mut maker, pointers) = pointed();
    point(&mut maker, &pointers);
    let scene = maker.scene();
    let e = evaluator(&scene);
    assert_eq!(e.warnings(), []);
    assert_eq!(e.pose(0.5).values().len(), pointers.len());
    // Each by itself, seen in the document that the posed object would be saved as.
    for &(pointer, width) in
        pointers.iter().filter(|(pointer, _)| !pointer.starts_with("/nodes") && !pointer.ends_with("weights"))
    {
        let (mut maker, _) = pointed();
        point(&mut maker, &[(pointer, width)]);
        let mut scene = maker.scene();
        let before = saved(&scene, pointer);
        let pose = evaluator(&scene).pose(0.5);
        let posed = Posed::new(&scene, &pose);
        let (material, light) = (posed.material(first_of(scene.materials())), posed.light(first_of(scene.lights())));
        let cameras: Vec<_> = scene.cameras().ids().map(|id| (id, posed.camera(id).into_owned())).collect();
        let (material, light) = (material.into_owned(), light.into_owned());
        scene.materials.values_mut().for_each(|slot| *slot = material.clone());
        scene.lights.values_mut().for_each(|slot| *slot = light.clone());
        for (id, camera) in cameras {
            *scene.cameras.get_mut(id).unwrap() = camera;
        }
        let after = saved(&scene, pointer);
        // What has a lower bound of 1 is clamped to it.
        let expected = if pointer.ends_with("iridescenceIor") { 1.0 } else { 0.4 };
        let numbers = match &after {
            Json::Array(numbers) => numbers.clone(),
            number => vec![number.clone()],
        };
        assert_eq!(numbers.len(), width, "{pointer}: {after}");
        assert!(
            numbers.iter().all(|n| n.as_f64().is_some_and(|n| (n - expected).abs() < 1e-6)),
            "{pointer}: {before} became {after}"
        );
    }
}

fn first_of<K: crate::model::Id, V>(store: &Store<K, V>) -> K {
    store.ids().next().unwrap()
}

#[test]
fn a_pointer_to_nothing_that_is_played_is_one_warning_by_name() {
    let (mut maker, _) = pointed();
    maker.json["nodes"][0]["extensions"] = json!({"KHR_node_selectability": {"selectable": true}});
    let nothing = [
        ("/nodes/0/extensions/KHR_node_selectability/selectable", 1),
        ("/materials/0/emissiveTexture/offset", 1),
        (
            "/materials/0/extensions/KHR_materials_sheen/sheenRoughnessTexture/extensions/KHR_texture_transform/offset",
            2,
        ),
        ("/cameras/1/perspective/yfov", 1),
        ("/nodes/0/weights/2", 1),
        ("/nodes/0/translation", 3),
    ];
    point(&mut maker, &nothing);
    let scene = maker.scene();
    let e = evaluator(&scene);
    assert_eq!(e.pose(0.0).values().len(), 1);
    let warnings: Vec<String> = e.warnings().iter().map(ToString::to_string).collect();
    assert_eq!(warnings.len(), 5, "{warnings:?}");
    for (i, warning) in warnings.iter().enumerate() {
        assert!(warning.starts_with(&format!("/animations/0/channels/{i}/target: ")), "{warning}");
    }
    assert!(warnings[0].contains("KHR_node_selectability"), "{}", warnings[0]);
}

#[test]
fn of_two_channels_for_one_property_the_last_is_played_and_said() {
    let mut maker = Maker::moving("translation", "LINEAR", &[0.0], "VEC3", &[1., 2., 3.]);
    let other = maker.floats("VEC3", &[4., 5., 6.]);
    let samplers = maker.json["animations"][0]["samplers"].as_array_mut().unwrap();
    let input = samplers[0]["input"].clone();
    samplers.push(json!({"input": input, "output": other}));
    let channels = maker.json["animations"][0]["channels"].as_array_mut().unwrap();
    channels.push(json!({"sampler": 1, "target": {"node": 0, "path": "translation"}}));
    let scene = maker.scene();
    let e = evaluator(&scene);
    assert_eq!(value(&e, 0.0)[..3], [4.0, 5.0, 6.0]);
    assert_eq!(e.warnings().len(), 1);
}

#[test]
fn data_that_makes_no_sense_is_refused_with_its_place_and_a_remedy() {
    let refused = |maker: Maker, place: &str, what: &str| {
        let scene = maker.scene();
        let error = Evaluator::new(&scene, first(&scene), 1 << 20).unwrap_err();
        assert_eq!(error.place, place, "{error}");
        assert!(error.what.contains(what) && !error.remedy.is_empty(), "{error}");
    };
    let moving = |times: &[f32], values: &[f32]| Maker::moving("translation", "LINEAR", times, "VEC3", values);
    let (input, output) = ("/animations/0/samplers/0/input", "/animations/0/samplers/0/output");
    refused(moving(&[0.0, 1.0, 1.0], &[0.; 9]), input, "time 2 is 1");
    refused(moving(&[0.0, 2.0, 1.0], &[0.; 9]), input, "time 2 is 1, and the one before it 2");
    refused(moving(&[f32::NAN], &[0.; 3]), input, "NaN");
    refused(moving(&[0.0, 1.0], &[0.; 9]), output, "3 values for 2 keys");
    refused(moving(&[0.0, 1.0], &[0., 0., 0., 0., f32::INFINITY, 0.]), output, "key 1 is inf");
    refused(Maker::moving("rotation", "LINEAR", &[0.0], "VEC3", &[0.; 3]), output, "3 numbers");
    refused(Maker::moving("translation", "LINEAR", &[0.0], "SCALAR", &[0.; 3]), output, "3");
    refused(Maker::moving("translation", "CUBICSPLINE", &[0.0, 1.0], "VEC3", &[0.; 6]), output, "1 numbers");
    let mut morph = Maker::moving("weights", "LINEAR", &[0.0, 1.0], "SCALAR", &[0.; 6]);
    morphed(&mut morph, 2);
    refused(morph, output, "3 numbers where its mesh's morph targets need 2");
    let mut large = moving(&[0.0], &[0.; 3]);
    let zeros = large.accessor(json!({"componentType": 5126, "count": 1_000_000, "type": "SCALAR"}));
    large.json["animations"][0]["samplers"][0]["input"] = zeros.into();
    refused(large, input, "over the limit of 1048576");
    let (mut maker, _) = pointed();
    point(&mut maker, &[("/nodes/0/extensions/KHR_node_visibility/visible", 1)]);
    maker.json["animations"][0]["samplers"][0]["interpolation"] = "LINEAR".into();
    refused(maker, output, "interpolated");
}

#[test]
fn a_sampler_without_keys_is_refused() {
    // No file can say this (a count is at least 1), but a document that was made otherwise can.
    let mut scene = Maker::moving("translation", "LINEAR", &[0.0], "VEC3", &[0.; 3]).scene();
    scene.accessors.values_mut().for_each(|accessor| accessor.count = 0);
    let error = Evaluator::new(&scene, first(&scene), u64::MAX).unwrap_err();
    assert!(error.place.ends_with("/input") && error.what.contains("no keys"), "{error}");
}

#[test]
fn a_player_makes_an_animation_ready_again_only_when_an_edit_has_changed_it() {
    let mut maker = Maker::moving("translation", "LINEAR", &[0.0, 1.0], "VEC3", &[0., 0., 0., 1., 1., 1.]);
    maker.json["nodes"].as_array_mut().unwrap().push(json!({}));
    let mut scene = maker.scene();
    let animation = first(&scene);
    let mut player = AnimationPlayer::new(u64::MAX);
    for i in 0..10 {
        player.pose(&scene, animation, f64::from(i) * 0.1).unwrap();
        let transform = Transform::Trs { translation: [f64::from(i); 3], rotation: [0., 0., 0., 1.], scale: [1.; 3] };
        scene.apply(Edit::SetTransform { node: node(0), transform }).unwrap();
    }
    assert_eq!(player.evaluators_made(), 1, "a transform below the pose is not of the animation");
    let made = scene.apply(Edit::Duplicate { node: node(0) }).unwrap().made;
    let pose = player.pose(&scene, animation, 1.0).unwrap();
    assert_eq!((player.evaluators_made(), pose.values().len()), (2, 2), "the copy is moved too");
    let Some(crate::model::AnyId::Node(copy)) = made else { panic!("a copy") };
    assert_eq!(Posed::new(&scene, &pose).local(copy).translation.to_array(), [1.0; 3]);
    let deleted = scene.apply(Edit::Delete { node: copy }).unwrap();
    assert_eq!(player.pose(&scene, animation, 1.0).unwrap().values().len(), 1);
    scene.apply(deleted.inverse).unwrap();
    assert_eq!(player.pose(&scene, animation, 1.0).unwrap(), pose);
    let gone = [node(0), copy].map(|node| scene.apply(Edit::Delete { node }).unwrap());
    assert!(player.pose(&scene, animation, 1.0).unwrap_err().what.contains("no such animation"));
    for edit in gone.into_iter().rev() {
        scene.apply(edit.inverse).unwrap();
    }
    assert_eq!(player.pose(&scene, animation, 1.0).unwrap(), pose);
}

#[test]
fn poses_differ_where_their_values_do() {
    let (mut maker, _) = pointed();
    point(
        &mut maker,
        &[
            ("/nodes/0/translation", 3),
            ("/nodes/0/extensions/KHR_node_visibility/visible", 1),
            ("/materials/0/pbrMetallicRoughness/metallicFactor", 1),
        ],
    );
    let scene = maker.scene();
    let e = evaluator(&scene);
    let (a, b) = (e.pose(0.1), e.pose(0.2));
    let material: MaterialId = first_of(scene.materials());
    // Visibility has not changed between the keys.
    let expected = [(node(0).into(), Facets::TRANSFORM), (material.into(), Facets::CONTENT)];
    assert_eq!(a.difference(&b, &scene).objects(), expected);
    assert!(a.difference(&a.clone(), &scene).is_empty());
    let all = [(node(0).into(), Facets::TRANSFORM | Facets::VISIBILITY), (material.into(), Facets::CONTENT)];
    for (from, to) in [(&a, &Pose::default()), (&Pose::default(), &a)] {
        let mut changes = from.difference(to, &scene);
        changes.compact();
        assert_eq!(changes.objects(), all);
    }
    let empty = Maker::new(json!({})).scene();
    assert!(a.difference(&b, &empty).is_empty(), "of objects that are gone nothing is said");
}
