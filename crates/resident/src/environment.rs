//! What surrounds the scene: radiance by direction, and optionally a sun.

use std::sync::Arc;

/// A latitude-longitude map of radiance.
///
/// Row 0 is the zenith (+Y). Column 0 begins at azimuth -pi; the direction of the texel coordinates (u, v) in 0..1 is
/// `theta = pi v`, `phi = 2 pi (u - 0.5)`, `(sin(theta) sin(phi), cos(theta), -sin(theta) cos(phi))`: the middle of the
/// image looks along -Z, its right half towards +X.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// Linear radiance, rows from the top. Finite and not negative.
    pub texels: Vec<[f32; 3]>,
}

/// A disc of uniform radiance at infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector from the scene to the centre of the disc.
    pub direction: [f32; 3],
    /// Radiance of the disc.
    pub radiance: [f32; 3],
    /// Cosine of its angular radius; the sun of Earth has 0.2666 degrees.
    pub cos_radius: f32,
}

/// What surrounds the scene. Without a map and a sun it is black.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Environment {
    /// Radiance from far away.
    pub map: Option<Arc<EnvironmentMap>>,
    /// Turns the map (and the sun) about +Y, in radians, counter-clockwise seen from above.
    pub rotation: f32,
    /// Multiplies the map and the sun. The default, 0, is replaced by nothing: set it.
    pub intensity: f32,
    /// The sun.
    pub sun: Option<Sun>,
}

impl Environment {
    /// Black.
    pub fn none() -> Self {
        Self { intensity: 1.0, ..Self::default() }
    }

    /// The same radiance from everywhere.
    pub fn constant(radiance: [f32; 3]) -> Self {
        let map = EnvironmentMap { width: 1, height: 1, texels: vec![radiance] };
        Self { map: Some(Arc::new(map)), rotation: 0.0, intensity: 1.0, sun: None }
    }
}
