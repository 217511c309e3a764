//! What is written is read back.

use super::refusals::everything;
use super::*;
use crate::export::crts::write;

pub fn written(scene: &Scene) -> (Vec<u8>, Vec<String>) {
    let mut out = Vec::new();
    let (length, notes) = write(scene, &mut out).unwrap();
    assert_eq!(length, out.len() as u64);
    (out, notes.iter().map(ToString::to_string).collect())
}

/// Everything that a scene says, with geometry and images by value.
pub fn said(scene: &Scene) -> Vec<String> {
    let mut out = Vec::new();
    for (_, node) in scene.nodes().iter() {
        out.push(format!("{node:?}"));
    }
    for (_, mesh) in scene.meshes().iter() {
        let p = &mesh.primitives[0];
        out.push(format!("{:?} {:?}", mesh.name, p.material));
        out.push(format!("{:?}", accessor::read_indices(scene, p.indices.unwrap()).unwrap()));
        for (semantic, id) in &p.attributes.0 {
            let values = match semantic.as_str() {
                "TEXCOORD_0" => accessor::read_f32::<2>(scene, *id).unwrap().into_flattened(),
                _ => accessor::read_f32::<3>(scene, *id).unwrap().into_flattened(),
            };
            out.push(format!("{semantic} {values:?}"));
        }
    }
    for (_, material) in scene.materials().iter() {
        out.push(format!("{material:?}"));
    }
    for (_, texture) in scene.textures().iter() {
        out.push(format!("{texture:?}"));
    }
    for (_, image) in scene.images().iter() {
        out.push(format!("{:?} {:?} {:?} {:?}", image.name, image.mime_type, image.extra, image.data.as_deref()));
    }
    for (_, camera) in scene.cameras().iter() {
        out.push(format!("{camera:?}"));
    }
    out.push(format!("{:?}", scene.extensions_used()));
    out
}

/// Light dialects, every textured scalar on every channel, tints, a bright specular, an odd camera.
fn files() -> Vec<File> {
    let mut files = vec![everything(), triangle()];
    for (channel, key) in [
        "metallic",
        "specular",
        "roughness",
        "specular_tint",
        "anisotropic",
        "sheen",
        "clearcoat",
        "ior",
        "transmission",
    ]
    .iter()
    .enumerate()
    {
        let mut file = triangle();
        let image = file.image(&[[1, 2, 3, 4]], 1, if channel % 2 == 0 { "LINEAR" } else { "sRGB" });
        files.push(
            file.with(&format!("/materials/0/{key}_texture"), json!({ "texture": image, "channel": channel % 4 })),
        );
    }
    let material = json!({ "name": "m", "base_color": [0.7, 0.2, 0.1], "specular": 0.9, "specular_tint": 0.3,
        "sheen": 0.7, "sheen_tint": 0.4, "clearcoat_roughness": 0.03, "ior": 1.45, "transmission": 0.5 });
    files.push(triangle().with("/materials/0", material));
    for z in [1.0, -1.0] {
        let mut file = triangle();
        let matrix = [0.3, 0.1, 0.0, 0.0, -0.2, 3.0, 0.7, 0.0, 0.0, 0.0, z, 0.0, 10.3, 20.0, 30.7, 1.0];
        file.add(
            "objects",
            placed("LIGHT", matrix, json!({ "color": [0.9, 0.5, 0.1], "energy": 7, "size": [0.3, 2] })),
        );
        file.add("objects", placed("CAMERA", matrix, json!({ "fov_y": 37.3 })));
        files.push(file);
    }
    files
}

#[test]
fn a_file_that_is_read_written_and_read_is_the_same_scene() {
    for (i, file) in files().iter().enumerate() {
        let first = file.import().unwrap().scene;
        let (bytes, notes) = written(&first);
        assert_eq!(notes, Vec::<String>::new(), "file {i}");
        let second = import(bytes.clone()).unwrap().scene;
        for (a, b) in said(&first).iter().zip(&said(&second)) {
            assert_eq!(a, b, "file {i}");
        }
        assert_eq!(said(&first).len(), said(&second).len());
        assert_eq!(written(&second).0, bytes, "file {i}: written again, it is the same file");
    }
}

#[test]
fn a_written_file_is_aligned_and_says_its_dialect() {
    let (bytes, _) = written(&everything().import().unwrap().scene);
    let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    assert!((8 + length).is_multiple_of(16));
    let header: Value = serde_json::from_slice(&bytes[8..8 + length]).unwrap();
    assert_eq!(header["crts_version"], 2);
    assert_eq!((&header["light_origin"], &header["light_emits"]), (&json!("corner"), &json!("-z")));
    for view in header["buffer_views"].as_array().unwrap() {
        assert!(view["byte_offset"].as_u64().unwrap().is_multiple_of(4));
    }
    assert_eq!(header["meshes"].as_array().unwrap().len(), 1, "one geometry under three materials");
    assert_eq!(header["images"].as_array().unwrap().len(), 1, "what was packed is not written");
    assert_eq!(header["materials"][1]["metallic_texture"], json!({ "texture": 0, "channel": 0 }));
}

#[test]
fn a_hierarchy_is_flattened_and_what_does_not_fit_is_noted() {
    let scene = crate::testing::every_slot_scene();
    let (bytes, notes) = written(&scene);
    assert!(notes.iter().any(|n| n.contains("CRTS has no hierarchy")), "{notes:?}");
    assert!(notes.iter().any(|n| n.contains("CRTS has no animations")), "{notes:?}");
    import(bytes).unwrap();
}
