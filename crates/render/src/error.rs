use crate::budget::OverBudget;

/// A scene that cannot be derived. The place is a JSON pointer into the document.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}: {what}; {remedy}")]
pub struct DeriveError {
    /// JSON pointer.
    pub place: String,
    /// What is wrong.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

impl DeriveError {
    pub(crate) fn new(place: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { place: place.into(), what: what.into(), remedy: remedy.into() }
    }

    /// What does not fit the memory that may be taken.
    pub(crate) fn over_budget(place: impl Into<String>, what: &str, over: OverBudget) -> Self {
        let OverBudget { needed, left } = over;
        Self::new(
            place,
            format!("{what} take {needed} bytes, of {left} that are left"),
            "raise --max-memory, or shrink the scene",
        )
    }
}

/// Something that is shown otherwise than the document says. The place is a JSON pointer into the document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeriveWarning {
    /// JSON pointer.
    pub place: String,
    /// What is shown instead, and why.
    pub what: String,
}

impl std::fmt::Display for DeriveWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.place, self.what)
    }
}
