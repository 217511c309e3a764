use super::budget::OverBudget;
use super::files::FileFault;
use super::obj::ObjFault;
use crate::accessor::AccessorFault;
use crate::codec::draco::DracoError;
use crate::codec::meshopt::MeshoptError;
use std::fmt;

/// Where in a file something is.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A JSON pointer (RFC 6901) into the document.
    Pointer(String),
    /// A byte offset.
    Offset(u64),
    /// Line and column of a text, both from 1.
    Line {
        /// Line.
        line: usize,
        /// Column.
        column: usize,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole => Ok(()),
            Self::Pointer(pointer) if pointer.is_empty() => write!(f, "document root: "),
            Self::Pointer(pointer) => write!(f, "{pointer}: "),
            Self::Offset(offset) => write!(f, "byte {offset}: "),
            Self::Line { line, column } => write!(f, "line {line}, column {column}: "),
        }
    }
}

/// Why a file was refused: the file, the place in it, and what is wrong.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}{fault}")]
pub struct ImportError {
    /// The file, as the caller named it.
    pub file: String,
    /// The place in it.
    pub place: Place,
    /// What is wrong there.
    pub fault: ImportFault,
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportFault {
    /// The file, or one that it refers to, cannot be read.
    #[error(transparent)]
    File(#[from] FileFault),
    /// More memory is needed than is allowed.
    #[error(transparent)]
    OverBudget(#[from] OverBudget),
    /// No importer knows it.
    #[error("this is no scene that can be imported ({0}); use .gltf, .glb, .obj or .crts")]
    UnknownFormat(String),
    /// The name says one thing and the content another.
    #[error("the extension says {extension}, but the content is {content}; rename the file")]
    FormatMismatch {
        /// What the name says.
        extension: &'static str,
        /// What it is.
        content: &'static str,
    },
    /// It is not the JSON that the format asks for.
    #[error("{0}")]
    Json(String),
    /// The GLB container is damaged.
    #[error("{0}")]
    Container(String),
    /// A version that is not understood.
    #[error("version {0:?} cannot be read; export the scene as glTF 2.0")]
    Version(String),
    /// The document cannot be shown without an extension that is not supported.
    #[error("the required extension {0} is not supported; export the scene without it")]
    RequiredExtension(String),
    /// A buffer view whose compressed data is damaged.
    #[error("the compressed view cannot be decoded: {0}")]
    Meshopt(#[from] MeshoptError),
    /// A primitive whose compressed data is damaged.
    #[error("the compressed primitive cannot be decoded: {0}")]
    Draco(#[from] DracoError),
    /// An index to something that is not there.
    #[error("there is no {kind} {index}; the document has {count}")]
    Index {
        /// The kind of object.
        kind: &'static str,
        /// The index.
        index: u64,
        /// How many there are.
        count: usize,
    },
    /// An accessor that cannot be read.
    #[error("the accessor cannot be read: {0}")]
    Accessor(#[from] AccessorFault),
    /// Fewer bytes than declared.
    #[error("byteLength is {declared}, but there are only {available} bytes; the data is truncated")]
    Truncated {
        /// Bytes wanted.
        declared: u64,
        /// Bytes there are.
        available: u64,
    },
    /// A node that is the child of two nodes, or twice of one.
    #[error("node {node}{} is a child of node {first} and of node {second}; a node has one parent", named(.name))]
    TwoParents {
        /// The node.
        node: usize,
        /// Its name.
        name: Option<String>,
        /// The parent that came first.
        first: usize,
        /// The other.
        second: usize,
    },
    /// A node that is its own ancestor.
    #[error("node {node}{} is its own ancestor; the hierarchy may not have a cycle", named(.name))]
    Cycle {
        /// The node.
        node: usize,
        /// Its name.
        name: Option<String>,
    },
    /// A line of an OBJ file.
    #[error(transparent)]
    Obj(#[from] ObjFault),
    /// A value that may not be.
    #[error("{0}")]
    Value(String),
}

fn named(name: &Option<String>) -> String {
    name.as_ref().map(|n| format!(" (\"{n}\")")).unwrap_or_default()
}
