//! Graphics pipelines of the preview, and the compute pipelines that read what they drew.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::abi::{RasterPush, ResolvePush};
use crate::device::Device;
use crate::error::{During, Result};
use crate::trace::compute::ShaderModule;
use ash::vk;
use std::ffi::CStr;
use std::sync::Arc;

/// Formats of the targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Formats {
    /// Sums of blended colours, which the device has to be able to add.
    pub blended: vk::Format,
    /// What blended surfaces leave of the background, likewise.
    pub revealed: vk::Format,
}

impl Formats {
    /// Radiance.
    pub const COLOR: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
    /// Depth.
    pub const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
    /// Row, triangle and two weights.
    pub const HITS: vk::Format = vk::Format::R32G32B32A32_UINT;

    fn new(device: &Device) -> Self {
        if device.info.limits.blends_floats {
            Self { blended: vk::Format::R32G32B32A32_SFLOAT, revealed: vk::Format::R32_SFLOAT }
        } else {
            Self { blended: vk::Format::R16G16B16A16_SFLOAT, revealed: vk::Format::R16_SFLOAT }
        }
    }
}

/// See the module.
pub(super) struct Pipelines {
    device: Arc<Device>,
    pub formats: Formats,
    /// Of sets that nothing is in.
    empty: vk::DescriptorSetLayout,
    /// Of [`super::targets::Targets`].
    pub targets: vk::DescriptorSetLayout,
    pub layout: vk::PipelineLayout,
    pub resolve_layout: vk::PipelineLayout,
    pub opaque: vk::Pipeline,
    pub mask: vk::Pipeline,
    pub backdrop: vk::Pipeline,
    pub blend: vk::Pipeline,
    pub hits: vk::Pipeline,
    pub resolve_samples: vk::Pipeline,
    pub resolve_hits: vk::Pipeline,
}

/// The set of the targets in the layout of the pipelines that read them.
pub(super) const TARGETS_SET: u32 = 2;
/// The set of images in the layout of the pipelines that draw.
pub(super) const IMAGES_SET: u32 = 1;

/// Stages that see push constants.
pub(super) const STAGES: vk::ShaderStageFlags =
    vk::ShaderStageFlags::from_raw(vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw());

impl Pipelines {
    /// Compiles them, for images of a layout.
    pub fn new(device: &Arc<Device>, images: vk::DescriptorSetLayout) -> Result<Self> {
        let what = "cannot make the pipelines of the preview";
        let raw = &device.raw;
        let mut all = Self {
            device: device.clone(),
            formats: Formats::new(device),
            empty: vk::DescriptorSetLayout::null(),
            targets: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            resolve_layout: vk::PipelineLayout::null(),
            opaque: vk::Pipeline::null(),
            mask: vk::Pipeline::null(),
            backdrop: vk::Pipeline::null(),
            blend: vk::Pipeline::null(),
            hits: vk::Pipeline::null(),
            resolve_samples: vk::Pipeline::null(),
            resolve_hits: vk::Pipeline::null(),
        };
        let binding = |binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding)
                .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        };
        let bindings = [0, 1, 2, 3].map(binding);
        let push = |stages, bytes| [vk::PushConstantRange::default().stage_flags(stages).size(bytes)];
        // SAFETY: the device lives; what is made is destroyed when `all` is dropped.
        unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default();
            all.empty = raw.create_descriptor_set_layout(&info, None).during(what)?;
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            all.targets = raw.create_descriptor_set_layout(&info, None).during(what)?;
            let (sets, range) = ([all.empty, images], push(STAGES, size_of::<RasterPush>() as u32));
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&range);
            all.layout = raw.create_pipeline_layout(&info, None).during(what)?;
            let sets = [all.empty, all.empty, all.targets];
            let range = push(vk::ShaderStageFlags::COMPUTE, size_of::<ResolvePush>() as u32);
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&range);
            all.resolve_layout = raw.create_pipeline_layout(&info, None).during(what)?;
        }

        let draw = ShaderModule::new(device, crate::shaders::RASTER_DRAW)?;
        let four = vk::SampleCountFlags::TYPE_4;
        let color = [(Formats::COLOR, None)];
        let corner = c"place_corner";
        all.opaque = all.graphics(&draw, [corner, c"shade_opaque"], &color, four)?;
        all.mask = all.graphics(&draw, [corner, c"shade_mask"], &color, four)?;
        all.backdrop = all.graphics(&draw, [c"place_backdrop", c"shade_backdrop"], &color, four)?;
        use vk::BlendFactor as Factor;
        let sums = [
            (all.formats.blended, Some((Factor::ONE, Factor::ONE))),
            (all.formats.revealed, Some((Factor::ZERO, Factor::ONE_MINUS_SRC_COLOR))),
        ];
        all.blend = all.graphics(&draw, [corner, c"shade_blend"], &sums, four)?;
        let hits = [(Formats::HITS, None)];
        all.hits = all.graphics(&draw, [corner, c"find_hit"], &hits, vk::SampleCountFlags::TYPE_1)?;

        let resolve = ShaderModule::new(device, crate::shaders::RASTER_RESOLVE)?;
        all.resolve_samples = all.compute(&resolve, c"resolve_samples")?;
        all.resolve_hits = all.compute(&resolve, c"resolve_hits")?;
        Ok(all)
    }

    /// A pipeline that draws triangles into targets of some formats, each with the factors of source and target where it
    /// blends. Which faces are left out, and how depths are compared and whether they are written, is said when it draws.
    fn graphics(
        &self,
        module: &ShaderModule<'_>,
        [vertex, fragment]: [&CStr; 2],
        targets: &[(vk::Format, Option<(vk::BlendFactor, vk::BlendFactor)>)],
        samples: vk::SampleCountFlags,
    ) -> Result<vk::Pipeline> {
        use vk::ShaderStageFlags as Stage;
        let stage =
            |stage, name| vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module.raw).name(name);
        let stages = [stage(Stage::VERTEX, vertex), stage(Stage::FRAGMENT, fragment)];
        let vertices = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(samples);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(true);
        let blend = |&(_, factors): &(vk::Format, Option<(vk::BlendFactor, vk::BlendFactor)>)| {
            let state =
                vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
            let Some((source, target)) = factors else { return state };
            state
                .blend_enable(true)
                .color_blend_op(vk::BlendOp::ADD)
                .alpha_blend_op(vk::BlendOp::ADD)
                .src_color_blend_factor(source)
                .src_alpha_blend_factor(source)
                .dst_color_blend_factor(target)
                .dst_alpha_blend_factor(target)
        };
        let blends: Vec<_> = targets.iter().map(blend).collect();
        let blending = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let states = [
            vk::DynamicState::VIEWPORT,
            vk::DynamicState::SCISSOR,
            vk::DynamicState::CULL_MODE,
            vk::DynamicState::DEPTH_COMPARE_OP,
            vk::DynamicState::DEPTH_WRITE_ENABLE,
        ];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&states);
        let formats: Vec<_> = targets.iter().map(|target| target.0).collect();
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&formats)
            .depth_attachment_format(Formats::DEPTH);
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertices)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth)
            .color_blend_state(&blending)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering)];
        // SAFETY: module and layout live until the call returns, and the device has what the state asks for.
        let made = unsafe { self.device.raw.create_graphics_pipelines(self.device.pipelines.raw(), &info, None) };
        let made = made.map_err(|(_, error)| error).during("cannot make the pipelines of the preview")?;
        Ok(made[0])
    }

    fn compute(&self, module: &ShaderModule<'_>, entry: &CStr) -> Result<vk::Pipeline> {
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.raw)
            .name(entry);
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(self.resolve_layout)];
        // SAFETY: as for `graphics`.
        let made = unsafe { self.device.raw.create_compute_pipelines(self.device.pipelines.raw(), &info, None) };
        let made = made.map_err(|(_, error)| error).during("cannot make the pipelines of the preview")?;
        Ok(made[0])
    }
}

impl Drop for Pipelines {
    fn drop(&mut self) {
        let pipelines =
            [self.opaque, self.mask, self.backdrop, self.blend, self.hits, self.resolve_samples, self.resolve_hits];
        // SAFETY: the backend drops them after its queue's work is done. Null handles are let pass.
        unsafe {
            for pipeline in pipelines {
                self.device.raw.destroy_pipeline(pipeline, None);
            }
            self.device.raw.destroy_pipeline_layout(self.layout, None);
            self.device.raw.destroy_pipeline_layout(self.resolve_layout, None);
            self.device.raw.destroy_descriptor_set_layout(self.targets, None);
            self.device.raw.destroy_descriptor_set_layout(self.empty, None);
        }
    }
}
