//! Samples of pixels, over all layers of a view, and what the ray through a pixel's centre hits.

use super::combine::LayerSum;
use super::layers::{LayerView, WorldTracer};
use super::preview::PreviewLight;
use super::trace::{RayEnd, trace_ray};
use crate::path::PathTracer;
use crate::path::integrator::{PathCounts, PathSample, trace_path};
use crate::trace::Ray;
use glam::{Vec2, Vec3};
use orthant_resident::sampling::{Sampler, hash_combine};
use orthant_resident::world::view::EXHAUSTED_COLOR;

/// The seed of a layer: that of the frame for the first, so that a slice is like any other image.
#[inline]
fn layer_seed(seed: u32, index: u32) -> u32 {
    if index == 0 { seed } else { hash_combine(seed, index) }
}

/// Traces one sample of pixel (x, y): a ray for each layer, combined. All go through the same point of the film and the lens. Albedo and normal are the mean over the layers.
pub fn sample_layers(
    tracer: &PathTracer,
    world: &WorldTracer,
    [x, y, sample_index]: [u32; 3],
    film: Vec2,
    lens: Vec2,
    counts: &mut PathCounts,
) -> PathSample {
    let mut sum = LayerSum::new(world.view.combine);
    let (mut albedo, mut normal) = (Vec3::ZERO, Vec3::ZERO);
    for (index, layer) in world.layers.iter().enumerate() {
        let (ray, cone) = layer.camera.camera_ray(film, lens);
        let sample = match &world.preview {
            Some(light) => trace_preview(world, layer, light, &ray, counts),
            None => {
                let sampler = Sampler::new(layer_seed(tracer.frame.seed, index as u32), x, y, sample_index);
                trace_path(tracer, Some(layer), &sampler, ray, cone, counts)
            }
        };
        sum.add(sample.radiance, sample.weight);
        albedo += sample.albedo;
        normal += sample.normal;
    }
    let layers = world.layers.len() as f32;
    PathSample { radiance: sum.color(), albedo: albedo / layers, normal: normal / layers, weight: None }
}

/// Follows a camera ray of a layer to what it sees, without further rays.
pub fn trace_preview(
    world: &WorldTracer,
    layer: &LayerView,
    light: &PreviewLight,
    ray: &Ray,
    counts: &mut PathCounts,
) -> PathSample {
    counts.rays.camera += 1;
    let world_ray = world.ray(layer, ray);
    let transit = trace_ray(&world.scene, &world_ray, &mut counts.world);
    match transit.end {
        RayEnd::Hit(hit) => {
            let (surface, normal) = world.surface(layer, ray, &world_ray, &hit);
            let seen = light.shade(surface.albedo, surface.emission, normal);
            PathSample {
                radiance: seen * transit.transmittance + transit.glow,
                albedo: surface.albedo,
                normal,
                weight: Some(surface.weight),
            }
        }
        RayEnd::Sky => PathSample {
            radiance: light.sky(ray.direction) * transit.transmittance + transit.glow,
            ..PathSample::default()
        },
        RayEnd::Exhausted => {
            PathSample { radiance: Vec3::from_array(EXHAUSTED_COLOR), weight: Some(1.0), ..PathSample::default() }
        }
    }
}
