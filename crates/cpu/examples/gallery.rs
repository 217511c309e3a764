//! Renders a scene that shows every part of the path tracer, and a box for measuring, and prints the speed.
//!
//!     cargo run --release -p orthant-cpu --example gallery -- gallery|box OUT.png [SAMPLES] [SIZE]

#[path = "../tests/common/mod.rs"]
mod common;

use common::*;
use glam::Vec3;
use orthant_resident::environment::{EnvironmentMap, Sun};
use orthant_resident::frame::PixelFilter;
use orthant_resident::image::{ImageData, MipLevel, Sampling, TexelFormat};
use orthant_resident::rows::*;
use orthant_resident::{Backend, Camera, Environment, Frame};
use std::sync::Arc;
use std::time::Duration;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, scene, out, rest @ ..] = arguments.as_slice() else {
        eprintln!("usage: gallery gallery|box OUT.png [SAMPLES] [SIZE]");
        std::process::exit(2);
    };
    let number = |i: usize, default: u32| rest.get(i).and_then(|v| v.parse().ok()).unwrap_or(default);
    let (samples, size) = (number(0, 64), number(1, 512));
    let (scene, environment, view) = if scene == "box" { cornell() } else { gallery() };
    let mut backend = scene.backend(environment);
    let frame = Frame {
        filter: PixelFilter::BlackmanHarris { radius: 1.5 },
        roulette_depth: 3,
        ..frame(view, size, size, samples)
    };
    let ticket = backend.submit(frame).expect("the frame is valid");
    let status = loop {
        let status = backend.poll(ticket, Duration::from_millis(200)).expect("the ticket is alive");
        if status.is_done() {
            break status;
        }
    };
    let seconds = status.elapsed.as_secs_f64();
    println!(
        "{:.2} s, {:.3} Msamples/s, {:.3} Mrays/s, {:.2} rays a sample, {} discarded",
        seconds,
        status.done as f64 / seconds / 1e6,
        status.rays.total() as f64 / seconds / 1e6,
        status.rays.total() as f64 / status.done as f64,
        backend.discarded_contributions()
    );
    let film = backend.read_film(ticket).expect("the ticket is alive");
    let encode = |v: f32| {
        let v = v.clamp(0.0, 1.0);
        let s = if v <= 0.0031308 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (s * 255.0 + 0.5) as u8
    };
    let pixels: Vec<u8> = film.resolve().iter().flatten().map(|&v| encode(v)).collect();
    image::save_buffer(out, &pixels, size, size, image::ColorType::Rgb8).expect("the image is written");
}

fn colored(r: f32, g: f32, b: f32, metallic: f32, roughness: f32) -> MaterialRow {
    MaterialRow { base_color: [r, g, b, 1.0], metallic, roughness, ..MaterialRow::DEFAULT }
}

/// The usual box: 36 triangles, one lamp.
fn cornell() -> (SceneBuilder, Environment, Camera) {
    let white = colored(0.73, 0.73, 0.73, 0.0, 0.9);
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let scene = SceneBuilder::default()
        .add(quad(-y, x, -z), white)
        .add(quad(y, x, z), white)
        .add(quad(-z, x, y), white)
        .add(quad(-x, -z, y), colored(0.63, 0.06, 0.05, 0.0, 0.9))
        .add(quad(x, z, y), colored(0.14, 0.45, 0.09, 0.0, 0.9))
        .add(cuboid(Vec3::new(-0.35, -0.4, -0.3), Vec3::new(0.28, 0.6, 0.28)), white)
        .add(cuboid(Vec3::new(0.35, -0.7, 0.3), Vec3::splat(0.3)), white)
        .add(quad(Vec3::new(0.0, 0.99, 0.0), x * 0.25, z * 0.25), lamp(15.0));
    (scene, Environment::none(), camera(Vec3::new(0.0, 0.0, 3.8), Vec3::ZERO, 40.0))
}

/// A checkerboard with its mip chain.
fn checkerboard() -> ImageData {
    let mut image = ImageData { format: TexelFormat::Rgba8Srgb, levels: vec![], texels: vec![] };
    for k in 0..7u32 {
        let n = 64 >> k;
        image.levels.push(MipLevel { width: n, height: n, offset: image.texels.len() });
        for i in 0..n * n {
            let white = ((i % n) / (8 >> k.min(3)) + (i / n) / (8 >> k.min(3))) % 2 == 0;
            let v = if k > 3 {
                150
            } else if white {
                200
            } else {
                60
            };
            image.texels.extend([v, v, v, 255]);
        }
    }
    image
}

/// Bumps as a normal map, and holes as alpha.
fn bumps(alpha: bool) -> ImageData {
    let n = 64u32;
    let texels = (0..n * n).flat_map(|i| {
        let (u, v) = ((i % n) as f32 / n as f32 - 0.5, (i / n) as f32 / n as f32 - 0.5);
        let r = (u * u + v * v).sqrt();
        if alpha {
            return [220, 180, 90, if r < 0.35 { 0 } else { 255 }];
        }
        let tilt = if r < 0.4 { (r * 7.8).sin() * 0.7 } else { 0.0 };
        let d = Vec3::new(u / r.max(1e-3) * tilt, -v / r.max(1e-3) * tilt, 1.0).normalize();
        let byte = |c: f32| (c * 127.0 + 128.0) as u8;
        [byte(d.x), byte(d.y), byte(d.z), 255]
    });
    let level = MipLevel { width: n, height: n, offset: 0 };
    ImageData { format: TexelFormat::Rgba8Linear, levels: vec![level], texels: texels.collect() }
}

fn gallery() -> (SceneBuilder, Environment, Camera) {
    let tiled = |texture: u32, times: f32| TextureSlot {
        texture,
        uv_set: 0,
        transform: [[times, 0.0, 0.0], [0.0, times, 0.0]],
    };
    let floor = MaterialRow { base_color_texture: tiled(0, 16.0), ..colored(1.0, 1.0, 1.0, 0.0, 0.35) };
    let mut scene = SceneBuilder::default()
        .texture(checkerboard(), Sampling::default())
        .texture(bumps(false), Sampling::default())
        .texture(bumps(true), Sampling::default())
        .add(quad(Vec3::ZERO, Vec3::X * 20.0, Vec3::NEG_Z * 20.0), floor);
    for (i, roughness) in [0.0, 0.15, 0.3, 0.6, 1.0].into_iter().enumerate() {
        let x = i as f32 * 1.1 - 2.2;
        scene = scene
            .add(sphere(Vec3::new(x, 0.5, 0.0), 0.5, 48), colored(0.95, 0.75, 0.4, 1.0, roughness))
            .add(sphere(Vec3::new(x, 0.5, -1.6), 0.5, 48), colored(0.2, 0.4, 0.8, 0.0, roughness));
    }
    let mapped = MaterialRow { normal_texture: tiled(1, 6.0), ..colored(0.7, 0.2, 0.2, 0.0, 0.3) };
    let holes = MaterialRow {
        base_color_texture: tiled(2, 5.0),
        flags: AlphaMode::Mask as u32 | MaterialFlags::DOUBLE_SIDED,
        ..colored(1.0, 1.0, 1.0, 0.0, 0.6)
    };
    let glassy = MaterialRow {
        base_color: [0.3, 0.8, 0.5, 0.4],
        flags: AlphaMode::Blend as u32 | MaterialFlags::DOUBLE_SIDED,
        ..colored(0.0, 0.0, 0.0, 0.0, 0.1)
    };
    scene = scene
        .add(sphere(Vec3::new(-1.3, 0.4, 1.3), 0.4, 48), mapped)
        .add(sphere(Vec3::new(0.0, 0.4, 1.3), 0.4, 48), holes)
        .add(quad(Vec3::new(1.2, 0.45, 1.3), Vec3::new(0.4, 0.0, 0.1), Vec3::Y * 0.45), glassy)
        .add(quad(Vec3::new(-3.4, 0.8, 0.5), Vec3::new(0.2, 0.0, -0.4), Vec3::Y * 0.5), lamp(12.0))
        .light(LightRow {
            kind: LightKind::Point as u32,
            position: [2.5, 1.2, 1.5],
            range: f32::INFINITY,
            color: [1.5, 0.6, 0.3],
            ..bytemuck::Zeroable::zeroed()
        });
    let (w, h) = (64, 32);
    let texels = (0..w * h).map(|i| {
        let up = 1.0 - (i / w) as f32 / (h / 2) as f32;
        if up >= 0.0 { [0.35 - 0.2 * up, 0.45 - 0.1 * up, 0.6 + 0.2 * up] } else { [0.1; 3] }
    });
    let environment = Environment {
        map: Some(Arc::new(EnvironmentMap { width: w, height: h, texels: texels.collect() })),
        sun: Some(Sun {
            direction: Vec3::new(0.5, 0.6, 0.45).normalize().to_array(),
            radiance: [40_000.0, 36_000.0, 30_000.0],
            cos_radius: 0.2666f32.to_radians().cos(),
        }),
        ..Environment::none()
    };
    let mut view = camera(Vec3::new(0.0, 2.2, 6.5), Vec3::new(0.0, 0.5, 0.0), 36.0);
    (view.lens_radius, view.focus_distance) = (0.03, 5.6);
    (scene, environment, view)
}
