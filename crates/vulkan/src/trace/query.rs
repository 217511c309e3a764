//! The path tracer as compute shaders with ray queries: for devices without ray tracing pipelines.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::compute::ShaderModule;
use super::pipeline::{Generation, TlasSet, tlas_layout};
use crate::abi::TracePush;
use crate::device::Device;
use crate::error::{During, Result};
use crate::memory::Commands;
use ash::vk;
use std::sync::Arc;

/// Pixels of a row that one group of threads takes; `numthreads` of the shaders.
const GROUP: u32 = 32;

/// Two compute pipelines: samples of a block, and what the rays through pixel centres hit.
pub(crate) struct QueryPipeline {
    device: Arc<Device>,
    raw: [vk::Pipeline; 2],
    layout: vk::PipelineLayout,
    tlas_layout: vk::DescriptorSetLayout,
}

impl QueryPipeline {
    /// Compiles them, for images of a layout.
    pub fn new(device: &Arc<Device>, images: vk::DescriptorSetLayout) -> Result<Self> {
        let what = "cannot make the path tracer of ray queries";
        let mut pipeline = Self {
            device: device.clone(),
            raw: [vk::Pipeline::null(); 2],
            layout: vk::PipelineLayout::null(),
            tlas_layout: tlas_layout(device, vk::ShaderStageFlags::COMPUTE)?,
        };
        let layouts = [pipeline.tlas_layout, images];
        let push = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(size_of::<TracePush>() as u32)];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(&push);
        // SAFETY: the device lives; what is made is destroyed when `pipeline` is dropped.
        pipeline.layout = unsafe { device.raw.create_pipeline_layout(&info, None) }.during(what)?;
        let module = ShaderModule::new(device, crate::shaders::PATH_QUERY)?;
        for (slot, name) in pipeline.raw.iter_mut().zip([c"query_block", c"query_centers"]) {
            *slot = module.compute_pipeline(name, pipeline.layout)?;
        }
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

    /// Traces rays for `width` x `height` pixels, in as many dispatches as the device's limit on rows makes it. They write
    /// different pixels.
    pub fn trace(
        &self,
        commands: &mut Commands,
        generation: Generation,
        tlas: &TlasSet,
        images: vk::DescriptorSet,
        push: &TracePush,
        (width, height): (u32, u32),
    ) {
        let point = vk::PipelineBindPoint::COMPUTE;
        let most = self.device.info.limits.max_dispatch_rows.max(1);
        debug_assert!(width <= self.widest(), "whoever made the frame has asked");
        // SAFETY: pipelines, sets and all that the push constants lead to live until the commands are done: the backend
        // retires what it replaces.
        unsafe {
            let raw = &self.device.raw;
            raw.cmd_bind_pipeline(commands.raw, point, self.raw[generation as usize]);
            raw.cmd_bind_descriptor_sets(commands.raw, point, self.layout, 0, &[tlas.raw, images], &[]);
            let mut first = 0;
            while first < height {
                let rows = most.min(height - first);
                let push = TracePush { first_row: push.first_row + first, ..*push };
                let bytes = bytemuck::bytes_of(&push);
                raw.cmd_push_constants(commands.raw, self.layout, vk::ShaderStageFlags::COMPUTE, 0, bytes);
                raw.cmd_dispatch(commands.raw, width.div_ceil(GROUP), rows, 1);
                first += rows;
            }
        }
    }
}

impl Drop for QueryPipeline {
    fn drop(&mut self) {
        // SAFETY: the backend drops it after its queue's work is done. Null handles are let pass.
        unsafe {
            for pipeline in self.raw {
                self.device.raw.destroy_pipeline(pipeline, None);
            }
            self.device.raw.destroy_pipeline_layout(self.layout, None);
            self.device.raw.destroy_descriptor_set_layout(self.tlas_layout, None);
        }
    }
}
