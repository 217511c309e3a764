//! Next event estimation.
//!
//! * [`emitter`]: emissive triangles, and quads: two that are one area light;
//! * [`distant`]: the environment map and the sun;
//! * [`punctual`]: lights without a size.
//!
//! How lights are chosen is told in [`orthant_resident::sampling::lights`], and how the tables follow edits in
//! [`orthant_resident::lights`].

pub mod distant;
pub mod emitter;
pub mod punctual;
#[cfg(test)]
mod tests;

pub use orthant_resident::lights::LightTables;

use glam::Vec3;

/// A direction in which light may come.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit vector to the light.
    pub direction: Vec3,
    /// The point at which the shadow ray ends; `None` for a light at infinity.
    pub end: Option<Vec3>,
    /// Radiance that arrives if nothing is between; for a punctual light irradiance at a surface that faces it.
    pub radiance: Vec3,
    /// Density over solid angle; 1 for a punctual light.
    pub pdf: f32,
}

/// The power heuristic (Veach 1997, section 9.2.4) for the strategy with density `a`, which is positive.
#[inline]
pub fn power_heuristic(a: f32, b: f32) -> f32 {
    let r = b / a;
    1.0 / (1.0 + r * r)
}
