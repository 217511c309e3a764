//! The slices of a view as a frame traces them.

use super::preview::PreviewLight;
use super::ray::{WorldRay, WorldScene};
use super::surface::{BlockSurface, layer_normal, layer_runs};
use super::trace::{RayEnd, WorldHit, trace_ray};
use crate::path::camera::View;
use crate::trace::Ray;
use glam::Vec3;
use orthant_resident::Frame;
use orthant_resident::math::gamma;
use orthant_resident::world::{Layer, WorldArenas, WorldCounts, WorldView};

/// What a frame shows of a world, with what all of its rays share.
#[derive(Clone, Debug)]
pub struct WorldTracer<'a> {
    /// What is hit.
    pub scene: WorldScene<'a>,
    /// What is asked for.
    pub view: &'a WorldView,
    /// The lights of the preview; `None` for light transport.
    pub preview: Option<PreviewLight>,
    /// The slices, at least one.
    pub layers: Vec<LayerView<'a>>,
    /// Where the anchor is for rays: at the camera's position if the frame shows a model scene too, else at 0.
    pub anchor: Vec3,
}

/// A slice.
#[derive(Clone, Copy, Debug)]
pub struct LayerView<'a> {
    /// Its axes.
    pub layer: &'a Layer,
    /// Its camera, in its axes.
    pub camera: View,
    /// Which axes of the world it runs along.
    pub runs: [bool; 4],
}

impl<'a> WorldTracer<'a> {
    /// For a frame; `None` if it shows no world. `with_scene` says whether it shows a model scene too.
    pub fn new(frame: &'a Frame, arenas: &'a WorldArenas, with_scene: bool) -> Option<Self> {
        let view = frame.world.as_ref()?;
        let anchor = if with_scene { Vec3::from_array(frame.camera.position) } else { Vec3::ZERO };
        let layer_view = |layer: &'a Layer| {
            let vectors = [layer.right, layer.up, layer.forward].map(Vec3::from_array);
            LayerView { layer, camera: View::of_layer(frame, anchor, vectors), runs: layer_runs(layer) }
        };
        Some(Self {
            scene: WorldScene::new(arenas, view.anchor, view.step_budget),
            view,
            preview: PreviewLight::new(&view.shade),
            layers: view.layers.iter().map(layer_view).collect(),
            anchor,
        })
    }

    /// The layer whose hits stand for a pixel where only one can: that in the middle.
    pub fn middle(&self) -> &LayerView<'a> {
        &self.layers[self.layers.len() / 2]
    }

    /// A ray of a layer in the world. It ends at the view distance at the latest.
    #[inline]
    pub fn ray(&self, layer: &LayerView, ray: &Ray) -> WorldRay {
        let origin = layer.layer.to_world((ray.origin - self.anchor).to_array());
        let direction = layer.layer.to_world(ray.direction.to_array());
        WorldRay::new(&self.scene, origin, direction, ray.t_min, ray.t_max.min(self.view.distance))
    }

    /// What of light passes along a ray of a layer, of any length: nothing where an opaque block is in the way, or where the budget of
    /// steps did not suffice (which is counted).
    #[inline]
    pub fn visibility(&self, layer: &LayerView, ray: &Ray, counts: &mut WorldCounts) -> Vec3 {
        let length = ray.direction.length();
        let unit = Ray { direction: ray.direction / length, t_max: ray.t_max * length, ..*ray };
        let transit = trace_ray(&self.scene, &self.ray(layer, &unit), counts);
        match transit.end {
            RayEnd::Sky => transit.transmittance,
            RayEnd::Hit(_) | RayEnd::Exhausted => Vec3::ZERO,
        }
    }

    /// Bounds the error, per axis, of the point at `t` of a ray of unit direction against the plane that it was found on: roundings of
    /// the origin's and the direction's way into the world, of the plane's offset, of `t` and of the point itself, each 2^-24 of the
    /// distances that are summed here.
    #[inline]
    pub fn position_error(&self, ray: &Ray, t: f32) -> Vec3 {
        let within = (ray.origin - self.anchor).abs().max_element() + t;
        Vec3::splat(within * gamma(12) + self.anchor.abs().max_element() * gamma(2))
    }

    /// The surface at a hit, and its unit normal in the layer.
    #[inline]
    pub fn surface(&self, layer: &LayerView, ray: &Ray, world_ray: &WorldRay, hit: &WorldHit) -> (BlockSurface, Vec3) {
        let surface = BlockSurface::new(&self.scene, world_ray, hit, layer.runs, self.view.edges);
        (surface, layer_normal(layer.layer, hit.axis, hit.positive, -ray.direction))
    }
}
