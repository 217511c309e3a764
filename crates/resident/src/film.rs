//! The film: what a frame accumulates.
//!
//! Colour is summed in fixed blocks of [`BLOCK`] samples: within a block in sample order, then block after block in
//! block order, all in `f32`. Because the blocks are fixed, the sum over shares that were rendered anywhere, in any
//! order, is the same bytes as the sum of one run.

use crate::frame::{Aov, Tile};

/// Samples in a block.
pub const BLOCK: u32 = 16;

/// The sum of one block of samples over the film's tile.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmBlock {
    /// The block's index: its samples are `index * BLOCK ..`.
    pub index: u32,
    /// Samples in it: [`BLOCK`], or fewer in the last block of an image.
    pub samples: u32,
    /// Sum of linear radiance, row by row over the tile.
    pub sum: Vec<[f32; 3]>,
}

/// What a frame accumulates.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Size of the whole image.
    pub width: u32,
    /// See `width`.
    pub height: u32,
    /// The part that was rendered.
    pub tile: Tile,
    /// Samples of every pixel.
    pub samples: u32,
    /// Sum of linear radiance over the samples, row by row over the tile.
    pub sum: Vec<[f32; 3]>,
    /// The blocks by themselves, ascending by index, if the frame asked for them.
    pub blocks: Vec<FilmBlock>,
    /// AOVs in the frame's order, each `channels` floats a pixel, row by row over the tile. Averaged ones are already
    /// divided.
    pub aovs: Vec<(Aov, Vec<f32>)>,
}

impl Film {
    /// Mean linear radiance of every pixel of the tile: `sum / samples`.
    pub fn resolve(&self) -> Vec<[f32; 3]> {
        let n = self.samples.max(1) as f32;
        self.sum.iter().map(|s| s.map(|c| c / n)).collect()
    }
}
