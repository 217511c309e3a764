//! Derived worlds: what the planner makes of patches, against judges that share nothing with it.

mod content;
mod costs;
mod cycles;
mod encodings;
mod interpreter;
mod patches;
mod sequences;
mod streams;
