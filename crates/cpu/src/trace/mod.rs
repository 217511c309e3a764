//! Rays through the resident scene.
//!
//! What a ray hits is defined by [`triangle`] alone: the nearest accepted triangle hit over all instances, the smaller
//! (RenderNode, triangle) where two are equally near. The trees only leave out what cannot be that hit: every box test
//! is conservative with respect to the triangle test, so the answer depends neither on the tree nor on the order of the
//! walk nor on the instruction set.

mod boxes;
mod object_ray;
mod stack;
pub(crate) mod triangle;
mod walk;

#[cfg(test)]
mod tests;

pub(crate) use walk::{any_hit, closest_hit, triangle_hit};

use glam::Vec3;

/// A ray in world space, relative to the scene's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Its direction; of any length. A ray with a zero or non-finite direction hits nothing.
    pub direction: Vec3,
    /// Hits are beyond this parameter (exclusive). Negative values mean 0.
    pub t_min: f32,
    /// Hits are before this parameter (exclusive); infinity for no limit.
    pub t_max: f32,
}

impl Ray {
    /// The half-line from a point.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter: the point is `origin + t direction`.
    pub t: f32,
    /// RenderNode index.
    pub render_node: u32,
    /// Triangle of the RenderNode's primitive.
    pub triangle: u32,
    /// Weight of the triangle's second corner: the point is `(1 - b1 - b2) p0 + b1 p1 + b2 p2`.
    pub b1: f32,
    /// Weight of its third corner.
    pub b2: f32,
    /// Whether the ray meets the back: its corners run clockwise as seen in object space. (A mirroring instance turns
    /// the order in world space, but not the front, which is what glTF asks for.)
    pub back_face: bool,
}
