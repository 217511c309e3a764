//! One file per command: from its arguments to its result.

pub mod bench;
pub mod compare;
pub mod convert;
pub mod devices;
pub mod edit;
pub mod generate;
pub mod info;
pub mod merge;
pub mod render;
pub mod world;
