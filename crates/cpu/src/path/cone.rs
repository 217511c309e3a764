//! Ray cones: how wide a ray is where it hits (Akenine-Moeller et al. 2021, "Improved Shader and Texture Level of Detail
//! Using Ray Cones").
//!
//! The footprint is taken by its area, `width^2 / cos`, the geometric mean of the ellipse's axes; the rest of a slanted
//! footprint's length is left to the samples of the pixel. Curvature narrows or widens nothing.

/// A cone about a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayCone {
    /// Width at the origin, in metres.
    pub width: f32,
    /// Growth of the width per metre: the small angle between its sides.
    pub spread: f32,
}

impl RayCone {
    /// The cone of a ray that goes on from a hit at distance `t`, spread by `angle` more.
    #[inline]
    pub fn propagate(self, t: f32, angle: f32) -> Self {
        Self { width: self.width + self.spread * t, spread: self.spread + angle }
    }

    /// Area of the footprint, in square metres, on a surface at distance `t` under the cosine `cos`.
    #[inline]
    pub fn footprint(self, t: f32, cos: f32) -> f32 {
        let width = self.width + self.spread * t;
        width * width / cos.abs().max(1e-3)
    }
}
