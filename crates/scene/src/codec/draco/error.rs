/// Why Draco data cannot be decoded, and where. The offset is in bytes from the start of the data.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("Draco data, byte {offset}: {fault}")]
pub struct DracoError {
    /// Where reading stopped.
    pub offset: usize,
    /// What is wrong there.
    pub fault: DracoFault,
}

/// What is wrong with Draco data.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DracoFault {
    /// The magic is missing.
    #[error("it does not begin with DRACO")]
    Magic,
    /// A bitstream of another version.
    #[error("bitstream version {major}.{minor} cannot be read; compress the mesh again, with version 2.2")]
    Version {
        /// Major.
        major: u8,
        /// Minor.
        minor: u8,
    },
    /// A point cloud, or a kind of geometry that does not exist.
    #[error("geometry of kind {0} where a triangle mesh (1) is expected")]
    NotAMesh(u8),
    /// A method of coding the connectivity that does not exist.
    #[error("connectivity of method {0}; it must be 0 (sequential) or 1 (edgebreaker)")]
    Method(u8),
    /// The data ends too soon.
    #[error("the data ends in {0}; it is truncated")]
    Truncated(&'static str),
    /// A number that does not fit its type.
    #[error("{0} is out of range")]
    Range(&'static str),
    /// No triangles or no vertices.
    #[error("the mesh has no {0}")]
    Empty(&'static str),
    /// More attributes than the caller takes.
    #[error("{count} attributes with seams of their own, and {limit} are allowed")]
    TooManyAttributes {
        /// How many.
        count: u32,
        /// The limit.
        limit: u32,
    },
    /// More memory is needed than is allowed.
    #[error("decoding may take {needed} bytes of memory, and {limit} are allowed; raise --max-memory")]
    OverBudget {
        /// Bytes.
        needed: u64,
        /// The limit.
        limit: u64,
    },
    /// The values of the attributes are larger than is allowed.
    #[error("{0}")]
    Limit(String),
    /// The bitstream contradicts itself.
    #[error("{0}")]
    Malformed(String),
}
