//! Frames: what traces rays, and a frame under way.
//!
//! * [`pipeline`]: the ray tracing pipeline; [`query`]: its twin of ray queries, for devices without;
//! * [`job`]: a frame under way; [`paths`]: memory of its paths;
//! * [`compute`]: passes beside it.

pub(crate) mod compute;
mod job;
mod paths;
mod pipeline;
mod query;

pub(crate) use job::{Job, Passes};
pub(crate) use paths::PathPool;
pub(crate) use pipeline::{Generation, TlasSet};

use crate::abi::TracePush;
use crate::device::{Device, Tracer};
use crate::error::{Result, VulkanError};
use crate::memory::Commands;
use ash::vk;
use pipeline::TracePipeline;
use query::QueryPipeline;
use std::sync::Arc;

/// What traces the rays of a device.
pub(crate) enum RayTracer {
    Pipeline(Box<TracePipeline>),
    Query(QueryPipeline),
}

impl RayTracer {
    /// Compiles the device's, for images of a layout.
    pub fn new(device: &Arc<Device>, images: vk::DescriptorSetLayout) -> Result<Self> {
        Ok(match device.tracer {
            Tracer::Pipeline => Self::Pipeline(Box::new(TracePipeline::new(device, images)?)),
            Tracer::Query => Self::Query(QueryPipeline::new(device, images)?),
        })
    }

    /// A descriptor set with a TLAS.
    pub fn bind_tlas(&self, tlas: vk::AccelerationStructureKHR) -> Result<TlasSet> {
        match self {
            Self::Pipeline(pipeline) => pipeline.bind_tlas(tlas),
            Self::Query(query) => query.bind_tlas(tlas),
        }
    }

    /// Whether it can trace rays for rows of so many pixels.
    pub fn check_width(&self, width: u32) -> Result<()> {
        match self {
            Self::Query(query) if width > query.widest() => Err(VulkanError::Limit(format!(
                "rows of {width} pixels are wider than the device's {}; render the image by tiles",
                query.widest()
            ))),
            _ => Ok(()),
        }
    }

    /// The pipelines that trace paths in stages, if these do.
    pub fn staged(&self) -> Option<&TracePipeline> {
        match self {
            Self::Pipeline(pipeline) => Some(pipeline.as_ref()).filter(|pipeline| pipeline.is_staged()),
            Self::Query(_) => None,
        }
    }

    /// Traces rays for `width` x `height` pixels.
    pub fn trace(
        &self,
        commands: &mut Commands,
        generation: Generation,
        tlas: &TlasSet,
        images: vk::DescriptorSet,
        push: &TracePush,
        size: (u32, u32),
    ) {
        match self {
            Self::Pipeline(pipeline) => pipeline.trace(commands, generation, tlas, images, push, size),
            Self::Query(query) => query.trace(commands, generation, tlas, images, push, size),
        }
    }
}
