//! Row layouts: what is resident, byte for byte, on every backend.
//!
//! Every row is `repr(C)` and [`bytemuck::Pod`], its size a multiple of 4 bytes without implicit padding, so that a
//! write is a copy and a shader reads it with the same offsets.

mod emitter;
mod light;
mod material;
mod matrix;
mod mesh_desc;
mod render_node;
mod vertex;

pub use emitter::{EmitterRow, EmitterTriangle};
pub use light::{LightKind, LightRow};
pub use material::{AlphaMode, MaterialFlags, MaterialRow, TextureSlot};
pub use matrix::Mat3x4;
pub use mesh_desc::{MeshDesc, MeshFlags};
pub use render_node::{NodeFlags, RenderNodeRow};
pub use vertex::{VertexRow, decode_normal, decode_tangent, encode_normal, encode_tangent};

/// The index that means "none" in every `u32` reference of a row.
pub const NONE: u32 = u32::MAX;
