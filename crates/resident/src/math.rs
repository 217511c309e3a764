//! Polynomials that every backend computes alike.
