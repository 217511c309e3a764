//! Images: decoding and mip chains.

mod decode;
mod mips;
mod srgb;

pub use decode::{ImageLimits, decode_images};
pub use mips::{mean_color, mip_chain};
pub use srgb::{linear_from_srgb, srgb_from_linear};
