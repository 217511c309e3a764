//! Every estimator converges to the same mean.

mod common;
use common::*;
use glam::Vec3;
use orthant_resident::environment::{EnvironmentMap, Sun};
use orthant_resident::frame::Estimator;
use orthant_resident::image::{ImageData, MipLevel, Sampling, TexelFormat};
use orthant_resident::rows::{LightKind, LightRow, MaterialFlags, MaterialRow, TextureSlot};
use orthant_resident::{Environment, Frame};
use std::sync::Arc;

fn gradient() -> Environment {
    let (w, h) = (16, 8);
    let texels = (0..w * h).map(|i| [0.2 + (i % w) as f32 / 16.0, 0.3, 1.0 - (i / w) as f32 / 10.0]).collect();
    Environment {
        map: Some(Arc::new(EnvironmentMap { width: w, height: h, texels })),
        rotation: 0.5,
        intensity: 0.7,
        sun: Some(Sun { direction: [0.36, 0.48, 0.8], radiance: [15.0; 3], cos_radius: 0.97 }),
    }
}

fn stripes() -> ImageData {
    let row: Vec<u8> = (0..8).flat_map(|x| if x % 4 < 2 { [255, 255, 255, 255] } else { [40, 20, 0, 255] }).collect();
    ImageData { format: TexelFormat::Rgba8Srgb, levels: vec![MipLevel { width: 8, height: 1, offset: 0 }], texels: row }
}

fn scene() -> SceneBuilder {
    let glossy =
        MaterialRow { base_color: [0.8, 0.5, 0.3, 1.0], metallic: 0.0, roughness: 0.35, ..MaterialRow::DEFAULT };
    let metal = MaterialRow { base_color: [0.9, 0.8, 0.5, 1.0], roughness: 0.4, ..MaterialRow::DEFAULT };
    let textured = MaterialRow {
        emissive: [6.0; 3],
        emissive_texture: TextureSlot { texture: 0, ..TextureSlot::NONE },
        ..lambert(0.0)
    };
    let two_sided = MaterialRow { flags: MaterialFlags::DOUBLE_SIDED, ..lamp(2.0) };
    SceneBuilder::default()
        .add(quad(Vec3::ZERO, Vec3::X * 4.0, Vec3::NEG_Z * 4.0), glossy)
        .add(sphere(Vec3::new(-0.6, 0.5, 0.0), 0.5, 24), metal)
        .add(cuboid(Vec3::new(0.8, 0.4, -0.3), Vec3::splat(0.4)), lambert(0.7))
        .add(quad(Vec3::new(0.0, 2.0, 0.0), Vec3::X * 0.7, Vec3::Z * 0.7), textured)
        .add(quad(Vec3::new(0.2, 0.6, 0.7), Vec3::X * 0.3, Vec3::Y * 0.3), two_sided)
        .texture(stripes(), Sampling::default())
        .light(LightRow {
            kind: LightKind::Point as u32,
            position: [-1.5, 1.5, 1.0],
            range: f32::INFINITY,
            color: [0.5; 3],
            ..bytemuck::Zeroable::zeroed()
        })
}

#[test]
fn all_estimators_converge_to_the_same_image() {
    let mut backend = scene().backend(gradient());
    let view = camera(Vec3::new(0.0, 1.6, 4.0), Vec3::new(0.0, 0.5, 0.0), 40.0);
    let image = |backend: &mut _, estimator, samples| {
        let film = render(backend, Frame { estimator, max_depth: 4, ..frame(view, 24, 24, samples) });
        (mean(&film), film.resolve())
    };
    let (mis, mis_pixels) = image(&mut backend, Estimator::Mis, 1024);
    for (estimator, samples) in [(Estimator::BsdfOnly, 2048), (Estimator::LightOnly, 2048)] {
        let (value, pixels) = image(&mut backend, estimator, samples);
        for k in 0..3 {
            assert_close(value[k], mis[k], 5e-3, &format!("{estimator:?}"));
        }
        // By quarters of the image too, so that errors cannot cancel.
        for quarter in 0..4 {
            let part = |p: &[[f32; 3]]| p[quarter * 144..(quarter + 1) * 144].iter().map(|c| c[1]).sum::<f32>();
            assert_close(part(&pixels), part(&mis_pixels), 1e-2, &format!("{estimator:?} quarter {quarter}"));
        }
    }
    assert_eq!(backend.discarded_contributions(), 0);
}

#[test]
fn a_clamp_dims_indirect_light_only() {
    let mut backend = scene().backend(gradient());
    let view = camera(Vec3::new(0.0, 1.6, 4.0), Vec3::new(0.0, 0.5, 0.0), 40.0);
    let brightness = |backend: &mut _, max_depth, firefly_clamp| {
        mean(&render(backend, Frame { max_depth, firefly_clamp, ..frame(view, 24, 24, 64) })).y
    };
    assert_eq!(brightness(&mut backend, 2, Some(1e-3)), brightness(&mut backend, 2, None));
    let (direct, all) = (brightness(&mut backend, 2, None), brightness(&mut backend, 6, None));
    let clamped = brightness(&mut backend, 6, Some(0.05));
    assert!(direct < clamped && clamped < all, "{direct} {clamped} {all}");
}
