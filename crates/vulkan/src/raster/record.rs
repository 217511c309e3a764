//! [`Raster`]: what all frames of the preview share, and the commands of one part of a pass.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::abi::{CullPush, RasterPush, ResolvePush};
use super::cull::{Bucket, Culling};
use super::environment::Surroundings;
use super::pipelines::{IMAGES_SET, Pipelines, STAGES, TARGETS_SET};
use super::targets::{Attachment, Targets};
use crate::device::Device;
use crate::error::{Result, VulkanError};
use crate::memory::{Commands, Queue};
use ash::vk;
use std::sync::Arc;

/// Pipelines, targets and tables of the preview. It is made with the first frame that asks for it.
pub(crate) struct Raster {
    device: Arc<Device>,
    pub(super) pipelines: Pipelines,
    pub(super) culling: Culling,
    pub(super) environment: Surroundings,
    pub(super) targets: Option<Targets>,
}

/// Where a part of a pass begins and how depths are: what is drawn with.
#[derive(Clone, Copy)]
pub(super) struct Part<'p> {
    pub push: &'p RasterPush,
    pub images: vk::DescriptorSet,
    /// Depths run from 1 down to 0, as perspective ones do.
    pub is_reversed: bool,
}

impl Raster {
    /// Makes it, for images of a layout.
    ///
    /// # Errors
    /// If the device lacks what it takes: the error says what.
    pub fn new(device: &Arc<Device>, images: vk::DescriptorSetLayout) -> Result<Self> {
        if !device.info.features.raster {
            let what = format!(
                "{} cannot rasterize: it lacks multi-draw indirect, first instances of indirect draws or independent \
                 blending; use --renderer path",
                device.info.name
            );
            return Err(VulkanError::NoDevice(what));
        }
        Ok(Self {
            device: device.clone(),
            pipelines: Pipelines::new(device, images)?,
            culling: Culling::new(device)?,
            environment: Surroundings::new(device)?,
            targets: None,
        })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.culling.bytes() + self.environment.bytes() + self.targets.as_ref().map_or(0, Targets::bytes)
    }

    /// Targets for parts of a size.
    pub(super) fn targets_for(&mut self, queue: &mut Queue, size: (u32, u32), with_hits: bool) -> Result<()> {
        if self.targets.as_ref().is_some_and(|targets| targets.fits(size.0, size.1, with_hits)) {
            return Ok(());
        }
        if let Some(old) = self.targets.take() {
            queue.retire(old);
        }
        let (formats, layout) = (&self.pipelines.formats, self.pipelines.targets);
        self.targets = Some(Targets::new(&self.device, formats, layout, size, with_hits)?);
        Ok(())
    }

    /// Finds out what is in the view.
    pub(super) fn cull(&self, commands: &mut Commands, push: &CullPush, rows: u32) {
        self.culling.run(commands, push, rows);
    }

    /// Draws a part of an image; `backdrop` says whether the environment is behind it, or nothing.
    pub(super) fn draw(&self, commands: &mut Commands, part: Part<'_>, backdrop: bool) {
        let Some(targets) = &self.targets else { return };
        for target in [&targets.color, &targets.depth, &targets.blended, &targets.revealed] {
            target.begin(commands);
        }
        let black = vk::ClearColorValue { float32: [0.0; 4] };
        let white = vk::ClearColorValue { float32: [1.0; 4] };
        let pipelines = &self.pipelines;

        // Opaque surfaces and alpha tests, and what is behind them
        let farthest = Some(if part.is_reversed { 0.0 } else { 1.0 });
        self.begin(commands, part, &[(&targets.color, black)], (&targets.depth, farthest));
        self.bind(commands, part, pipelines.opaque, true);
        self.faces(commands, vk::CullModeFlags::BACK);
        self.culling.draw(commands, Bucket::Opaque);
        self.faces(commands, vk::CullModeFlags::NONE);
        self.culling.draw(commands, Bucket::TwoSided);
        self.bind(commands, part, pipelines.mask, true);
        self.culling.draw(commands, Bucket::Mask);
        if backdrop {
            self.bind(commands, part, pipelines.backdrop, false);
            // SAFETY: a pipeline is bound that reads no vertices.
            unsafe { self.device.raw.cmd_draw(commands.raw, 3, 1, 0, 0) };
        }
        self.end(commands);
        commands.full_barrier();

        // What is blended over it
        let sums = [(&targets.blended, black), (&targets.revealed, white)];
        self.begin(commands, part, &sums, (&targets.depth, None));
        self.bind(commands, part, pipelines.blend, false);
        self.faces(commands, vk::CullModeFlags::NONE);
        self.culling.draw(commands, Bucket::Blend);
        self.end(commands);
        for target in [&targets.color, &targets.blended, &targets.revealed] {
            target.end(commands);
        }
    }

    /// Draws what pixel centres see.
    pub(super) fn draw_hits(&self, commands: &mut Commands, part: Part<'_>) {
        let Some([hits, depth]) = self.targets.as_ref().and_then(|targets| targets.hits.as_ref()) else { return };
        hits.begin(commands);
        depth.begin(commands);
        let none = vk::ClearColorValue { uint32: [u32::MAX; 4] };
        let farthest = Some(if part.is_reversed { 0.0 } else { 1.0 });
        self.begin(commands, part, &[(hits, none)], (depth, farthest));
        self.bind(commands, part, self.pipelines.hits, true);
        self.faces(commands, vk::CullModeFlags::BACK);
        self.culling.draw(commands, Bucket::Opaque);
        self.faces(commands, vk::CullModeFlags::NONE);
        for bucket in [Bucket::TwoSided, Bucket::Mask, Bucket::Blend] {
            self.culling.draw(commands, bucket);
        }
        self.end(commands);
        hits.end(commands);
    }

    /// Adds what was drawn to sums.
    pub(super) fn resolve(&self, commands: &mut Commands, push: &ResolvePush) {
        self.read_targets(commands, self.pipelines.resolve_samples, push);
    }

    /// Makes AOVs of what pixel centres see.
    pub(super) fn resolve_hits(&self, commands: &mut Commands, push: &ResolvePush) {
        self.read_targets(commands, self.pipelines.resolve_hits, push);
    }

    fn read_targets(&self, commands: &mut Commands, pipeline: vk::Pipeline, push: &ResolvePush) {
        let Some(targets) = &self.targets else { return };
        commands.full_barrier();
        let (raw, point) = (&self.device.raw, vk::PipelineBindPoint::COMPUTE);
        let (layout, stage) = (self.pipelines.resolve_layout, vk::ShaderStageFlags::COMPUTE);
        // SAFETY: pipeline, targets and all that the push constants lead to live until the commands are done.
        unsafe {
            raw.cmd_bind_pipeline(commands.raw, point, pipeline);
            raw.cmd_bind_descriptor_sets(commands.raw, point, layout, TARGETS_SET, &[targets.set], &[]);
            raw.cmd_push_constants(commands.raw, layout, stage, 0, bytemuck::bytes_of(push));
            raw.cmd_dispatch(commands.raw, push.width.div_ceil(8), push.height.div_ceil(8), 1);
        }
        commands.full_barrier();
    }

    /// Begins to draw into targets, each cleared to a colour, and depths, cleared unless they are to be kept.
    fn begin(
        &self,
        commands: &mut Commands,
        part: Part<'_>,
        colors: &[(&Attachment, vk::ClearColorValue)],
        (depth, farthest): (&Attachment, Option<f32>),
    ) {
        let color = |&(target, color): &(&Attachment, vk::ClearColorValue)| {
            vk::RenderingAttachmentInfo::default()
                .image_view(target.view)
                .image_layout(target.drawn())
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(vk::ClearValue { color })
        };
        let colors: Vec<_> = colors.iter().map(color).collect();
        let mut depth = vk::RenderingAttachmentInfo::default()
            .image_view(depth.view)
            .image_layout(depth.drawn())
            .load_op(vk::AttachmentLoadOp::LOAD)
            .store_op(vk::AttachmentStoreOp::STORE);
        if let Some(farthest) = farthest {
            let depth_stencil = vk::ClearDepthStencilValue { depth: farthest, stencil: 0 };
            depth = depth.load_op(vk::AttachmentLoadOp::CLEAR).clear_value(vk::ClearValue { depth_stencil });
        }
        let (width, height) = (part.push.tile_width, part.push.tile_height);
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth);
        let viewport =
            vk::Viewport { x: 0.0, y: 0.0, width: width as f32, height: height as f32, min_depth: 0.0, max_depth: 1.0 };
        let nearer = if part.is_reversed { vk::CompareOp::GREATER_OR_EQUAL } else { vk::CompareOp::LESS_OR_EQUAL };
        // SAFETY: the targets live until the commands are done, and are in the layouts that are named.
        unsafe {
            let raw = &self.device.raw;
            raw.cmd_begin_rendering(commands.raw, &info);
            raw.cmd_set_viewport(commands.raw, 0, &[viewport]);
            raw.cmd_set_scissor(commands.raw, 0, &[area]);
            raw.cmd_set_depth_compare_op(commands.raw, nearer);
        }
    }

    fn bind(&self, commands: &mut Commands, part: Part<'_>, pipeline: vk::Pipeline, writes_depth: bool) {
        let (raw, point) = (&self.device.raw, vk::PipelineBindPoint::GRAPHICS);
        let layout = self.pipelines.layout;
        // SAFETY: as for `read_targets`; the backend retires what it replaces.
        unsafe {
            raw.cmd_bind_pipeline(commands.raw, point, pipeline);
            raw.cmd_bind_descriptor_sets(commands.raw, point, layout, IMAGES_SET, &[part.images], &[]);
            raw.cmd_push_constants(commands.raw, layout, STAGES, 0, bytemuck::bytes_of(part.push));
            raw.cmd_set_depth_write_enable(commands.raw, writes_depth);
        }
    }

    fn faces(&self, commands: &mut Commands, left_out: vk::CullModeFlags) {
        // SAFETY: the pipelines leave it to the commands.
        unsafe { self.device.raw.cmd_set_cull_mode(commands.raw, left_out) };
    }

    fn end(&self, commands: &mut Commands) {
        // SAFETY: drawing was begun in these commands.
        unsafe { self.device.raw.cmd_end_rendering(commands.raw) };
    }
}
