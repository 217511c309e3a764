//! Shares: parts of one rendering, made anywhere and put together in any order.
//!
//! A share covers a tile of the image and a range of samples. Its file is
//!
//! | offset | bytes | what |
//! |---|---|---|
//! | 0 | 8 | `ORTSHARE` |
//! | 8 | 4 | version, 1 |
//! | 12 | 4 | length of the header |
//! | 16 | n | the header: [`Header`] as JSON |
//! | 16 + n | 32 | BLAKE3 of everything before |
//!
//! and then, for every block of [`BLOCK`] samples in ascending order:
//!
//! | bytes | what |
//! |---|---|
//! | 4 | index of the block |
//! | 4 | samples in it |
//! | 12 w h | sums of radiance, red, green, blue by pixel, rows from the top of the tile, 32-bit floats |
//! | 32 | BLAKE3 of this block so far |
//!
//! Numbers are little-endian. The blocks are those of [`orthant_resident::Film`]: added in ascending order, in 32-bit
//! floats, they give the very bytes of one run over the whole image.

mod coverage;
mod merge;
mod read;
mod write;

pub use merge::{Merged, merge};
pub use read::Share;
pub use write::ShareWriter;

use orthant_resident::film::BLOCK;
use orthant_resident::frame::Tile;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::PathBuf;

const MAGIC: &[u8; 8] = b"ORTSHARE";
const VERSION: u32 = 2;
/// Length of a BLAKE3 hash.
const HASH: u64 = 32;
/// No header is longer.
const MAX_HEADER: u32 = 1 << 20;

/// What a share is a part of, and which part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// The program that rendered it, with its version: another one may sum otherwise.
    pub program: String,
    /// The backend that rendered it, and on which device where that decides the last bits.
    pub backend: String,
    /// Columns of the whole image.
    pub width: u32,
    /// Rows of the whole image.
    pub height: u32,
    /// The tile: x, y, width, height.
    pub tile: [u32; 4],
    /// The samples: the first, and one past the last.
    pub samples: [u32; 2],
    /// Samples of the whole image.
    pub spp: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// BLAKE3 of everything else that decides the pixels: scene, camera, environment, options.
    pub settings: String,
    /// Tone mapping of the final image.
    pub tonemap: String,
    /// Exposure of the final image, in stops.
    pub exposure: f32,
}

impl Header {
    /// The tile.
    pub fn tile(&self) -> Tile {
        let [x, y, width, height] = self.tile;
        Tile { x, y, width, height }
    }

    /// Indices of the blocks.
    pub fn blocks(&self) -> Range<u32> {
        self.samples[0] / BLOCK..self.samples[1].div_ceil(BLOCK)
    }

    /// Samples in a block of this rendering.
    pub fn block_samples(&self, index: u32) -> u32 {
        BLOCK.min(self.spp - index * BLOCK)
    }

    /// Bytes of one block in the file.
    fn block_bytes(&self) -> u64 {
        8 + 12 * u64::from(self.tile[2]) * u64::from(self.tile[3]) + HASH
    }

    /// What does not make sense, if anything.
    fn fault(&self) -> Option<String> {
        let tile = self.tile();
        let inside = |at: u32, size: u32, end: u32| size > 0 && u64::from(at) + u64::from(size) <= u64::from(end);
        if !inside(tile.x, tile.width, self.width) || !inside(tile.y, tile.height, self.height) {
            return Some(format!("the tile {:?} lies outside the image {} x {}", self.tile, self.width, self.height));
        }
        let [start, end] = self.samples;
        let whole = start.is_multiple_of(BLOCK) && (end.is_multiple_of(BLOCK) || end == self.spp);
        if start >= end || end > self.spp || !whole {
            return Some(format!("the samples {start}..{end} of {} are not whole blocks of {BLOCK}", self.spp));
        }
        if self.width > 1 << 16 || self.height > 1 << 16 {
            return Some(format!("the image {} x {} exceeds 65536 pixels a side", self.width, self.height));
        }
        None
    }
}

/// What is wrong with a share, or with shares together.
#[derive(Debug, thiserror::Error)]
pub enum ShareError {
    /// It cannot be read.
    #[error("{path}: cannot read the file: {source}: check the path and the permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is damaged, or no share.
    #[error("{path}: byte {offset}: {what}: render this share again")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where.
        offset: u64,
        /// What is wrong.
        what: String,
    },
    /// Shares of different renderings.
    #[error("{path}: its {field} is {this}, but {other} has {that}: merge the shares of one rendering only")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// A file before it.
        other: PathBuf,
        /// What differs.
        field: &'static str,
        /// Its value here.
        this: String,
        /// Its value there.
        that: String,
    },
    /// Two shares have a part in common.
    #[error("{path}: covers {part}, which {other} covers too: leave one of them out")]
    Overlap {
        /// The file.
        path: PathBuf,
        /// The other file.
        other: PathBuf,
        /// What both cover.
        part: String,
    },
    /// A part of the image is in no share.
    #[error(
        "no share covers {part} of the image of {width} x {height} pixels and {spp} samples: render that share too"
    )]
    Gap {
        /// What is missing.
        part: String,
        /// Columns of the image.
        width: u32,
        /// Rows of the image.
        height: u32,
        /// Samples of the image.
        spp: u32,
    },
    /// The image is too large.
    #[error("{path}: the image takes {needed} bytes, more than the limit of {limit}: raise --max-memory")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
}

impl From<ShareError> for crate::failure::Failure {
    fn from(error: ShareError) -> Self {
        // The message has the file and the place in it already.
        Self::new(crate::failure::Exit::BadInput, error.to_string())
    }
}

#[cfg(test)]
mod tests;
