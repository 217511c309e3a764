//! What shines in a resident scene, prepared for sampling: tables that follow batches at the cost of what they change.
//!
//! A backend keeps [`LightTables`] beside its rows and samples them ([`crate::sampling::lights`] tells how lights are chosen);
//! one whose rows are on a device keeps those few that [`LightRows`] asks for, and sends what [`LightTables`] has written.

mod changes;
mod quad;
mod tables;
mod validate;

pub use changes::{LightChanges, LightWork, LightWrites};
pub use quad::Quad;
pub use tables::LightTables;

use crate::rows::{EmitterRow, LightRow, MeshDesc, RenderNodeRow};

/// What the tables look at of a resident scene.
pub trait LightRows {
    /// The light buffer.
    fn lights(&self) -> &[LightRow];

    /// The emitter buffer.
    fn emitters(&self) -> &[EmitterRow];

    /// A row of the render-node buffer that emits.
    fn emitting_node(&self, row: u32) -> Option<&RenderNodeRow>;

    /// The geometry of a RenderPrimitive.
    fn mesh_desc(&self, primitive: u32) -> Option<&MeshDesc>;

    /// Object-space corners of the first triangle of a RenderPrimitive that is a parallelogram
    /// ([`MeshDesc::parallelogram`]).
    fn first_triangle(&self, primitive: u32) -> Option<[[f32; 3]; 3]>;
}
