//! Many lights: the light tree chooses among them.

mod common;
use common::*;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use orthant_cpu::CpuBackend;
use orthant_resident::batch::{RowRange, RowWrites, TlasAction};
use orthant_resident::camera::Projection;
use orthant_resident::extent::scene_radius;
use orthant_resident::frame::Estimator;
use orthant_resident::math::unit_float;
use orthant_resident::rows::{LightKind, LightRow, MaterialFlags, MaterialRow};
use orthant_resident::sampling::hash_combine;
use orthant_resident::{Backend, Camera, Environment, Frame, SceneBatch};
use std::f32::consts::FRAC_1_PI;

const ALBEDO: f32 = 0.6;

fn random(i: u32, k: u32) -> f32 {
    unit_float(hash_combine(i, k))
}

fn ground() -> SceneBuilder {
    SceneBuilder::default().add(quad(Vec3::ZERO, Vec3::X * 50.0, Vec3::NEG_Z * 50.0), lambert(ALBEDO))
}

fn at_origin(samples: u32) -> Frame {
    let view = Camera {
        projection: Projection::Orthographic { half_height: 0.001 },
        ..camera(Vec3::new(3.0, 0.4, 1.0), Vec3::ZERO, 1.0)
    };
    Frame { max_depth: 2, ..frame(view, 16, 16, samples) }
}

/// Quads of one face or two, and cubes, that emit, turned at random in a room over a glossy floor.
fn lamps() -> SceneBuilder {
    let glossy = MaterialRow { base_color: [0.8, 0.6, 0.4, 1.0], roughness: 0.4, ..MaterialRow::DEFAULT };
    let mut scene = SceneBuilder::default()
        .add(quad(Vec3::ZERO, Vec3::X * 3.0, Vec3::NEG_Z * 3.0), glossy)
        .add(sphere(Vec3::new(0.3, 0.5, 0.2), 0.5, 24), lambert(0.7));
    for i in 0..60 {
        let at = DVec3::new(f64::from(random(i, 0)), 0.0, f64::from(random(i, 1))) * 6.0 - DVec3::new(3.0, 0.0, 3.0);
        let turn =
            DQuat::from_euler(glam::EulerRot::YXZ, f64::from(random(i, 2)) * 6.0, f64::from(random(i, 3)) * 6.0, 0.0);
        let world = DAffine3::from_rotation_translation(turn, at + DVec3::Y * f64::from(0.3 + random(i, 4)));
        let radiance = 0.5 + 4.0 * random(i, 5);
        let two_sided = MaterialRow { flags: MaterialFlags::DOUBLE_SIDED, ..lamp(radiance) };
        scene = match i % 3 {
            0 => scene.add_at(quad(Vec3::ZERO, Vec3::X * 0.2, Vec3::Y * 0.1), lamp(radiance), world),
            1 => scene.add_at(quad(Vec3::ZERO, Vec3::X * 0.15, Vec3::Y * 0.15), two_sided, world),
            _ => scene.add_at(cuboid(Vec3::ZERO, Vec3::splat(0.08)), lamp(radiance), world),
        };
    }
    scene
}

fn view() -> Camera {
    camera(Vec3::new(0.0, 2.0, 5.0), Vec3::new(0.0, 0.4, 0.0), 45.0)
}

#[test]
fn every_estimator_converges_to_the_same_image_under_sixty_lamps() {
    let mut backend = lamps().backend(Environment::none());
    let mut image = |estimator, samples| {
        let film = render(&mut backend, Frame { estimator, max_depth: 3, ..frame(view(), 24, 24, samples) });
        (mean(&film), film.resolve())
    };
    let (mis, mis_pixels) = image(Estimator::Mis, 1024);
    for (estimator, samples) in [(Estimator::BsdfOnly, 2048), (Estimator::LightOnly, 1024)] {
        let (value, pixels) = image(estimator, samples);
        assert_close(value.y, mis.y, 5e-3, &format!("{estimator:?}"));
        for quarter in 0..4 {
            let part = |p: &[[f32; 3]]| p[quarter * 144..(quarter + 1) * 144].iter().map(|c| c[1]).sum::<f32>();
            assert_close(part(&pixels), part(&mis_pixels), 1.5e-2, &format!("{estimator:?} quarter {quarter}"));
        }
    }
    assert_eq!(backend.discarded_contributions(), 0);
}

#[test]
fn a_hundred_spots_and_eight_suns_add_up() {
    let mut scene = ground();
    let mut expected = 0.0;
    for i in 0..108 {
        let position = Vec3::new(8.0 * random(i, 0) - 4.0, 0.5 + 2.0 * random(i, 1), 8.0 * random(i, 2) - 4.0);
        let direction = Vec3::new(random(i, 3) - 0.5, -0.2 - random(i, 4), random(i, 5) - 0.5).normalize();
        let mut row = LightRow {
            kind: LightKind::Spot as u32,
            position: position.to_array(),
            direction: direction.to_array(),
            range: f32::INFINITY,
            color: [1.0 + 3.0 * random(i, 6); 3],
            ..bytemuck::Zeroable::zeroed()
        };
        let (inner, outer) = (0.6f32, 1.2f32);
        row.angle_scale = 1.0 / (inner.cos() - outer.cos());
        row.angle_offset = -outer.cos() * row.angle_scale;
        if i < 8 {
            row.kind = LightKind::Directional as u32;
            expected += row.color[0] * -direction.y;
        } else {
            let distance = position.length();
            let cos = (-position / distance).dot(direction);
            let cone = (cos * row.angle_scale + row.angle_offset).clamp(0.0, 1.0);
            expected += row.color[0] * cone * cone * position.y / distance.powi(3);
        }
        scene = scene.light(row);
    }
    let value = mean(&render(&mut scene.backend(Environment::none()), at_origin(512))).x;
    assert_close(value, ALBEDO * FRAC_1_PI * expected, 5e-3, "sum");
}

#[test]
fn lamps_that_all_look_away_leave_the_dark() {
    let mut scene = ground();
    for i in 0..40 {
        let at = DVec3::new(f64::from(i % 8) - 4.0, 1.0, f64::from(i / 8) - 2.0);
        let up = quad(Vec3::ZERO, Vec3::X * 0.2, Vec3::NEG_Z * 0.2);
        scene = scene.add_at(up, lamp(5.0), DAffine3::from_translation(at));
    }
    let mut backend = scene.backend(Environment::none());
    assert_eq!(mean(&render(&mut backend, at_origin(64))), Vec3::ZERO);
    assert_eq!(backend.discarded_contributions(), 0);
}

#[test]
fn moved_lamps_are_sampled_where_they_are() {
    let whole = lamps().batch();
    let moved = lamps().transformed(DAffine3::from_translation(DVec3::new(0.0, 0.5, 0.0))).batch();
    let edit = SceneBatch {
        render_nodes: moved.render_nodes.clone(),
        scene_radius: moved.scene_radius,
        tlas: TlasAction::Rebuild,
        ..unchanged(&whole, 1)
    };
    let mut edited = lamps().backend(Environment::none());
    edited.apply(edit).unwrap();
    let mut fresh =
        lamps().transformed(DAffine3::from_translation(DVec3::new(0.0, 0.5, 0.0))).backend(Environment::none());
    let frame = Frame { max_depth: 3, ..frame(view(), 16, 16, 16) };
    assert_eq!(render(&mut edited, frame.clone()).resolve(), render(&mut fresh, frame).resolve());
}

/// One lamp after another, so that the trees follow and are not built anew.
#[test]
fn a_few_moved_lamps_among_many_light_the_room_as_if_they_had_been_there() {
    let whole = lamps().batch();
    let up = DAffine3::from_translation(DVec3::new(0.3, 0.6, 0.2));
    let moved = lamps().transformed(up).batch();
    let (mut rows, after) = (whole.render_nodes.ranges[0].rows.clone(), &moved.render_nodes.ranges[0].rows);
    let mut edited = lamps().backend(Environment::none());
    for (step, node) in (2..62).step_by(7).enumerate() {
        rows[node] = after[node];
        let mut edit = SceneBatch {
            tlas: TlasAction::Update,
            scene_radius: scene_radius(&rows, &whole.mesh_descs.ranges[0].rows),
            ..unchanged(&whole, 1 + step as u64)
        };
        edit.render_nodes.ranges = vec![RowRange { first: node as u32, rows: vec![rows[node]] }];
        edited.apply(edit).unwrap();
        edited.validate_lights().unwrap();
    }
    let mut fresh = CpuBackend::new();
    fresh.apply(SceneBatch { render_nodes: RowWrites::whole(rows), ..whole }).unwrap();
    for estimator in [Estimator::Mis, Estimator::LightOnly] {
        let frame = Frame { estimator, max_depth: 3, ..frame(view(), 24, 24, 512) };
        let (a, b) = (mean(&render(&mut edited, frame.clone())), mean(&render(&mut fresh, frame)));
        assert_close(a.y, b.y, 5e-3, &format!("{estimator:?}"));
    }
}
