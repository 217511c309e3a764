//! Frames: the ray tracing pipeline, and a frame under way.

pub(crate) mod compute;
mod job;
mod pipeline;

pub(crate) use job::{Job, Passes};
pub(crate) use pipeline::{TlasSet, TracePipeline};
