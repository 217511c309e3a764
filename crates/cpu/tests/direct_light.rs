//! A Lambertian plane under lights whose irradiance is known in closed form.

mod common;
use common::*;
use glam::Vec3;
use orthant_resident::batch::{RowWrites, TlasAction};
use orthant_resident::camera::Projection;
use orthant_resident::environment::Sun;
use orthant_resident::frame::Estimator;
use orthant_resident::rows::{LightKind, LightRow};
use orthant_resident::{Backend, Camera, Environment, Frame, SceneBatch};
use std::f32::consts::{FRAC_1_PI, PI};

const ALBEDO: f32 = 0.6;
const TOLERANCE: f32 = 5e-3;

fn ground() -> SceneBuilder {
    SceneBuilder::default().add(quad(Vec3::ZERO, Vec3::X * 500.0, Vec3::NEG_Z * 500.0), lambert(ALBEDO))
}

/// Looks at a millimetre around the origin from the side.
fn at_origin(samples: u32) -> Frame {
    let view = Camera {
        projection: Projection::Orthographic { half_height: 0.001 },
        ..camera(Vec3::new(3.0, 0.4, 1.0), Vec3::ZERO, 1.0)
    };
    let mut frame = frame(view, 16, 16, samples);
    frame.max_depth = 2;
    frame
}

fn light(kind: LightKind) -> LightRow {
    LightRow {
        kind: kind as u32,
        position: [0.5, 2.0, -1.0],
        direction: [0.0, -1.0, 0.0],
        range: f32::INFINITY,
        color: [10.0; 3],
        ..bytemuck::Zeroable::zeroed()
    }
}

fn radiance(scene: SceneBuilder, environment: Environment, frame: Frame) -> f32 {
    mean(&render(&mut scene.backend(environment), frame)).x
}

#[test]
fn an_emissive_quad_gives_its_form_factor() {
    // Half extents over the height; Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", B-4, four times.
    let (a, b, height, emitted) = (0.8f32, 0.5f32, 1.25f32, 7.0);
    let (x, y) = (a / height, b / height);
    let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let form_factor = 4.0 / (2.0 * PI) * (x / rx * (y / rx).atan() + y / ry * (x / ry).atan());
    for estimator in [Estimator::Mis, Estimator::LightOnly, Estimator::BsdfOnly] {
        let ceiling = quad(Vec3::Y * height, Vec3::X * a, Vec3::Z * b);
        let scene = ground().add(ceiling, lamp(emitted));
        let frame = Frame { estimator, ..at_origin(if estimator == Estimator::BsdfOnly { 512 } else { 128 }) };
        let value = radiance(scene, Environment::none(), frame);
        assert_close(value, ALBEDO * emitted * form_factor, TOLERANCE, &format!("{estimator:?}"));
    }
}

#[test]
fn the_back_of_a_single_sided_emitter_is_dark() {
    let scene = ground().add(quad(Vec3::Y, Vec3::X, Vec3::NEG_Z), lamp(5.0));
    assert_eq!(radiance(scene, Environment::none(), at_origin(16)), 0.0);
}

#[test]
fn a_point_light_follows_the_inverse_square_law() {
    let scene = ground().light(light(LightKind::Point));
    let distance2 = 0.25 + 4.0 + 1.0f32;
    let cos = 2.0 / distance2.sqrt();
    let expected = ALBEDO * FRAC_1_PI * 10.0 * cos / distance2;
    assert_close(radiance(scene, Environment::none(), at_origin(16)), expected, TOLERANCE, "point");
}

#[test]
fn a_range_ends_a_light_smoothly() {
    let mut row = light(LightKind::Point);
    row.range = 3.0;
    let distance2 = 5.25f32;
    let window = 1.0 - (distance2.sqrt() / 3.0).powi(4);
    let expected = ALBEDO * FRAC_1_PI * 10.0 * window * 2.0 / distance2.powf(1.5);
    assert_close(radiance(ground().light(row), Environment::none(), at_origin(16)), expected, TOLERANCE, "range");
    row.range = 2.0;
    assert_eq!(radiance(ground().light(row), Environment::none(), at_origin(16)), 0.0);
}

#[test]
fn a_spot_falls_off_between_its_cones() {
    let (inner, outer) = (0.2f32, 0.8f32);
    let mut row = light(LightKind::Spot);
    row.angle_scale = 1.0 / (inner.cos() - outer.cos());
    row.angle_offset = -outer.cos() * row.angle_scale;
    let distance2 = 5.25f32;
    let cos = 2.0 / distance2.sqrt();
    let falloff = ((cos - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0).powi(2);
    assert!(falloff > 0.05 && falloff < 0.95);
    let expected = ALBEDO * FRAC_1_PI * 10.0 * falloff * cos / distance2;
    assert_close(radiance(ground().light(row), Environment::none(), at_origin(16)), expected, TOLERANCE, "spot");
}

#[test]
fn a_directional_light_gives_its_illuminance() {
    let mut row = light(LightKind::Directional);
    row.direction = [0.6, -0.8, 0.0];
    let value = radiance(ground().light(row), Environment::none(), at_origin(16));
    assert_close(value, ALBEDO * FRAC_1_PI * 10.0 * 0.8, TOLERANCE, "directional");
}

#[test]
fn a_thousand_point_lights_add_up() {
    let mut scene = ground();
    let mut expected = 0.0;
    for i in 0..1000 {
        let mut row = light(LightKind::Point);
        let (s, c) = (i as f32 * 2.4).sin_cos();
        let r = 0.2 * (i as f32).sqrt();
        row.position = [r * c, 0.5 + (i % 7) as f32 * 0.3, r * s];
        row.color = [1.0 + (i % 5) as f32; 3];
        let d = Vec3::from(row.position).length();
        expected += ALBEDO * FRAC_1_PI * row.color[0] * row.position[1] / (d * d * d);
        scene = scene.light(row);
    }
    assert_close(radiance(scene, Environment::none(), at_origin(512)), expected, 1e-2, "thousand");
}

#[test]
fn a_constant_environment_gives_the_albedo() {
    for estimator in [Estimator::Mis, Estimator::LightOnly, Estimator::BsdfOnly] {
        let value = radiance(ground(), Environment::constant([2.0; 3]), Frame { estimator, ..at_origin(128) });
        assert_close(value, ALBEDO * 2.0, TOLERANCE, &format!("{estimator:?}"));
    }
}

#[test]
fn the_sun_gives_its_solid_angle() {
    for (radius, estimator, samples) in [
        (0.2666f32.to_radians(), Estimator::Mis, 64),
        (0.2666f32.to_radians(), Estimator::LightOnly, 64),
        (0.3, Estimator::BsdfOnly, 1024),
    ] {
        let elevation = 0.7f32;
        let direction = [elevation.cos() * 0.6, elevation.sin(), elevation.cos() * 0.8];
        // From the rounded cosine, which is what defines the disc: sin^2 = (1 - cos) (1 + cos).
        let cos_radius = radius.cos();
        let sin2 = (1.0 - cos_radius) * (1.0 + cos_radius);
        let environment =
            Environment { sun: Some(Sun { direction, radiance: [100.0; 3], cos_radius }), ..Environment::none() };
        let value = radiance(ground(), environment, Frame { estimator, ..at_origin(samples) });
        let expected = ALBEDO * FRAC_1_PI * 100.0 * PI * sin2 * elevation.sin();
        assert_close(value, expected, TOLERANCE, &format!("{estimator:?}"));
    }
}

#[test]
fn a_rotated_environment_turns_counter_clockwise_from_above() {
    // One bright quarter about -Z, turned by a quarter to -X.
    let mut texels = vec![[0.0; 3]; 16 * 8];
    for y in 0..8 {
        texels[y * 16 + 7] = [1.0; 3];
        texels[y * 16 + 8] = [1.0; 3];
    }
    let map = orthant_resident::environment::EnvironmentMap { width: 16, height: 8, texels };
    let environment = Environment {
        map: Some(std::sync::Arc::new(map)),
        rotation: std::f32::consts::FRAC_PI_2,
        ..Environment::none()
    };
    let mut backend = SceneBuilder::default().backend(environment);
    let see = |backend: &mut orthant_cpu::CpuBackend, d: Vec3| {
        mean(&render(backend, frame(camera(Vec3::ZERO, d, 5.0), 8, 8, 1))).x
    };
    assert!(see(&mut backend, Vec3::NEG_X) > 0.9);
    assert!(see(&mut backend, Vec3::X) < 0.1 && see(&mut backend, Vec3::Z) < 0.1);
    assert!(see(&mut backend, Vec3::NEG_Z) < 0.1);
}

#[test]
fn a_batch_that_changes_a_light_is_seen_by_the_next_frame() {
    let scene = ground().light(light(LightKind::Point));
    let mut backend = scene.backend(Environment::none());
    let before = mean(&render(&mut backend, at_origin(16))).x;
    let whole = scene.batch();
    let mut brighter = light(LightKind::Point);
    brighter.color = [30.0; 3];
    let edit = SceneBatch {
        // One light becomes three times as bright, and a second one is added beside it.
        lights: RowWrites::whole(vec![brighter, light(LightKind::Point)]),
        tlas: TlasAction::None,
        ..unchanged(&whole, 1)
    };
    backend.apply(edit).unwrap();
    assert_close(mean(&render(&mut backend, at_origin(64))).x, 4.0 * before, 5e-3, "brighter");
}
