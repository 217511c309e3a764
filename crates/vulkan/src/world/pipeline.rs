//! Pipelines of worlds: those of the preview are one module, specialised by what a world has and what a frame asks for.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::view::WorldPush;
use crate::device::Device;
use crate::error::{During, Result};
use crate::memory::Commands;
use crate::trace::RayTracer;
use crate::trace::compute::ShaderModule;
use ash::vk;
use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::Arc;

/// Threads of a group; `GROUP` of the shaders.
const GROUP: u32 = 128;

/// What pipelines are specialised by; `shaders/world/variant.slang`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Variant {
    /// There are transparent materials.
    pub has_media: bool,
    /// There are chunks of more than one block.
    pub has_chunks: bool,
    /// Albedo or normals are asked for.
    pub has_averages: bool,
    /// Threads that share the layers of a pixel: a power of two, at most [`GROUP`].
    pub layer_slots: u32,
}

/// A shader of the module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Pass {
    /// Samples of a block.
    Block,
    /// What the rays through pixel centres hit.
    Centers,
}

impl Pass {
    fn entry(self) -> &'static CStr {
        match self {
            Self::Block => c"preview_block",
            Self::Centers => c"preview_centers",
        }
    }
}

/// Columns and rows of pixels that a group takes.
fn group_size(layer_slots: u32) -> (u32, u32) {
    let bits = (GROUP / layer_slots).ilog2();
    (1 << bits.div_ceil(2), 1 << (bits / 2))
}

/// See the module. Pipelines are made when a frame asks for them.
pub(crate) struct WorldPipelines {
    device: Arc<Device>,
    layout: vk::PipelineLayout,
    made: HashMap<(Pass, Variant), vk::Pipeline>,
    /// Threads that share the layers of a pixel, if that is not left to this module.
    pub layer_slots: Option<u32>,
    /// Seconds that a ray of a preview took in the last frame.
    pub pace: Option<f64>,
    /// What traces paths in a world, and what does in a world and a scene.
    paths: [Option<RayTracer>; 2],
}

impl WorldPipelines {
    /// None yet.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let bytes = size_of::<WorldPush>() as u32;
        let push = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(bytes)];
        let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&push);
        // SAFETY: the device lives.
        let layout = unsafe { device.raw.create_pipeline_layout(&info, None) }.during("cannot make a pipeline")?;
        Ok(Self {
            device: device.clone(),
            layout,
            made: HashMap::new(),
            layer_slots: None,
            pace: None,
            paths: [None, None],
        })
    }

    /// Threads that share the layers of a pixel. Pixels side by side in one layer stay closer together than the layers of one
    /// pixel do; a few slots give a device enough threads, and even out those that take longer.
    pub fn slots(&self, layers: u32) -> u32 {
        let most = 1 << layers.ilog2();
        self.layer_slots.unwrap_or(4).clamp(1, GROUP).min(most)
    }

    /// Makes the pipelines of a variant, if they are not there yet; and that of samples where there are dense chunks too, so that the
    /// first edit that makes one does not have a frame wait for it.
    pub fn prepare(&mut self, variant: Variant, centers: bool) -> Result<()> {
        self.make(Pass::Block, variant)?;
        self.make(Pass::Block, Variant { has_chunks: true, ..variant })?;
        if centers { self.make(Pass::Centers, variant) } else { Ok(()) }
    }

    fn make(&mut self, pass: Pass, variant: Variant) -> Result<()> {
        if self.made.contains_key(&(pass, variant)) {
            return Ok(());
        }
        let module = ShaderModule::new(&self.device, crate::shaders::WORLD_PREVIEW)?;
        let Variant { has_media, has_chunks, has_averages, layer_slots } = variant;
        let constants = [u32::from(has_media), u32::from(has_chunks), u32::from(has_averages), layer_slots];
        let pipeline = module.specialized_pipeline(pass.entry(), self.layout, &constants)?;
        self.made.insert((pass, variant), pipeline);
        Ok(())
    }

    /// Makes what traces paths, if it is not there yet, for images of a layout.
    pub fn prepare_paths(&mut self, images: vk::DescriptorSetLayout, with_scene: bool) -> Result<()> {
        let slot = &mut self.paths[usize::from(with_scene)];
        if slot.is_none() {
            *slot = Some(RayTracer::of_world(&self.device, images, with_scene)?);
        }
        Ok(())
    }

    /// What [`Self::prepare_paths`] has made.
    pub fn paths(&self, with_scene: bool) -> Option<&RayTracer> {
        self.paths[usize::from(with_scene)].as_ref()
    }

    /// The device.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Runs a pass over `width` columns and `push.rows` rows of the tile, in as many dispatches as the device's limits make
    /// it. They write different pixels.
    pub fn record(&self, commands: &mut Commands, pass: Pass, variant: Variant, push: WorldPush, width: u32) {
        let Some(&pipeline) = self.made.get(&(pass, variant)) else { return };
        let (columns, lines) = group_size(variant.layer_slots);
        let most = self.device.info.limits.max_dispatch_rows.max(1).saturating_mul(lines);
        let stages = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: the pipeline and all that the push constants lead to live until the commands are done: the backend retires
        // what it replaces. Whoever made the frame has compared the width with the device's limit.
        unsafe {
            let raw = &self.device.raw;
            raw.cmd_bind_pipeline(commands.raw, vk::PipelineBindPoint::COMPUTE, pipeline);
            let mut first = 0;
            while first < push.rows {
                let rows = most.min(push.rows - first);
                let mut part = WorldPush { rows, ..push };
                part.trace.first_row += first;
                raw.cmd_push_constants(commands.raw, self.layout, stages, 0, bytemuck::bytes_of(&part));
                raw.cmd_dispatch(commands.raw, width.div_ceil(columns), rows.div_ceil(lines), 1);
                first += rows;
            }
        }
    }

    /// Columns that one dispatch can have, whatever the variant.
    pub fn widest(&self) -> u32 {
        self.device.info.limits.max_dispatch
    }
}

impl Drop for WorldPipelines {
    fn drop(&mut self) {
        // SAFETY: the backend drops it after its queue's work is done.
        unsafe {
            for pipeline in self.made.values() {
                self.device.raw.destroy_pipeline(*pipeline, None);
            }
            self.device.raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}
