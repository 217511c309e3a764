//! Axis-aligned boxes, and their images under the affine maps of instances.

use orthant_resident::rows::{Mat3x4, RenderNodeRow};

/// An axis-aligned box. Empty when `lower > upper` on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub lower: [f32; 3],
    /// Largest corner.
    pub upper: [f32; 3],
}

impl Bounds {
    /// The box of nothing.
    pub const EMPTY: Self = Self { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    /// The box of some points.
    #[inline]
    pub fn of_points(points: &[[f32; 3]]) -> Self {
        points.iter().fold(Self::EMPTY, |b, &p| b.union(&Self { lower: p, upper: p }))
    }

    /// The smallest box around both.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            lower: std::array::from_fn(|k| self.lower[k].min(other.lower[k])),
            upper: std::array::from_fn(|k| self.upper[k].max(other.upper[k])),
        }
    }

    /// Whether it holds no point.
    #[inline]
    pub fn is_empty(&self) -> bool {
        (0..3).any(|k| self.lower[k] > self.upper[k])
    }

    /// Whether `other` lies within (an empty box lies within every box).
    pub fn contains(&self, other: &Self) -> bool {
        other.is_empty() || (0..3).all(|k| self.lower[k] <= other.lower[k] && other.upper[k] <= self.upper[k])
    }
}

/// Half the unit in the last place of 1, and a bound of the rounding errors of a few operations: Higham's
/// `gamma(n) = n u / (1 - n u)` with a margin for second-order terms.
const fn gamma(n: u32) -> f64 {
    let nu = n as f64 * (f32::EPSILON as f64 / 2.0);
    nu / (1.0 - nu) * 1.001
}

/// Rays of a TLAS are tested against boxes with this share of their origin's largest coordinate as slack (see
/// [`world_bounds`]).
pub(crate) const ORIGIN_SLACK: f32 = (2.0 * gamma(8) * MAX_SPREAD) as f32;

/// The largest `|A| |A^-1|` (its largest row sum) that [`ORIGIN_SLACK`] pays for. A rotation with a uniform scale has at
/// most 3. An instance above it pays with a larger box.
const MAX_SPREAD: f64 = 8.0;

/// The world-space box of an instance whose geometry lies in the object-space boxes `parts`, or the empty box when a
/// matrix is not made of numbers. Sides beyond the range of `f32` are infinite. More and smaller parts give a tighter box.
///
/// It is larger than the image of the boxes by what `f32` can do to a ray on its way to object space. With the map
/// `A x + a` and its inverse `R`, the object-space ray that is traced is that of a world-space ray which is off by at most
/// `gamma(8) |A| |R| (2 |o| + |x| + |a|)` at the world point `x`, for a ray from `o` (rounding of `R`, of the transformed
/// origin and of the transformed direction). The part of `x` and `a` is added here, the part of `o` when a ray is traced.
/// So every hit that the traced ray has inside a part lies inside the box for the world-space ray.
pub(crate) fn world_bounds(parts: &[Bounds], row: &RenderNodeRow) -> Bounds {
    let (m, r) = (matrix(&row.world), matrix(&row.inverse));
    let mut lower = [f64::INFINITY; 3];
    let mut upper = [f64::NEG_INFINITY; 3];
    for part in parts.iter().filter(|part| !part.is_empty()) {
        let center: [f64; 3] = std::array::from_fn(|k| 0.5 * (f64::from(part.lower[k]) + f64::from(part.upper[k])));
        let half: [f64; 3] = std::array::from_fn(|k| 0.5 * (f64::from(part.upper[k]) - f64::from(part.lower[k])));
        for i in 0..3 {
            let middle = m[i][0] * center[0] + m[i][1] * center[1] + m[i][2] * center[2] + m[i][3];
            let extent = m[i][0].abs() * half[0] + m[i][1].abs() * half[1] + m[i][2].abs() * half[2];
            lower[i] = lower[i].min(middle - extent);
            upper[i] = upper[i].max(middle + extent);
        }
    }
    let reach: [f64; 3] = std::array::from_fn(|i| lower[i].abs().max(upper[i].abs()) + m[i][3].abs());
    let mut bounds = Bounds::EMPTY;
    for i in 0..3 {
        let row_of_spread: [f64; 3] = std::array::from_fn(|j| (0..3).map(|k| m[i][k].abs() * r[k][j].abs()).sum());
        let spread: f64 = row_of_spread.iter().sum();
        // The origin of a ray that sees an ill-conditioned instance is taken to be about as far from the scene's
        // origin as the instance is.
        let origin_share = if spread > MAX_SPREAD { 2.0 } else { 0.0 };
        let slack: f64 = (0..3).map(|j| row_of_spread[j] * reach[j]).sum::<f64>() * (1.0 + origin_share) * gamma(8)
            + gamma(4) * reach[i];
        bounds.lower[i] = round_down(lower[i] - slack);
        bounds.upper[i] = round_up(upper[i] + slack);
        if bounds.lower[i].is_nan() || bounds.upper[i].is_nan() {
            return Bounds::EMPTY;
        }
    }
    bounds
}

fn matrix(m: &Mat3x4) -> [[f64; 4]; 3] {
    m.rows.map(|row| row.map(f64::from))
}

fn round_down(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x { rounded.next_down() } else { rounded }
}

fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x { rounded.next_up() } else { rounded }
}
