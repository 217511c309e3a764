//! Images: decoding and mip chains.
//!
//! PNG, JPEG, WebP and Radiance HDR go through the `image` crate; KTX2 and DDS are read here (`ktx2`, `dds`), to a
//! common [`file::TextureFile`] whose levels are decoded by `encoding` (plain and block-compressed texels) and `basis`
//! (ETC1S and UASTC).

mod basis;
mod dds;
mod decode;
mod encoding;
mod file;
mod jpeg;
mod ktx2;
mod mips;
mod need;
mod srgb;
#[cfg(test)]
mod tests;
mod texels;

pub use decode::{ImageLimits, Levels, decode_images};
pub(crate) use mips::{
    chain_bytes as mip_chain_bytes, first_level_row, mean_texel, working_bytes as mip_working_bytes,
};
pub use mips::{mean_color, mip_chain};
pub use srgb::{linear_from_srgb, srgb_from_linear};
