//! The raster preview: the resident scene by graphics pipelines, from the same buffers and tables as the path tracer.
//!
//! * `cull`: a compute pass writes a draw command for each render node in the view; the host does nothing per node;
//! * `pipelines`, `targets`: what draws, and into what: four samples a pixel, radiance as 32-bit floats;
//! * `environment`: the environment's map filtered for image-based lighting, once for each map;
//! * `camera`: projection, planes and offsets of a pass;
//! * `record`: one pass over the image; `job`: a frame under way, which is the mean of passes;
//! * [`abi`]: what the shaders (`shaders/raster`) see of it.
//!
//! Opaque surfaces and alpha tests write depth; what is blended comes after, in any order, by weighted sums; the sky fills
//! what is left. Light comes from the environment, the sun, punctual lights and surfaces that emit, without shadows and
//! without light from other surfaces.

pub mod abi;
mod camera;
mod cull;
mod environment;
mod job;
mod pipelines;
mod record;
mod targets;
mod timer;

pub(crate) use job::{RasterJob, RasterPasses, RasterScene, check};
pub(crate) use record::Raster;

use std::time::Duration;

/// What the image shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum RasterView {
    /// Lit surfaces before the environment.
    #[default]
    Shaded = 0,
    /// Base colour: factor times texture times vertex colour.
    BaseColor = 1,
    /// Metalness, grey.
    Metallic = 2,
    /// Perceptual roughness, grey.
    Roughness = 3,
    /// World-space shading normals on the side that is seen, n / 2 + 1 / 2.
    Normals = 4,
    /// World-space tangents, t / 2 + 1 / 2; black where there is none.
    Tangents = 5,
    /// The fractions of the first UV set, red and green.
    Uvs = 6,
    /// Emitted radiance.
    Emissive = 7,
    /// A colour for each node.
    Node = 8,
    /// A colour for each RenderPrimitive.
    Primitive = 9,
    /// A colour for each material; grey for the default one.
    Material = 10,
    /// Edges of triangles, white on nearly black.
    Wireframe = 11,
}

/// How a frame is rasterized.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RasterOptions {
    /// What the image shows.
    pub view: RasterView,
    /// Leave out what is outside of the view before it is drawn. The image does not depend on it.
    pub culls: bool,
}

impl Default for RasterOptions {
    fn default() -> Self {
        Self { view: RasterView::Shaded, culls: true }
    }
}

/// What the last finished pass of a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RasterReport {
    /// Passes that are done.
    pub passes: u32,
    /// Render nodes that the last of them drew.
    pub drawn: u64,
    /// Time on the device of the fastest of them; `None` where the device has no clock.
    pub pass_time: Option<Duration>,
    /// The part of it that culling took.
    pub cull_time: Option<Duration>,
}
