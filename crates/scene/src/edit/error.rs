//! Why an edit is refused. The scene is as before then.

use crate::model::{AnyId, Kind, NodeId, Store};
use std::fmt;

/// Why an edit is refused.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum EditError {
    /// An id means nothing (any more).
    Stale(AnyId),
    /// A node would be its own ancestor.
    Cycle {
        /// The node that was to be moved.
        node: NodeId,
        /// The parent that was asked for: the node itself or one below it.
        parent: NodeId,
    },
    /// The object does not have what the edit is about.
    Missing {
        /// The object.
        id: AnyId,
        /// What it lacks, and what to do.
        what: String,
    },
    /// A value makes no sense.
    Value {
        /// Where: a JSON pointer into the edit.
        pointer: String,
        /// What is wrong with it.
        what: String,
    },
    /// A transform cannot be kept: it shears.
    Shear(NodeId),
    /// There is no equal mesh to go back to.
    NoEqualMesh(NodeId),
    /// Something refers to an object that is to go, in a way that cannot be mended.
    Unmendable {
        /// Who refers.
        owner: AnyId,
        /// To what.
        target: AnyId,
    },
    /// A file cannot be merged.
    File(String),
    /// Steps that were planned elsewhere do not fit the scene as it is.
    Steps {
        /// Which of them; `None` if what all of them lead to is no document.
        step: Option<usize>,
        /// What does not fit.
        what: String,
    },
    /// There is nothing to undo or to redo.
    EndOfHistory {
        /// What was asked for: "undo" or "redo".
        what: &'static str,
        /// Steps that were asked for.
        asked: usize,
        /// Steps that there are.
        there: usize,
    },
}

/// An object as messages name it.
pub(super) struct Named(pub AnyId);

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.0.kind().name(), self.0.slot())
    }
}

impl fmt::Display for EditError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let node = |id: NodeId| Store::<NodeId, ()>::slot(id);
        match self {
            Self::Stale(id) => write!(f, "there is no {}: it never was, or has been deleted", Named(*id)),
            Self::Cycle { node: id, parent } if id == parent => {
                write!(f, "node {} cannot be its own parent", node(*id))
            }
            Self::Cycle { node: id, parent } => write!(
                f,
                "node {} cannot go under node {}, which is below it; move that one out first",
                node(*id),
                node(*parent)
            ),
            Self::Missing { id, what } => write!(f, "{}: {what}", Named(*id)),
            Self::Value { pointer, what } if pointer.is_empty() => f.write_str(what),
            Self::Value { pointer, what } => write!(f, "{pointer}: {what}"),
            Self::Shear(id) => write!(
                f,
                "node {}: its place in the world would need a sheared transform, which glTF nodes cannot have; apply or \
                 remove the non-uniform scale above it, or move it without keeping the world transform",
                node(*id)
            ),
            Self::NoEqualMesh(id) => write!(
                f,
                "node {}: no other mesh has the same geometry and equal materials; assign one with set_mesh",
                node(*id)
            ),
            Self::Unmendable { owner, target } => {
                write!(f, "{} refers to {}, and cannot do without it", Named(*owner), Named(*target))
            }
            Self::File(what) => f.write_str(what),
            Self::Steps { step, what } => {
                if let Some(step) = step {
                    write!(f, "step {step}: ")?;
                }
                write!(f, "{what}; the steps are not for this state of the scene")
            }
            Self::EndOfHistory { what, asked, there } => {
                write!(f, "cannot {what} {asked} edits: the history holds {there}")
            }
        }
    }
}

impl std::error::Error for EditError {}

impl EditError {
    pub(super) fn value(pointer: impl Into<String>, what: impl Into<String>) -> Self {
        Self::Value { pointer: pointer.into(), what: what.into() }
    }

    pub(super) fn missing(id: impl Into<AnyId>, what: impl Into<String>) -> Self {
        Self::Missing { id: id.into(), what: what.into() }
    }

    /// The kind of object that the error is about, if it is about one.
    pub fn kind(&self) -> Option<Kind> {
        match self {
            Self::Stale(id) | Self::Missing { id, .. } | Self::Unmendable { owner: id, .. } => Some(id.kind()),
            Self::Cycle { .. } | Self::Shear(_) | Self::NoEqualMesh(_) => Some(Kind::Node),
            Self::Value { .. } | Self::File(_) | Self::Steps { .. } | Self::EndOfHistory { .. } => None,
        }
    }
}
