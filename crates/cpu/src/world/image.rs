//! Samples of pixels, over all layers of a view, and what the ray through a pixel's centre hits.

use super::combine::LayerSum;
use super::layers::{LayerView, WorldTracer};
use super::preview::PreviewLight;
use super::trace::{RayEnd, trace_ray};
use crate::path::PathTracer;
use crate::path::integrator::{PathCounts, PathSample};
use crate::trace::Ray;
use glam::{Vec2, Vec3};
use orthant_resident::world::view::EXHAUSTED_COLOR;

/// Traces one sample: a ray for each layer, combined. Albedo and normal are the mean over the layers.
pub fn sample_layers(
    tracer: &PathTracer,
    world: &WorldTracer,
    pixel: [u32; 3],
    film: Vec2,
    lens: Vec2,
    counts: &mut PathCounts,
) -> PathSample {
    let mut sum = LayerSum::new(world.view.combine);
    let (mut albedo, mut normal) = (Vec3::ZERO, Vec3::ZERO);
    for layer in &world.layers {
        let (ray, _) = layer.camera.camera_ray(film, lens);
        let Some(light) = &world.preview else { continue };
        let sample = trace_preview(world, layer, light, &ray, counts);
        sum.add(sample.radiance, sample.weight);
        albedo += sample.albedo;
        normal += sample.normal;
    }
    let _ = (tracer, pixel);
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
