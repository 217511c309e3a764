//! Polynomials and small geometry that every backend computes alike.
//!
//! Everything here is additions, multiplications, divisions, square roots and integer operations in a fixed order,
//! none of them fused, so that a shader that repeats the order computes the same bits. No function of the platform's
//! mathematics library is called.

mod float;
mod frame;
mod log;
mod srgb;
mod trig;

pub use float::{gamma, next_float_down, next_float_up, unit_float};
pub use frame::{OrthonormalFrame, safe_normalize};
pub use log::{exp2, log2, pow};
pub use srgb::{SRGB8, srgb_to_linear};
pub use trig::{atan2_turns, sin_cos_turns};

/// Luminance of a linear Rec. 709 colour.
#[inline]
pub fn luminance(c: glam::Vec3) -> f32 {
    c.x * 0.212_671 + c.y * 0.715_16 + c.z * 0.072_169
}
