//! Rays against what they must hit.

use super::Ray;
use crate::scene::testing::{TestMesh, instance, scene};
use glam::{DAffine3, DVec3, Vec3};
use orthant_resident::rows::NodeFlags;

/// A triangle in the plane z = 0, counter-clockwise as seen from +z.
fn triangle() -> TestMesh {
    TestMesh { positions: vec![[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]], indices: vec![0, 1, 2] }
}

fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray {
    Ray::new(Vec3::from_array(origin), Vec3::from_array(direction))
}

#[test]
fn a_hit_has_the_weights_of_its_corners_and_the_parameter_of_the_ray() {
    let world = DAffine3::from_scale(DVec3::splat(2.0));
    let scene = scene(&[triangle()], vec![instance(0, world, NodeFlags::OPAQUE)]);
    // Object-space point (1, 2, 0): weights 1/4, 1/4, 1/2.
    let hit = scene.closest_hit(&ray([2.0, 4.0, 6.0], [0.0, 0.0, -0.5]), |_| unreachable!()).unwrap();
    assert_eq!((hit.t, hit.b1, hit.b2, hit.back_face), (12.0, 0.25, 0.5, false));
    assert_eq!((hit.render_node, hit.triangle), (0, 0));
}

#[test]
fn a_back_face_exists_for_double_sided_nodes_only() {
    let from_behind = ray([1.0, 1.0, -3.0], [0.0, 0.0, 1.0]);
    let one = scene(&[triangle()], vec![instance(0, DAffine3::IDENTITY, NodeFlags::OPAQUE)]);
    assert_eq!(one.closest_hit(&from_behind, |_| true), None);
    assert!(!one.any_hit(&from_behind, |_| true));
    let two = scene(&[triangle()], vec![instance(0, DAffine3::IDENTITY, NodeFlags::OPAQUE | NodeFlags::DOUBLE_SIDED)]);
    assert!(two.closest_hit(&from_behind, |_| true).unwrap().back_face);
    assert!(two.any_hit(&from_behind, |_| true));
}

#[test]
fn a_mirrored_instance_keeps_its_front() {
    // Mirrored along x, the corners run clockwise in world space as seen from +z, but +z is still the front.
    let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let scene = scene(&[triangle()], vec![instance(0, mirrored, NodeFlags::OPAQUE)]);
    let hit = scene.closest_hit(&ray([-1.0, 1.0, 3.0], [0.0, 0.0, -1.0]), |_| true).unwrap();
    assert!(!hit.back_face);
    assert_eq!(scene.closest_hit(&ray([-1.0, 1.0, -3.0], [0.0, 0.0, 1.0]), |_| true), None);
}
