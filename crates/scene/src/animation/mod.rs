//! Playing animations: what they say of the scene at a time, beside the document and not in it.
//!
//! An [`Evaluator`] is an animation made ready: its key frames are decoded, its targets found. At a time it gives a [`Pose`],
//! an overlay of values (transforms, weights, visibility, properties that KHR_animation_pointer names) that whoever shows
//! the scene reads on top of the document, through [`Posed`]. So playing is no edit: it touches neither the history nor what
//! is saved, and edits change the values below the overlay.
//!
//! * `track`: key frames and their interpolation (glTF 2.0, appendix C);
//! * `target`: where channels and pointers lead;
//! * `property`: the properties of materials, lights and cameras;
//! * `pose`: the overlay;
//! * `evaluator`, `player`: an animation made ready, and made ready again when an edit has changed it.

mod error;
mod evaluator;
mod player;
mod pose;
mod property;
mod target;
#[cfg(test)]
mod tests;
mod track;

pub use error::{AnimationError, AnimationWarning};
pub use evaluator::Evaluator;
pub use player::AnimationPlayer;
pub use pose::{Pose, Posed};
pub use property::{CameraProperty, LightProperty, MaterialProperty};
pub use target::{Property, Target, Value};
