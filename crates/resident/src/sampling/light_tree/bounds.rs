//! [`LightBounds`]: where light comes from, in which directions it leaves and how much there is of it.

use crate::math::{atan2_turns, safe_normalize, sin_cos_turns};
use crate::rows::{EmitterRow, LightKind, LightRow, MeshDesc, NodeFlags, RenderNodeRow};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// A light or a group of lights: a box about it, a cone about its axis that holds the directions in which its surfaces face,
/// and the angle beyond that cone at which their light ends. 48 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LightBounds {
    /// Smallest corner.
    pub lower: [f32; 3],
    /// Luminous intensity of all together, in the directions in which they shine most.
    pub intensity: f32,
    /// Largest corner.
    pub upper: [f32; 3],
    /// Cosine of the cone's half angle; -1 for all directions.
    pub cos_spread: f32,
    /// Unit axis of the cone.
    pub axis: [f32; 3],
    /// Cosine of the angle beyond the cone at which light ends: 0 for surfaces, 1 for what shines inside the cone only.
    pub cos_end: f32,
}

impl LightBounds {
    /// Nothing.
    pub const NOTHING: Self = Self {
        lower: [f32::INFINITY; 3],
        intensity: 0.0,
        upper: [f32::NEG_INFINITY; 3],
        cos_spread: 1.0,
        axis: [0.0, 0.0, 1.0],
        cos_end: 1.0,
    };

    /// A point light or a spot; `None` for others and for a dark one.
    pub fn of_light(light: &LightRow) -> Option<Self> {
        let intensity = crate::math::luminance(Vec3::from_array(light.color));
        let cos_spread = match light.kind {
            k if k == LightKind::Point as u32 => -1.0,
            k if k == LightKind::Spot as u32 => (-light.angle_offset / light.angle_scale).clamp(-1.0, 1.0),
            _ => return None,
        };
        let (lower, upper) = (light.position, light.position);
        let bounds = Self { lower, intensity, upper, cos_spread, axis: light.direction, cos_end: 1.0 };
        bounds.is_usable().then_some(bounds)
    }

    /// An emissive RenderNode; `front` is the unit normal in the world of one that is flat and emits to one side. `None`
    /// where numbers are not finite.
    pub fn of_emitter(row: &EmitterRow, node: &RenderNodeRow, desc: &MeshDesc, front: Option<Vec3>) -> Option<Self> {
        let (a, b) = (Vec3::from_array(desc.bounds_min), Vec3::from_array(desc.bounds_max));
        let centre = node.world.transform_point((a + b) * 0.5);
        let half = (b - a) * 0.5;
        let extent =
            Vec3::from_array(node.world.rows.map(|r| r[0].abs() * half.x + r[1].abs() * half.y + r[2].abs() * half.z));
        let front = front.filter(|_| node.flags & NodeFlags::DOUBLE_SIDED == 0);
        let bounds = Self {
            lower: (centre - extent).to_array(),
            // A flat lamp's intensity along its normal, else the mean over all directions.
            intensity: row.power * if front.is_some() { FRAC_1_PI } else { 0.25 * FRAC_1_PI },
            upper: (centre + extent).to_array(),
            cos_spread: if front.is_some() { 1.0 } else { -1.0 },
            axis: front.unwrap_or(Vec3::Z).to_array(),
            cos_end: 0.0,
        };
        bounds.is_usable().then_some(bounds)
    }

    fn is_usable(&self) -> bool {
        let (lower, upper) = (Vec3::from_array(self.lower), Vec3::from_array(self.upper));
        self.intensity > 0.0 && self.intensity.is_finite() && (upper - lower).is_finite() && lower.is_finite()
    }

    /// Both together.
    pub fn union(&self, other: &Self) -> Self {
        if self.intensity == 0.0 {
            return *other;
        }
        if other.intensity == 0.0 {
            return *self;
        }
        let (axis, cos_spread) = union_of_cones((self.axis, self.cos_spread), (other.axis, other.cos_spread));
        Self {
            lower: Vec3::from_array(self.lower).min(Vec3::from_array(other.lower)).to_array(),
            intensity: self.intensity + other.intensity,
            upper: Vec3::from_array(self.upper).max(Vec3::from_array(other.upper)).to_array(),
            cos_spread,
            axis,
            cos_end: self.cos_end.min(other.cos_end),
        }
    }

    /// Twice the centre of the box.
    pub(super) fn centre(&self) -> Vec3 {
        Vec3::from_array(self.lower) + Vec3::from_array(self.upper)
    }

    /// The measure of directions and places of section 4.1: what a group costs, by its intensity.
    pub(super) fn cost(&self) -> f32 {
        if self.intensity == 0.0 {
            return 0.0;
        }
        let d = Vec3::from_array(self.upper) - Vec3::from_array(self.lower);
        // Lights in a row span no area, but nearer ones still belong together.
        let area = d.x * d.y + d.y * d.z + d.z * d.x + 0.01 * d.length_squared();
        let spread = TAU * acos_turns(self.cos_spread);
        let end = (spread + TAU * acos_turns(self.cos_end)).min(PI);
        let sin = (1.0 - self.cos_spread * self.cos_spread).max(0.0).sqrt();
        let (_, cos_far) = sin_cos_turns((spread - 2.0 * end) / TAU);
        let directions = TAU * (1.0 - self.cos_spread)
            + 0.25 * TAU * (2.0 * end * sin - cos_far - 2.0 * spread * sin + self.cos_spread);
        self.intensity * directions * area
    }

    /// About how much light it brings to a surface at `from` with the unit normal `normal` (zero for one that takes light
    /// from both sides), by section 5: not 0 where it may bring any. `is_group` says whether it is one of many lights, which
    /// can come much nearer than its centre.
    #[inline]
    pub fn importance(&self, from: Vec3, normal: Vec3, is_group: bool) -> f32 {
        let (lower, upper) = (Vec3::from_array(self.lower), Vec3::from_array(self.upper));
        let half = (upper - lower) * 0.5;
        let to_centre = (lower + upper) * 0.5 - from;
        let (radius2, distance2) = (half.length_squared(), to_centre.length_squared());
        let (radius, distance) = (radius2.sqrt(), distance2.sqrt());

        // The mean of 1 / d^2 lies between that at the nearest and at the farthest point of the box
        let nearest = (to_centre.abs() - half).max(Vec3::ZERO).length();
        let nearest = nearest.max(if is_group { GROUP_NEAREST * radius } else { radius });
        let at_most = self.intensity / (nearest * (distance + radius));
        if distance2 <= radius2 {
            // Inside the sphere about the box all directions are possible.
            return bounded(at_most);
        }
        let direction = to_centre / distance;
        // The angle that the sphere covers
        let (sin_u, cos_u) = (radius / distance, (1.0 - radius2 / distance2).max(0.0).sqrt());

        // The least angle to the surface's normal
        let received = if normal == Vec3::ZERO { 1.0 } else { cos_less(normal.dot(direction), sin_u, cos_u) };
        if received <= 0.0 {
            return 0.0;
        }

        // The least angle between directions to the surface and the cone
        let cos_w = -Vec3::from_array(self.axis).dot(direction);
        let sin_spread = (1.0 - self.cos_spread * self.cos_spread).max(0.0).sqrt();
        let cos_out = cos_less(cos_w, sin_spread, self.cos_spread);
        let cos_out = cos_less(cos_out, sin_u, cos_u);
        if cos_out < self.cos_end {
            return 0.0;
        }
        bounded(at_most * received * cos_out)
    }
}

/// How near the lights of a group about a surface are taken to come, as a share of the radius: lights spread over a plane
/// bring several times what they would bring from the rim.
const GROUP_NEAREST: f32 = 0.06;

/// Bound of importances, so that sums and ratios of them are numbers.
const MOST: f32 = 1e30;

/// Makes an importance of any number, and of what is none: coordinates may leave the range of `f32`.
#[inline]
fn bounded(value: f32) -> f32 {
    let value = value.max(f32::MIN_POSITIVE);
    if value > MOST { MOST } else { value }
}

/// The cosine of an angle less another one, at least 0 degrees.
#[inline]
fn cos_less(cos: f32, sin_less: f32, cos_less: f32) -> f32 {
    if cos > cos_less {
        return 1.0;
    }
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    cos * cos_less + sin * sin_less
}

fn acos_turns(cos: f32) -> f32 {
    atan2_turns((1.0 - cos * cos).max(0.0).sqrt(), cos)
}

/// The smallest cone about two cones, each an axis and the cosine of its half angle.
fn union_of_cones(a: ([f32; 3], f32), b: ([f32; 3], f32)) -> ([f32; 3], f32) {
    let ((wide, cos_wide), (narrow, cos_narrow)) = if a.1 <= b.1 { (a, b) } else { (b, a) };
    if cos_wide <= -1.0 {
        return (wide, -1.0);
    }
    let (axis, other) = (Vec3::from_array(wide), Vec3::from_array(narrow));
    let (wide_turns, narrow_turns) = (acos_turns(cos_wide), acos_turns(cos_narrow));
    let cross = axis.cross(other);
    let between = atan2_turns(cross.length(), axis.dot(other));
    if between + narrow_turns <= wide_turns {
        return (wide, cos_wide);
    }
    let half = 0.5 * (wide_turns + between + narrow_turns);
    if half >= 0.5 {
        return (wide, -1.0);
    }
    // Turn the wider one's axis towards the other, and allow for the rounding of the angles
    let towards = safe_normalize(other - axis * axis.dot(other), Vec3::ZERO);
    let (sin, cos) = sin_cos_turns(half - wide_turns);
    let (_, cos_half) = sin_cos_turns((half + 1e-6).min(0.5));
    (safe_normalize(axis * cos + towards * sin, axis).to_array(), cos_half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::unit_float;
    use crate::sampling::hash_combine;

    fn random(i: u32, k: u32) -> f32 {
        2.0 * unit_float(hash_combine(i, k)) - 1.0
    }

    fn vector(i: u32, k: u32) -> Vec3 {
        Vec3::new(random(i, k), random(i, k + 1), random(i, k + 2))
    }

    fn unit(i: u32, k: u32) -> Vec3 {
        safe_normalize(vector(i, k), Vec3::Y)
    }

    fn part(at: Vec3, axis: Vec3, cos_spread: f32, cos_end: f32) -> LightBounds {
        LightBounds {
            lower: at.to_array(),
            intensity: 1.0,
            upper: at.to_array(),
            cos_spread,
            axis: axis.to_array(),
            cos_end,
        }
    }

    #[test]
    fn a_union_of_cones_holds_both() {
        for i in 0..2000 {
            let (a, b) = ((unit(i, 0), random(i, 6)), (unit(i, 3), random(i, 7)));
            let (axis, cos) = union_of_cones((a.0.to_array(), a.1), (b.0.to_array(), b.1));
            let axis = Vec3::from_array(axis);
            for (part, cos_part) in [a, b] {
                // The farthest direction of the part.
                let angle = part.angle_between(axis) + cos_part.acos();
                assert!(
                    angle.min(PI) <= cos.acos() + 2e-3,
                    "{i}: {} > {}",
                    angle.to_degrees(),
                    cos.acos().to_degrees()
                );
            }
        }
    }

    #[test]
    fn where_a_part_shines_a_group_has_importance() {
        for i in 0..5000 {
            let parts: Vec<LightBounds> = (0..4)
                .map(|k| {
                    let k = 10 * k;
                    let cos_end = if random(i, k + 8) > 0.0 { 0.0 } else { 1.0 };
                    part(vector(i, k), unit(i, k + 3), random(i, k + 7), cos_end)
                })
                .collect();
            let group = parts.iter().fold(LightBounds::NOTHING, |group, part| group.union(part));
            assert!((group.intensity - 4.0).abs() < 1e-6);
            let (from, normal) = (2.0 * vector(i, 60), unit(i, 63));
            let sum: f32 = parts.iter().map(|p| p.importance(from, normal, false)).sum();
            let whole = group.importance(from, normal, false);
            assert!(sum <= 1e-4 || whole > 0.0, "{i}: the parts have {sum}");
        }
    }

    #[test]
    fn importance_is_what_a_single_light_gives() {
        let from = Vec3::new(0.0, 2.0, 0.0);
        let point = part(Vec3::ZERO, Vec3::Z, -1.0, 1.0);
        assert!((point.importance(from, Vec3::NEG_Y, false) - 0.25).abs() < 1e-6);
        assert!((point.importance(from, Vec3::new(0.0, -0.5, 0.75f32.sqrt()), false) - 0.125).abs() < 1e-6);
        assert_eq!(point.importance(from, Vec3::Y, false), 0.0);
        assert!(point.importance(from, Vec3::ZERO, false) > 0.0);
        let surface = part(Vec3::ZERO, Vec3::new(0.6, 0.8, 0.0), 1.0, 0.0);
        assert!((surface.importance(from, Vec3::NEG_Y, false) - 0.25 * 0.8).abs() < 1e-6);
        assert_eq!(surface.importance(-from, Vec3::Y, false), 0.0);
        let spot = part(Vec3::ZERO, Vec3::Y, 0.9, 1.0);
        assert!((spot.importance(Vec3::new(0.5, 2.0, 0.0), Vec3::ZERO, false) - 1.0 / 4.25).abs() < 1e-6);
        assert_eq!(spot.importance(Vec3::new(2.0, 2.0, 0.0), Vec3::ZERO, false), 0.0);
    }
}
