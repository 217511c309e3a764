//! Rays and images of worlds, on sets of arenas made by hand.

mod combine;
mod pattern;
mod rays;
