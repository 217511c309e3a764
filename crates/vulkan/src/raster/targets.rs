//! What is drawn into.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::pipelines::Formats;
use crate::device::Device;
use crate::error::{During, Result};
use crate::memory::Commands;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// An image that is drawn into, with its memory and its view.
pub(super) struct Attachment {
    device: Arc<Device>,
    raw: vk::Image,
    pub view: vk::ImageView,
    allocation: Option<Allocation>,
    aspect: vk::ImageAspectFlags,
    bytes: u64,
}

impl Attachment {
    fn new(
        device: &Arc<Device>,
        (width, height): (u32, u32),
        format: vk::Format,
        samples: vk::SampleCountFlags,
    ) -> Result<Self> {
        let what = "a target of the preview";
        let is_depth = format == Formats::DEPTH;
        let (aspect, usage) = if is_depth {
            (vk::ImageAspectFlags::DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT)
        } else {
            let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
            (vk::ImageAspectFlags::COLOR, usage)
        };
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(samples)
            .usage(usage);
        // SAFETY: the device lives; `info` is complete.
        let raw = unsafe { device.raw.create_image(&info, None) }.during("cannot make a target of the preview")?;
        let view = vk::ImageView::null();
        let mut attachment = Self { device: device.clone(), raw, view, allocation: None, aspect, bytes: 0 };
        // SAFETY: the image is of this device.
        let requirements = unsafe { device.raw.get_image_memory_requirements(raw) };
        attachment.bytes = requirements.size;
        let allocation = device.allocate(&AllocationCreateDesc {
            name: what,
            requirements,
            location: MemoryLocation::GpuOnly,
            linear: false,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        })?;
        let allocation = attachment.allocation.insert(allocation);
        // SAFETY: the memory was allocated for this image's requirements, and is bound once.
        unsafe { device.raw.bind_image_memory(raw, allocation.memory(), allocation.offset()) }
            .during("cannot make a target of the preview")?;
        let info = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(attachment.range());
        // SAFETY: the image has memory.
        attachment.view =
            unsafe { device.raw.create_image_view(&info, None) }.during("cannot make a target of the preview")?;
        Ok(attachment)
    }

    fn range(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange::default().aspect_mask(self.aspect).level_count(1).layer_count(1)
    }

    /// The layout in which it is drawn into.
    pub fn drawn(&self) -> vk::ImageLayout {
        match self.aspect {
            vk::ImageAspectFlags::DEPTH => vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
            _ => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
        }
    }

    /// To be drawn into anew: what it held is lost.
    pub fn begin(&self, commands: &mut Commands) {
        self.transition(commands, vk::ImageLayout::UNDEFINED, self.drawn());
    }

    /// To be read after it was drawn into.
    pub fn end(&self, commands: &mut Commands) {
        self.transition(commands, self.drawn(), vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
    }

    fn transition(&self, commands: &mut Commands, from: vk::ImageLayout, to: vk::ImageLayout) {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let all = (Stage::ALL_COMMANDS, Access::MEMORY_READ | Access::MEMORY_WRITE);
        commands.transition(self.raw, self.range(), (from, all), (to, all));
    }
}

impl Drop for Attachment {
    fn drop(&mut self) {
        // SAFETY: whoever drops it knows that the device does not use it any more (`Queue::retire`).
        unsafe {
            self.device.raw.destroy_image_view(self.view, None);
            self.device.raw.destroy_image(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            self.device.free(allocation);
        }
    }
}

/// The targets of one part of an image.
pub(super) struct Targets {
    device: Arc<Device>,
    pub width: u32,
    pub height: u32,
    /// Four samples each.
    pub color: Attachment,
    pub depth: Attachment,
    pub blended: Attachment,
    pub revealed: Attachment,
    /// One sample each; only where hits are asked for.
    pub hits: Option<[Attachment; 2]>,
    pool: vk::DescriptorPool,
    /// All but depths, to be read.
    pub set: vk::DescriptorSet,
}

impl Targets {
    pub fn new(
        device: &Arc<Device>,
        formats: &Formats,
        layout: vk::DescriptorSetLayout,
        (width, height): (u32, u32),
        with_hits: bool,
    ) -> Result<Self> {
        let size = (width, height);
        let four = |format| Attachment::new(device, size, format, vk::SampleCountFlags::TYPE_4);
        let one = |format| Attachment::new(device, size, format, vk::SampleCountFlags::TYPE_1);
        let hits = if with_hits { Some([one(Formats::HITS)?, one(Formats::DEPTH)?]) } else { None };
        let mut targets = Self {
            device: device.clone(),
            width,
            height,
            color: four(Formats::COLOR)?,
            depth: four(Formats::DEPTH)?,
            blended: four(formats.blended)?,
            revealed: four(formats.revealed)?,
            hits,
            pool: vk::DescriptorPool::null(),
            set: vk::DescriptorSet::null(),
        };
        let what = "cannot make the targets of the preview";
        let sizes = [vk::DescriptorPoolSize::default().ty(vk::DescriptorType::SAMPLED_IMAGE).descriptor_count(4)];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the device lives.
        targets.pool = unsafe { device.raw.create_descriptor_pool(&info, None) }.during(what)?;
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(targets.pool).set_layouts(&layouts);
        // SAFETY: the pool has room for one set of this layout.
        targets.set = unsafe { device.raw.allocate_descriptor_sets(&info) }.during(what)?[0];
        let views = [
            Some(targets.color.view),
            Some(targets.blended.view),
            Some(targets.revealed.view),
            targets.hits.as_ref().map(|[hits, _]| hits.view),
        ];
        for (binding, view) in (0..).zip(views) {
            let Some(view) = view else { continue };
            let image = [vk::DescriptorImageInfo::default()
                .image_view(view)
                .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
            let write = [vk::WriteDescriptorSet::default()
                .dst_set(targets.set)
                .dst_binding(binding)
                .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
                .image_info(&image)];
            // SAFETY: nothing uses the set yet.
            unsafe { device.raw.update_descriptor_sets(&write, &[]) };
        }
        Ok(targets)
    }

    /// Whether a part of some size can be drawn into them.
    pub fn fits(&self, width: u32, height: u32, with_hits: bool) -> bool {
        self.width == width && self.height == height && (self.hits.is_some() || !with_hits)
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let all = [&self.color, &self.depth, &self.blended, &self.revealed];
        all.into_iter().chain(self.hits.iter().flatten()).map(|attachment| attachment.bytes).sum()
    }
}

impl Drop for Targets {
    fn drop(&mut self) {
        // SAFETY: as for `Attachment`. A null handle is let pass.
        unsafe { self.device.raw.destroy_descriptor_pool(self.pool, None) };
    }
}
