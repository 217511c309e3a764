use bytemuck::{Pod, Zeroable};

/// Bits of [`MeshDesc::flags`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshFlags;

impl MeshFlags {
    /// The file gave no normals and asks for flat shading: the normal is the triangle's own.
    pub const FLAT: u32 = 1;
    /// The first UV set was given (else it is (0, 0)).
    pub const UV0: u32 = 2;
    /// The second UV set was given (else it is (0, 0)).
    pub const UV1: u32 = 4;
    /// Vertex colours were given (else they are white).
    pub const COLOR: u32 = 8;
    /// Tangents are in the tangent stream (given, or made by MikkTSpace).
    pub const TANGENT: u32 = 16;
    /// The vertices are skinned or morphed: the span belongs to one node.
    pub const DEFORMED: u32 = 32;
}

/// The ranges of one distinct piece of geometry in the global streams; its row is the RenderPrimitive index and the
/// BLAS slot. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MeshDesc {
    /// First element in the position and attribute streams.
    pub first_vertex: u32,
    /// Vertices.
    pub vertex_count: u32,
    /// First element in the index stream. Indices are local: 0 is `first_vertex`.
    pub first_index: u32,
    /// Indices: three a triangle.
    pub index_count: u32,
    /// First element in the tangent stream (one per index, in index order), or [`super::NONE`].
    pub first_tangent: u32,
    /// [`MeshFlags`].
    pub flags: u32,
    /// First row in the emitter-triangle table, or [`super::NONE`] where no material in use makes it emit.
    pub first_emitter_triangle: u32,
    /// Zero.
    pub reserved: u32,
    /// Smallest corner of the object-space bounds.
    pub bounds_min: [f32; 3],
    /// Sum of the triangles' object-space areas.
    pub area: f32,
    /// Largest corner of the object-space bounds.
    pub bounds_max: [f32; 3],
    /// Zero.
    pub reserved2: u32,
}

impl MeshDesc {
    /// Triangles.
    #[inline]
    pub fn triangle_count(&self) -> u32 {
        self.index_count / 3
    }
}
