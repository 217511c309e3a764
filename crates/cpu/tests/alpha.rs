//! Alpha cutoff and stochastic transparency.

mod common;
use common::*;
use glam::Vec3;
use orthant_resident::image::{ImageData, MipLevel, Sampling, TexelFormat};
use orthant_resident::rows::{AlphaMode, LightKind, LightRow, MaterialFlags, MaterialRow, TextureSlot};
use orthant_resident::{Environment, Frame};

/// A black, unreflecting pane of the given alpha.
fn pane(mode: AlphaMode, alpha: f32) -> MaterialRow {
    MaterialRow { base_color: [0.0, 0.0, 0.0, alpha], flags: mode as u32 | MaterialFlags::DOUBLE_SIDED, ..lambert(0.0) }
}

/// Alpha from 0 on the left to 1 on the right, 256 columns.
fn ramp() -> ImageData {
    ImageData {
        format: TexelFormat::Rgba8Linear,
        levels: vec![MipLevel { width: 256, height: 1, offset: 0 }],
        texels: (0..=255u8).flat_map(|a| [255, 255, 255, a]).collect(),
    }
}

/// Mean of what is seen through a pane that fills the view, in front of light.
fn seen_through(material: MaterialRow, panes: u32) -> f32 {
    let mut scene = SceneBuilder::default()
        .texture(ramp(), Sampling { wrap_s: orthant_resident::image::Wrap::ClampToEdge, ..Sampling::default() });
    for i in 0..panes {
        scene = scene.add(quad(Vec3::NEG_Z * i as f32 * 0.01, Vec3::X, Vec3::Y), material);
    }
    let mut frame = frame(camera(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, 11.0), 64, 64, 64);
    frame.camera.projection = orthant_resident::camera::Projection::Orthographic { half_height: 1.0 };
    mean(&render(&mut scene.backend(Environment::constant([1.0; 3])), frame)).x
}

#[test]
fn blended_surfaces_let_through_what_alpha_leaves() {
    assert_close(seen_through(pane(AlphaMode::Blend, 0.3), 1), 0.7, 3e-3, "one pane");
    assert_close(seen_through(pane(AlphaMode::Blend, 0.3), 3), 0.343, 5e-3, "three panes");
    assert_eq!(seen_through(pane(AlphaMode::Blend, 1.0), 1), 0.0);
    assert_eq!(seen_through(pane(AlphaMode::Blend, 0.0), 1), 1.0);
    let slot = TextureSlot { texture: 0, ..TextureSlot::NONE };
    let ramp = MaterialRow { base_color_texture: slot, ..pane(AlphaMode::Blend, 0.8) };
    assert_close(seen_through(ramp, 1), 0.6, 3e-3, "ramp");
}

#[test]
fn masked_surfaces_are_there_from_the_cutoff_on() {
    assert_eq!(seen_through(pane(AlphaMode::Mask, 0.49), 1), 1.0);
    assert_eq!(seen_through(pane(AlphaMode::Mask, 0.5), 1), 0.0);
    let slot = TextureSlot { texture: 0, ..TextureSlot::NONE };
    let ramp = MaterialRow { base_color_texture: slot, alpha_cutoff: 0.25, ..pane(AlphaMode::Mask, 1.0) };
    assert_close(seen_through(ramp, 1), 0.25, 1e-2, "ramp");
}

#[test]
fn opaque_surfaces_ignore_alpha() {
    assert_eq!(seen_through(pane(AlphaMode::Opaque, 0.0), 1), 0.0);
}

#[test]
fn vertex_alpha_counts() {
    let mut mesh = quad(Vec3::ZERO, Vec3::X, Vec3::Y);
    mesh.colors = vec![[1.0, 1.0, 1.0, 0.25]; 4];
    let scene = SceneBuilder::default().add(mesh, pane(AlphaMode::Blend, 0.8));
    let mut frame = frame(camera(Vec3::new(0.0, 0.0, 10.0), Vec3::ZERO, 11.0), 32, 32, 64);
    frame.camera.projection = orthant_resident::camera::Projection::Orthographic { half_height: 1.0 };
    let value = mean(&render(&mut scene.backend(Environment::constant([1.0; 3])), frame)).x;
    assert_close(value, 0.8, 5e-3, "vertex alpha");
}

#[test]
fn shadows_are_as_dark_as_the_pane() {
    let light = LightRow {
        kind: LightKind::Directional as u32,
        direction: [0.0, -1.0, 0.0],
        color: [1.0; 3],
        ..bytemuck::Zeroable::zeroed()
    };
    let brightness = |alpha: f32, mode: AlphaMode| {
        let scene = SceneBuilder::default()
            .add(quad(Vec3::ZERO, Vec3::X, Vec3::NEG_Z), lambert(0.5))
            .add(quad(Vec3::Y * 2.0, Vec3::X * 2.0, Vec3::Z * 2.0), pane(mode, alpha))
            .light(light);
        let view = camera(Vec3::new(0.0, 1.0, 1.2), Vec3::ZERO, 20.0);
        let film = render(&mut scene.backend(Environment::none()), Frame { max_depth: 2, ..frame(view, 32, 32, 64) });
        mean(&film).x
    };
    let open = brightness(0.0, AlphaMode::Blend);
    assert_close(open, 0.5 * std::f32::consts::FRAC_1_PI, 1e-3, "open");
    assert_close(brightness(0.4, AlphaMode::Blend), 0.6 * open, 5e-3, "blend");
    assert_eq!(brightness(0.6, AlphaMode::Mask), 0.0);
}
