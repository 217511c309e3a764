//! What a command does with a scene before and after the backend: loading, cameras, environments, checks, statistics.

pub mod animation;
pub mod aov;
pub mod backend;
pub mod camera;
pub mod environment;
pub mod load;
pub mod progress;
pub mod rendering;
pub mod settings;
pub mod validate;
pub mod world;
pub mod world_view;

pub use animation::Moment;
pub use load::{LoadOptions, Loaded, load};
pub use progress::Progress;
pub use rendering::Rendering;
pub use world::{LoadedWorld, WorldFormat, load_world};
pub use world_view::WorldShot;
