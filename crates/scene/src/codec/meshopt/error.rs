use super::{Filter, Mode};

/// Why a compressed view cannot be decoded. Offsets are in bytes from the start of the compressed data.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshoptError {
    /// The stride does not go with the mode.
    #[error("a byteStride of {stride} cannot be decoded in mode {mode}; it must be {allowed}")]
    StrideOfMode {
        /// `byteStride`.
        stride: usize,
        /// `mode`.
        mode: Mode,
        /// What the specification allows.
        allowed: &'static str,
    },
    /// The stride does not go with the filter.
    #[error("a byteStride of {stride} cannot be filtered by {filter}; it must be {allowed}")]
    StrideOfFilter {
        /// `byteStride`.
        stride: usize,
        /// `filter`.
        filter: Filter,
        /// What the specification allows.
        allowed: &'static str,
    },
    /// Only attributes are filtered.
    #[error("filter {filter} is for mode ATTRIBUTES, not for {mode}")]
    FilterOfMode {
        /// `filter`.
        filter: Filter,
        /// `mode`.
        mode: Mode,
    },
    /// Triangles have three indices.
    #[error("a count of {count} is not a whole number of triangles")]
    CountOfTriangles {
        /// `count`.
        count: usize,
    },
    /// The decoded bytes do not fit the budget.
    #[error("{count} elements of {stride} bytes are over the limit of {limit} bytes; raise --max-memory")]
    OverBudget {
        /// `count`.
        count: usize,
        /// `byteStride`.
        stride: usize,
        /// The budget.
        limit: u64,
    },
    /// So few bytes cannot hold so many elements, whatever they are: nothing was allocated.
    #[error("{count} elements need {needed} compressed bytes or more, but there are {available}")]
    TooShort {
        /// `count`.
        count: usize,
        /// The shortest stream of so many elements.
        needed: u64,
        /// Compressed bytes.
        available: usize,
    },
    /// The first byte is of another codec or version.
    #[error("the first byte is {found:#04x}, but mode {mode} begins with {expected}")]
    Header {
        /// The byte.
        found: u8,
        /// `mode`.
        mode: Mode,
        /// The header bytes of that mode.
        expected: &'static str,
    },
    /// The stream ends within an element.
    #[error("the stream ends at byte {offset}, before all elements are decoded")]
    EndOfStream {
        /// Where the data ends (the tail is not data).
        offset: usize,
    },
    /// Bytes are left over.
    #[error("all elements are decoded at byte {offset}, but the data ends at byte {end}")]
    TrailingBytes {
        /// Where decoding ended.
        offset: usize,
        /// Where the data ends (the tail is not data).
        end: usize,
    },
    /// The tail names a channel mode that is not defined.
    #[error("byte {offset}: channel mode {mode:#04x} is not defined")]
    ChannelMode {
        /// Where.
        offset: usize,
        /// The byte.
        mode: u8,
    },
    /// The table of triangle codes breaks its rules.
    #[error("byte {offset}: {value:#04x} may not stand in the table of triangle codes")]
    CodeTable {
        /// Where.
        offset: usize,
        /// The byte.
        value: u8,
    },
    /// A triangle refers to an edge or vertex that was not there yet.
    #[error("byte {offset}: the triangle refers to an edge or a vertex before the first")]
    Fifo {
        /// Where the triangle's code is.
        offset: usize,
    },
    /// A number goes on over its fifth byte.
    #[error("byte {offset}: the number is longer than five bytes")]
    Varint {
        /// Where it begins.
        offset: usize,
    },
}
