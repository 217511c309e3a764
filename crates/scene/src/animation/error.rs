//! What is wrong with an animation.

/// An animation that cannot be played. The place is a JSON pointer into the document.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {what}; {remedy}")]
pub struct AnimationError {
    /// JSON pointer.
    pub place: String,
    /// What is wrong.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

impl AnimationError {
    pub(super) fn new(place: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { place: place.into(), what: what.into(), remedy: remedy.into() }
    }
}

/// A channel that is not played as the document says. The place is a JSON pointer into the document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AnimationWarning {
    /// JSON pointer.
    pub place: String,
    /// What is shown instead, and why.
    pub what: String,
}

impl std::fmt::Display for AnimationWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.place, self.what)
    }
}
