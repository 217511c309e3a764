//! Importance sampling of a latitude-longitude map, and the geometry of the map and of the sun.
//!
//! Radiance between texel centres is bilinear. The distribution is constant over each texel, in proportion to the
//! texel's solid angle times the mean of the bilinear radiance over it; so a direction with radiance always has a
//! density, and a constant map is sampled uniformly over the sphere, whatever its resolution.

use crate::environment::{EnvironmentMap, Sun};
use crate::math::{OrthonormalFrame, atan2_turns, luminance, safe_normalize, sin_cos_turns};
use crate::sampling::warp::sample_cone;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Texture coordinates (u, v) in 0..=1 of a unit direction in the map's frame.
#[inline]
pub fn direction_to_lat_long(d: Vec3) -> Vec2 {
    let u = atan2_turns(d.x, -d.z) + 0.5;
    let v = 2.0 * atan2_turns((d.x * d.x + d.z * d.z).sqrt(), d.y);
    Vec2::new(u, v)
}

/// The unit direction with a given cosine from the zenith at texture coordinate u.
#[inline]
pub fn lat_long_to_direction(u: f32, cos_theta: f32) -> Vec3 {
    let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt();
    let (s, c) = sin_cos_turns(u - 0.5);
    Vec3::new(sin_theta * s, cos_theta, -sin_theta * c)
}

/// Turns `d` about +Y by the angle whose sine and cosine are given, counter-clockwise seen from above.
#[inline]
pub fn rotate_y(d: Vec3, sin: f32, cos: f32) -> Vec3 {
    Vec3::new(d.x * cos + d.z * sin, d.y, d.z * cos - d.x * sin)
}

/// Radiance of the map along a unit direction in its frame: bilinear, periodic in u, clamped at the poles.
#[inline]
pub fn lookup_environment(map: &EnvironmentMap, d: Vec3) -> Vec3 {
    let (w, h) = (map.width, map.height);
    if w == 1 && h == 1 {
        return Vec3::from_array(map.texels[0]);
    }
    let uv = direction_to_lat_long(d);
    let (x, y) = (uv.x * w as f32 - 0.5, uv.y * h as f32 - 0.5);
    let (xf, yf) = (x.floor(), y.floor());
    let (fx, fy) = (x - xf, y - yf);
    let column = |i: i32| i.rem_euclid(w as i32) as usize;
    let row = |j: i32| j.clamp(0, h as i32 - 1) as usize * w as usize;
    let (x0, x1) = (column(xf as i32), column(xf as i32 + 1));
    let (y0, y1) = (row(yf as i32), row(yf as i32 + 1));
    let texel = |i: usize| Vec3::from_array(map.texels[i]);
    let top = texel(y0 + x0) * (1.0 - fx) + texel(y0 + x1) * fx;
    let bottom = texel(y1 + x0) * (1.0 - fx) + texel(y1 + x1) * fx;
    top * (1.0 - fy) + bottom * fy
}

/// Tables that sample a latitude-longitude map.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentDistribution {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Cumulative probability of the rows, from the top; the last is 1.
    pub marginal: Vec<f32>,
    /// Cumulative probability of the texels within their row; each row's last is 1 (0 for a black row).
    pub conditional: Vec<f32>,
    /// Cosine of the angle from the zenith at the upper edge of each row, and at the lower edge of the last.
    pub cos_edges: Vec<f32>,
    /// Luminance integrated over the sphere, in W/m^2: the distribution's normalisation.
    pub integral: f32,
}

impl EnvironmentDistribution {
    /// Builds the tables; `None` for a black map.
    pub fn build(map: &EnvironmentMap) -> Option<Self> {
        let (w, h) = (map.width as usize, map.height as usize);
        let cos_edges: Vec<f32> = (0..=h)
            .map(|j| match j {
                0 => 1.0,
                j if j == h => -1.0,
                j => sin_cos_turns(0.5 * j as f32 / h as f32).1,
            })
            .collect();
        // The mean of a bilinear interpolant over a texel weighs the texel 3/4 and its neighbours 1/8 along each axis.
        let filtered_row = |j: usize| -> Vec<f32> {
            let lum: Vec<f32> = map.texels[j * w..(j + 1) * w]
                .iter()
                .map(|&t| luminance(Vec3::from_array(t)))
                .map(|l| if l > 0.0 && l.is_finite() { l } else { 0.0 })
                .collect();
            (0..w).map(|i| 0.75 * lum[i] + 0.125 * (lum[(i + w - 1) % w] + lum[(i + 1) % w])).collect()
        };
        let mut conditional = Vec::with_capacity(w * h);
        let mut row_sums = Vec::with_capacity(h);
        let mut above = filtered_row(0);
        let mut here = above.clone();
        for j in 0..h {
            let below = if j + 1 < h { filtered_row(j + 1) } else { here.clone() };
            let first = conditional.len();
            let mut sum = 0.0f64;
            for i in 0..w {
                sum += (0.75 * here[i] + 0.125 * (above[i] + below[i])) as f64;
                conditional.push(sum as f32);
            }
            normalize_cumulative(&mut conditional[first..]);
            let solid_angle = 2.0 * PI / w as f32 * (cos_edges[j] - cos_edges[j + 1]);
            row_sums.push(sum * solid_angle as f64);
            above = std::mem::replace(&mut here, below);
        }
        let mut marginal = Vec::with_capacity(h);
        let mut integral = 0.0f64;
        for sum in row_sums {
            integral += sum;
            marginal.push(integral as f32);
        }
        normalize_cumulative(&mut marginal);
        let integral = integral as f32;
        (integral > 0.0 && integral.is_finite()).then_some(Self {
            width: map.width,
            height: map.height,
            marginal,
            conditional,
            cos_edges,
            integral,
        })
    }

    /// The direction that `u` selects, in the map's frame, and its density over solid angle.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let (row, fy) = search_cumulative(&self.marginal, u.y);
        let texels = self.row(row);
        let (column, fx) = search_cumulative(texels, u.x);
        let (c0, c1) = (self.cos_edges[row], self.cos_edges[row + 1]);
        let d = lat_long_to_direction((column as f32 + fx) / self.width as f32, c0 + (c1 - c0) * fy);
        (d, self.texel_pdf(row, column))
    }

    /// The density over solid angle with which [`Self::sample`] gives a unit direction of the map's frame.
    #[inline]
    pub fn pdf(&self, d: Vec3) -> f32 {
        let uv = direction_to_lat_long(d);
        let column = ((uv.x * self.width as f32) as usize).min(self.width as usize - 1);
        let row = ((uv.y * self.height as f32) as usize).min(self.height as usize - 1);
        self.texel_pdf(row, column)
    }

    #[inline]
    fn row(&self, row: usize) -> &[f32] {
        let w = self.width as usize;
        &self.conditional[row * w..(row + 1) * w]
    }

    #[inline]
    fn texel_pdf(&self, row: usize, column: usize) -> f32 {
        let probability = cumulative_step(&self.marginal, row) * cumulative_step(self.row(row), column);
        let solid_angle = 2.0 * PI / self.width as f32 * (self.cos_edges[row] - self.cos_edges[row + 1]);
        probability / solid_angle
    }
}

/// Divides by the last element, which becomes exactly 1 (all stay 0 where it is 0).
fn normalize_cumulative(values: &mut [f32]) {
    let total = values.last().copied().unwrap_or(0.0);
    if total > 0.0 {
        for v in values {
            *v /= total;
        }
    }
}

/// The probability of element `i` of a normalised cumulative table.
#[inline]
pub fn cumulative_step(cumulative: &[f32], i: usize) -> f32 {
    if i == 0 { cumulative[0] } else { cumulative[i] - cumulative[i - 1] }
}

/// The first element whose cumulative value exceeds `u` (which is below the last one), and where `u` lies in its step,
/// in 0..1.
#[inline]
pub fn search_cumulative(cumulative: &[f32], u: f32) -> (usize, f32) {
    let (mut lo, mut hi) = (0, cumulative.len() - 1);
    while lo < hi {
        let mid = (lo + hi) / 2;
        if cumulative[mid] > u {
            hi = mid;
        } else {
            lo = mid + 1;
        }
    }
    let before = if lo == 0 { 0.0 } else { cumulative[lo - 1] };
    let step = cumulative[lo] - before;
    let fraction = if step > 0.0 { (u - before) / step } else { 0.0 };
    (lo, fraction.clamp(0.0, 1.0 - f32::EPSILON / 2.0))
}

/// Whether a unit direction lies in the sun's disc: the squared chord decides, which keeps its precision for a disc of a
/// quarter of a degree.
#[inline]
pub fn sun_contains(sun: &Sun, d: Vec3) -> bool {
    (d - Vec3::from_array(sun.direction)).length_squared() <= 2.0 * (1.0 - sun.cos_radius)
}

/// Density over solid angle of a uniform choice within the sun's disc.
#[inline]
pub fn sun_pdf(sun: &Sun) -> f32 {
    1.0 / (2.0 * PI * (1.0 - sun.cos_radius))
}

/// A uniform direction within the sun's disc.
#[inline]
pub fn sample_sun(sun: &Sun, u: Vec2) -> Vec3 {
    let frame = OrthonormalFrame::from_normal(Vec3::from_array(sun.direction));
    let d = frame.to_world(sample_cone(u, 1.0 - sun.cos_radius));
    safe_normalize(d, frame.n)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient_map(w: u32, h: u32) -> EnvironmentMap {
        let texels = (0..w * h)
            .map(|i| {
                let (x, y) = (i % w, i / w);
                let hot = if x == w / 3 && y == h / 4 { 500.0 } else { 0.0 };
                [0.1 + x as f32 / w as f32, hot, if y > h / 2 { 0.0 } else { 1.0 }]
            })
            .collect();
        EnvironmentMap { width: w, height: h, texels }
    }

    fn sphere(n: usize) -> impl Iterator<Item = Vec3> {
        (0..n).flat_map(move |i| {
            (0..2 * n).map(move |j| {
                lat_long_to_direction((j as f32 + 0.5) / (2 * n) as f32, 1.0 - 2.0 * (i as f32 + 0.5) / n as f32)
            })
        })
    }

    #[test]
    fn directions_and_coordinates_are_inverse() {
        for d in sphere(64) {
            let uv = direction_to_lat_long(d);
            let back = lat_long_to_direction(uv.x, sin_cos_turns(uv.y * 0.5).1);
            assert!(d.distance(back) < 2e-3 * (1.0 - d.y.abs()).max(1e-3) + 1e-5, "{d} {back}");
        }
        assert!(direction_to_lat_long(Vec3::NEG_Z).distance(Vec2::new(0.5, 0.5)) < 1e-6);
        assert!(direction_to_lat_long(Vec3::X).distance(Vec2::new(0.75, 0.5)) < 1e-6);
        assert!(direction_to_lat_long(Vec3::Y).y < 1e-6);
    }

    #[test]
    fn a_positive_rotation_is_counter_clockwise_from_above() {
        // Seen from +Y with -Z up on the page, +X is to the right: a quarter turn takes +X to -Z.
        assert!(rotate_y(Vec3::X, 1.0, 0.0).distance(Vec3::NEG_Z) < 1e-6);
    }

    #[test]
    fn the_density_integrates_to_one_and_matches_the_samples() {
        let map = gradient_map(32, 16);
        let tables = EnvironmentDistribution::build(&map).unwrap();
        let n = 512;
        let integral: f64 =
            sphere(n).map(|d| tables.pdf(d) as f64).sum::<f64>() * 4.0 * std::f64::consts::PI / (2 * n * n) as f64;
        assert!((integral - 1.0).abs() < 5e-3, "{integral}");
        for i in 0..100 {
            for j in 0..100 {
                let (d, pdf) = tables.sample(Vec2::new(i as f32 + 0.5, j as f32 + 0.5) / 100.0);
                assert!(pdf > 0.0 && (d.length() - 1.0).abs() < 1e-5);
                assert!((tables.pdf(d) / pdf - 1.0).abs() < 1e-3, "{d}");
            }
        }
    }

    #[test]
    fn the_estimate_of_the_integral_has_little_variance() {
        let map = gradient_map(64, 32);
        let tables = EnvironmentDistribution::build(&map).unwrap();
        let (mut sum, mut squares, n) = (0.0f64, 0.0f64, 100);
        for i in 0..n * n {
            let (d, pdf) = tables.sample(Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32);
            let estimate = (luminance(lookup_environment(&map, d)) / pdf) as f64;
            sum += estimate;
            squares += estimate * estimate;
        }
        let (mean, count) = (sum / (n * n) as f64, (n * n) as f64);
        assert!((mean / tables.integral as f64 - 1.0).abs() < 0.01, "{mean} {}", tables.integral);
        let relative_deviation = (squares / count - mean * mean).sqrt() / mean;
        assert!(relative_deviation < 0.8, "{relative_deviation}");
    }

    #[test]
    fn a_constant_map_of_one_texel_is_sampled_uniformly() {
        let map = EnvironmentMap { width: 1, height: 1, texels: vec![[2.0; 3]] };
        let tables = EnvironmentDistribution::build(&map).unwrap();
        assert!((tables.integral / (8.0 * PI) - 1.0).abs() < 1e-5);
        let (_, pdf) = tables.sample(Vec2::new(0.3, 0.9));
        assert!((pdf * 4.0 * PI - 1.0).abs() < 1e-5);
        assert!(EnvironmentDistribution::build(&EnvironmentMap { texels: vec![[0.0; 3]], ..map }).is_none());
    }

    #[test]
    fn sun_samples_lie_in_the_sun() {
        let sun = Sun { direction: [0.48, 0.8, -0.36], radiance: [1.0; 3], cos_radius: 0.2666f32.to_radians().cos() };
        for i in 0..1000 {
            let d = sample_sun(&sun, Vec2::new((i as f32 + 0.5) / 1001.0, (i as f32 * 0.618).fract()));
            assert!(sun_contains(&sun, d));
        }
        let outside = sample_sun(&Sun { cos_radius: 0.3f32.to_radians().cos(), ..sun }, Vec2::new(0.999, 0.1));
        assert!(!sun_contains(&sun, outside));
    }
}
