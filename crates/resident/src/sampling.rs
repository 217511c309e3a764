//! Counter-based random numbers and warps that every backend computes alike.
