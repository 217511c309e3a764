//! Export: from a [`Scene`] to files.

pub mod crts;

use crate::accessor::AccessorError;
use std::fmt;
use std::io;

/// Something that the target does not hold as the scene has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Where in the scene: a JSON pointer in the terms of glTF.
    pub pointer: String,
    /// What is different.
    pub what: String,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.pointer.as_str() {
            "" => write!(f, "{}", self.what),
            pointer => write!(f, "{pointer}: {}", self.what),
        }
    }
}

/// What is wrong with an export.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportFault {
    /// The system says no.
    #[error("the file cannot be written: {0}")]
    Io(#[from] io::Error),
    /// A number that the format cannot write.
    #[error("a \"{0}\" is infinite or not a number; set it to a finite value")]
    NotFinite(&'static str),
    /// Geometry that cannot be read.
    #[error("{pointer}: {fault}")]
    Geometry {
        /// Where in the scene: a JSON pointer in the terms of glTF.
        pointer: String,
        /// Why.
        fault: AccessorError,
    },
}
