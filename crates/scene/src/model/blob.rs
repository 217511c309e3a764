use std::ops::Range;
use std::sync::Arc;

/// Shared immutable bytes: a file, a decoded data URI, or a part of one. Cloning and slicing copy nothing.
#[derive(Clone)]
pub struct Blob {
    data: Arc<Vec<u8>>,
    range: Range<usize>,
}

impl Blob {
    /// Takes the bytes.
    pub fn new(data: Vec<u8>) -> Self {
        let range = 0..data.len();
        Self { data: Arc::new(data), range }
    }

    /// A part of it, or `None` if the range does not lie inside.
    pub fn slice(&self, range: Range<usize>) -> Option<Self> {
        if range.start > range.end || range.end > self.range.len() {
            return None;
        }
        let start = self.range.start + range.start;
        Some(Self { data: Arc::clone(&self.data), range: start..start + range.len() })
    }

    /// The bytes.
    #[inline]
    pub fn as_slice(&self) -> &[u8] {
        &self.data[self.range.clone()]
    }
}

impl std::ops::Deref for Blob {
    type Target = [u8];

    #[inline]
    fn deref(&self) -> &[u8] {
        self.as_slice()
    }
}

impl PartialEq for Blob {
    fn eq(&self, other: &Self) -> bool {
        (Arc::ptr_eq(&self.data, &other.data) && self.range == other.range) || self.as_slice() == other.as_slice()
    }
}

impl std::fmt::Debug for Blob {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Blob({} bytes)", self.range.len())
    }
}
