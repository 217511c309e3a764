//! A ray in four dimensions, relative to the anchor of a view.

use glam::Vec4;
use orthant_resident::world::WorldArenas;
use orthant_resident::world::ray::{UNITS_PER_RAW, inverse_direction, plane_offset, plane_t};

/// A set of arenas as a frame sees it.
#[derive(Clone, Copy, Debug)]
pub struct WorldScene<'a> {
    /// The set.
    pub arenas: &'a WorldArenas,
    /// The point, raw, that rays are relative to.
    pub anchor: [i64; 4],
    /// Steps that a ray may take.
    pub step_budget: u32,
    /// The anchor less the set's origin, in units, rounded.
    shift: [f32; 4],
}

impl<'a> WorldScene<'a> {
    /// A set seen from an anchor.
    pub fn new(arenas: &'a WorldArenas, anchor: [i64; 4], step_budget: u32) -> Self {
        let shift = std::array::from_fn(|a| (anchor[a] - arenas.origin[a]) as f32 * UNITS_PER_RAW);
        Self { arenas, anchor, step_budget, shift }
    }

    /// Parameter at which a ray meets the plane at the raw coordinate `plane` of an axis.
    #[inline]
    pub(super) fn plane_t(&self, ray: &WorldRay, axis: usize, plane: i64) -> f32 {
        plane_t(plane_offset(plane, self.anchor[axis]), ray.origin[axis], ray.inverse[axis])
    }
}

/// A ray.
#[derive(Clone, Copy, Debug)]
pub struct WorldRay {
    /// Where it starts, in units relative to the anchor.
    pub origin: [f32; 4],
    /// Its unit direction.
    pub direction: [f32; 4],
    /// [`inverse_direction`] of each component.
    pub inverse: [f32; 4],
    /// It begins at this parameter, not below 0: in the medium that is there.
    pub t_min: f32,
    /// Surfaces are before this parameter (exclusive).
    pub t_max: f32,
    /// What lower corners of node bounds are held against: the origin relative to the set's, plus what rounding may have done.
    lower: Vec4,
    /// What upper corners are held against: the origin minus that.
    upper: Vec4,
}

/// Bounds the roundings of [`WorldScene::shift`], of its sum with a ray's origin, and of the plane offsets of leaves, as far as they
/// are relative to those two: each is at most 2^-24 of them, and they are fewer than four.
const ORIGIN_SLACK: f32 = 1.0 / (1 << 22) as f32;

/// Bounds the roundings that are relative to the distance of a plane, fewer than eight of 2^-24.
const DISTANCE_SLACK: f32 = 1.0 / (1 << 21) as f32;

impl WorldRay {
    /// A ray through a set.
    #[inline]
    pub fn new(scene: &WorldScene, origin: [f32; 4], direction: [f32; 4], t_min: f32, t_max: f32) -> Self {
        let (o, shift) = (Vec4::from_array(origin), Vec4::from_array(scene.shift));
        let slack = (o.abs() + shift.abs()) * ORIGIN_SLACK;
        let at = shift + o;
        Self {
            origin,
            direction,
            inverse: direction.map(inverse_direction),
            t_min: t_min.max(0.0),
            t_max,
            lower: at + slack,
            upper: at - slack,
        }
    }

    /// Where the ray is in the bounds of a node, at `from >= 0` or later: from the first number to the second, and not at all if
    /// they descend. Conservative: no leaf within the bounds is entered before or left after.
    #[inline]
    pub(super) fn node_interval(&self, [lower, upper]: &[[f32; 4]; 2], from: f32) -> (f32, f32) {
        let inverse = Vec4::from_array(self.inverse);
        let a = (Vec4::from_array(*lower) - self.lower) * inverse;
        let b = (Vec4::from_array(*upper) - self.upper) * inverse;
        let enter = a.min(b).max_element() * (1.0 - DISTANCE_SLACK);
        let leave = a.max(b).min_element() * (1.0 + DISTANCE_SLACK);
        (enter.max(from), leave)
    }

    /// The point at `t`, in units relative to the anchor.
    #[inline]
    pub fn at(&self, t: f32) -> [f32; 4] {
        std::array::from_fn(|a| self.origin[a] + t * self.direction[a])
    }
}
