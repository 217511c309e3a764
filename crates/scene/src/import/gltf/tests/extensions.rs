use super::*;
use crate::model::*;

fn material(material: Value) -> Material {
    let doc = document(json!({
        "images": [{ "uri": "data:image/png;base64,iVBORw==" }],
        "textures": [{}, { "source": 0 }],
        "materials": [material],
    }));
    load(&doc).materials().iter().next().unwrap().1.clone()
}

fn extension(name: &str, value: Value) -> Material {
    material(json!({ "extensions": { name: value } }))
}

#[test]
fn the_core_material_has_its_defaults_and_its_values() {
    assert_eq!(material(json!({})), Material::default());
    let m = material(json!({
        "name": "m",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
            "metallicFactor": 0.5,
            "roughnessFactor": 0.6,
            "metallicRoughnessTexture": { "index": 1, "texCoord": 1 },
        },
        "normalTexture": { "index": 0, "scale": 0.7 },
        "occlusionTexture": { "index": 0, "strength": 0.8 },
        "emissiveTexture": { "index": 0 },
        "emissiveFactor": [0.1, 0.2, 0.3],
        "alphaMode": "MASK",
        "alphaCutoff": 0.9,
        "doubleSided": true,
    }));
    assert_eq!((m.base_color, m.metallic, m.roughness), ([0.1, 0.2, 0.3, 0.4], 0.5, 0.6));
    assert_eq!(m.metallic_roughness_texture.unwrap().tex_coord, 1);
    assert_eq!((m.normal_texture.unwrap().scale, m.occlusion_texture.unwrap().scale), (0.7, 0.8));
    assert_eq!((m.alpha_mode, m.alpha_cutoff, m.double_sided), (AlphaMode::Mask, Some(0.9), true));
    assert_eq!((m.emissive, m.emissive_texture.unwrap().scale), ([0.1, 0.2, 0.3], 1.0));
}

#[test]
fn scalar_extensions_have_their_defaults() {
    assert!(extension("KHR_materials_unlit", json!({})).unlit);
    assert_eq!(extension("KHR_materials_ior", json!({})).ior, Some(1.5));
    assert_eq!(extension("KHR_materials_ior", json!({ "ior": 1.2 })).ior, Some(1.2));
    let strength = extension("KHR_materials_emissive_strength", json!({ "emissiveStrength": 5 }));
    assert_eq!(strength.emissive_strength, Some(5.0));
    assert_eq!(extension("KHR_materials_dispersion", json!({ "dispersion": 0.1 })).dispersion, Some(0.1));
}

#[test]
fn lobe_extensions_have_their_values_and_defaults() {
    let m = extension(
        "KHR_materials_clearcoat",
        json!({ "clearcoatFactor": 0.5, "clearcoatNormalTexture": { "index": 0, "scale": 2 } }),
    );
    let coat = m.clearcoat.unwrap();
    assert_eq!((coat.factor, coat.roughness, coat.normal_texture.unwrap().scale), (0.5, 0.0, 2.0));
    let m = extension(
        "KHR_materials_transmission",
        json!({ "transmissionFactor": 0.5, "transmissionTexture": { "index": 1 } }),
    );
    assert!(m.transmission.is_some_and(|t| t.factor == 0.5 && t.texture.is_some()));
    let m = extension("KHR_materials_diffuse_transmission", json!({ "diffuseTransmissionFactor": 0.5 }));
    assert!(m.diffuse_transmission.is_some_and(|d| d.factor == 0.5 && d.color == [1.0; 3]));
    let m = extension("KHR_materials_volume", json!({ "thicknessFactor": 2, "attenuationColor": [0.1, 0.2, 0.3] }));
    let volume = m.volume.unwrap();
    assert_eq!((volume.thickness, volume.attenuation_distance), (2.0, None));
    assert_eq!(volume.attenuation_color, [0.1, 0.2, 0.3]);
    let m = extension("KHR_materials_specular", json!({ "specularColorFactor": [2, 1, 1] }));
    assert!(m.specular.is_some_and(|s| s.factor == 1.0 && s.color == [2.0, 1.0, 1.0]));
    let m = extension("KHR_materials_sheen", json!({ "sheenColorFactor": [1, 0, 0], "sheenRoughnessFactor": 0.4 }));
    assert!(m.sheen.is_some_and(|s| s.color == [1.0, 0.0, 0.0] && s.roughness == 0.4));
    let m = extension("KHR_materials_iridescence", json!({ "iridescenceFactor": 1 }));
    let film = m.iridescence.unwrap();
    assert_eq!((film.ior, film.thickness_minimum, film.thickness_maximum), (1.3, 100.0, 400.0));
    let m = extension("KHR_materials_anisotropy", json!({ "anisotropyStrength": 0.6, "anisotropyRotation": 1.5 }));
    assert!(m.anisotropy.is_some_and(|a| a.strength == 0.6 && a.rotation == 1.5));
}

#[test]
fn a_texture_transform_is_part_of_the_reference() {
    let m = material(json!({ "pbrMetallicRoughness": { "baseColorTexture": {
        "index": 1, "texCoord": 0,
        "extensions": { "KHR_texture_transform": { "offset": [1, 2], "rotation": 3, "texCoord": 1, "extras": 5 }, "X": 1 },
    } } }));
    let info = m.base_color_texture.unwrap();
    let transform = info.transform.unwrap();
    assert_eq!((transform.offset, transform.rotation, transform.scale), ([1.0, 2.0], 3.0, [1.0; 2]));
    assert_eq!((info.tex_coord, transform.tex_coord), (0, Some(1)));
    assert_eq!(transform.extra.extras.as_deref(), Some(&json!(5)));
    assert_eq!(info.extra.extensions.unwrap().keys().collect::<Vec<_>>(), ["X"]);
}

#[test]
fn what_a_modelled_extension_carries_besides_is_kept_under_its_name() {
    let m = extension("KHR_materials_unlit", json!({ "extras": { "a": 1 } }));
    assert!(m.unlit);
    assert_eq!(m.extra.extensions.unwrap()["KHR_materials_unlit"], json!({ "extras": { "a": 1 } }));
    assert_eq!(extension("KHR_materials_unlit", json!({})).extra, Extra::default());
}

#[test]
fn unrendered_lobes_are_those_that_would_be_seen() {
    let lobes = |extensions: Value| {
        load(&document(json!({ "materials": [{}, { "extensions": extensions }] }))).unrendered_lobes()
    };
    assert!(lobes(json!({ "KHR_materials_ior": { "ior": 1.1 }, "KHR_materials_unlit": {} })).is_empty());
    assert!(
        lobes(json!({ "KHR_materials_clearcoat": { "clearcoatFactor": 0 }, "KHR_materials_specular": {} })).is_empty()
    );
    let two = lobes(json!({
        "KHR_materials_transmission": { "transmissionFactor": 1 },
        "KHR_materials_clearcoat": { "clearcoatFactor": 0.1 },
    }));
    assert_eq!(two, ["KHR_materials_clearcoat", "KHR_materials_transmission"]);
}

#[test]
fn lights_hang_at_nodes() {
    let scene = load(&document(json!({
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "directional", "color": [1, 0.5, 0], "intensity": 3 },
            { "type": "spot", "range": 5, "spot": { "innerConeAngle": 0.1, "extras": 1 } },
        ] } },
        "nodes": [{ "extensions": { "KHR_lights_punctual": { "light": 1 } } }],
    })));
    let lights: Vec<&Light> = scene.lights().iter().map(|(_, l)| l).collect();
    assert_eq!((lights[0].color, lights[0].intensity, lights[0].kind), ([1.0, 0.5, 0.0], 3.0, LightKind::Directional));
    let cone = LightKind::Spot { inner_cone_angle: 0.1, outer_cone_angle: std::f64::consts::FRAC_PI_4 };
    assert_eq!((lights[1].kind, lights[1].range, lights[1].intensity), (cone, Some(5.0), 1.0));
    assert_eq!(lights[1].spot_extra.extras.as_deref(), Some(&json!(1)));
    let node = scene.nodes().iter().next().unwrap().1;
    assert_eq!((node.light, &node.extra), (scene.lights().ids().nth(1), &Extra::default()));
}

#[test]
fn visibility_instancing_and_variants_are_typed() {
    let mut doc = triangle_with(
        "/nodes/0/extensions",
        json!({
            "KHR_node_visibility": { "visible": false },
            "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0, "_ID": 1 } },
        }),
    );
    merge(
        &mut doc,
        json!({
            "materials": [{}],
            "extensions": { "KHR_materials_variants": { "variants": [{ "name": "red" }, { "name": "blue" }] } },
        }),
    );
    let mappings = json!([{ "material": 0, "variants": [1], "name": "m" }]);
    let doc =
        with(doc, "/meshes/0/primitives/0/extensions", json!({ "KHR_materials_variants": { "mappings": mappings } }));
    let scene = load(&doc);
    let node = scene.nodes().iter().next().unwrap().1;
    assert_eq!(node.visible, Some(false));
    let accessors: Vec<AccessorId> = scene.accessors().ids().collect();
    let instancing = node.instancing.as_ref().unwrap();
    assert_eq!((instancing.translation, instancing.scale), (Some(accessors[0]), None));
    assert_eq!(instancing.custom, [("_ID".to_owned(), accessors[1])]);
    assert_eq!(scene.variants().iter().map(|(_, v)| v.name.as_str()).collect::<Vec<_>>(), ["red", "blue"]);
    let mapping = &scene.meshes().iter().next().unwrap().1.primitives[0].variants[0];
    assert_eq!(mapping.variants, [scene.variants().ids().nth(1).unwrap()]);
    assert_eq!(mapping.material, scene.materials().ids().next().unwrap());
}

#[test]
fn a_required_extension_that_is_not_supported_is_refused_by_name() {
    let message = refusal(&document(json!({ "extensionsRequired": ["KHR_materials_unlit", "VENDOR_new"] })));
    assert!(message.starts_with("a.gltf: /extensionsRequired/1: "), "{message}");
    assert!(message.contains("VENDOR_new"), "{message}");
}

#[test]
fn specular_and_glossiness_are_kept_and_can_be_read() {
    let name = "KHR_materials_pbrSpecularGlossiness";
    let transform = json!({ "KHR_texture_transform": { "scale": [2, 3], "texCoord": 1 } });
    let given = json!({
        "diffuseFactor": [0.5, 0.25, 0.125, 0.75],
        "specularGlossinessTexture": { "index": 1, "texCoord": 2, "extensions": transform },
        "glossinessFactor": 0.25,
    });
    let doc = document(json!({
        "extensionsUsed": [name, "KHR_texture_transform"],
        "extensionsRequired": [name],
        "images": [{ "uri": "data:image/png;base64,iVBORw==" }],
        "textures": [{ "source": 0 }, { "source": 0 }],
        "materials": [{ "extensions": { name: given } }, {}],
    }));
    assert_eq!(warnings(&doc), Vec::<String>::new());
    let scene = load(&doc);
    let material = scene.materials().iter().next().unwrap().1;
    assert_eq!(material.extra.extensions.as_ref().unwrap()[name], given);
    let read = SpecularGlossiness::of(material).unwrap();
    assert_eq!((read.diffuse, read.specular, read.glossiness), ([0.5, 0.25, 0.125, 0.75], [1.0; 3], 0.25));
    assert!(read.diffuse_texture.is_none());
    let texture = read.texture.unwrap();
    assert_eq!(Some(texture.texture), scene.textures().ids().nth(1));
    let transform = texture.transform.unwrap();
    assert_eq!((texture.tex_coord, transform.scale, transform.tex_coord), (2, [2.0, 3.0], Some(1)));
    assert!(SpecularGlossiness::of(scene.materials().iter().nth(1).unwrap().1).is_none());
}

#[test]
fn metadata_packets_are_kept_with_what_refers_to_them() {
    let packet = json!({ "@context": { "dc": "http://purl.org/dc/elements/1.1/" }, "dc:title": { "@list": ["x"] } });
    let doc = document(json!({
        "asset": { "version": "2.0", "extensions": { "KHR_xmp_json_ld": { "packet": 1 } } },
        "extensionsUsed": ["KHR_xmp_json_ld"],
        "extensions": { "KHR_xmp_json_ld": { "packets": [{}, packet] } },
        "nodes": [{ "extensions": { "KHR_xmp_json_ld": { "packet": 0 } } }],
    }));
    assert_eq!(warnings(&doc), Vec::<String>::new());
    let scene = load(&doc);
    assert_eq!(scene.packets().iter().map(|(_, p)| p.0.clone()).collect::<Vec<_>>(), [json!({}), packet]);
    let second: AnyId = scene.packets().ids().nth(1).unwrap().into();
    assert_eq!(scene.asset().extra.links().iter().map(|link| link.target).collect::<Vec<_>>(), [second]);
    let files = crate::export::gltf::to_gltf(&scene, "a", &crate::export::ExportOptions::default()).unwrap();
    let written: Value = serde_json::from_slice(&files.document).unwrap();
    for at in ["/asset/extensions", "/extensions", "/nodes/0/extensions", "/extensionsUsed"] {
        assert_eq!(written.pointer(at), doc.pointer(at), "{at}");
    }
}

#[test]
fn an_unknown_optional_extension_is_a_warning_by_name() {
    let list = warnings(&document(json!({ "extensionsUsed": ["KHR_materials_sheen", "VENDOR_new"] })));
    assert_eq!(list, ["/extensionsUsed/1: extension VENDOR_new is not known; its data is kept, but has no effect"]);
}

#[test]
fn a_texture_whose_image_is_only_in_an_unsupported_form_has_none() {
    let doc = document(json!({
        "extensionsUsed": ["EXT_texture_avif"],
        "images": [{ "uri": "data:image/gif;base64,R0lGODlh" }],
        "textures": [{ "extensions": { "EXT_texture_avif": { "source": 0 } } }, { "source": 0 }],
    }));
    let imported = import(&doc).unwrap();
    let sources: Vec<bool> = imported.scene.textures().iter().map(|(_, t)| t.source.is_some()).collect();
    assert_eq!(sources, [false, true]);
    let list: Vec<String> = imported.warnings.iter().map(ToString::to_string).collect();
    assert!(list[1].starts_with("/textures/0: its image is only given by EXT_texture_avif"), "{list:?}");
    assert!(list[2].starts_with("/textures/1/source: the image is image/gif"), "{list:?}");
}

#[test]
fn a_texture_shows_the_form_of_an_extension_and_keeps_the_core_one() {
    let png = "data:image/png;base64,iVBORw0KGgo=";
    let webp = "data:image/webp;base64,UklGRgAAAABXRUJQ";
    let ktx2 = "data:image/ktx2;base64,q0tUWCAyMLsNChoK";
    let dds = "data:image/vnd-ms.dds;base64,RERTIHwAAAA=";
    let texture = |name: &str, source: usize| json!({ "source": 0, "extensions": { name: { "source": source } } });
    let doc = document(json!({
        "extensionsUsed": ["EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds"],
        "extensionsRequired": ["EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds"],
        "images": [{ "uri": png }, { "uri": webp }, { "uri": ktx2 }, { "uri": dds }, { "uri": "data:image/webp;base64,!" }],
        "textures": [
            texture("EXT_texture_webp", 1),
            texture("KHR_texture_basisu", 2),
            texture("MSFT_texture_dds", 3),
            texture("EXT_texture_webp", 4),
            { "extensions": { "KHR_texture_basisu": { "source": 2, "extras": 7 } } },
            texture("MSFT_texture_dds", 9),
        ],
    }));
    let imported = import(&doc).unwrap();
    let scene = imported.scene;
    let best = |t: &Texture| t.best_source(scene.images()).map(Store::<ImageId, Image>::slot);
    let slots: Vec<_> = scene.textures().iter().map(|(_, t)| best(t)).collect();
    assert_eq!(slots, [Some(1), Some(2), Some(3), Some(0), Some(2), Some(0)]);
    let textures: Vec<_> = scene.textures().iter().map(|(_, t)| t).collect();
    assert!(textures.iter().take(4).all(|t| t.source == textures[5].source));
    assert_eq!(textures[1].alternatives.basisu, textures[4].alternatives.basisu);
    assert_eq!(textures[4].extra.extensions.as_ref().unwrap()["KHR_texture_basisu"], json!({ "extras": 7 }));
    let list: Vec<String> = imported.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(list.len(), 2, "{list:?}");
    assert!(list[0].starts_with("/images/4/uri: "), "{list:?}");
    assert!(list[1].starts_with("/textures/5/extensions/MSFT_texture_dds/source: there is no such image"), "{list:?}");
}
