use crate::accessor::AccessorError;
use std::io;
use std::path::PathBuf;

/// Why a scene was not exported.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", file.display())]
pub struct ExportError {
    /// The file that was to be written.
    pub file: PathBuf,
    /// What is wrong.
    pub fault: ExportFault,
}

/// What is wrong with an export.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportFault {
    /// No exporter knows the extension.
    #[error("a scene cannot be written as \"{0}\"; use .gltf, .glb, .obj or .crts")]
    UnknownFormat(String),
    /// The system says no.
    #[error("the file cannot be written: {0}")]
    Io(#[from] io::Error),
    /// The scene is inconsistent, which import and edits refuse.
    #[error("{pointer}: the reference leads nowhere")]
    Dangling {
        /// Where.
        pointer: String,
    },
    /// A number that the format cannot write.
    #[error("a \"{0}\" is infinite or not a number; set it to a finite value")]
    NotFinite(&'static str),
    /// Geometry that cannot be read.
    #[error("{pointer}: {fault}")]
    Geometry {
        /// Where in the scene: a JSON pointer in the terms of glTF.
        pointer: String,
        /// Why.
        fault: Box<AccessorError>,
    },
    /// The container has 32-bit lengths.
    #[error("the scene has {0} bytes, and a .glb holds 4 GiB at most; write it as .gltf")]
    TooLarge(u64),
}
