//! The path tracer.

pub mod bsdf;
