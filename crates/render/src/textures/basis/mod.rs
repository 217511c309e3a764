//! Basis Universal's two formats, decoded to RGBA of 8 bits, from their published specifications.
//!
//! * [`etc1s`]: BasisLZ (KTX 2.0, appendix "BasisLZ/ETC1S Bitstream Specification");
//! * [`uastc`]: UASTC LDR 4x4 ("UASTC LDR 4x4 Texture Specification", Binomial, public domain).

mod bits;
pub(super) mod etc1s;
mod huffman;
pub(super) mod uastc;
