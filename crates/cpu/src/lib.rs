//! Orthant.
