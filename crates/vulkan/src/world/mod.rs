//! Worlds on the device.
//!
//! * [`abi`]: what shaders see of a set of arenas.

pub mod abi;
