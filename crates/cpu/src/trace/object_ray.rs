//! A ray in the object space of one instance, with what the box and triangle tests need of it.

use super::boxes::BoxRay;
use crate::accel::Bounds;

/// See the module.
pub(super) struct ObjectRay {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    /// The axis along which the direction is longest, last; the other two so that the three are a rotation or, for a
    /// negative longest component, a reflection of one (which keeps the winding of triangles as the ray sees it).
    pub axes: [usize; 3],
    /// Shear that takes the ray to the last axis, and the scale that makes it of length 1.
    pub shear: [f32; 3],
    pub boxes: BoxRay,
}

/// Bound of the rounding errors of a sheared corner, relative to its coordinates (Woop, Benthin and Wald 2013, section
/// 3.3, "Watertight Ray/Triangle Intersection").
const SHEAR_ERROR: f32 = 5.0 * f32::EPSILON / 2.0;

impl ObjectRay {
    /// Prepares a ray for triangles inside `bounds`. `None` where the direction is zero or a value is not finite.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], t_min: f32, bounds: &Bounds) -> Option<Self> {
        let magnitude = direction.map(f32::abs);
        let z = if magnitude[0] > magnitude[1] {
            if magnitude[0] > magnitude[2] { 0 } else { 2 }
        } else if magnitude[1] > magnitude[2] {
            1
        } else {
            2
        };
        let (mut x, mut y) = ([1, 2, 0][z], [2, 0, 1][z]);
        if direction[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        let scale = 1.0 / direction[z];
        let finite = |v: &[f32; 3]| v[0].is_finite() & v[1].is_finite() & v[2].is_finite();
        if !(finite(&origin) & finite(&direction) & scale.is_finite()) {
            return None;
        }
        let shear = [direction[x] * scale, direction[y] * scale, scale];
        // How far a corner can lie from the ray's origin, by axis.
        let reach: [f32; 3] =
            std::array::from_fn(|k| (bounds.lower[k] - origin[k]).abs().max((bounds.upper[k] - origin[k]).abs()));
        let mut slack = [0.0; 3];
        slack[x] = SHEAR_ERROR * (reach[x] + reach[z]);
        slack[y] = SHEAR_ERROR * (reach[y] + reach[z]);
        let boxes = BoxRay::new(origin, direction, slack, t_min);
        Some(Self { origin, direction, axes: [x, y, z], shear, boxes })
    }
}
