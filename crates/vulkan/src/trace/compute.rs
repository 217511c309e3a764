//! Compute pipelines: push constants and device addresses, no descriptors.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use crate::device::Device;
use crate::error::{During, Result};
use crate::memory::Commands;
use ash::vk;
use std::ffi::CStr;
use std::sync::Arc;

/// See the module.
pub(crate) struct ComputePipeline {
    device: Arc<Device>,
    raw: vk::Pipeline,
    layout: vk::PipelineLayout,
}

/// A module of compiled SPIR-V.
pub(crate) struct ShaderModule<'d> {
    device: &'d Device,
    pub raw: vk::ShaderModule,
}

impl<'d> ShaderModule<'d> {
    pub fn new(device: &'d Device, spirv: &[u8]) -> Result<Self> {
        let words: Vec<u32> = spirv.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are a module that was compiled with this crate and validated.
        let raw = unsafe { device.raw.create_shader_module(&info, None) }.during("cannot load a shader")?;
        Ok(Self { device, raw })
    }

    /// The pipeline of one of its compute shaders; the caller destroys it.
    pub fn compute_pipeline(&self, entry: &CStr, layout: vk::PipelineLayout) -> Result<vk::Pipeline> {
        self.specialized_pipeline(entry, layout, &[])
    }

    /// The same, with the specialisation constants 0, 1, ...
    pub fn specialized_pipeline(
        &self,
        entry: &CStr,
        layout: vk::PipelineLayout,
        constants: &[u32],
    ) -> Result<vk::Pipeline> {
        let entries: Vec<_> = (0..constants.len() as u32)
            .map(|id| vk::SpecializationMapEntry { constant_id: id, offset: 4 * id, size: 4 })
            .collect();
        let specialization =
            vk::SpecializationInfo::default().map_entries(&entries).data(bytemuck::cast_slice(constants));
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(self.raw)
            .name(entry)
            .specialization_info(&specialization);
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
        // SAFETY: module, layout and constants live until the call returns.
        let made = unsafe { self.device.raw.create_compute_pipelines(self.device.pipelines.raw(), &info, None) };
        Ok(made.map_err(|(_, error)| error).during("cannot make a pipeline")?[0])
    }
}

impl Drop for ShaderModule<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules once they are made.
        unsafe { self.device.raw.destroy_shader_module(self.raw, None) };
    }
}

impl ComputePipeline {
    pub fn new(device: &Arc<Device>, spirv: &[u8], entry: &CStr, push_bytes: u32) -> Result<Self> {
        let module = ShaderModule::new(device, spirv)?;
        let push = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(push_bytes)];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&push);
        // SAFETY: the device lives.
        let layout = unsafe { device.raw.create_pipeline_layout(&info, None) }.during("cannot make a pipeline")?;
        let raw = module.compute_pipeline(entry, layout).inspect_err(|_| {
            // SAFETY: nothing else has the layout.
            unsafe { device.raw.destroy_pipeline_layout(layout, None) }
        })?;
        Ok(Self { device: device.clone(), raw, layout })
    }

    /// Runs it over a number of groups, which is at most what the device takes ([`Limits::max_dispatch`]).
    ///
    /// [`Limits::max_dispatch`]: crate::device::Limits::max_dispatch
    pub fn dispatch(&self, commands: &mut Commands, push: &[u8], groups: u32) {
        let most = self.device.info.limits.max_dispatch;
        assert!(groups <= most, "{groups} groups are more than the {most} of the device: the caller splits them");
        // SAFETY: pipeline and layout live as long as the scene, which outlives its commands; the push constants have the
        // size that the layout says.
        unsafe {
            self.device.raw.cmd_bind_pipeline(commands.raw, vk::PipelineBindPoint::COMPUTE, self.raw);
            self.device.raw.cmd_push_constants(commands.raw, self.layout, vk::ShaderStageFlags::COMPUTE, 0, push);
            self.device.raw.cmd_dispatch(commands.raw, groups, 1, 1);
        }
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        // SAFETY: the owner is dropped after the queue's work is done.
        unsafe {
            self.device.raw.destroy_pipeline(self.raw, None);
            self.device.raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}
