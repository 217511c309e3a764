use bytemuck::{Pod, Zeroable};

/// One emissive RenderNode. 32 bytes.
///
/// A point on it is sampled by choosing a triangle in proportion to its object-space area, then a point uniformly on
/// the triangle: the density over world area is `p(emitter) * (area_object / total_area_object) / area_world`. One that is
/// a rectangle ([`MeshDesc::parallelogram`](super::MeshDesc::parallelogram)) is sampled by solid angle instead:
/// `p(emitter) / solid_angle`. `p(emitter)` depends on where it is seen from
/// ([`LightTree`](crate::sampling::LightTree)).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct EmitterRow {
    /// The RenderNode that emits.
    pub render_node: u32,
    /// First row in the emitter-triangle table (the same as its MeshDesc's).
    pub first_triangle: u32,
    /// Rows in the emitter-triangle table: its triangles.
    pub triangle_count: u32,
    /// Sum of the object-space areas of its triangles.
    pub area: f32,
    /// About the power that it emits (luminance x world area x pi x faces): its weight in the choice among emitters and kinds
    /// of light.
    pub power: f32,
    /// Zero.
    pub reserved: [u32; 3],
}

impl EmitterRow {
    /// A row that holds no emitter.
    pub const HOLE: Self = Self {
        render_node: super::NONE,
        first_triangle: super::NONE,
        triangle_count: 0,
        area: 0.0,
        power: 0.0,
        reserved: [0; 3],
    };
}

/// One triangle of an emissive RenderPrimitive; the order is that of the index stream. 4 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct EmitterTriangle {
    /// Object-space area summed over this and all earlier triangles of the primitive, divided by the total: the last
    /// one's is 1.
    pub cumulative: f32,
}
