use super::{AccessorId, Extra, NodeId};
use serde::{Deserialize, Serialize};

/// An animation. It is kept and saved; the rest pose is what the document's nodes say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Animation {
    /// `name`.
    pub name: Option<String>,
    /// What moves.
    pub channels: Vec<AnimationChannel>,
    /// Key frames.
    pub samplers: Vec<AnimationSampler>,
    /// The rest.
    pub extra: Extra,
}

/// What a channel moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum AnimationPath {
    /// `translation`.
    Translation,
    /// `rotation`.
    Rotation,
    /// `scale`.
    Scale,
    /// `weights`.
    Weights,
    /// `pointer`: KHR_animation_pointer, whose JSON pointer is kept in [`AnimationChannel::target_extra`].
    Pointer,
}

/// A channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnimationChannel {
    /// Index into [`Animation::samplers`].
    pub sampler: usize,
    /// The node that is moved.
    pub node: Option<NodeId>,
    /// What of it.
    pub path: AnimationPath,
    /// The rest of the `target` object.
    pub target_extra: Extra,
    /// The rest of the channel.
    pub extra: Extra,
}

/// `interpolation`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Interpolation {
    /// `LINEAR`.
    #[default]
    Linear,
    /// `STEP`.
    Step,
    /// `CUBICSPLINE`.
    CubicSpline,
}

/// Key frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnimationSampler {
    /// Times in seconds.
    pub input: AccessorId,
    /// How values are interpolated.
    pub interpolation: Interpolation,
    /// Values.
    pub output: AccessorId,
    /// The rest.
    pub extra: Extra,
}
