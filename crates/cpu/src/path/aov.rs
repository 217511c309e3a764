//! Arbitrary output variables of the ray through a pixel's centre.

use super::PathTracer;
use super::alpha::surface_presence;
use super::camera::View;
use super::surface::SurfacePoint;
use crate::trace::Ray;
use crate::world::{LayerView, RayEnd, WorldTracer, trace_ray};
use glam::{Vec2, Vec3};
use orthant_resident::frame::Aov;
use orthant_resident::rows::NONE;
use orthant_resident::world::WorldCounts;
use orthant_resident::world::ray::BEFORE_SCENE;

/// What the ray through a pixel's centre (and the lens's) hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CenterHit {
    /// Distance along the camera's forward axis in metres; infinity where nothing is hit.
    pub depth: f32,
    /// World-space position.
    pub position: Vec3,
    /// [`orthant_resident::rows::RenderNodeRow::node`], or -1.
    pub node: f32,
    /// RenderPrimitive, or -1.
    pub primitive: f32,
    /// [`orthant_resident::rows::MaterialRow::id`], or -1.
    pub material: f32,
    /// Number of the block's material, or -1.
    pub block: f32,
    /// Face of the block, or -1.
    pub face: f32,
    /// Place of the block less the anchor's; 0 where there is none.
    pub cell: [f32; 4],
}

impl CenterHit {
    /// Nothing.
    pub const MISS: Self = Self {
        depth: f32::INFINITY,
        position: Vec3::ZERO,
        node: -1.0,
        primitive: -1.0,
        material: -1.0,
        block: -1.0,
        face: -1.0,
        cell: [0.0; 4],
    };

    /// Appends the channels of an AOV.
    pub fn write(&self, aov: Aov, out: &mut Vec<f32>) {
        match aov {
            Aov::Depth => out.push(self.depth),
            Aov::Position => out.extend(self.position.to_array()),
            Aov::Node => out.push(self.node),
            Aov::Primitive => out.push(self.primitive),
            Aov::Material => out.push(self.material),
            Aov::Albedo | Aov::Normal => {}
            Aov::Block => out.push(self.block),
            Aov::Face => out.push(self.face),
            Aov::Cell => out.extend(self.cell),
        }
    }
}

/// Whether an AOV is averaged over the samples; the others are of the ray through the centre.
pub fn is_averaged(aov: Aov) -> bool {
    matches!(aov, Aov::Albedo | Aov::Normal)
}

/// Traces the ray through the centre of pixel (x, y). A surface that is half there or more counts as there.
/// Of a world seen in several layers the middle one stands for all; the work in the world is added to `counts`.
pub fn trace_center(tracer: &PathTracer, x: u32, y: u32, counts: &mut WorldCounts) -> CenterHit {
    let center = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
    let Some(world) = tracer.world else {
        let (ray, _) = tracer.view.camera_ray(center, Vec2::splat(0.5));
        return scene_center(tracer, &tracer.view, &ray).map_or(CenterHit::MISS, |(_, hit)| hit);
    };
    let layer = world.middle();
    let (mut ray, _) = layer.camera.camera_ray(center, Vec2::splat(0.5));
    let mut nearest = CenterHit::MISS;
    if let Some((t, hit)) = scene_center(tracer, &layer.camera, &ray) {
        (ray.t_max, nearest) = (t * BEFORE_SCENE, hit);
    }
    world_center(world, layer, &ray, counts).unwrap_or(nearest)
}

/// The hit of a block.
fn world_center(world: &WorldTracer, layer: &LayerView, ray: &Ray, counts: &mut WorldCounts) -> Option<CenterHit> {
    let world_ray = world.ray(layer, ray);
    let RayEnd::Hit(hit) = trace_ray(&world.scene, &world_ray, counts).end else { return None };
    let (surface, _) = world.surface(layer, ray, &world_ray, &hit);
    let position = ray.origin + ray.direction * hit.t;
    Some(CenterHit {
        depth: layer.camera.depth(position),
        position,
        block: surface.id as f32,
        face: surface.face as f32,
        cell: surface.cell.map(|c| c as f32),
        ..CenterHit::MISS
    })
}

/// The hit of the model scene, with its ray parameter.
fn scene_center(tracer: &PathTracer, camera: &View, ray: &Ray) -> Option<(f32, CenterHit)> {
    let scene = tracer.scene;
    let hit = scene.closest_hit(ray, |hit| {
        let point = SurfacePoint::new(scene, hit.render_node, hit.triangle, hit.b1, hit.b2);
        surface_presence(scene, &point) >= 0.5
    })?;
    let point = SurfacePoint::new(scene, hit.render_node, hit.triangle, hit.b1, hit.b2);
    let index = |i: u32| if i == NONE { -1.0 } else { i as f32 };
    let center = CenterHit {
        depth: camera.depth(point.position),
        position: point.position,
        node: index(point.node.node),
        primitive: index(point.node.primitive),
        material: index(point.material.id),
        ..CenterHit::MISS
    };
    Some((hit.t, center))
}
