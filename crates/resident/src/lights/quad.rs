//! Emissive parallelograms: area lights. Where one is a rectangle in the world, and not too small as seen from a surface,
//! directions to it are uniform; else its points are.

use super::LightRows;
use crate::math::safe_normalize;
use crate::rows::{MeshDesc, NodeFlags, RenderNodeRow};
use crate::sampling::{Rectangle, SphericalRectangle};
use glam::{Vec2, Vec3};

/// A parallelogram in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Across both sides; of any length.
    normal: Vec3,
    /// `None` where the sides are not at right angles.
    rectangle: Option<Rectangle>,
    /// See [`MeshDesc::parallelogram`].
    opposite: [usize; 2],
}

impl Quad {
    /// The instance's, if its primitive is one.
    pub fn new(scene: &impl LightRows, node: &RenderNodeRow, desc: &MeshDesc) -> Option<Self> {
        let opposite = desc.parallelogram()?;
        let corners = scene.first_triangle(node.primitive)?;
        let [p, next, last] = [0, 1, 2].map(|k| Vec3::from_array(corners[(opposite[0] + k) % 3]));
        let sides = [next - p, last - p].map(|side| node.world.transform_vector(side));
        let rectangle = Rectangle::new(node.world.transform_point(p), sides);
        Some(Self { normal: sides[0].cross(sides[1]), rectangle, opposite })
    }

    /// Unit normal of the front face; zero for one without area.
    pub fn front(&self, node: &RenderNodeRow) -> Vec3 {
        let normal = safe_normalize(self.normal, Vec3::ZERO);
        if node.flags & NodeFlags::MIRRORED != 0 { -normal } else { normal }
    }

    /// The rectangle that it is, if it is one.
    pub fn rectangle(&self) -> Option<&Rectangle> {
        self.rectangle.as_ref()
    }

    /// See [`MeshDesc::parallelogram`].
    pub fn opposite(&self) -> [usize; 2] {
        self.opposite
    }

    /// How it is seen from a point; `None` where it is to be sampled by area.
    #[inline]
    pub fn seen_from(&self, from: Vec3) -> Option<SphericalRectangle> {
        self.rectangle?.seen_from(from)
    }

    /// Triangle, and weights of its second and third corner, of the point at `at` in 0..=1 along the sides.
    #[inline]
    pub fn point(&self, at: Vec2) -> (u32, Vec2) {
        let outside = at.x + at.y > 1.0;
        // The second triangle's corner is opposite to the first's, and its sides point back.
        let along = if outside { Vec2::new(1.0 - at.x, 1.0 - at.y) } else { at };
        let triangle = usize::from(outside);
        let first = self.opposite[triangle];
        let mut weights = [0.0; 3];
        weights[first] = 1.0 - along.x - along.y;
        weights[(first + 1) % 3] = along.x;
        weights[(first + 2) % 3] = along.y;
        (triangle as u32, Vec2::new(weights[1], weights[2]))
    }
}
