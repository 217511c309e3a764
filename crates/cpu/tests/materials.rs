//! Textures, levels of detail, normal maps, unlit surfaces and the camera, as they are seen in images.

mod common;
use common::*;
use glam::{Vec2, Vec3};
use orthant_resident::camera::Projection;
use orthant_resident::image::{ImageData, MipLevel, Sampling, TexelFormat};
use orthant_resident::rows::{LightKind, LightRow, MaterialFlags, MaterialRow, TextureSlot};
use orthant_resident::{Camera, Environment, Frame};
use std::f32::consts::FRAC_1_PI;

const SLOT: TextureSlot = TextureSlot { texture: 0, ..TextureSlot::NONE };

/// 256 x 256 floats; level k is k everywhere.
fn numbered_levels() -> ImageData {
    let mut image = ImageData { format: TexelFormat::Rgba32Float, levels: vec![], texels: vec![] };
    for k in 0..9 {
        let size = 256u32 >> k;
        image.levels.push(MipLevel { width: size, height: size, offset: image.texels.len() });
        for _ in 0..size * size {
            for v in [k as f32, k as f32, k as f32, 1.0] {
                image.texels.extend(v.to_le_bytes());
            }
        }
    }
    image
}

fn one_texel(rgba: [u8; 4]) -> ImageData {
    ImageData {
        format: TexelFormat::Rgba8Linear,
        levels: vec![MipLevel { width: 1, height: 1, offset: 0 }],
        texels: rgba.to_vec(),
    }
}

fn unlit() -> MaterialRow {
    MaterialRow { flags: MaterialFlags::UNLIT, base_color_texture: SLOT, ..MaterialRow::DEFAULT }
}

#[test]
fn the_level_of_detail_is_where_a_pixel_covers_a_texel() {
    // A square of 2 m has 256 texels; a pixel of the orthographic view covers 2^k of them.
    for k in [0.0f32, 1.0, 2.5, 4.0] {
        let scene = SceneBuilder::default()
            .add(quad(Vec3::ZERO, Vec3::X, Vec3::Y), unlit())
            .texture(numbered_levels(), Sampling::default());
        let half_height = k.exp2() / 128.0 * 4.0;
        let projection = Projection::Orthographic { half_height };
        let view = Camera { projection, ..camera(Vec3::Z * 3.0, Vec3::ZERO, 1.0) };
        let value = mean(&render(&mut scene.backend(Environment::none()), frame(view, 8, 8, 1))).x;
        assert!((value - k).abs() < 1e-3, "{k}: {value}");

        // The same by perspective, from the distance at which a pixel is as large.
        let distance = 10.0;
        let projection = Projection::Perspective { tan_half_fov_y: half_height / distance };
        let view = Camera { projection, ..camera(Vec3::Z * distance, Vec3::ZERO, 1.0) };
        let value = mean(&render(&mut scene.backend(Environment::none()), frame(view, 8, 8, 1))).x;
        assert!((value - k).abs() < 1e-2, "{k}: {value}");
    }
}

#[test]
fn a_texture_transform_changes_the_level() {
    let slot = TextureSlot { transform: [[4.0, 0.0, 0.3], [0.0, 4.0, 0.1]], ..SLOT };
    let scene = SceneBuilder::default()
        .add(quad(Vec3::ZERO, Vec3::X, Vec3::Y), MaterialRow { base_color_texture: slot, ..unlit() })
        .texture(numbered_levels(), Sampling::default());
    let projection = Projection::Orthographic { half_height: 4.0 / 128.0 };
    let view = Camera { projection, ..camera(Vec3::Z * 3.0, Vec3::ZERO, 1.0) };
    let value = mean(&render(&mut scene.backend(Environment::none()), frame(view, 8, 8, 1))).x;
    assert!((value - 2.0).abs() < 1e-3, "{value}");
}

#[test]
fn a_diffuse_bounce_reads_coarser_levels_than_the_camera() {
    let cone = orthant_cpu::path::cone::RayCone { width: 0.0, spread: 0.001 };
    let bounced = cone.propagate(2.0, 0.2);
    assert!((bounced.width - 0.002).abs() < 1e-9);
    assert!(bounced.footprint(1.0, 1.0) > 1e4 * cone.footprint(1.0, 1.0));
}

/// Radiance of a Lambertian wall at z = 0 that looks along +z, under a directional light.
fn lit_wall(material: MaterialRow, image: ImageData, light_from: Vec3, eye: Vec3) -> f32 {
    let scene = SceneBuilder::default()
        .add(quad(Vec3::ZERO, Vec3::X, Vec3::Y), material)
        .texture(image, Sampling::default())
        .light(LightRow {
            kind: LightKind::Directional as u32,
            direction: (-light_from.normalize()).to_array(),
            color: [1.0; 3],
            ..bytemuck::Zeroable::zeroed()
        });
    let view = Frame { max_depth: 2, ..frame(camera(eye, Vec3::ZERO, 5.0), 8, 8, 16) };
    mean(&render(&mut scene.backend(Environment::none()), view)).x
}

#[test]
fn a_normal_map_tilts_towards_u_and_up() {
    let mapped = MaterialRow { normal_texture: SLOT, ..lambert(1.0) };
    // x = 0.6 and y = 0 to 8 bits; z follows.
    let (x, flat) = (128 + 76, 128);
    let tilted = |r: u8, g: u8, light: Vec3| lit_wall(mapped, one_texel([r, g, 230, 255]), light, Vec3::Z * 3.0);
    let normal = |r: u8, g: u8| (Vec3::new(r as f32, g as f32, 230.0) / 255.0 * 2.0 - 1.0).normalize();
    for light in [Vec3::new(0.5, 0.0, 1.0), Vec3::new(-0.3, 0.1, 1.0), Vec3::new(0.0, 0.5, 1.0)] {
        let expected = |n: Vec3| n.dot(light.normalize()) * FRAC_1_PI;
        assert_close(tilted(x, flat, light), expected(normal(x, flat)), 1e-2, "towards +u");
        assert_close(tilted(flat, x, light), expected(normal(flat, x)), 1e-2, "towards +y");
    }
    // The scale multiplies x and y.
    let scaled = MaterialRow { normal_scale: 0.0, ..mapped };
    let light = Vec3::new(0.5, 0.0, 1.0);
    let value = lit_wall(scaled, one_texel([x, flat, 230, 255]), light, Vec3::Z * 3.0);
    assert_close(value, light.normalize().z * FRAC_1_PI, 1e-3, "scale 0");
}

#[test]
fn both_faces_of_a_double_sided_wall_are_lit_alike() {
    let both = MaterialRow { flags: MaterialFlags::DOUBLE_SIDED, ..lambert(0.8) };
    let white = || one_texel([255; 4]);
    let front = lit_wall(both, white(), Vec3::new(0.3, 0.0, 1.0), Vec3::Z * 3.0);
    let back = lit_wall(both, white(), Vec3::new(0.3, 0.0, -1.0), Vec3::NEG_Z * 3.0);
    assert_close(back, front, 1e-3, "back");
    assert_eq!(lit_wall(lambert(0.8), white(), Vec3::new(0.3, 0.0, -1.0), Vec3::NEG_Z * 3.0), 0.0);
}

#[test]
fn base_color_is_factor_times_texture_times_vertex_color() {
    let mut mesh = quad(Vec3::ZERO, Vec3::X, Vec3::Y);
    mesh.colors = vec![[0.5, 0.25, 1.0, 1.0]; 4];
    let material = MaterialRow { base_color: [0.5, 1.0, 0.2, 1.0], ..unlit() };
    let scene = SceneBuilder::default()
        .add(mesh, material)
        .texture(ImageData { format: TexelFormat::Rgba8Srgb, ..one_texel([128, 255, 255, 255]) }, Sampling::default());
    let film = render(&mut scene.backend(Environment::none()), frame(camera(Vec3::Z * 3.0, Vec3::ZERO, 5.0), 8, 8, 1));
    let srgb = ((128.0f32 / 255.0 + 0.055) / 1.055).powf(2.4);
    assert!((mean(&film) - Vec3::new(0.25 * srgb, 0.25, 0.2)).abs().max_element() < 1e-5, "{}", mean(&film));
}

#[test]
fn unlit_surfaces_show_their_colour_and_block_light() {
    let unlit = MaterialRow { base_color: [0.3, 0.3, 0.3, 1.0], flags: MaterialFlags::UNLIT, ..MaterialRow::DEFAULT };
    let scene = SceneBuilder::default().add(sphere(Vec3::ZERO, 1.0, 16), unlit);
    let film = render(
        &mut scene.backend(Environment::constant([5.0; 3])),
        frame(camera(Vec3::Z * 5.0, Vec3::ZERO, 5.0), 8, 8, 4),
    );
    assert_close(mean(&film).x, 0.3, 1e-5, "unlit");
}

#[test]
fn near_and_far_cut_along_the_forward_axis() {
    let unlit = MaterialRow { base_color: [0.3, 0.3, 0.3, 1.0], flags: MaterialFlags::UNLIT, ..MaterialRow::DEFAULT };
    let scene = SceneBuilder::default().add(quad(Vec3::ZERO, Vec3::X * 9.0, Vec3::Y * 9.0), unlit);
    let mut backend = scene.backend(Environment::none());
    let mut seen = |near: f32, far: f32| {
        let view = Camera { near, far, ..camera(Vec3::Z * 5.0, Vec3::ZERO, 60.0) };
        mean(&render(&mut backend, frame(view, 16, 16, 4))).x
    };
    assert_close(seen(4.99, 5.01), 0.3, 1e-5, "between");
    assert_eq!(seen(5.01, 100.0), 0.0);
    assert_eq!(seen(0.1, 4.99), 0.0);
}

#[test]
fn a_lens_keeps_the_plane_in_focus_sharp() {
    let view = Camera { lens_radius: 0.3, focus_distance: 4.0, ..camera(Vec3::ZERO, Vec3::NEG_Z, 40.0) };
    let view = orthant_cpu::path::camera::View::new(&frame(view, 64, 48, 1));
    let film = Vec2::new(10.0, 40.0);
    let at = |lens: Vec2, depth: f32| {
        let (ray, _) = view.camera_ray(film, lens);
        ray.origin + ray.direction * (depth / -ray.direction.z)
    };
    let center = at(Vec2::splat(0.5), 4.0);
    let mut blur = 0.0f32;
    for i in 0..64 {
        let lens = Vec2::new((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5) / 8.0;
        assert!(at(lens, 4.0).distance(center) < 1e-5);
        blur = blur.max(at(lens, 8.0).distance(at(Vec2::splat(0.5), 8.0)));
    }
    assert!(blur > 0.25 && blur <= 0.3 + 1e-4, "{blur}");
}
