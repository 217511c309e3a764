use super::Mat3x4;
use bytemuck::{Pod, Zeroable};

/// Bits of [`RenderNodeRow::flags`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeFlags;

impl NodeFlags {
    /// The slot holds an instance (a slot without it is a hole, and every other field of it is zero or [`super::NONE`]).
    pub const OCCUPIED: u32 = 1;
    /// Rays see it: it is inherited-visible and its primitive has triangles.
    pub const VISIBLE: u32 = 2;
    /// No any-hit work: the material is opaque, so that the nearest triangle is the hit.
    pub const OPAQUE: u32 = 4;
    /// Rays see both faces; without it, back faces do not exist for any ray.
    pub const DOUBLE_SIDED: u32 = 8;
    /// The world matrix mirrors (negative determinant): the front face is the clockwise one.
    pub const MIRRORED: u32 = 16;
}

/// One instance of a RenderPrimitive; its index is the TLAS instance index. 128 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct RenderNodeRow {
    /// Object to world, relative to the scene's origin.
    pub world: Mat3x4,
    /// World to object: the inverse of `world`, computed in `f64`.
    pub inverse: Mat3x4,
    /// RenderPrimitive index (= row of the MeshDesc buffer = BLAS slot).
    pub primitive: u32,
    /// Row of the material buffer.
    pub material: u32,
    /// What the `node` AOV shows: the index of the node in the document (its glTF index after loading one file).
    pub node: u32,
    /// [`NodeFlags`].
    pub flags: u32,
    /// Row of the emitter buffer, or [`super::NONE`].
    pub emitter: u32,
    /// Zero.
    pub reserved: [u32; 3],
}

impl RenderNodeRow {
    /// A hole: what a free slot holds.
    pub const HOLE: Self = Self {
        world: Mat3x4::IDENTITY,
        inverse: Mat3x4::IDENTITY,
        primitive: super::NONE,
        material: super::NONE,
        node: super::NONE,
        flags: 0,
        emitter: super::NONE,
        reserved: [0; 3],
    };
}
