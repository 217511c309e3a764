//! The path tracer as compute shaders: with ray queries, for devices without ray tracing pipelines, and where there is a world
//! alone.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::compute::ShaderModule;
use super::pipeline::{Generation, TlasSet, tlas_layout};
use super::program::{Program, Stages};
use crate::abi::TracePush;
use crate::device::Device;
use crate::error::{During, Result};
use crate::memory::Commands;
use ash::vk;
use std::mem::offset_of;
use std::sync::Arc;

/// Pixels of a row that one group of threads takes; `numthreads` of the shaders.
const GROUP: u32 = 32;

/// Two compute pipelines: samples of a block, and what the rays through pixel centres hit; and the stages that trace no ray.
pub(crate) struct QueryPipeline {
    device: Arc<Device>,
    raw: [vk::Pipeline; 2],
    stages: Stages,
    layout: vk::PipelineLayout,
    tlas_layout: vk::DescriptorSetLayout,
}

impl QueryPipeline {
    /// Compiles a program, for images of a layout.
    pub(super) fn new(device: &Arc<Device>, images: vk::DescriptorSetLayout, program: &Program) -> Result<Self> {
        let what = program.what;
        let mut pipeline = Self {
            device: device.clone(),
            raw: [vk::Pipeline::null(); 2],
            stages: Stages::NONE,
            layout: vk::PipelineLayout::null(),
            tlas_layout: tlas_layout(device, vk::ShaderStageFlags::COMPUTE)?,
        };
        let layouts = [pipeline.tlas_layout, images];
        let push =
            [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(program.push as u32)];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(&push);
        // SAFETY: the device lives; what is made is destroyed when `pipeline` is dropped.
        pipeline.layout = unsafe { device.raw.create_pipeline_layout(&info, None) }.during(what)?;
        for (slot, (spirv, entry)) in pipeline.raw.iter_mut().zip(program.rays) {
            *slot = ShaderModule::new(device, spirv)?.compute_pipeline(entry, pipeline.layout)?;
        }
        pipeline.stages.make(device, program, pipeline.layout)?;
        Ok(pipeline)
    }

    /// A descriptor set with a TLAS.
    pub fn bind_tlas(&self, tlas: vk::AccelerationStructureKHR) -> Result<TlasSet> {
        TlasSet::new(&self.device, self.tlas_layout, tlas)
    }

    /// Columns that one dispatch can have.
    pub fn widest(&self) -> u32 {
        self.device.info.limits.max_dispatch.saturating_mul(GROUP)
    }

    /// Whether paths are traced in stages, by [`Self::trace_vertices`].
    pub fn is_staged(&self) -> bool {
        self.stages.are_there()
    }

    /// See [`super::TracePipeline::trace_vertices`].
    pub fn trace_vertices(
        &self,
        commands: &mut Commands,
        tlas: Option<&TlasSet>,
        images: vk::DescriptorSet,
        push: &[u8],
        size: (u32, u32),
        (vertices, last): (u32, bool),
    ) {
        for _ in 0..vertices {
            self.trace(commands, Generation::Block, tlas, images, push, size);
            for stage in self.stages.0 {
                commands.full_barrier();
                self.dispatch(commands, stage, Stages::groups(size.0), tlas, images, push, size.1);
            }
            commands.full_barrier();
        }
        if last {
            self.trace(commands, Generation::Block, tlas, images, push, size);
        }
    }

    /// Traces rays for `width` x `height` pixels, in as many dispatches as the device's limit on rows makes it. They write
    /// different pixels.
    pub fn trace(
        &self,
        commands: &mut Commands,
        generation: Generation,
        tlas: Option<&TlasSet>,
        images: vk::DescriptorSet,
        push: &[u8],
        (width, height): (u32, u32),
    ) {
        debug_assert!(width <= self.widest(), "whoever made the frame has asked");
        let pipeline = self.raw[generation as usize];
        self.dispatch(commands, pipeline, width.div_ceil(GROUP), tlas, images, push, height);
    }

    #[allow(clippy::too_many_arguments, reason = "it is one command")]
    fn dispatch(
        &self,
        commands: &mut Commands,
        pipeline: vk::Pipeline,
        groups: u32,
        tlas: Option<&TlasSet>,
        images: vk::DescriptorSet,
        push: &[u8],
        height: u32,
    ) {
        let point = vk::PipelineBindPoint::COMPUTE;
        let most = self.device.info.limits.max_dispatch_rows.max(1);
        let mut push = push.to_vec();
        let at = offset_of!(TracePush, first_row);
        let mut first_row = u32::from_ne_bytes([push[at], push[at + 1], push[at + 2], push[at + 3]]);
        // SAFETY: pipelines, sets and all that the push constants lead to live until the commands are done: the backend
        // retires what it replaces. Shaders that trace no ray in a scene see nothing of set 0.
        unsafe {
            let raw = &self.device.raw;
            raw.cmd_bind_pipeline(commands.raw, point, pipeline);
            if let Some(tlas) = tlas {
                raw.cmd_bind_descriptor_sets(commands.raw, point, self.layout, 0, &[tlas.raw], &[]);
            }
            raw.cmd_bind_descriptor_sets(commands.raw, point, self.layout, 1, &[images], &[]);
            let mut first = 0;
            while first < height {
                let rows = most.min(height - first);
                push[at..at + 4].copy_from_slice(&first_row.to_ne_bytes());
                raw.cmd_push_constants(commands.raw, self.layout, vk::ShaderStageFlags::COMPUTE, 0, &push);
                raw.cmd_dispatch(commands.raw, groups, rows, 1);
                (first, first_row) = (first + rows, first_row + rows);
            }
        }
    }
}

impl Drop for QueryPipeline {
    fn drop(&mut self) {
        // SAFETY: the backend drops it after its queue's work is done. Null handles are let pass.
        unsafe {
            for pipeline in self.raw.into_iter().chain(self.stages.0) {
                self.device.raw.destroy_pipeline(pipeline, None);
            }
            self.device.raw.destroy_pipeline_layout(self.layout, None);
            self.device.raw.destroy_descriptor_set_layout(self.tlas_layout, None);
        }
    }
}
