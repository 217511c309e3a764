//! A CRTS scene through the whole program: its lights shine as the format says, in both dialects.

mod common;

use common::succeed;
use orthant::image_io;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::path::Path;

/// What the light has in every file: 2 by 0.5 metres about (0, 1, 0), seen from below.
const SIZE: [f64; 2] = [2.0, 0.5];
const COLOR: [f64; 3] = [1.0, 0.5, 0.25];
const ENERGY: f64 = 6.0;
const ALBEDO: f64 = 0.5;

const OLDER: [f64; 16] = [3.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0];
const NEWER: [f64; 16] = [3.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 1.0, 0.25, 1.0];

/// Writes a scene of a ground, a light and a camera.
fn write(folder: &Path, light: [f64; 16], eye: [f64; 16]) {
    let positions = [[-50f32, 0.0, 50.0], [50.0, 0.0, 50.0], [50.0, 0.0, -50.0], [-50.0, 0.0, -50.0]];
    let indices = [0u32, 1, 2, 0, 2, 3];
    let mut blob: Vec<u8> = positions.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    blob.extend(indices.iter().flat_map(|v| v.to_le_bytes()));
    // An index of refraction of 1 leaves the diffuse part alone.
    let material = json!({ "name": "matt", "base_color": [ALBEDO, ALBEDO, ALBEDO], "roughness": 1.0, "ior": 1.0 });
    let identity: Vec<f64> = (0..16).map(|i| f64::from(u8::from(i % 5 == 0))).collect();
    let objects: [Value; 3] = [
        json!({ "name": "ground", "type": "MESH", "matrix": identity, "mesh": 0, "material": 0 }),
        json!({ "name": "lamp", "type": "LIGHT", "matrix": light, "color": COLOR, "energy": ENERGY, "size": SIZE }),
        json!({ "name": "eye", "type": "CAMERA", "matrix": eye, "fov_y": 0.02 }),
    ];
    let header = json!({
        "buffer_views": [
            { "byte_offset": 0, "byte_length": 48, "type": "VEC3_F32" },
            { "byte_offset": 48, "byte_length": 24, "type": "VEC3_U32" },
        ],
        "meshes": [{ "name": "ground", "positions": 0, "indices": 1 }],
        "images": [],
        "materials": [material],
        "objects": objects,
    })
    .to_string();
    let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
    bytes.extend_from_slice(header.as_bytes());
    bytes.extend(blob);
    std::fs::write(folder.join("scene.crts"), bytes).expect("the folder can be written to");
}

/// Renders the scene and gives the mean of the picture.
fn mean(folder: &Path) -> [f64; 3] {
    let size = ["--size", "16x16", "--spp", "128", "--max-depth", "2"];
    succeed(folder, &[&["render", "scene.crts", "-o", "out.exr"][..], &size].concat());
    let picture = image_io::read(&folder.join("out.exr"), 1 << 30).expect("a picture");
    let sum = |k: usize| picture.pixels.iter().map(|p| f64::from(p[k])).sum::<f64>();
    [0, 1, 2].map(|k| sum(k) / picture.pixels.len() as f64)
}

#[track_caller]
fn assert_mean(folder: &Path, expected: [f64; 3], what: &str) {
    let value = mean(folder);
    for k in 0..3 {
        assert!((value[k] - expected[k]).abs() <= 5e-3 * expected[k], "{what}: {value:?}, expected {expected:?}");
    }
}

#[test]
fn lights_of_both_dialects_give_their_form_factor_and_are_seen_at_their_radiance() {
    // From a metre below the centre: Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", B-4, four times.
    let [x, y] = SIZE.map(|s| 0.5 * s);
    let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let form_factor = 4.0 / (2.0 * PI) * (x / rx * (y / rx).atan() + y / ry * (x / ry).atan());
    // Both look along -column 2: at the origin from the side, below the light, and up at it.
    let (s, c) = 0.1f64.sin_cos();
    let aside = [1.0, 0.0, 0.0, 0.0, 0.0, c, -s, 0.0, 0.0, s, c, 0.0, 0.0, 4.0 * s, 4.0 * c, 1.0];
    let upwards = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.1, 0.5, 0.1, 1.0];
    let downwards = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 1.0];
    for (name, light) in [("older", OLDER), ("newer", NEWER)] {
        let folder = tempfile::tempdir().expect("folder");
        let reflected = COLOR.map(|c| c * ENERGY * ALBEDO * form_factor);
        write(folder.path(), light, aside);
        assert_mean(folder.path(), reflected, name);
        write(folder.path(), light, upwards);
        assert_mean(folder.path(), COLOR.map(|c| c * ENERGY), &format!("{name}, from below"));
        // The back is not there: the ground is seen through it.
        write(folder.path(), light, downwards);
        assert_mean(folder.path(), reflected, &format!("{name}, from above"));
    }
}
