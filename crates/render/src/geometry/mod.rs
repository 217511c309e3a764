//! Geometry: from accessors to the global streams.
//!
//! Every format ends as the same four streams (positions, attributes, indices, corner tangents) with one
//! [`MeshDesc`](orthant_resident::rows::MeshDesc) per distinct geometry. The sizes of all spans are known from the
//! accessors' counts before anything is decoded, so the streams are allocated once and filled in parallel.

mod decode;
mod deform;
mod rows;
pub mod store;
mod tangents;
mod topology;

pub use decode::{GeometryPlan, GeometryStreams};
pub use deform::{Deformation, SkinPose};
pub use store::{GeometryStore, Piece};
pub use topology::triangle_index_count;

use orthant_scene::model::{MeshId, NodeId};

/// One distinct piece of geometry; its index is the row of its MeshDesc and its BLAS slot.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderPrimitive {
    /// The first mesh that has it.
    pub mesh: MeshId,
    /// Its position in that mesh's primitives.
    pub primitive: usize,
    /// The node whose pose deforms it, for a skinned or morphed one.
    pub deformed_by: Option<NodeId>,
    /// Which UV set MikkTSpace runs on, where a material in use has a normal map and the file gives no tangents.
    pub tangents_from_uv: Option<u32>,
}

impl RenderPrimitive {
    /// A slot without geometry.
    pub(crate) const FREE: Self = Self { mesh: MeshId::NULL, primitive: 0, deformed_by: None, tangents_from_uv: None };
}
