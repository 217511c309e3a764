//! Arbitrary output variables of the ray through a pixel's centre.

use super::PathTracer;
use super::alpha::surface_presence;
use super::surface::SurfacePoint;
use glam::{Vec2, Vec3};
use orthant_resident::frame::Aov;
use orthant_resident::rows::NONE;

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
}

impl CenterHit {
    /// Nothing.
    pub const MISS: Self =
        Self { depth: f32::INFINITY, position: Vec3::ZERO, node: -1.0, primitive: -1.0, material: -1.0 };

    /// Appends the channels of an AOV.
    pub fn write(&self, aov: Aov, out: &mut Vec<f32>) {
        match aov {
            Aov::Depth => out.push(self.depth),
            Aov::Position => out.extend(self.position.to_array()),
            Aov::Node => out.push(self.node),
            Aov::Primitive => out.push(self.primitive),
            Aov::Material => out.push(self.material),
            Aov::Albedo | Aov::Normal => {}
            Aov::Block | Aov::Face => out.push(-1.0),
            Aov::Cell => out.extend([0.0; 4]),
        }
    }
}

/// Whether an AOV is averaged over the samples; the others are of the ray through the centre.
pub fn is_averaged(aov: Aov) -> bool {
    matches!(aov, Aov::Albedo | Aov::Normal)
}

/// Traces the ray through the centre of pixel (x, y). A surface that is half there or more counts as there.
pub fn trace_center(tracer: &PathTracer, x: u32, y: u32) -> CenterHit {
    let scene = tracer.scene;
    let (ray, _) = tracer.view.camera_ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::splat(0.5));
    let hit = scene.closest_hit(&ray, |hit| {
        let point = SurfacePoint::new(scene, hit.render_node, hit.triangle, hit.b1, hit.b2);
        surface_presence(scene, &point) >= 0.5
    });
    let Some(hit) = hit else { return CenterHit::MISS };
    let point = SurfacePoint::new(scene, hit.render_node, hit.triangle, hit.b1, hit.b2);
    let index = |i: u32| if i == NONE { -1.0 } else { i as f32 };
    CenterHit {
        depth: tracer.view.depth(point.position),
        position: point.position,
        node: index(point.node.node),
        primitive: index(point.node.primitive),
        material: index(point.material.id),
    }
}
