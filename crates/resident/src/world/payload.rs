//! How the 4,096 blocks of a dense chunk lie in the payload arena, a buffer of 32-bit words.
//!
//! | words | what |
//! |---|---|
//! | 0 | bits per index (1, 2, 4, 8 or 16), `\| palette length << 8` |
//! | 1 | blocks that are not air |
//! | 2, 3 | zero |
//! | 4..132 | occupancy: bit `i % 32` of word `4 + i / 32` says that block `i` is not air |
//! | 132.. | the palette: the bits of each block ([`super::rows::block`]; 0 is air) |
//! | then | indices of the palette, `bits` each, the first in the lowest bits |
//!
//! The palette's span is rounded up to whole groups of 4 words. Blocks are numbered x fastest, w slowest. Spans in the arena
//! begin at multiples of [`ALIGN`] words.

/// First word of the occupancy bits.
pub const OCCUPANCY: usize = 4;
/// First word of the palette.
pub const PALETTE: usize = OCCUPANCY + 4096 / 32;
/// Spans begin at multiples of this many words, and take whole multiples.
pub const ALIGN: u32 = 16;

/// Words of a dense chunk with a palette of this length, not rounded to [`ALIGN`].
pub const fn words(palette: usize, bits: u32) -> usize {
    PALETTE + palette.next_multiple_of(4) + 4096 / 32 * bits as usize
}

/// Whether block `index` of the chunk that begins at `chunk[0]` is not air.
#[inline]
pub fn is_solid(chunk: &[u32], index: usize) -> bool {
    chunk[OCCUPANCY + index / 32] >> (index % 32) & 1 == 1
}

/// The bits of block `index` of the chunk that begins at `chunk[0]`.
#[inline]
pub fn block(chunk: &[u32], index: usize) -> u32 {
    let (bits, palette) = (chunk[0] & 0xff, (chunk[0] >> 8) as usize);
    let first = PALETTE + palette.next_multiple_of(4);
    let at = index * bits as usize;
    let entry = chunk[first + at / 32] >> (at % 32) & (u32::MAX >> (32 - bits));
    chunk[PALETTE + entry as usize]
}
