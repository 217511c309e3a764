//! What a frame shows of a world, and how.
//!
//! A *layer* is a three-dimensional slice of the world: a hyperplane through the anchor, with three orthonormal axes of its own. Within a
//! layer everything is as in a model scene: the camera, shading, shadows, light that bounces, the environment. An image is one
//! layer, or several that are combined.

/// A slice of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Where the layer's x, y and z axes point in the world (X, Y, Z, W); orthonormal. Those of an unrotated view are X, Y and Z; of
    /// any other they are turned with the hidden axis by the smallest rotation that takes W there, so that the environment
    /// stands still while the camera turns.
    pub axes: [[f32; 4]; 3],
    /// The camera's unit vectors in the layer's axes.
    pub right: [f32; 3],
    /// See `right`.
    pub up: [f32; 3],
    /// See `right`.
    pub forward: [f32; 3],
}

impl Layer {
    /// A direction of the layer in the world.
    #[inline]
    pub fn to_world(&self, d: [f32; 3]) -> [f32; 4] {
        let [x, y, z] = &self.axes;
        std::array::from_fn(|a| x[a] * d[0] + y[a] * d[1] + z[a] * d[2])
    }

    /// The components of a direction of the world in the layer: its projection.
    #[inline]
    pub fn from_world(&self, d: [f32; 4]) -> [f32; 3] {
        self.axes.map(|axis| axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2] + axis[3] * d[3])
    }
}

/// How layers become one colour, sample by sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Combine {
    /// The mean. One layer is itself.
    Mean,
    /// Hits and sky are averaged separately, hits by the weight of their material and the sky by 1, and mixed by
    /// `log(1 + mix p) / log(1 + mix)`, `p` being the share of the hits in all weight; by `p` itself if `mix` is 0.
    Integral {
        /// The constant, at least 0.
        mix: f32,
    },
}

/// How a hit becomes a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shade {
    /// `emission + albedo (ambient + sun max(0, n l))`, with the normal projected into the layer: no rays but the camera's.
    Preview {
        /// Unit vector to the sun, in the layer's axes.
        direction: [f32; 3],
        /// The sun's irradiance over pi.
        sun: [f32; 3],
        /// The light from all around.
        ambient: [f32; 3],
        /// What is seen where nothing is hit, at the zenith. Between the three the sky is mixed linearly by the height of the
        /// direction, its y in the layer.
        zenith: [f32; 3],
        /// At the horizon.
        horizon: [f32; 3],
        /// At the nadir.
        nadir: [f32; 3],
    },
    /// Light transport within the layer, as in a model scene: [`crate::Frame::max_depth`] and the backend's environment.
    Path,
}

/// What a frame shows of a world.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldView {
    /// The point of the world, raw, at which the frame's camera stands.
    pub anchor: [i64; 4],
    /// The slices, at least one. A frame that shows a model scene too has one. The frame's camera has the vectors of the first;
    /// its position is the anchor.
    pub layers: Vec<Layer>,
    /// How they are combined.
    pub combine: Combine,
    /// Rays end here, in units.
    pub distance: f32,
    /// How hits are shaded.
    pub shade: Shade,
    /// Every block gets edges: lines of this width, as a fraction of the block's edge, darkened by half; 0 for none.
    pub edges: f32,
    /// Steps (nodes, leaves and cells together) that a ray may take; one that runs out is drawn in [`EXHAUSTED_COLOR`] and counted.
    pub step_budget: u32,
}

/// Radiance of a ray that ran out of steps.
pub const EXHAUSTED_COLOR: [f32; 3] = [1.0, 0.2, 0.0];

/// Steps that suffice for any scene seen so far.
pub const STEP_BUDGET: u32 = 1 << 16;

/// Layers of a view, at most.
pub const MAX_LAYERS: usize = 4096;

/// The farthest that a view may reach, in units.
pub const MAX_DISTANCE: f32 = 1e9;
