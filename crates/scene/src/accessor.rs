//! Decoding of accessors.
