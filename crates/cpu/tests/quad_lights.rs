//! Area lights: emissive quads, sampled by solid angle.

mod common;
use common::*;
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use orthant_resident::camera::Projection;
use orthant_resident::frame::Estimator;
use orthant_resident::rows::{MaterialFlags, MaterialRow};
use orthant_resident::{Camera, Environment, Frame};
use std::f32::consts::{FRAC_1_PI, PI};

const ALBEDO: f32 = 0.6;
const RADIANCE: f32 = 7.0;

fn ground() -> SceneBuilder {
    SceneBuilder::default().add(quad(Vec3::ZERO, Vec3::X * 50.0, Vec3::NEG_Z * 50.0), lambert(ALBEDO))
}

/// Looks at a millimetre of the ground around the origin, from below all lights.
fn at_origin(samples: u32) -> Frame {
    let view = Camera {
        projection: Projection::Orthographic { half_height: 0.0005 },
        ..camera(Vec3::new(0.3, 0.004, 0.1), Vec3::ZERO, 1.0)
    };
    Frame { max_depth: 2, ..frame(view, 16, 16, samples) }
}

/// Irradiance at the origin of a ground with the normal +Y under a polygon of radiance 1 above it, whose corners run
/// clockwise as seen from there (Lambert 1760; Baum, Rushmeier and Winget 1989, equation 12).
fn irradiance(corners: &[DVec3]) -> f32 {
    let edge = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        let normal = a.cross(b);
        a.angle_between(b) * normal.normalize().y
    };
    (0.5 * (0..corners.len()).map(edge).sum::<f64>()).abs() as f32
}

/// The unit square in the XZ plane, with its front below; cut into two triangles, or into four that are no quad.
fn square(triangles: usize) -> Mesh {
    let two = quad(Vec3::ZERO, Vec3::X * 0.5, Vec3::Z * 0.5);
    if triangles == 2 {
        return two;
    }
    let mut four = two;
    four.positions.push(Vec3::ZERO);
    four.normals.push(Vec3::NEG_Y);
    four.uvs.push(glam::Vec2::splat(0.5));
    four.indices = vec![0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4];
    four
}

fn expected(world: &DAffine3) -> f32 {
    let corners = square(2).positions.iter().map(|p| world.transform_point3(p.as_dvec3())).collect::<Vec<_>>();
    ALBEDO * FRAC_1_PI * RADIANCE * irradiance(&corners)
}

fn lit(triangles: usize, world: DAffine3, estimator: Estimator, samples: u32) -> (f32, f32) {
    let mut backend = ground().add_at(square(triangles), lamp(RADIANCE), world).backend(Environment::none());
    let film = render(&mut backend, Frame { estimator, ..at_origin(samples) });
    assert_eq!(backend.discarded_contributions(), 0);
    let mean = mean(&film).x;
    let pixels = film.resolve();
    let variance = pixels.iter().map(|p| (p[0] - mean) * (p[0] - mean)).sum::<f32>() / pixels.len() as f32;
    (mean, variance)
}

fn scaled(x: f64, z: f64) -> DAffine3 {
    DAffine3::from_scale(DVec3::new(x, 1.0, z))
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

#[test]
fn a_rectangle_gives_its_form_factor_near_and_far_turned_and_mirrored() {
    let turned = DAffine3::from_quat(DQuat::from_euler(glam::EulerRot::YXZ, 0.7, 0.4, -0.5));
    let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let lights = [
        ("a metre above", at(0.0, 1.0, 0.0)),
        ("a strip beside", at(0.2, 0.3, -0.6) * scaled(0.05, 3.0)),
        ("very near", at(0.3, 0.02, -0.1)),
        ("turned", at(0.1, 0.7, 0.3) * turned * scaled(0.8, 0.3)),
        ("mirrored and scaled", at(-0.4, 0.5, 0.2) * mirrored * scaled(2.0, 0.7)),
        ("far: by area", at(3.0, 40.0, 1.0)),
    ];
    for (name, world) in lights {
        for (estimator, samples) in [(Estimator::LightOnly, 128), (Estimator::Mis, 128), (Estimator::BsdfOnly, 1024)] {
            if estimator == Estimator::BsdfOnly && name.starts_with("far") {
                continue;
            }
            let (value, _) = lit(2, world, estimator, samples);
            assert_close(value, expected(&world), 5e-3, &format!("{name}, {estimator:?}"));
        }
    }
}

#[test]
fn a_sheared_square_is_sampled_by_area_and_gives_its_form_factor() {
    for shear in [1e-4, 0.05, 0.8] {
        let sheared = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(shear, 0.0, 1.0)));
        let world = at(0.1, 0.5, -0.2) * sheared;
        for estimator in [Estimator::LightOnly, Estimator::Mis] {
            let (value, _) = lit(2, world, estimator, 256);
            assert_close(value, expected(&world), 5e-3, &format!("sheared by {shear}, {estimator:?}"));
        }
    }
}

#[test]
fn near_a_light_solid_angles_have_less_variance_than_areas() {
    for (height, less) in [(0.5, 1.5), (0.2, 4.0), (0.05, 10.0)] {
        let world = at(0.1, height, 0.2);
        let (_, by_angle) = lit(2, world, Estimator::LightOnly, 1);
        let (_, by_area) = lit(4, world, Estimator::LightOnly, 1);
        assert!(by_angle * less < by_area, "{height} above: {by_angle}, by area {by_area}");
    }
}

#[test]
fn a_quad_shines_from_its_front_or_from_both_faces() {
    let two_sided = MaterialRow { flags: MaterialFlags::DOUBLE_SIDED, ..lamp(RADIANCE) };
    let upside_down = at(0.0, 0.5, 0.0) * DAffine3::from_rotation_x(std::f64::consts::PI);
    let value = |material: MaterialRow| {
        let mut backend = ground().add_at(square(2), material, upside_down).backend(Environment::none());
        mean(&render(&mut backend, at_origin(128))).x
    };
    assert_eq!(value(lamp(RADIANCE)), 0.0);
    assert_close(value(two_sided), expected(&upside_down), 5e-3, "both faces");
}

#[test]
fn the_camera_sees_a_quad_at_its_radiance_from_the_front_and_not_at_all_from_the_back() {
    let mut backend = SceneBuilder::default().add(square(2), lamp(RADIANCE)).backend(Environment::constant([0.25; 3]));
    let from = |y: f32| frame(camera(Vec3::new(0.0, y, 0.01), Vec3::ZERO, 5.0), 4, 4, 4);
    assert_eq!(mean(&render(&mut backend, from(-1.0))), Vec3::splat(RADIANCE));
    assert_eq!(mean(&render(&mut backend, from(1.0))), Vec3::splat(0.25));
}

#[test]
fn a_quad_inside_a_glossy_room_is_the_same_for_every_estimator() {
    let glossy = MaterialRow { base_color: [0.8, 0.8, 0.8, 1.0], roughness: 0.4, ..MaterialRow::DEFAULT };
    let scene = SceneBuilder::default()
        .add(quad(Vec3::ZERO, Vec3::X, Vec3::NEG_Z), glossy)
        .add(quad(Vec3::new(0.0, 1.0, -1.0), Vec3::X, Vec3::Y), lambert(0.7))
        .add_at(square(2), lamp(3.0), at(0.0, 0.3, -0.3) * scaled(1.2, 0.4));
    let mut backend = scene.backend(Environment::none());
    let view = camera(Vec3::new(0.0, 0.8, 2.5), Vec3::new(0.0, 0.3, 0.0), 45.0);
    let mut value = |estimator, samples| {
        mean(&render(&mut backend, Frame { estimator, max_depth: 4, ..frame(view, 24, 24, samples) })).x
    };
    let mis = value(Estimator::Mis, 1024);
    assert!(mis > 0.1 && mis < PI, "{mis}");
    assert_close(value(Estimator::LightOnly, 2048), mis, 5e-3, "lights");
    assert_close(value(Estimator::BsdfOnly, 2048), mis, 5e-3, "BSDF");
}
