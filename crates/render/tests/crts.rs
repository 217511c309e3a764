//! CRTS: what the format says about cameras and lights is what is derived.

use glam::{DVec3, Vec3};
use orthant_render::camera::View;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::camera::Projection;
use orthant_scene::Scene;
use orthant_scene::import::{ImportOptions, import_slice};
use serde_json::{Value, json};

/// A file of objects alone.
fn load(objects: Value) -> (Scene, DerivedScene) {
    let header = json!({
        "buffer_views": [], "meshes": [], "images": [], "materials": [], "objects": objects,
    });
    let header = header.to_string();
    let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
    bytes.extend_from_slice(header.as_bytes());
    let imported = import_slice(bytes, None, "a.crts", &ImportOptions::default()).expect("the file is valid");
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    let derived = DerivedScene::derive(&imported.scene, &DeriveOptions::default()).expect("the scene can be derived");
    (imported.scene, derived)
}

fn light(matrix: [f64; 16]) -> Value {
    json!({
        "name": "lamp", "type": "LIGHT", "matrix": matrix, "color": [1.0, 0.5, 0.25], "energy": 8.0, "size": [2.0, 0.5],
    })
}

#[test]
fn the_angle_of_a_camera_depends_on_the_aspect_of_the_picture() {
    let matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 3.0, 4.0, 5.0, 1.0];
    let (scene, derived) = load(json!([{ "name": "eye", "type": "CAMERA", "matrix": matrix, "fov_y": 40.0 }]));
    let written = 20f64.to_radians().tan();
    // The sensor is 36 mm wide and fitted to the larger side of the picture; the file's angle is of 24 mm.
    for (aspect, expected) in [(1.5, written), (3.0, 0.5 * written), (1.0, 1.5 * written), (0.5, 1.5 * written)] {
        let view = View::first_camera(&scene, &derived, aspect).expect("there is a camera");
        assert_eq!(view.eye, DVec3::new(3.0, 4.0, 5.0));
        let Projection::Perspective { tan_half_fov_y } = view.projection else { panic!("perspective") };
        assert!((f64::from(tan_half_fov_y) / expected - 1.0).abs() < 1e-6, "{aspect}: {tan_half_fov_y}");
    }
}

#[test]
fn lights_of_both_dialects_are_quads_with_their_front_to_where_they_shine() {
    let older = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 3.0, 0.0, 1.0];
    let newer = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 3.0, 0.25, 1.0];
    for (name, matrix) in [("older", older), ("newer", newer)] {
        let (_, mut derived) = load(json!([light(matrix)]));
        let row = derived.render_nodes[0];
        let desc = derived.mesh_descs[0];
        let [corner, _] = desc.parallelogram().expect("a quad");
        assert_eq!(derived.emitters.len(), 1, "{name}");
        assert_eq!(derived.materials[row.material as usize].emissive, [8.0, 4.0, 2.0], "{name}");

        let batch = derived.load_batch();
        let positions = &batch.positions.ranges[0].rows;
        let indices = &batch.indices.ranges[0].rows;
        let at = |k: usize| row.world.transform_point(Vec3::from(positions[indices[(corner + k) % 3] as usize]));
        let sides = [at(1) - at(0), at(2) - at(0)];
        let front = sides[0].cross(sides[1]).normalize();
        assert!(front.distance(Vec3::NEG_Y) < 1e-6, "{name}: {front}");
        let centre = at(0) + 0.5 * (sides[0] + sides[1]);
        assert!(centre.distance(Vec3::new(0.0, 3.0, 0.0)) < 1e-6, "{name}: {centre}");
        assert!((desc.area - 1.0).abs() < 1e-6, "{name}");
    }
}
