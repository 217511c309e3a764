//! Worlds: resident sets of arenas.

mod sets;

pub(crate) use sets::WorldSets;
