//! Counter-based random numbers, warps and light distributions that every backend computes alike.
//!
//! * [`hash`], [`sobol`], [`sampler`]: the numbers: Owen-scrambled Sobol points, keyed by what they decide;
//! * [`warp`]: from the unit square to discs, hemispheres, cones and triangles;
//! * [`pixel_filter`]: from the unit square to offsets from the pixel's centre;
//! * [`environment`]: importance sampling of a latitude-longitude map and the sun;
//! * [`rectangle`]: uniform directions to a rectangle;
//! * [`lights`]: the choice among kinds of light and among punctual lights; [`light_tree`]: among many lights.

pub mod environment;
pub mod hash;
pub mod light_tree;
pub mod lights;
pub mod pixel_filter;
pub mod rectangle;
pub mod sampler;
pub mod sobol;
pub mod warp;

pub use environment::EnvironmentDistribution;
pub use hash::{hash_combine, hash_mix};
pub use light_tree::LightTree;
pub use lights::{LightKinds, PunctualDistribution};
pub use pixel_filter::sample_pixel_filter;
pub use rectangle::{Rectangle, SphericalRectangle};
pub use sampler::{DimensionSet, Sampler};
