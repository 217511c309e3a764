//! White furnace: a convex white object in an environment of radiance 1 cannot be seen.

mod common;
use common::*;
use glam::Vec3;
use orthant_resident::Environment;
use orthant_resident::rows::MaterialRow;

#[test]
fn a_white_convex_object_is_as_bright_as_its_surroundings() {
    for flat in [false, true] {
        for metallic in [0.0, 1.0] {
            for roughness in [0.0, 0.1, 0.3, 0.5, 0.8, 1.0] {
                let mesh = sphere(Vec3::ZERO, 1.0, 24);
                let mesh = if flat { mesh.flat() } else { mesh };
                let material = MaterialRow { metallic, roughness, ..MaterialRow::DEFAULT };
                let mut backend = SceneBuilder::default().add(mesh, material).backend(Environment::constant([1.0; 3]));
                // The object fills the frame but for the corners.
                let mut frame = frame(camera(Vec3::new(0.0, 1.0, 4.0), Vec3::ZERO, 27.0), 32, 32, 64);
                frame.max_depth = 64;
                let film = render(&mut backend, frame);
                let what = format!("flat {flat} metallic {metallic} roughness {roughness}");
                assert_close(mean(&film).x, 1.0, 2e-3, &what);
                // No region of it stands out either.
                for (i, row) in film.resolve().chunks(32 * 4).enumerate() {
                    let mean = row.iter().map(|p| p[0]).sum::<f32>() / row.len() as f32;
                    assert_close(mean, 1.0, 5e-3, &format!("{what}, rows {i}"));
                }
                assert_eq!(backend.discarded_contributions(), 0);
            }
        }
    }
}

#[test]
fn with_russian_roulette_the_mean_stays() {
    let material =
        MaterialRow { metallic: 1.0, roughness: 0.6, base_color: [0.7, 0.5, 0.3, 1.0], ..MaterialRow::DEFAULT };
    let mut backend = SceneBuilder::default()
        .add(cuboid(Vec3::ZERO, Vec3::splat(0.5)), material)
        .add(quad(Vec3::new(0.0, -0.5, 0.0), Vec3::X * 3.0, Vec3::NEG_Z * 3.0), material)
        .backend(Environment::constant([1.0; 3]));
    let view = camera(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, 40.0);
    let mut reference = frame(view, 32, 32, 256);
    reference.max_depth = 30;
    let mut roulette = reference.clone();
    roulette.roulette_depth = 1;
    let (a, b) = (mean(&render(&mut backend, reference)), mean(&render(&mut backend, roulette)));
    for k in 0..3 {
        assert_close(b[k], a[k], 5e-3, "channel");
    }
}
