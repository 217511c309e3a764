//! One file per command: from its arguments to its result.

pub mod compare;
pub mod devices;
pub mod generate;
