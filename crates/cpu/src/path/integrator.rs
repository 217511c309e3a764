//! The loop over the vertices of a path.

use super::PathTracer;
use super::alpha::accept_hit;
use super::bsdf::{BsdfParameters, ShadingBsdf, valid_shading_normal};
use super::cone::RayCone;
use super::lights::distant::{
    environment_pdf, environment_radiance, sample_environment, sample_sun_disc, sun_radiance,
};
use super::lights::emitter::{emitter_pdf, sample_emitter};
use super::lights::punctual::sample_punctual;
use super::lights::{LightSample, power_heuristic};
use super::material::{TextureFrame, base_color, bsdf_parameters, emitted_radiance, is_unlit, shading_normal};
use super::offset::{SHADOW_END, offset_ray_origin};
use super::surface::SurfacePoint;
use crate::trace::Ray;
use crate::world::{LayerView, RayEnd, WorldTracer, trace_ray};
use glam::{Vec2, Vec3};
use orthant_resident::backend::RayCounts;
use orthant_resident::frame::Estimator;
use orthant_resident::sampling::{DimensionSet, Sampler};
use orthant_resident::world::WorldCounts;
use orthant_resident::world::ray::BEFORE_SCENE;
use orthant_resident::world::view::EXHAUSTED_COLOR;

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

/// Traces one path from the camera; in a world, within a layer of its view.
pub fn trace_path(
    tracer: &PathTracer,
    layer: Option<&LayerView>,
    sampler: &Sampler,
    mut ray: Ray,
    mut cone: RayCone,
    counts: &mut PathCounts,
) -> PathSample {
    let frame = tracer.frame;
    let mut sample = PathSample::default();
    let mut gathered = Gathered::default();
    let mut throughput = Vec3::ONE;
    let mut previous = Previous { position: ray.origin, geometric: Vec3::ZERO, pdf: 0.0 };

    for depth in 1..=frame.max_depth {
        // Find the next vertex
        let step = Step { depth, ray: &ray, cone, previous };
        if depth == 1 {
            counts.rays.camera += 1;
        } else {
            counts.rays.bounce += 1;
        }
        let found = match (tracer.world, layer) {
            (Some(world), Some(layer)) => {
                let passage = world_interaction(tracer, world, layer, sampler, &step, counts);
                gathered.add(throughput * passage.glow, depth);
                throughput *= passage.transmittance;
                passage.found
            }
            _ => scene_interaction(tracer, sampler, &step),
        };
        let Some(found) = found else {
            gathered.add(throughput * distant_radiance(tracer, ray.direction, previous), depth);
            break;
        };
        let Interaction { geometric, shading, .. } = found;

        // Add what it emits
        if let Some(emitted) = found.emitted {
            gathered.add(throughput * emitted, depth);
        }
        if depth == 1 {
            sample.albedo = found.albedo;
            sample.normal = shading;
            sample.weight = Some(found.weight);
        }
        let Some(parameters) = found.parameters else { break };

        let bsdf = ShadingBsdf::new(&parameters, shading, geometric, -ray.direction);
        let [u0, u1, lobe, roulette] = sampler.set(depth, DimensionSet::Bsdf);
        let next = bsdf.sample(Vec2::new(u0, u1), lobe);
        let spread = bsdf.local.spread(next.map_or(0.0, |s| s.value.pdf));
        cone = cone.propagate(found.t, spread);

        // Sample the lights
        let Interaction { position, origin, .. } = found;
        let vertex = Vertex { position, origin, geometric, shading, bsdf: &bsdf, cone, depth, layer };
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
        previous = Previous { position, geometric, pdf: next.value.pdf };
        ray = Ray::new(origin, next.direction);
    }
    counts.discarded += gathered.discarded;
    sample.radiance = gathered.radiance(frame.firefly_clamp);
    sample
}

/// The ray to the next vertex of a path.
struct Step<'a> {
    depth: u32,
    ray: &'a Ray,
    cone: RayCone,
    previous: Previous,
}

/// A vertex of a path, as far as it matters to it.
#[derive(Clone, Copy)]
struct Interaction {
    /// Parameter of the ray that led there.
    t: f32,
    position: Vec3,
    /// Where rays start that leave to the side from which it is seen.
    origin: Vec3,
    /// Geometric normal on that side.
    geometric: Vec3,
    /// Shading normal; the geometric one where nothing is asked of it.
    shading: Vec3,
    /// Emitted radiance, weighted; `None` if it does not emit.
    emitted: Option<Vec3>,
    /// Base colour; of the first vertex only.
    albedo: Vec3,
    /// Weight in the `integral` mode of worlds.
    weight: f32,
    /// How it scatters; `None` where the path ends.
    parameters: Option<BsdfParameters>,
}

/// The vertex on the model scene.
#[inline(always)]
fn scene_interaction(tracer: &PathTracer, sampler: &Sampler, step: &Step) -> Option<Interaction> {
    let (scene, frame) = (tracer.scene, tracer.frame);
    let Step { depth, ray, cone, previous } = *step;
    let alpha_key = sampler.alpha_key(2 * (depth - 1));
    let hit = scene.closest_hit(ray, |hit| accept_hit(scene, hit, alpha_key))?;
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
    let emitted = (unlit || point.material.is_emissive()).then(|| {
        let emitted = emitted_radiance(scene, &point, &textures);
        emitted * emission_weight(tracer, &point, geometric.dot(wo), previous)
    });
    let ends = unlit || depth == frame.max_depth;
    let shading = if depth > 1 && ends {
        geometric
    } else {
        let n = shading_normal(scene, &point, &textures);
        valid_shading_normal(if back_face { -n } else { n }, geometric, wo)
    };
    Some(Interaction {
        t: hit.t,
        position: point.position,
        origin: point.ray_origin(geometric),
        geometric,
        shading,
        emitted,
        albedo: if depth == 1 { base_color(scene, &point, &textures) } else { Vec3::ZERO },
        weight: 1.0,
        parameters: (!ends).then(|| bsdf_parameters(scene, &point, &textures)),
    })
}

/// What a ray through a world passes and finds.
struct Passage {
    found: Option<Interaction>,
    /// What passes from there.
    transmittance: Vec3,
    /// Radiance that arrives from the media on the way.
    glow: Vec3,
}

/// The nearer of the vertex on the model scene and that on a block. The light of blocks is found by rays alone, so that nothing
/// competes with them.
#[inline(never)]
fn world_interaction(
    tracer: &PathTracer,
    world: &WorldTracer,
    layer: &LayerView,
    sampler: &Sampler,
    step: &Step,
    counts: &mut PathCounts,
) -> Passage {
    let Step { depth, ray, .. } = *step;
    let on_scene = scene_interaction(tracer, sampler, step);
    let before = Ray { t_max: on_scene.map_or(ray.t_max, |found| found.t * BEFORE_SCENE), ..*ray };
    let world_ray = world.ray(layer, &before);
    let transit = trace_ray(&world.scene, &world_ray, &mut counts.world);
    let found = match transit.end {
        RayEnd::Sky => on_scene,
        RayEnd::Hit(hit) => {
            let (surface, normal) = world.surface(layer, ray, &world_ray, &hit);
            let position = ray.origin + ray.direction * hit.t;
            let error = world.position_error(ray, hit.t);
            Some(Interaction {
                t: hit.t,
                position,
                origin: offset_ray_origin(position, error, normal),
                geometric: normal,
                shading: valid_shading_normal(normal, normal, -ray.direction),
                emitted: (surface.emission != Vec3::ZERO).then_some(surface.emission),
                albedo: surface.albedo,
                weight: surface.weight,
                parameters: (depth < tracer.frame.max_depth).then(|| surface.bsdf_parameters()),
            })
        }
        RayEnd::Exhausted => {
            let shown = Vec3::from_array(EXHAUSTED_COLOR);
            let position = ray.origin;
            let found = Interaction {
                t: 0.0,
                position,
                origin: position,
                geometric: -ray.direction,
                shading: Vec3::ZERO,
                emitted: Some(shown),
                albedo: Vec3::ZERO,
                weight: 1.0,
                parameters: None,
            };
            return Passage { found: Some(found), transmittance: Vec3::ONE, glow: Vec3::ZERO };
        }
    };
    Passage { found, transmittance: transit.transmittance, glow: transit.glow }
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
    position: Vec3,
    /// Where rays start that leave it.
    origin: Vec3,
    geometric: Vec3,
    shading: Vec3,
    bsdf: &'a ShadingBsdf,
    cone: RayCone,
    depth: u32,
    layer: Option<&'a LayerView<'a>>,
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
            if contribution != Vec3::ZERO {
                let passes = visibility(tracer, sampler, vertex, &light, counts);
                if passes != Vec3::ZERO {
                    reflected += contribution * passes;
                }
            }
        }
    }
    if !lights.punctual.is_empty() {
        let [seed, choice, _, _] = sampler.set(vertex.depth, DimensionSet::Punctual);
        let light = sample_punctual(scene, lights, vertex.position, vertex.geometric, vertex.shading, seed, choice);
        if let Some(light) = light {
            let contribution = vertex.bsdf.evaluate(light.direction).f_cos * light.radiance;
            if contribution != Vec3::ZERO {
                let passes = visibility(tracer, sampler, vertex, &light, counts);
                if passes != Vec3::ZERO {
                    reflected += contribution * passes;
                }
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
        let (from, normal) = (vertex.position, vertex.geometric);
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

/// What passes from a light to a vertex: all or nothing, but for the media of a world.
#[inline]
fn visibility(
    tracer: &PathTracer,
    sampler: &Sampler,
    vertex: &Vertex,
    light: &LightSample,
    counts: &mut PathCounts,
) -> Vec3 {
    counts.rays.shadow += 1;
    let scene = tracer.scene;
    let origin = vertex.origin;
    let ray = match light.end {
        Some(end) => Ray { origin, direction: end - origin, t_min: 0.0, t_max: SHADOW_END },
        None => Ray::new(origin, light.direction),
    };
    let alpha_key = sampler.alpha_key(2 * (vertex.depth - 1) + 1);
    if scene.any_hit(&ray, |hit| accept_hit(scene, hit, alpha_key)) {
        return Vec3::ZERO;
    }
    match (tracer.world, vertex.layer) {
        (Some(world), Some(layer)) => world.visibility(layer, &ray, &mut counts.world),
        _ => Vec3::ONE,
    }
}
