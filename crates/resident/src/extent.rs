//! [`Extent`]: a box in the scene, and how the radius of the scene follows from it.

use crate::rows::{MeshDesc, NodeFlags, RenderNodeRow};
use crate::slot_tree::Join;
use glam::Vec3;

/// A box, in metres relative to the scene's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Smallest corner.
    pub lower: Vec3,
    /// Largest corner.
    pub upper: Vec3,
}

impl Join for Extent {
    const NOTHING: Self = Self { lower: Vec3::INFINITY, upper: Vec3::NEG_INFINITY };

    fn join(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }
}

impl Extent {
    /// The box about an instance's object-space box; nothing for one that is not visible or that leaves the range of `f32`.
    pub fn of_instance(node: &RenderNodeRow, mesh_descs: &[MeshDesc]) -> Self {
        let desc = mesh_descs.get(node.primitive as usize).filter(|_| node.flags & NodeFlags::VISIBLE != 0);
        let Some(desc) = desc else { return Self::NOTHING };
        let (a, b) = (Vec3::from(desc.bounds_min), Vec3::from(desc.bounds_max));
        let center = node.world.transform_point((a + b) * 0.5);
        let half = (b - a) * 0.5;
        let r = &node.world.rows;
        let extent = |i: usize| r[i][0].abs() * half.x + r[i][1].abs() * half.y + r[i][2].abs() * half.z;
        let half = Vec3::new(extent(0), extent(1), extent(2));
        let (lower, upper) = (center - half, center + half);
        if lower.is_finite() && upper.is_finite() { Self { lower, upper } } else { Self::NOTHING }
    }

    /// Radius in metres of a sphere about it; 1 for nothing and for a point.
    pub fn radius(&self) -> f32 {
        let radius = 0.5 * (self.upper - self.lower).length();
        if radius > 0.0 && radius.is_finite() { radius } else { 1.0 }
    }
}

/// Radius in metres of a sphere about everything that is seen, from the bounds of the MeshDescs; 1 for an empty scene. It
/// weighs lights at infinity, so that its precision does not matter, but every backend has to have the same: a batch says
/// it ([`crate::SceneBatch::scene_radius`]).
pub fn scene_radius(render_nodes: &[RenderNodeRow], mesh_descs: &[MeshDesc]) -> f32 {
    let all = render_nodes.iter().map(|node| Extent::of_instance(node, mesh_descs));
    all.fold(Extent::NOTHING, Extent::join).radius()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_is_that_of_what_is_seen() {
        let desc = MeshDesc { bounds_min: [-1.0; 3], bounds_max: [1.0; 3], ..bytemuck::Zeroable::zeroed() };
        let mut near = RenderNodeRow { primitive: 0, flags: NodeFlags::VISIBLE, ..RenderNodeRow::HOLE };
        near.world.rows[0][3] = 4.0;
        let hidden = RenderNodeRow { flags: 0, ..near };
        let mut endless = near;
        endless.world.rows[0][0] = f32::INFINITY;
        let radius = scene_radius(&[near, RenderNodeRow::HOLE, hidden, endless], &[desc]);
        assert!((radius - 3f32.sqrt()).abs() < 1e-6);
        assert_eq!(scene_radius(&[], &[desc]), 1.0);
    }
}
