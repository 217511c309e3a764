//! The table of images: one descriptor array, indexed by what [`ImageRow::descriptor`] says.
//!
//! A descriptor that a frame in flight may read is never written: an image that takes a slot gets a free descriptor, and the
//! one that it replaces is free again when that frame is done.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use crate::abi::ImageRow;
use crate::device::Device;
use crate::error::{During, Result, VulkanError};
use crate::memory::{Arena, Uploads};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use orthant_resident::batch::{ImageWrite, RowRange, RowWrites};
use orthant_resident::image::{ImageData, TexelFormat};
use std::collections::VecDeque;
use std::sync::Arc;

/// Descriptors of the table, if the device has as many.
const MOST: u32 = 1 << 16;

/// An image with its memory and its view.
struct Image {
    device: Arc<Device>,
    raw: vk::Image,
    view: vk::ImageView,
    allocation: Option<Allocation>,
    bytes: u64,
}

struct Slot {
    image: Image,
    descriptor: u32,
    row: ImageRow,
}

/// See the module.
pub(crate) struct ImageTable {
    device: Arc<Device>,
    slots: Vec<Option<Slot>>,
    /// [`ImageRow`] by slot.
    pub rows: Arena,
    pool: vk::DescriptorPool,
    pub layout: vk::DescriptorSetLayout,
    pub set: vk::DescriptorSet,
    capacity: u32,
    /// Descriptors that were used before and are free when a submission is done.
    free: VecDeque<(u64, u32)>,
    /// Descriptors that were never used.
    fresh: u32,
}

impl ImageTable {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let capacity = MOST.min(device.info.limits.max_images).max(1);
        let stages = vk::ShaderStageFlags::RAYGEN_KHR
            | vk::ShaderStageFlags::ANY_HIT_KHR
            | vk::ShaderStageFlags::CLOSEST_HIT_KHR
            | vk::ShaderStageFlags::COMPUTE
            | vk::ShaderStageFlags::FRAGMENT;
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .binding(0)
            .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
            .descriptor_count(capacity)
            .stage_flags(stages)];
        let flags = [vk::DescriptorBindingFlags::UPDATE_AFTER_BIND
            | vk::DescriptorBindingFlags::PARTIALLY_BOUND
            | vk::DescriptorBindingFlags::UPDATE_UNUSED_WHILE_PENDING];
        let mut binding_flags = vk::DescriptorSetLayoutBindingFlagsCreateInfo::default().binding_flags(&flags);
        let info = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::UPDATE_AFTER_BIND_POOL)
            .bindings(&bindings)
            .push_next(&mut binding_flags);
        // SAFETY: the device lives and has the features that the flags ask for.
        let layout = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .during("cannot make the table of images")?;
        let mut table = Self {
            device: device.clone(),
            slots: Vec::new(),
            rows: Arena::new("the table of images", size_of::<ImageRow>(), vk::BufferUsageFlags::empty()),
            pool: vk::DescriptorPool::null(),
            layout,
            set: vk::DescriptorSet::null(),
            capacity,
            free: VecDeque::new(),
            fresh: 0,
        };
        let sizes =
            [vk::DescriptorPoolSize::default().ty(vk::DescriptorType::SAMPLED_IMAGE).descriptor_count(capacity)];
        let info = vk::DescriptorPoolCreateInfo::default()
            .flags(vk::DescriptorPoolCreateFlags::UPDATE_AFTER_BIND)
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: as above.
        table.pool =
            unsafe { device.raw.create_descriptor_pool(&info, None) }.during("cannot make the table of images")?;
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(table.pool).set_layouts(&layouts);
        // SAFETY: pool and layout are of this device, and the pool has room for one set of it.
        table.set = unsafe { device.raw.allocate_descriptor_sets(&info) }.during("cannot make the table of images")?[0];
        Ok(table)
    }

    /// Slots.
    pub fn len(&self) -> u32 {
        self.slots.len() as u32
    }

    /// Bytes of all images with their mips.
    pub fn bytes(&self) -> u64 {
        self.slots.iter().flatten().map(|slot| slot.image.bytes).sum()
    }

    /// Follows a batch. Images do not count as its bytes.
    pub fn follow(&mut self, uploads: &mut Uploads<'_>, writes: &[ImageWrite]) -> Result<()> {
        if writes.is_empty() {
            return Ok(());
        }
        let done = uploads.queue.done()?;
        let mut changed = Vec::with_capacity(writes.len());
        for write in writes {
            let at = write.slot as usize;
            if at >= self.slots.len() {
                changed.extend(self.slots.len() as u32..write.slot);
                self.slots.resize_with(at + 1, || None);
            }
            if let Some(old) = self.slots[at].take() {
                self.free.push_back((uploads.queue.next(), old.descriptor));
                uploads.queue.retire(old.image);
            }
            changed.push(write.slot);
            if let Some(data) = &write.image {
                // Before anything is recorded for an image that finds no place.
                let descriptor = self.descriptor(done)?;
                let image = Image::new(&self.device, data)?;
                if let Err(error) = uploads.overhead(|uploads| image.upload(uploads, data)) {
                    // Some of its texels may be under way.
                    uploads.queue.retire(image);
                    return Err(error);
                }
                self.describe(descriptor, image.view);
                let srgb = matches!(data.format, TexelFormat::Rgba8Srgb | TexelFormat::Rgba16Srgb);
                let row = ImageRow {
                    width: data.levels[0].width,
                    height: data.levels[0].height,
                    levels: data.levels.len() as u32,
                    srgb: u32::from(srgb) << u32::from(data.format == TexelFormat::Rgba16Srgb),
                    descriptor,
                    reserved: 0,
                };
                self.slots[at] = Some(Slot { image, descriptor, row });
            }
        }
        changed.sort_unstable();
        changed.dedup();
        let row = |&slot: &u32| self.slots[slot as usize].as_ref().map_or(ImageRow::default(), |slot| slot.row);
        let ranges = changed
            .chunk_by(|a, b| a + 1 == *b)
            .map(|run| RowRange { first: run[0], rows: run.iter().map(row).collect() })
            .collect();
        let writes = RowWrites { len: self.slots.len() as u32, ranges };
        let device = self.device.clone();
        uploads.overhead(|uploads| uploads.rows(&device, &mut self.rows, &writes).map(|_| ()))
    }

    /// A descriptor that no frame in flight reads.
    fn descriptor(&mut self, done: u64) -> Result<u32> {
        if let Some(&(number, descriptor)) = self.free.front()
            && number <= done
        {
            self.free.pop_front();
            return Ok(descriptor);
        }
        if self.fresh == self.capacity {
            let what = format!("the scene has more than {} images, which is what the device takes", self.capacity);
            return Err(VulkanError::Limit(what));
        }
        self.fresh += 1;
        Ok(self.fresh - 1)
    }

    fn describe(&self, descriptor: u32, view: vk::ImageView) {
        let image = [vk::DescriptorImageInfo::default()
            .image_view(view)
            .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(0)
            .dst_array_element(descriptor)
            .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
            .image_info(&image)];
        // SAFETY: no frame in flight reads this element, and the layout allows writes beside those that it reads.
        unsafe { self.device.raw.update_descriptor_sets(&write, &[]) };
    }
}

impl Drop for ImageTable {
    fn drop(&mut self) {
        // SAFETY: the scene is dropped after its queue's work is done.
        unsafe {
            self.device.raw.destroy_descriptor_pool(self.pool, None);
            self.device.raw.destroy_descriptor_set_layout(self.layout, None);
        }
    }
}

fn format(format: TexelFormat) -> vk::Format {
    match format {
        TexelFormat::Rgba8Linear | TexelFormat::Rgba8Srgb => vk::Format::R8G8B8A8_UNORM,
        TexelFormat::Rgba16Linear | TexelFormat::Rgba16Srgb => vk::Format::R16G16B16A16_UNORM,
        TexelFormat::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
    }
}

impl Image {
    fn new(device: &Arc<Device>, data: &ImageData) -> Result<Self> {
        let what = "an image";
        let level = data.levels[0];
        let most = device.info.limits.max_image_size;
        if level.width.max(level.height) > most {
            let what = format!(
                "an image of {} x {} texels is larger than the device takes ({most}); make it smaller, or use --backend cpu",
                level.width, level.height
            );
            return Err(VulkanError::Limit(what));
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format(data.format))
            .extent(vk::Extent3D { width: level.width, height: level.height, depth: 1 })
            .mip_levels(data.levels.len() as u32)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST);
        // SAFETY: the device lives; `info` is complete.
        let raw = unsafe { device.raw.create_image(&info, None) }.during("cannot make an image")?;
        let mut image = Self { device: device.clone(), raw, view: vk::ImageView::null(), allocation: None, bytes: 0 };
        // SAFETY: the image is of this device.
        let requirements = unsafe { device.raw.get_image_memory_requirements(raw) };
        image.bytes = requirements.size;
        let allocation = device.allocate(&AllocationCreateDesc {
            name: what,
            requirements,
            location: MemoryLocation::GpuOnly,
            linear: false,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        })?;
        let allocation = image.allocation.insert(allocation);
        // SAFETY: the memory was allocated for this image's requirements, and is bound once.
        unsafe { device.raw.bind_image_memory(raw, allocation.memory(), allocation.offset()) }
            .during("cannot make an image")?;
        let info = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format(data.format))
            .subresource_range(image.range(data));
        // SAFETY: the image has memory.
        image.view = unsafe { device.raw.create_image_view(&info, None) }.during("cannot make an image")?;
        Ok(image)
    }

    fn range(&self, data: &ImageData) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .level_count(data.levels.len() as u32)
            .layer_count(1)
    }

    /// Copies all levels, in pieces of whole rows.
    fn upload(&self, uploads: &mut Uploads<'_>, data: &ImageData) -> Result<()> {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let (range, transfer) = (self.range(data), (Stage::ALL_TRANSFER, Access::TRANSFER_WRITE));
        let none = (Stage::NONE, Access::NONE);
        uploads.commands().transition(
            self.raw,
            range,
            (Layout::UNDEFINED, none),
            (Layout::TRANSFER_DST_OPTIMAL, transfer),
        );
        for (i, level) in data.levels.iter().enumerate() {
            let stride = u64::from(level.width) * data.format.bytes() as u64;
            let bytes = &data.texels[level.offset..][..(stride * u64::from(level.height)) as usize];
            uploads.write(bytes, stride, |commands, from, place, at, size| {
                let part = vk::BufferImageCopy::default()
                    .buffer_offset(place)
                    .image_subresource(
                        vk::ImageSubresourceLayers::default()
                            .aspect_mask(vk::ImageAspectFlags::COLOR)
                            .mip_level(i as u32)
                            .layer_count(1),
                    )
                    .image_offset(vk::Offset3D { x: 0, y: (at / stride) as i32, z: 0 })
                    .image_extent(vk::Extent3D { width: level.width, height: (size / stride) as u32, depth: 1 });
                commands.copy_to_image(from, self.raw, &[part]);
            })?;
        }
        let read = (Stage::ALL_COMMANDS, Access::SHADER_READ);
        uploads.commands().transition(
            self.raw,
            range,
            (Layout::TRANSFER_DST_OPTIMAL, transfer),
            (Layout::SHADER_READ_ONLY_OPTIMAL, read),
        );
        Ok(())
    }
}

impl Drop for Image {
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
