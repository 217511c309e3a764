//! Directional albedo of the GGX reflection lobe, tabulated: what energy compensation needs on every backend.
//!
//! For the single-scattering lobe with Fresnel term `F = f0 + (f90 - f0) (1 - cos)^5` (Schlick 1994) the albedo is
//! linear in both: `E = f0 (A - B) + f90 B`, where A is the albedo with F = 1 and B that with F = (1 - cos)^5. Both are
//! tabulated over the square root of the cosine of the view direction (it resolves the fall-off at grazing angles) and
//! the perceptual roughness, and are bilinear between.
//!
//! The numbers of [`table`] are made by `cargo run --release -p orthant-cpu --example energy_table`.

mod table;

pub use table::{AVERAGES, COSINES, ENERGY, ROUGHNESSES};

/// The smallest GGX width: smoother surfaces reflect like it (the lobe's half width is then 0.06 degrees).
pub const MIN_ALPHA: f32 = 5e-4;

/// The GGX width of a perceptual roughness: its square (glTF 2.0, appendix B.2), at least [`MIN_ALPHA`].
#[inline]
pub fn roughness_to_alpha(roughness: f32) -> f32 {
    (roughness * roughness).clamp(MIN_ALPHA, 1.0)
}

/// A and B of the module's text: at one angle, or their cosine-weighted means over the hemisphere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Albedo with a Fresnel term of 1.
    pub a: f32,
    /// Albedo with a Fresnel term of `(1 - cos)^5`.
    pub b: f32,
}

impl Energy {
    /// The albedo with Schlick's Fresnel term.
    #[inline]
    pub fn albedo(self, f0: f32, f90: f32) -> f32 {
        f0 * (self.a - self.b) + f90 * self.b
    }

    #[inline]
    fn lerp(self, other: Self, t: f32) -> Self {
        Self { a: self.a + (other.a - self.a) * t, b: self.b + (other.b - self.b) * t }
    }
}

/// The table at one roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyRow {
    row: usize,
    fraction: f32,
}

impl EnergyRow {
    /// The row (between two rows) of a perceptual roughness in 0..=1.
    #[inline]
    pub fn new(roughness: f32) -> Self {
        let y = roughness.clamp(0.0, 1.0) * (ROUGHNESSES - 1) as f32;
        let row = (y as usize).min(ROUGHNESSES - 2);
        Self { row, fraction: y - row as f32 }
    }

    /// A and B seen under the cosine `mu` in 0..=1.
    #[inline]
    pub fn at(self, mu: f32) -> Energy {
        let x = mu.clamp(0.0, 1.0).sqrt() * (COSINES - 1) as f32;
        let column = (x as usize).min(COSINES - 2);
        let t = x - column as f32;
        let at_row = |row: usize| {
            let i = row * COSINES + column;
            unpack(ENERGY[i]).lerp(unpack(ENERGY[i + 1]), t)
        };
        let e = at_row(self.row).lerp(at_row(self.row + 1), self.fraction);
        Energy { a: e.a * (1.0 / 65535.0), b: e.b * (1.0 / 65535.0) }
    }

    /// The cosine-weighted means `2 integral of E(mu) mu dmu` of what [`Self::at`] gives.
    #[inline]
    pub fn average(self) -> Energy {
        let at_row = |row: usize| Energy { a: AVERAGES[row][0], b: AVERAGES[row][1] };
        at_row(self.row).lerp(at_row(self.row + 1), self.fraction)
    }
}

/// Two 16-bit integers, A in the low half; 65535 is 1.
#[inline]
fn unpack(bits: u32) -> Energy {
    Energy { a: (bits & 0xffff) as f32, b: (bits >> 16) as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_averages_are_those_of_the_interpolated_table() {
        for roughness in [0.0, 0.13, 0.5, 0.77, 1.0] {
            let row = EnergyRow::new(roughness);
            let n = 200_000;
            let (mut a, mut b) = (0.0f64, 0.0f64);
            for i in 0..n {
                let mu = (i as f32 + 0.5) / n as f32;
                let e = row.at(mu);
                a += (e.a * mu) as f64 * 2.0 / n as f64;
                b += (e.b * mu) as f64 * 2.0 / n as f64;
            }
            let mean = row.average();
            assert!((a - mean.a as f64).abs() < 1e-5 && (b - mean.b as f64).abs() < 1e-5, "{roughness}: {a} {mean:?}");
        }
    }

    #[test]
    fn smooth_surfaces_keep_all_energy_and_rough_ones_lose_some() {
        assert!(EnergyRow::new(0.0).at(1.0).a > 0.9999);
        assert!(EnergyRow::new(0.0).average().a > 0.998);
        let rough = EnergyRow::new(1.0);
        assert!(rough.at(1.0).a < 0.95 && rough.average().a < 0.8);
        assert!(rough.at(0.5).albedo(1.0, 1.0) == rough.at(0.5).a);
    }
}
