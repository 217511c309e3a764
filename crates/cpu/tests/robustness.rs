//! Self-intersection and leaks, at several scales and places.

mod common;
use common::*;
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use orthant_resident::frame::Estimator;
use orthant_resident::rows::{MaterialFlags, MaterialRow};
use orthant_resident::{Environment, Frame};

fn placements() -> Vec<(&'static str, DAffine3)> {
    let rotation = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    let scaled = |s: f64| DAffine3::from_scale_rotation_translation(DVec3::splat(s), rotation, DVec3::ZERO);
    vec![
        ("identity", DAffine3::IDENTITY),
        ("a thousandth", scaled(1e-3)),
        ("a hundred", scaled(1e2)),
        ("ten thousand", scaled(1e4)),
        ("far", DAffine3::from_rotation_translation(rotation, DVec3::new(700.0, -300.0, 900.0))),
        ("mirrored", DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)))),
        (
            "stretched",
            DAffine3::from_mat3(DMat3::from_quat(rotation) * DMat3::from_diagonal(DVec3::new(5.0, 0.2, 1.0))),
        ),
    ]
}

fn view(m: &DAffine3, eye: DVec3, target: DVec3, degrees: f32) -> orthant_resident::Camera {
    let (eye, target) = (m.transform_point3(eye), m.transform_point3(target));
    camera(eye.as_vec3(), target.as_vec3(), degrees)
}

#[test]
fn a_grey_convex_object_never_meets_itself() {
    for (name, place) in placements() {
        for estimator in [Estimator::BsdfOnly, Estimator::LightOnly] {
            for mesh in [sphere(Vec3::new(0.3, -0.2, 0.1), 1.0, 16).flat(), cuboid(Vec3::ZERO, Vec3::splat(0.8))] {
                let mut backend =
                    SceneBuilder::default().add_at(mesh, lambert(0.5), place).backend(Environment::constant([1.0; 3]));
                let eye = DVec3::new(0.0, 1.2, 5.0);
                let view = view(&place, eye, DVec3::new(0.1, 0.1, 0.3), 2.0);
                let film = render(&mut backend, Frame { estimator, ..frame(view, 32, 32, 64) });
                // BSDF sampling of a Lambertian surface has no variance; light sampling has.
                let tolerance = if estimator == Estimator::BsdfOnly { 1e-4 } else { 5e-3 };
                assert_close(mean(&film).x, 0.5, tolerance, &format!("{name} {estimator:?}"));
            }
        }
    }
}

#[test]
fn nothing_leaks_into_a_closed_box() {
    for (name, place) in placements() {
        let wall =
            MaterialRow { flags: MaterialFlags::DOUBLE_SIDED, roughness: 0.3, metallic: 0.5, ..MaterialRow::DEFAULT };
        let mut backend = SceneBuilder::default()
            .add_at(cuboid(Vec3::ZERO, Vec3::splat(1.0)), wall, place)
            .backend(Environment::constant([1.0; 3]));
        let eye = DVec3::new(0.2, 0.1, 0.4);
        let frame = Frame { max_depth: 12, ..frame(view(&place, eye, DVec3::new(-0.5, -0.6, -1.0), 90.0), 32, 32, 32) };
        let leaked = mean(&render(&mut backend, frame)).x;
        // A thousand times its size from the origin, the box's corners are known to some 1e-4 of its size only: a hit as
        // near to an edge as that may lie beyond the other wall.
        let limit = if name == "far" { 1e-3 } else { 0.0 };
        assert!(leaked <= limit, "{name}: {leaked}");
    }
}

#[test]
fn light_through_touching_surfaces_is_the_same_everywhere() {
    // A lamp a hair above a table, and a table that stands on the floor.
    let build = || {
        SceneBuilder::default()
            .add(quad(Vec3::ZERO, Vec3::X * 3.0, Vec3::NEG_Z * 3.0), lambert(0.7))
            .add(cuboid(Vec3::new(0.0, 0.25, 0.0), Vec3::new(0.5, 0.25, 0.5)), lambert(0.5))
            .add(quad(Vec3::new(0.0, 1.5, 0.3), Vec3::X * 0.5, Vec3::Z * 0.5), lamp(4.0))
    };
    let eye = DVec3::new(0.5, 1.2, 4.0);
    let brightness = |place: &DAffine3| {
        let mut backend = build().transformed(*place).backend(Environment::none());
        let frame = frame(view(place, eye, DVec3::new(0.0, 0.4, 0.0), 35.0), 32, 32, 64);
        let up = place.transform_vector3(DVec3::Y).normalize();
        let mut frame = Frame { max_depth: 5, ..frame };
        let forward = Vec3::from(frame.camera.forward);
        let right = forward.cross(up.as_vec3()).normalize();
        frame.camera.right = right.to_array();
        frame.camera.up = right.cross(forward).to_array();
        mean(&render(&mut backend, frame)).x
    };
    let reference = brightness(&DAffine3::IDENTITY);
    assert!(reference > 0.05);
    for (name, place) in placements() {
        if name != "stretched" && name != "mirrored" {
            assert_close(brightness(&place), reference, 5e-3, name);
        }
    }
}
