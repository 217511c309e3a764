//! The world file, `.orw`.
//!
//! All numbers are little-endian. Hashes are the first 16 bytes of BLAKE3.
//!
//! ```text
//! header    magic 8 bytes | version u32 | zero u32 | hash of these 16 bytes
//! section*  marker 8 bytes | kind 4 bytes | number u32 | raw length u64 | stored length u64 | hash of the stored bytes
//!           | hash of all of that | stored bytes (deflate)
//! ```
//!
//! Sections are numbered from 0. The first is the palette (`PALE`: the entries as JSON); then regions (`REGN`: chunks, then regions
//! that are uniform or refer to those chunks), each section on its own; then, in files of version 2, moving bodies (`BODY`: a version and
//! bytes, which are kept as they are); the last is `DONE`, with the number of regions. A file ends with it. Every byte is under a hash: no flipped bit goes unnoticed. As sections can be found by their markers and
//! understood alone, what is intact of a damaged file can be had ([`salvage`]).

mod atomic;
mod bodies;
mod reader;
mod regions;
mod writer;

pub(crate) use bodies::BodySection;
pub use reader::{Salvaged, read, read_bytes, salvage, salvage_bytes};
pub use writer::{write, write_to};

use std::io;

const MAGIC: [u8; 8] = *b"\x89ORW\r\n\x1a\n";
const MARKER: [u8; 8] = *b"\xf0section";
/// Of a file without bodies, which every program can read.
const VERSION: u32 = 1;
/// Of a file with bodies.
const VERSION_BODIES: u32 = 2;
const HEADER_BYTES: usize = 32;
const SECTION_HEADER_BYTES: usize = 64;
const PALETTE: [u8; 4] = *b"PALE";
const REGIONS: [u8; 4] = *b"REGN";
const BODIES: [u8; 4] = *b"BODY";
const DONE: [u8; 4] = *b"DONE";

/// No section is larger than this when unpacked.
const MOST_RAW: u64 = 64 << 20;

/// Extension of world files.
pub const EXTENSION: &str = "orw";

/// How a file may be read.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions {
    /// Bytes that the world, and what is needed to make it, may take.
    pub max_memory: u64,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { max_memory: 8 << 30 }
    }
}

/// Why a file was not read or written: the file, the place in it, and what is wrong.
#[derive(Debug, thiserror::Error)]
#[error("{file}: byte {offset}: {fault}")]
pub struct FileError {
    /// The file, as the caller named it.
    pub file: String,
    /// The place in it.
    pub offset: u64,
    /// What is wrong there.
    pub fault: FileFault,
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileFault {
    /// It cannot be read or written.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It is something else.
    #[error("this is no world file; it does not begin like one")]
    NotAWorld,
    /// It is newer than this program.
    #[error("version {0} cannot be read, only {VERSION} to {VERSION_BODIES}; use a newer program")]
    Version(u32),
    /// Bytes are not those that were written.
    #[error("the {0} is damaged; --salvage reads what is intact")]
    Damaged(&'static str),
    /// It ends too early.
    #[error("the file ends within the {0}; --salvage reads what is intact")]
    Truncated(&'static str),
    /// Sections are missing or in another order.
    #[error("a section is missing or out of place; --salvage reads what is intact")]
    Order,
    /// There is more after the end.
    #[error("there are bytes after the end of the world")]
    Trailing,
    /// What was written makes no sense.
    #[error("{0}")]
    Content(String),
    /// More memory would be taken than is allowed.
    #[error("{needed} bytes of memory are needed, and {limit} are allowed; raise --max-memory")]
    OverBudget {
        /// Bytes that would be in use.
        needed: u64,
        /// Bytes that are allowed.
        limit: u64,
    },
}

/// The first 16 bytes of BLAKE3.
fn hash(parts: &[&[u8]]) -> [u8; 16] {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(part);
    }
    let mut short = [0; 16];
    short.copy_from_slice(&hasher.finalize().as_bytes()[..16]);
    short
}
