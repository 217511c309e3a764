//! Derived scenes, and the planners that turn changes into batches.
//!
//! [`DerivedScene::derive`] walks a model [`Scene`](orthant_scene::Scene) and makes what a renderer needs of it: flat
//! render nodes, geometry streams, material, light and emitter rows. [`DerivedScene::load_batch`] hands it to a backend
//! as one [`SceneBatch`](orthant_resident::SceneBatch).
//!
//! * [`derived`]: the derived scene and its parts;
//! * [`DecodedScene`]: geometry and images alone, decoded;
//! * [`geometry`]: accessors to streams, tangents, morph targets and skins;
//! * [`textures`]: image decoding and mip chains;
//! * [`camera`]: cameras of the document, and framing;
//! * [`sky`]: the built-in sky;
//! * [`world`]: derived worlds, and the planner that follows their patches.

mod budget;
pub mod camera;
mod decoded;
pub mod derived;
mod error;
pub mod geometry;
pub mod sky;
pub mod textures;
pub mod world;

pub use decoded::DecodedScene;
pub use derived::{DeriveOptions, DerivedScene};
pub use error::{DeriveError, DeriveWarning};
