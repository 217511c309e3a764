//! The camera, as plain data.

/// How film points become rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole or thin lens.
    Perspective {
        /// Tangent of half the vertical field of view.
        tan_half_fov_y: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the height of the view, in metres.
        half_height: f32,
    },
}

/// A camera in world space relative to the scene's origin. The aspect ratio is that of the image: pixels are square.
///
/// The film point of pixel (x, y) with offsets in 0..1 is `sx = (2 (x + ox) / W - 1) W / H`,
/// `sy = 1 - 2 (y + oy) / H`; the ray goes along `forward + tan_half_fov_y (sx right + sy up)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the lens.
    pub position: [f32; 3],
    /// Unit vector to the right of the image.
    pub right: [f32; 3],
    /// Unit vector to the top of the image.
    pub up: [f32; 3],
    /// Unit vector into the scene; `right`, `up` and `-forward` are right-handed.
    pub forward: [f32; 3],
    /// The projection.
    pub projection: Projection,
    /// Radius of the lens in metres; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance along `forward` of the plane in focus, in metres.
    pub focus_distance: f32,
    /// Hits nearer than this along `forward` do not exist for camera rays, in metres.
    pub near: f32,
    /// Nor do those farther than this; infinity for none.
    pub far: f32,
}
