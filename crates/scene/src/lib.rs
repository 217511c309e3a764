//! The model scene: document, stable ids, import and export.
//!
//! A [`Scene`] holds everything that a glTF 2.0 document holds, in generational stores, so that an id never shifts and
//! a stale one is an error. It knows nothing of rendering.

pub mod accessor;
pub mod animation;
pub mod codec;
mod compare;
pub mod edit;
pub mod export;
pub mod import;
mod json_words;
pub mod model;
mod place;
#[cfg(test)]
mod testing;
pub mod visit;

pub use compare::Difference;
pub use model::Scene;
