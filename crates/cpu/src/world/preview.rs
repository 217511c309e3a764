//! Shading without further rays: one sun and light from all around.

use glam::Vec3;
use orthant_resident::world::Shade;

/// The lights of [`Shade::Preview`].
#[derive(Clone, Copy, Debug)]
pub struct PreviewLight {
    direction: Vec3,
    sun: Vec3,
    ambient: Vec3,
    zenith: Vec3,
    horizon: Vec3,
    nadir: Vec3,
}

impl PreviewLight {
    /// Those of a view; `None` if it is shaded by light transport.
    pub fn new(shade: &Shade) -> Option<Self> {
        let Shade::Preview { direction, sun, ambient, zenith, horizon, nadir } = *shade else { return None };
        Some(Self {
            direction: direction.into(),
            sun: sun.into(),
            ambient: ambient.into(),
            zenith: zenith.into(),
            horizon: horizon.into(),
            nadir: nadir.into(),
        })
    }

    /// Radiance of a surface with the unit normal `n` of its layer.
    #[inline]
    pub fn shade(&self, albedo: Vec3, emission: Vec3, n: Vec3) -> Vec3 {
        emission + albedo * (self.ambient + self.sun * n.dot(self.direction).max(0.0))
    }

    /// Radiance of the sky in a direction of the layer.
    #[inline]
    pub fn sky(&self, direction: Vec3) -> Vec3 {
        let height = direction.y.clamp(-1.0, 1.0);
        let end = if height >= 0.0 { self.zenith } else { self.nadir };
        self.horizon + (end - self.horizon) * height.abs()
    }
}
