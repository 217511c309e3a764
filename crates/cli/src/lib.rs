//! The `orthant` command as a library, so that tests and benchmarks call what the program runs.
//!
//! * [`failure`]: exit codes and the one-line error;
//! * [`output`]: files that are whole or absent;
//! * [`generate`]: scenes that the program makes itself;
//! * [`image_io`]: PNG, OpenEXR and Radiance HDR.
//! * [`metrics`]: how far two pictures are apart.

pub mod failure;
pub mod generate;
pub mod image_io;
pub mod metrics;
pub mod output;
