//! Decoders of compressed geometry. They know bytes, not documents: the importers call them.

pub mod draco;
pub mod meshopt;
