//! Frames: what traces rays, and a frame under way.
//!
//! * [`pipeline`]: the ray tracing pipeline; [`query`]: its twin of ray queries, for devices without;
//! * [`program`]: which shaders they are made of;
//! * [`job`]: a frame under way; [`paths`]: memory of its paths;
//! * [`compute`]: passes beside it.

pub(crate) mod compute;
mod job;
mod paths;
mod pipeline;
mod program;
mod query;

pub(crate) use job::{Job, Passes};
pub(crate) use paths::PathPool;
pub(crate) use pipeline::{Generation, TlasSet};

use crate::device::{Device, Tracer};
use crate::error::{Result, VulkanError};
use crate::memory::Commands;
use ash::vk;
use pipeline::TracePipeline;
use program::Program;
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
            Tracer::Pipeline => {
                let program = Program::scene(device.info.features.invocation_reorder);
                Self::Pipeline(Box::new(TracePipeline::new(device, images, &program)?))
            }
            Tracer::Query => Self::Query(QueryPipeline::new(device, images, &Program::scene_by_queries())?),
        })
    }

    /// Compiles what traces paths in a world, or in a world and a scene; in stages.
    pub fn of_world(device: &Arc<Device>, images: vk::DescriptorSetLayout, with_scene: bool) -> Result<Self> {
        Ok(match device.tracer {
            _ if !with_scene => Self::Query(QueryPipeline::new(device, images, &Program::world())?),
            Tracer::Pipeline => Self::Pipeline(Box::new(TracePipeline::new(device, images, &Program::both())?)),
            Tracer::Query => Self::Query(QueryPipeline::new(device, images, &Program::both_by_queries())?),
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

    /// Whether paths are traced in stages, by [`Self::trace_vertices`].
    pub fn is_staged(&self) -> bool {
        match self {
            Self::Pipeline(pipeline) => pipeline.is_staged(),
            Self::Query(query) => query.is_staged(),
        }
    }

    /// Takes every path of `size` pixels over at most `vertices.0` vertices. With `vertices.1` it then settles those that have come to
    /// their end.
    pub fn trace_vertices(
        &self,
        commands: &mut Commands,
        sets: &Sets<'_>,
        push: &[u8],
        size: (u32, u32),
        vertices: (u32, bool),
    ) {
        match (self, sets.tlas) {
            (Self::Pipeline(pipeline), Some(tlas)) => {
                pipeline.trace_vertices(commands, tlas, sets.images, push, size, vertices);
            }
            (Self::Pipeline(_), None) => {}
            (Self::Query(query), tlas) => query.trace_vertices(commands, tlas, sets.images, push, size, vertices),
        }
    }

    /// Traces rays for `size` pixels. A pipeline traces none without a TLAS.
    pub fn trace(
        &self,
        commands: &mut Commands,
        generation: Generation,
        sets: &Sets<'_>,
        push: &[u8],
        size: (u32, u32),
    ) {
        match (self, sets.tlas) {
            (Self::Pipeline(pipeline), Some(tlas)) => {
                pipeline.trace(commands, generation, tlas, sets.images, push, size);
            }
            (Self::Pipeline(_), None) => {}
            (Self::Query(query), tlas) => query.trace(commands, generation, tlas, sets.images, push, size),
        }
    }
}

/// The descriptor sets of a frame.
#[derive(Clone, Copy)]
pub(crate) struct Sets<'a> {
    /// Not where there is a world alone.
    pub tlas: Option<&'a TlasSet>,
    pub images: vk::DescriptorSet,
}
