//! The CPU backend: the resident scene in memory and a multi-threaded ray tracer.
//!
//! * [`scene`]: [`ResidentScene`], every row and stream that a [`orthant_resident::SceneBatch`] writes, and the
//!   acceleration structures over them;
//! * [`accel`]: the structures themselves: one BLAS per RenderPrimitive, one TLAS over the RenderNodes;
//! * [`trace`]: rays through them;
//! * [`path`]: the path tracer;
//! * [`world`]: worlds of blocks: sets of arenas, rays, image modes;
//! * [`backend`]: [`CpuBackend`], which ties them together.

pub mod accel;
pub mod backend;
pub mod path;
pub mod scene;
pub mod trace;
pub mod world;

pub use backend::CpuBackend;
pub use scene::ResidentScene;
pub use trace::{Hit, Ray};
