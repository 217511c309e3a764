//! What crosses between the host and the shaders of the preview: every struct has a twin of the same name and layout in
//! `shaders/raster/tables.slang`; see [`crate::abi`].

use crate::abi::Address;
use bytemuck::{Pod, Zeroable};

/// A frame of the preview, and where its passes find what they need.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct RasterTable {
    /// Of a [`crate::abi::FrameTable`].
    pub frame: Address,
    /// [`DrawCommand`]s: `capacity` for each bucket.
    pub commands: Address,
    /// Four counts for each group of rows.
    pub group_counts: Address,
    /// Commands of each bucket.
    pub counts: Address,
    /// Four floats a texel: the filtered maps of image-based lighting.
    pub filtered: Address,
    /// Commands that a bucket has room for.
    pub capacity: u32,
    /// Rows of the render-node buffer.
    pub row_count: u32,
    /// Groups of 256 rows.
    pub group_count: u32,
    /// 1 if there is an environment map, and so filtered ones.
    pub has_environment: u32,
    /// 1 over the distance of the plane in focus; 0 without a lens.
    pub inverse_focus: f32,
    /// What distances are multiplied by in the weights of blending.
    pub blend_scale: f32,
}

/// Push constants of the graphics pipelines.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct RasterPush {
    /// Of a [`RasterTable`].
    pub table: Address,
    /// Where in a pixel its samples are centred, in pixels from its centre.
    pub offset: [f32; 2],
    /// The point of the lens, in metres along the camera's right and up.
    pub lens: [f32; 2],
    /// Depth in clip space is the first plus the second times the distance along the forward axis.
    pub depth: [f32; 2],
    /// Left column of the part of the image that is drawn.
    pub tile_x: u32,
    /// Top row.
    pub tile_y: u32,
    /// Columns.
    pub tile_width: u32,
    /// Rows.
    pub tile_height: u32,
    /// [`super::RasterView`], or 12 for normals as they are.
    pub view: u32,
    /// Which of the passes over the image it is: random numbers differ between them.
    pub sample: u32,
}

/// Push constants of culling.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct CullPush {
    /// Of a [`RasterTable`].
    pub table: Address,
    /// 1 if what is outside of a plane is left out.
    pub culls: u32,
    /// Zero.
    pub reserved: u32,
    /// Six planes, each a normal and a distance: what is seen of a point p relative to the camera has n p + d >= 0.
    pub planes: [f32; 24],
}

/// Push constants of what is done with finished targets.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ResolvePush {
    /// Of a [`RasterTable`].
    pub table: Address,
    /// Four floats for each pixel of the frame's tile, to which the targets are added.
    pub sums: Address,
    /// Left column of the part in the frame's tile.
    pub x: u32,
    /// Top row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// What the targets are multiplied by: the samples that they stand for.
    pub weight: f32,
    /// Zero.
    pub reserved: u32,
}

/// Push constants of filtering the environment.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct EnvironmentPush {
    /// Of a [`crate::abi::LightTable`].
    pub lights: Address,
    /// Four floats a texel: the map in smaller and smaller sizes.
    pub pyramid: Address,
    /// Four floats a texel: what the passes make.
    pub filtered: Address,
    /// Which level is made.
    pub level: u32,
    /// Zero.
    pub reserved: u32,
}

/// `VkDrawIndirectCommand`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct DrawCommand {
    /// Indices of the primitive.
    pub vertex_count: u32,
    /// 1.
    pub instance_count: u32,
    /// 0.
    pub first_vertex: u32,
    /// Row of the render node.
    pub first_instance: u32,
}
