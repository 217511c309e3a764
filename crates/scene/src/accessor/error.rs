use crate::model::{ComponentType, ElementType};

/// Why an accessor cannot be read. `accessor` is its position in the document (its index in the file, right after
/// loading one).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("accessor {accessor}: {fault}")]
pub struct AccessorError {
    /// The accessor's slot, see [`crate::model::Store::slot`].
    pub accessor: usize,
    /// What is wrong.
    pub fault: AccessorFault,
}

/// What is wrong with an accessor. All figures are in bytes unless they say otherwise.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AccessorFault {
    /// The id is stale.
    #[error("it is not in the document any more")]
    Stale,
    /// The elements end behind the view.
    #[error("its {count} elements need {needed} bytes of buffer view {view}, which has {available}")]
    OutsideView {
        /// Slot of the view.
        view: usize,
        /// Elements.
        count: usize,
        /// Bytes from the start of the view to the end of the last element.
        needed: u128,
        /// Bytes of the view.
        available: usize,
    },
    /// The view ends behind its buffer.
    #[error("buffer view {view} ends at byte {end}, but its buffer {buffer} has {available} bytes")]
    OutsideBuffer {
        /// Slot of the view.
        view: usize,
        /// Slot of the buffer.
        buffer: usize,
        /// Where the view ends.
        end: u128,
        /// Bytes of the buffer.
        available: usize,
    },
    /// Elements would overlap.
    #[error("buffer view {view} has a byteStride of {stride}, less than the {element} bytes of an element")]
    StrideTooSmall {
        /// Slot of the view.
        view: usize,
        /// `byteStride`.
        stride: usize,
        /// Bytes of an element.
        element: usize,
    },
    /// The reader asked for something else.
    #[error("{wanted} wanted, but it is {element_type:?} of {component_type:?}")]
    WrongType {
        /// What the reader can take.
        wanted: &'static str,
        /// What the accessor is.
        element_type: ElementType,
        /// Of what it is made.
        component_type: ComponentType,
    },
    /// Sparse indices are of a type that they may not have.
    #[error("its sparse indices are {0:?}; they must be U8, U16 or U32")]
    SparseIndexType(ComponentType),
    /// More sparse elements than elements.
    #[error("it replaces {sparse} elements of {count}")]
    TooManySparse {
        /// Replaced elements.
        sparse: usize,
        /// Elements.
        count: usize,
    },
    /// A sparse index is not less than the count.
    #[error("sparse index {position} is {index}, but there are {count} elements")]
    SparseIndexRange {
        /// Which of the sparse indices.
        position: usize,
        /// Its value.
        index: u32,
        /// Elements.
        count: usize,
    },
    /// Sparse indices do not rise.
    #[error("sparse index {position} is {index}, which is not greater than the one before it; sort them")]
    SparseIndexOrder {
        /// Which of the sparse indices.
        position: usize,
        /// Its value.
        index: u32,
    },
    /// A vertex index is not less than the vertex count.
    #[error("index {position} is {index}, but there are {vertices} vertices")]
    VertexIndexRange {
        /// Which of the indices.
        position: usize,
        /// Its value.
        index: u32,
        /// Vertices.
        vertices: usize,
    },
    /// Memory could not be had.
    #[error("there is no memory for its {count} elements")]
    OutOfMemory {
        /// Elements.
        count: usize,
    },
}
