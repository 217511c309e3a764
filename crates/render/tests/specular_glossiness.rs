//! KHR_materials_pbrSpecularGlossiness, as rows of metallic and roughness.

#[allow(dead_code, reason = "shared by test binaries that need different parts of it")]
mod common;

use common::Document;
use image::ImageEncoder;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::batch::SceneBatch;
use orthant_resident::image::{ImageData, TexelFormat};
use orthant_resident::rows::{MaterialRow, NONE, TextureSlot};
use orthant_scene::Scene;
use orthant_scene::animation::Pose;
use orthant_scene::edit::script::{Operation, Session};
use orthant_scene::import::{ImportOptions, import_slice};
use orthant_scene::model::metallic_roughness;
use serde_json::{Value, json};

const NAME: &str = "KHR_materials_pbrSpecularGlossiness";

fn png(width: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut out = Vec::new();
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(texels.as_flattened(), width, texels.len() as u32 / width, image::ExtendedColorType::Rgba8)
        .expect("PNG is written to memory");
    out
}

/// A document of one material, whose images are a view each.
fn scene(extension: Value, images: &[Vec<u8>]) -> Scene {
    let mut document = Document::new(json!({
        "extensionsUsed": [NAME, "KHR_texture_transform"],
        "materials": [{ "pbrMetallicRoughness": { "metallicFactor": 0.5 }, "extensions": { NAME: extension } }],
    }));
    let views: Vec<usize> = images.iter().map(|bytes| document.bytes(bytes)).collect();
    let image = |&view: &usize| json!({ "bufferView": view, "mimeType": "image/png" });
    document.json["images"] = views.iter().map(image).collect();
    document.json["textures"] = (0..views.len()).map(|i| json!({ "source": i })).collect();
    import_slice(document.glb(), None, "a.glb", &ImportOptions::default()).expect("valid").scene
}

fn derive(extension: Value, images: &[Vec<u8>]) -> (DerivedScene, SceneBatch) {
    let scene = scene(extension, images);
    let mut derived = DerivedScene::derive(&scene, &DeriveOptions::default()).expect("derived");
    let batch = derived.load_batch();
    (derived, batch)
}

fn row(derived: &DerivedScene) -> &MaterialRow {
    &derived.materials[1]
}

fn image<'b>(derived: &DerivedScene, batch: &'b SceneBatch, slot: &TextureSlot) -> &'b ImageData {
    let image = derived.textures[slot.texture as usize].image;
    batch.images.iter().find(|write| write.slot == image).and_then(|write| write.image.as_deref()).expect("an image")
}

fn srgb(byte: u8) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn factors_alone_are_converted() {
    let given = json!({
        "diffuseFactor": [0.25, 0.25, 0.25, 0.5], "specularFactor": [0.5, 0.5, 0.5], "glossinessFactor": 0.75,
    });
    let (derived, _) = derive(given, &[]);
    let row = row(&derived);
    // Worked by hand in the tests of the formula.
    assert!((row.metallic - 0.790_61).abs() < 1e-4 && (row.roughness - 0.25).abs() < 1e-6, "{row:?}");
    assert!((row.base_color[0] - 0.621_83).abs() < 1e-4 && row.base_color[3] == 0.5, "{row:?}");
    assert_eq!(row.base_color_texture.texture, NONE);
}

#[test]
fn textures_become_images_of_base_colour_and_of_metallic_and_roughness() {
    let diffuse = [[200, 100, 50, 255], [0, 0, 0, 128]];
    let specular = [[10, 10, 10, 51], [230, 180, 90, 255]];
    let given = json!({
        "diffuseTexture": { "index": 0 }, "specularGlossinessTexture": { "index": 1 }, "glossinessFactor": 0.5,
    });
    let (derived, batch) = derive(given, &[png(2, &diffuse), png(2, &specular)]);
    assert!(derived.warnings.is_empty(), "{:?}", derived.warnings);
    let row = row(&derived);
    assert_eq!((row.base_color, row.metallic, row.roughness), ([1.0; 4], 1.0, 1.0));
    let base = image(&derived, &batch, &row.base_color_texture);
    let packed = image(&derived, &batch, &row.metallic_roughness_texture);
    assert_eq!((base.format, packed.format), (TexelFormat::Rgba8Srgb, TexelFormat::Rgba8Linear));
    for (i, (d, s)) in diffuse.into_iter().zip(specular).enumerate() {
        let linear = |t: [u8; 4]| [srgb(t[0]), srgb(t[1]), srgb(t[2]), f64::from(t[3]) / 255.0];
        let (d, s) = (linear(d), linear(s));
        let wanted = metallic_roughness(d, [s[0], s[1], s[2]], 0.5 * s[3]);
        let texel = |image: &ImageData| -> [u8; 4] { image.texels[4 * i..4 * i + 4].try_into().expect("four bytes") };
        for c in 0..3 {
            let found = srgb(texel(base)[c]);
            assert!((found - wanted.base_color[c]).abs() < 0.006, "texel {i}: {:?}, {wanted:?}", texel(base));
        }
        let [_, roughness, metallic, _] = texel(packed).map(|b| f64::from(b) / 255.0);
        assert!((roughness - wanted.roughness).abs() < 0.003 && (metallic - wanted.metallic).abs() < 0.003);
        assert_eq!(texel(base)[3], (d[3] * 255.0).round() as u8);
    }
    // What they were made of is not resident.
    let resident: Vec<bool> = batch.images.iter().map(|write| write.image.is_some()).collect();
    assert_eq!(resident, [false, false, true, true]);
}

#[test]
fn textures_of_two_sizes_are_brought_to_the_larger_one() {
    let given = json!({ "diffuseTexture": { "index": 0 }, "specularGlossinessTexture": { "index": 1 } });
    let (derived, batch) = derive(given, &[png(1, &[[188, 188, 188, 255]]), png(4, &[[0, 0, 0, 0]; 8])]);
    let base = image(&derived, &batch, &row(&derived).base_color_texture);
    assert_eq!((base.levels[0].width, base.levels[0].height), (4, 2));
    // 188 is 0.503; over 0.96 it is 0.524, which is 191.5.
    let is_expected = |t: &[u8]| (191..=192).contains(&t[0]) && t[3] == 255;
    assert!(base.texels[..32].chunks(4).all(is_expected), "{:?}", &base.texels[..32]);
}

#[test]
fn textures_that_lie_in_different_ways_take_the_mean_of_the_specular_one() {
    let scaled = json!({ "KHR_texture_transform": { "scale": [2, 2] } });
    let given = json!({
        "diffuseTexture": { "index": 0 }, "specularGlossinessTexture": { "index": 1, "extensions": scaled },
    });
    let images = [png(1, &[[100, 100, 100, 255]]), png(2, &[[0, 0, 0, 0], [0, 0, 0, 255]])];
    let (derived, batch) = derive(given, &images);
    assert_eq!(derived.warnings.len(), 1, "{:?}", derived.warnings);
    assert!(
        derived.warnings[0].to_string().starts_with("/materials/0: its two textures lie"),
        "{:?}",
        derived.warnings
    );
    let packed = image(&derived, &batch, &row(&derived).metallic_roughness_texture);
    assert!(packed.texels[1].abs_diff(128) <= 1, "{:?}", packed.texels);
}

#[test]
fn a_texture_whose_image_is_broken_leaves_the_factors_and_the_other_texture() {
    let given = json!({ "diffuseTexture": { "index": 0 }, "specularGlossinessTexture": { "index": 1 } });
    let broken = b"\x89PNG broken".to_vec();
    let (derived, batch) = derive(given, &[broken.clone(), png(1, &[[0, 0, 0, 255]])]);
    assert_eq!(derived.warnings.len(), 1, "{:?}", derived.warnings);
    let packed = image(&derived, &batch, &row(&derived).metallic_roughness_texture);
    assert_eq!(packed.texels[1], 0, "glossy");
    let (derived, _) = derive(json!({ "diffuseTexture": { "index": 0 } }), &[broken]);
    assert_eq!(row(&derived).base_color_texture.texture, NONE);
    assert_eq!(row(&derived).roughness, 0.0, "glossiness is 1 unless given");
}

#[test]
fn textures_are_converted_again_only_where_what_they_are_made_of_has_changed() {
    let diffuse = png(2, &[[255, 0, 0, 255], [0, 255, 0, 255]]);
    let mut scene = scene(json!({ "diffuseTexture": { "index": 0 }, "glossinessFactor": 0.5 }), &[diffuse]);
    scene.prepare_edits();
    let options = DeriveOptions { live: true, ..DeriveOptions::default() };
    let mut derived = DerivedScene::derive(&scene, &options).expect("derived");
    derived.load_batch();
    let mut cursor = scene.change_log().cursor();
    let mut session = Session::new(std::path::Path::new("."), ImportOptions::default());
    let set = |patch: Value| json!({ "op": "set_material", "material": 0, "set": patch });
    let glossiness = |value: f64| set(json!({ "extensions": { NAME: { "glossinessFactor": value } } }));
    for (operation, images) in [
        (json!({ "op": "rename", "material": 0, "name": "brass" }), 0),
        (set(json!({ "doubleSided": true, "emissiveFactor": [0.5, 0, 0] })), 0),
        // No one sees what the extension takes the place of.
        (set(json!({ "pbrMetallicRoughness": { "metallicFactor": 0.25, "baseColorTexture": { "index": 0 } } })), 0),
        (json!({ "op": "duplicate_material", "material": 0 }), 0),
        (glossiness(0.25), 2),
        // What it was stands beside it, in the copy.
        (glossiness(0.5), 0),
        (set(json!({ "extensions": { NAME: null } })), 1),
    ] {
        let parsed = Operation::parse(&operation.to_string()).expect("an operation");
        session.run(&mut scene, &parsed).expect("carried out");
        let changes = scene.change_log().take(&mut cursor).expect("kept");
        let (batch, _) = derived.sync(&scene, &Pose::default(), &changes).expect("followed");
        assert_eq!(batch.images.len(), images, "{operation}");
        derived.check(&scene).unwrap_or_else(|e| panic!("{operation}: {e}"));
    }
}
