//! Where to look: points of a scene, and directions to look at them from.

use super::geometry::Geometry;
use glam::{DVec3, Vec3};
use orthant_resident::extent::Extent;
use orthant_resident::rows::{NodeFlags, RenderNodeRow};
use orthant_resident::slot_tree::Join;
use orthant_scene::edit::random::Choice;

/// A look at a point, relative to the scene's origin.
#[derive(Clone, Copy, Debug)]
pub struct Aim {
    /// Where from.
    pub from: DVec3,
    /// The point.
    pub at: DVec3,
    /// A unit vector from one to the other.
    pub direction: DVec3,
    /// Size of what is looked at: the whole scene, or a triangle.
    pub size: f64,
}

/// What can be looked at.
pub struct Targets<'s> {
    geometry: Geometry<'s>,
    visible: Vec<u32>,
    extent: Extent,
}

impl<'s> Targets<'s> {
    /// The visible render nodes.
    pub fn of(geometry: Geometry<'s>) -> Self {
        let is_visible = |row: &RenderNodeRow| row.flags & NodeFlags::VISIBLE != 0;
        let rows = geometry.render_nodes;
        let visible = (0..rows.len() as u32).filter(|&i| is_visible(&rows[i as usize])).collect();
        let extents = rows.iter().map(|row| Extent::of_instance(row, geometry.mesh_descs));
        Self { geometry, visible, extent: extents.fold(Extent::NOTHING, Extent::join) }
    }

    /// Through the whole scene, from outside. `None` where there is none, or it is too large for numbers.
    pub fn across(&self, (_, a, b, c): Choice) -> Option<Aim> {
        let (lower, upper) = (self.extent.lower.as_dvec3(), self.extent.upper.as_dvec3());
        let part = DVec3::new(unit(a), unit(b), unit(c));
        let (at, size) = (lower + (upper - lower) * part, (upper - lower).length());
        let direction = direction(a ^ b.rotate_left(7) ^ c.rotate_left(19));
        Aim { from: at - direction * size, at, direction, size }.sound(!self.visible.is_empty())
    }

    /// At a triangle. `None` where there is none, or it is too large for numbers.
    pub fn at_triangle(&self, (op, a, b, c): Choice) -> Option<Aim> {
        let row = *self.visible.get((a as usize).checked_rem(self.visible.len())?)?;
        let primitive = self.geometry.render_nodes[row as usize].primitive;
        let count = self.geometry.mesh_descs[primitive as usize].triangle_count();
        let corners = world_triangle(&self.geometry, row, b.checked_rem(count)?);
        let (u, v) = (unit(c), unit(c.rotate_left(16)) * (1.0 - unit(c)));
        let at = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
        let size = (corners[1] - corners[0]).length().max((corners[2] - corners[0]).length());
        let (direction, away) = (direction(b), size * (0.5 + f64::from(op)));
        Aim { from: at - direction * away, at, direction, size }.sound(true)
    }
}

impl Aim {
    fn sound(self, is_there: bool) -> Option<Self> {
        let is_finite = self.at.is_finite() && self.from.as_vec3().is_finite();
        (is_there && is_finite && self.size > 0.0).then_some(self)
    }
}

fn unit(bits: u32) -> f64 {
    f64::from(bits) / f64::from(u32::MAX)
}

fn direction(bits: u32) -> DVec3 {
    let direction = [bits, bits.rotate_left(11), bits.rotate_left(22)].map(|bits| unit(bits) - 0.5);
    DVec3::from_array(direction).try_normalize().unwrap_or(DVec3::Y)
}

/// The corners of a triangle of a render node, relative to the scene's origin.
pub fn world_triangle(geometry: &Geometry<'_>, row: u32, triangle: u32) -> [DVec3; 3] {
    let node = &geometry.render_nodes[row as usize];
    let desc = &geometry.mesh_descs[node.primitive as usize];
    let world = node.world.to_affine();
    let first = desc.first_index as usize + 3 * triangle as usize;
    [0, 1, 2].map(|k| {
        let corner = geometry.positions[desc.first_vertex as usize + geometry.indices[first + k] as usize];
        world.transform_point3(Vec3::from_array(corner).as_dvec3())
    })
}
