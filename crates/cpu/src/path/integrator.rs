//! The loop over the vertices of a path.

use super::PathTracer;
use super::alpha::accept_hit;
use super::bsdf::{ShadingBsdf, valid_shading_normal};
use super::cone::RayCone;
use super::lights::distant::{
    environment_pdf, environment_radiance, sample_environment, sample_sun_disc, sun_radiance,
};
use super::lights::emitter::{emitter_pdf, sample_emitter};
use super::lights::punctual::sample_punctual;
use super::lights::{LightSample, power_heuristic};
use super::material::{TextureFrame, base_color, bsdf_parameters, emitted_radiance, is_unlit, shading_normal};
use super::offset::SHADOW_END;
use super::surface::SurfacePoint;
use crate::trace::Ray;
use glam::{Vec2, Vec3};
use orthant_resident::backend::RayCounts;
use orthant_resident::frame::Estimator;
use orthant_resident::sampling::{DimensionSet, Sampler};
use orthant_resident::world::WorldCounts;

/// Most probability with which Russian roulette lets a path go on.
const MAX_SURVIVAL: f32 = 0.95;

/// What one path brings back.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathSample {
    /// Radiance.
    pub radiance: Vec3,
    /// Base colour of the first surface; 0 where there is none.
    pub albedo: Vec3,
    /// World-space shading normal of the first surface; 0 where there is none.
    pub normal: Vec3,
    /// Weight of the first surface in the `integral` mode of worlds; `None` where there is none.
    pub weight: Option<f32>,
}

/// Counters of the work of one thread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathCounts {
    /// Rays.
    pub rays: RayCounts,
    /// Work in the world.
    pub world: WorldCounts,
    /// Contributions that were not finite and were left out.
    pub discarded: u64,
}

/// Sums up the contributions of a path.
#[derive(Default)]
struct Gathered {
    direct: Vec3,
    indirect: Vec3,
    discarded: u64,
}

impl Gathered {
    /// `edges` counts the edges between camera and light; 1 and 2 are direct.
    #[inline]
    fn add(&mut self, contribution: Vec3, edges: u32) {
        if !contribution.is_finite() {
            self.discarded += 1;
        } else if edges <= 2 {
            self.direct += contribution;
        } else {
            self.indirect += contribution;
        }
    }

    #[inline]
    fn radiance(&self, clamp: Option<f32>) -> Vec3 {
        let brightest = self.indirect.max_element();
        match clamp {
            Some(limit) if brightest > limit => self.direct + self.indirect * (limit / brightest),
            _ => self.direct + self.indirect,
        }
    }
}

/// The vertex that a ray comes from: what MIS needs to know where it hits a light.
#[derive(Clone, Copy)]
struct Previous {
    position: Vec3,
    /// Geometric normal on the side from which it was seen.
    geometric: Vec3,
    /// Density of the BSDF sample; 0 for the camera, which no other strategy competes with.
    pdf: f32,
}

/// Traces one path from the camera.
pub fn trace_path(
    tracer: &PathTracer,
    sampler: &Sampler,
    mut ray: Ray,
    mut cone: RayCone,
    counts: &mut PathCounts,
) -> PathSample {
    let (scene, frame) = (tracer.scene, tracer.frame);
    let mut sample = PathSample::default();
    let mut gathered = Gathered::default();
    let mut throughput = Vec3::ONE;
    let mut previous = Previous { position: ray.origin, geometric: Vec3::ZERO, pdf: 0.0 };

    for depth in 1..=frame.max_depth {
        // Find the next vertex
        let alpha_key = sampler.alpha_key(2 * (depth - 1));
        if depth == 1 {
            counts.rays.camera += 1;
        } else {
            counts.rays.bounce += 1;
        }
        let Some(hit) = scene.closest_hit(&ray, |hit| accept_hit(scene, hit, alpha_key)) else {
            gathered.add(throughput * distant_radiance(tracer, ray.direction, previous), depth);
            break;
        };
        let point = SurfacePoint::new(scene, hit.render_node, hit.triangle, hit.b1, hit.b2);
        let back_face = hit.back_face;
        let wo = -ray.direction;
        let mut geometric = if back_face { -point.front } else { point.front };
        if geometric.dot(wo) < 0.0 {
            // Seen edge-on: rounding disagrees with the hit about the face.
            geometric = -geometric;
        }
        let textures = TextureFrame::new(scene, &point, cone.footprint(hit.t, geometric.dot(wo)));
        let unlit = is_unlit(&point);

        // Add what it emits
        if unlit || point.material.is_emissive() {
            let emitted = emitted_radiance(scene, &point, &textures);
            let weight = emission_weight(tracer, &point, geometric.dot(wo), previous);
            gathered.add(throughput * emitted * weight, depth);
        }
        let shading = if depth > 1 && (unlit || depth == frame.max_depth) {
            geometric
        } else {
            let n = shading_normal(scene, &point, &textures);
            valid_shading_normal(if back_face { -n } else { n }, geometric, wo)
        };
        if depth == 1 {
            sample.albedo = base_color(scene, &point, &textures);
            sample.normal = shading;
        }
        if unlit || depth == frame.max_depth {
            break;
        }

        let parameters = bsdf_parameters(scene, &point, &textures);
        let bsdf = ShadingBsdf::new(&parameters, shading, geometric, wo);
        let [u0, u1, lobe, roulette] = sampler.set(depth, DimensionSet::Bsdf);
        let next = bsdf.sample(Vec2::new(u0, u1), lobe);
        let spread = bsdf.local.spread(next.map_or(0.0, |s| s.value.pdf));
        cone = cone.propagate(hit.t, spread);

        // Sample the lights
        let vertex = Vertex { point: &point, geometric, shading, bsdf: &bsdf, cone, depth };
        let direct = sample_lights(tracer, sampler, &vertex, counts);
        gathered.add(throughput * direct, depth + 1);

        // Go on in a sampled direction
        let Some(next) = next else { break };
        throughput *= next.value.f_cos / next.value.pdf;
        if !(throughput.max_element() > 0.0 && throughput.is_finite()) {
            gathered.discarded += u64::from(!throughput.is_finite());
            break;
        }
        if depth >= frame.roulette_depth {
            let survival = throughput.max_element().min(MAX_SURVIVAL);
            if roulette >= survival {
                break;
            }
            throughput /= survival;
        }
        previous = Previous { position: point.position, geometric, pdf: next.value.pdf };
        ray = Ray::new(point.ray_origin(geometric), next.direction);
    }
    counts.discarded += gathered.discarded;
    sample.radiance = gathered.radiance(frame.firefly_clamp);
    sample
}

/// Weight of light that a ray found by itself, where next event estimation would have found it with density `light_pdf`.
#[inline]
fn found_weight(estimator: Estimator, previous: Previous, light_pdf: f32) -> f32 {
    if previous.pdf == 0.0 || light_pdf <= 0.0 {
        return 1.0;
    }
    match estimator {
        Estimator::BsdfOnly => 1.0,
        Estimator::LightOnly => 0.0,
        Estimator::Mis => power_heuristic(previous.pdf, light_pdf),
    }
}

/// Radiance from infinity that a ray finds.
#[inline]
fn distant_radiance(tracer: &PathTracer, direction: Vec3, previous: Previous) -> Vec3 {
    let (lights, estimator) = (tracer.lights, tracer.frame.estimator);
    let mut radiance = Vec3::ZERO;
    if lights.map.is_some() {
        let weight = found_weight(estimator, previous, environment_pdf(lights, direction));
        radiance += environment_radiance(lights, direction) * weight;
    }
    if let Some((sun, pdf)) = sun_radiance(lights, direction) {
        radiance += sun * found_weight(estimator, previous, pdf);
    }
    radiance
}

/// Weight of the emission at a hit under the cosine `cos`.
#[inline]
fn emission_weight(tracer: &PathTracer, point: &SurfacePoint, cos: f32, previous: Previous) -> f32 {
    if previous.pdf == 0.0 {
        return 1.0;
    }
    let light_pdf = emitter_pdf(tracer.scene, tracer.lights, point, previous.position, previous.geometric, cos);
    found_weight(tracer.frame.estimator, previous, light_pdf)
}

/// A vertex at which lights are sampled.
struct Vertex<'a> {
    point: &'a SurfacePoint<'a>,
    geometric: Vec3,
    shading: Vec3,
    bsdf: &'a ShadingBsdf,
    cone: RayCone,
    depth: u32,
}

/// Reflected radiance from sampled lights: one with a size, one without.
#[inline]
fn sample_lights(tracer: &PathTracer, sampler: &Sampler, vertex: &Vertex, counts: &mut PathCounts) -> Vec3 {
    let (scene, lights) = (tracer.scene, tracer.lights);
    let mut reflected = Vec3::ZERO;
    if tracer.frame.estimator != Estimator::BsdfOnly && !lights.kinds.is_empty() {
        let u = sampler.set(vertex.depth, DimensionSet::Light);
        if let Some(light) = sample_sized_light(tracer, vertex, u) {
            let value = vertex.bsdf.evaluate(light.direction);
            let weight = match tracer.frame.estimator {
                Estimator::LightOnly => 1.0,
                _ => power_heuristic(light.pdf, value.pdf),
            };
            let contribution = value.f_cos * light.radiance * (weight / light.pdf);
            if contribution != Vec3::ZERO && is_visible(tracer, sampler, vertex, &light, counts) {
                reflected += contribution;
            }
        }
    }
    if !lights.punctual.is_empty() {
        let [seed, choice, _, _] = sampler.set(vertex.depth, DimensionSet::Punctual);
        let position = vertex.point.position;
        let light = sample_punctual(scene, lights, position, vertex.geometric, vertex.shading, seed, choice);
        if let Some(light) = light {
            let contribution = vertex.bsdf.evaluate(light.direction).f_cos * light.radiance;
            if contribution != Vec3::ZERO && is_visible(tracer, sampler, vertex, &light, counts) {
                reflected += contribution;
            }
        }
    }
    reflected
}

/// Samples a light with a size; the density is complete.
#[inline]
fn sample_sized_light(tracer: &PathTracer, vertex: &Vertex, u: [f32; 4]) -> Option<LightSample> {
    let (scene, lights) = (tracer.scene, tracer.lights);
    let kinds = &lights.kinds;
    let [u0, u1, pick, pick_triangle] = u;
    let u = Vec2::new(u0, u1);
    let (sample, probability) = if pick < kinds.emitters {
        let pick = (pick / kinds.emitters).min(1.0 - f32::EPSILON / 2.0);
        let (from, normal) = (vertex.point.position, vertex.geometric);
        (sample_emitter(scene, lights, from, normal, vertex.cone, pick, pick_triangle, u), kinds.emitters)
    } else if pick < kinds.emitters + kinds.environment || kinds.sun == 0.0 {
        (sample_environment(lights, u), kinds.environment)
    } else {
        (sample_sun_disc(lights, u), kinds.sun)
    };
    let mut sample = sample?;
    sample.pdf *= probability;
    (sample.pdf > 0.0).then_some(sample)
}

/// Whether nothing is between a vertex and a light.
#[inline]
fn is_visible(
    tracer: &PathTracer,
    sampler: &Sampler,
    vertex: &Vertex,
    light: &LightSample,
    counts: &mut PathCounts,
) -> bool {
    counts.rays.shadow += 1;
    let scene = tracer.scene;
    let origin = vertex.point.ray_origin(vertex.geometric);
    let ray = match light.end {
        Some(end) => Ray { origin, direction: end - origin, t_min: 0.0, t_max: SHADOW_END },
        None => Ray::new(origin, light.direction),
    };
    let alpha_key = sampler.alpha_key(2 * (vertex.depth - 1) + 1);
    !scene.any_hit(&ray, |hit| accept_hit(scene, hit, alpha_key))
}
