//! The pipelines of the path tracer.
//!
//! A path is traced in stages (`shaders/stages.slang`): small programs that run over all paths in turn, those that trace rays
//! in the ray tracing pipeline, the others in compute pipelines. Devices that sort threads by what their rays have hit take
//! the whole path tracer in one ray generation shader instead.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::compute::ShaderModule;
use super::program::{Program, Stages};
use crate::device::Device;
use crate::error::{During, Result};
use crate::memory::{Buffer, Commands, Place};
use ash::vk;
use std::sync::Arc;

/// Which ray generation shader runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Generation {
    /// Samples of a block; where paths are traced in stages, the first stage.
    Block = 0,
    /// What the rays through pixel centres hit.
    Centers = 1,
}

/// Shaders that see the push constants.
const PUSHED: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::RAYGEN_KHR.as_raw()
        | vk::ShaderStageFlags::ANY_HIT_KHR.as_raw()
        | vk::ShaderStageFlags::COMPUTE.as_raw(),
);

/// Descriptor set 0: the TLAS. One for each structure; it is never written again.
pub(crate) struct TlasSet {
    device: Arc<Device>,
    pool: vk::DescriptorPool,
    pub(super) raw: vk::DescriptorSet,
}

/// See the module.
pub(crate) struct TracePipeline {
    device: Arc<Device>,
    raw: vk::Pipeline,
    layout: vk::PipelineLayout,
    tlas_layout: vk::DescriptorSetLayout,
    // Holds the records that the regions lead to.
    _table: Option<Buffer>,
    generation: [vk::StridedDeviceAddressRegionKHR; 2],
    miss: vk::StridedDeviceAddressRegionKHR,
    hit: vk::StridedDeviceAddressRegionKHR,
    stages: Stages,
}

impl TracePipeline {
    /// Compiles a program, for images of a layout.
    pub(super) fn new(device: &Arc<Device>, images: vk::DescriptorSetLayout, program: &Program) -> Result<Self> {
        let what = program.what;
        let none = vk::StridedDeviceAddressRegionKHR::default();
        let mut pipeline = Self {
            device: device.clone(),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            tlas_layout: vk::DescriptorSetLayout::null(),
            _table: None,
            generation: [none; 2],
            miss: none,
            hit: none,
            stages: Stages::NONE,
        };
        pipeline.tlas_layout = tlas_layout(device, vk::ShaderStageFlags::RAYGEN_KHR)?;
        let layouts = [pipeline.tlas_layout, images];
        let push = [vk::PushConstantRange::default().stage_flags(PUSHED).size(program.push as u32)];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(&push);
        // SAFETY: the device lives; what is made is destroyed when `pipeline` is dropped.
        pipeline.layout = unsafe { device.raw.create_pipeline_layout(&info, None) }.during(what)?;

        pipeline.stages.make(device, program, pipeline.layout)?;
        let hits = ShaderModule::new(device, crate::shaders::PATH)?;
        let [(block, block_entry), (centers, centers_entry)] = program.rays;
        let (block, centers) = (ShaderModule::new(device, block)?, ShaderModule::new(device, centers)?);
        let of = |module: &ShaderModule<'_>, stage, name| {
            vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module.raw).name(name)
        };
        let stage = |stage, name| of(&hits, stage, name);
        use vk::ShaderStageFlags as Stage;
        let stages = [
            of(&block, Stage::RAYGEN_KHR, block_entry),
            of(&centers, Stage::RAYGEN_KHR, centers_entry),
            stage(Stage::MISS_KHR, c"missed"),
            stage(Stage::CLOSEST_HIT_KHR, c"hit_closest"),
            stage(Stage::ANY_HIT_KHR, c"hit_any"),
        ];
        let general = |shader| {
            vk::RayTracingShaderGroupCreateInfoKHR::default()
                .ty(vk::RayTracingShaderGroupTypeKHR::GENERAL)
                .general_shader(shader)
                .closest_hit_shader(vk::SHADER_UNUSED_KHR)
                .any_hit_shader(vk::SHADER_UNUSED_KHR)
                .intersection_shader(vk::SHADER_UNUSED_KHR)
        };
        let triangles = vk::RayTracingShaderGroupCreateInfoKHR::default()
            .ty(vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP)
            .general_shader(vk::SHADER_UNUSED_KHR)
            .closest_hit_shader(3)
            .any_hit_shader(4)
            .intersection_shader(vk::SHADER_UNUSED_KHR);
        let groups = [general(0), general(1), general(2), triangles];
        let info = [vk::RayTracingPipelineCreateInfoKHR::default()
            .stages(&stages)
            .groups(&groups)
            .max_pipeline_ray_recursion_depth(1)
            .layout(pipeline.layout)];
        // SAFETY: module and layout live until the call returns.
        let made = unsafe {
            let deferred = vk::DeferredOperationKHR::null();
            device.tracing.create_ray_tracing_pipelines(deferred, device.pipelines.raw(), &info, None)
        };
        pipeline.raw = made.map_err(|(_, error)| error).during(what)?[0];
        pipeline.fill_table(groups.len())?;
        Ok(pipeline)
    }

    /// The shader binding table: two ray generation records, each a region of its own, then miss, then hit.
    fn fill_table(&mut self, groups: usize) -> Result<()> {
        let what = "cannot make the shader binding table";
        let limits = self.device.info.limits;
        let size = limits.handle_size as usize;
        // SAFETY: the pipeline has this many groups.
        let handles = unsafe {
            self.device.tracing.get_ray_tracing_shader_group_handles(self.raw, 0, groups as u32, size * groups)
        }
        .during(what)?;
        let stride = u64::from(limits.handle_size.next_multiple_of(limits.handle_alignment.max(1)));
        let base = u64::from(limits.base_alignment.max(1));
        let region = stride.next_multiple_of(base);
        let usage = vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR;
        let mut table =
            Buffer::new(&self.device, "the shader binding table", region * (groups as u64 + 1), usage, Place::Upload)?;
        let first = table.address.next_multiple_of(base);
        let skipped = (first - table.address) as usize;
        for (i, handle) in handles.chunks_exact(size).enumerate() {
            let at = skipped + i * region as usize;
            table.mapped_mut()[at..at + size].copy_from_slice(handle);
        }
        let at =
            |i: u64| vk::StridedDeviceAddressRegionKHR { device_address: first + i * region, stride, size: stride };
        // A ray generation region's stride is its size.
        (self.generation, self.miss, self.hit) = ([at(0), at(1)], at(2), at(3));
        self._table = Some(table);
        Ok(())
    }

    /// A descriptor set with a TLAS.
    pub fn bind_tlas(&self, tlas: vk::AccelerationStructureKHR) -> Result<TlasSet> {
        TlasSet::new(&self.device, self.tlas_layout, tlas)
    }

    /// Whether paths are traced in stages, by [`Self::trace_vertices`].
    pub fn is_staged(&self) -> bool {
        self.stages.are_there()
    }

    /// Takes every path of `width` x `height` pixels over at most `vertices` vertices. With `last` it then settles those that
    /// have come to their end.
    pub fn trace_vertices(
        &self,
        commands: &mut Commands,
        tlas: &TlasSet,
        images: vk::DescriptorSet,
        push: &[u8],
        size: (u32, u32),
        (vertices, last): (u32, bool),
    ) {
        for _ in 0..vertices {
            self.trace(commands, Generation::Block, tlas, images, push, size);
            for stage in self.stages.0 {
                commands.shader_barrier();
                self.compute(commands, stage, tlas, images, push, size);
            }
            commands.shader_barrier();
        }
        if last {
            self.trace(commands, Generation::Block, tlas, images, push, size);
        }
    }

    fn compute(
        &self,
        commands: &mut Commands,
        pipeline: vk::Pipeline,
        tlas: &TlasSet,
        images: vk::DescriptorSet,
        push: &[u8],
        (width, height): (u32, u32),
    ) {
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: as for `trace`.
        unsafe {
            let raw = &self.device.raw;
            raw.cmd_bind_pipeline(commands.raw, point, pipeline);
            raw.cmd_bind_descriptor_sets(commands.raw, point, self.layout, 0, &[tlas.raw, images], &[]);
            raw.cmd_push_constants(commands.raw, self.layout, PUSHED, 0, push);
            raw.cmd_dispatch(commands.raw, Stages::groups(width), height, 1);
        }
    }

    /// Traces rays for `width` x `height` pixels.
    pub fn trace(
        &self,
        commands: &mut Commands,
        generation: Generation,
        tlas: &TlasSet,
        images: vk::DescriptorSet,
        push: &[u8],
        (width, height): (u32, u32),
    ) {
        let point = vk::PipelineBindPoint::RAY_TRACING_KHR;
        let callable = vk::StridedDeviceAddressRegionKHR::default();
        let record = &self.generation[generation as usize];
        // SAFETY: pipeline, table, sets and all that the push constants lead to live until the commands are done: the
        // backend retires what it replaces.
        unsafe {
            let raw = &self.device.raw;
            raw.cmd_bind_pipeline(commands.raw, point, self.raw);
            raw.cmd_bind_descriptor_sets(commands.raw, point, self.layout, 0, &[tlas.raw, images], &[]);
            raw.cmd_push_constants(commands.raw, self.layout, PUSHED, 0, push);
            let (miss, hit) = (&self.miss, &self.hit);
            self.device.tracing.cmd_trace_rays(commands.raw, record, miss, hit, &callable, width, height, 1);
        }
    }
}

impl Drop for TracePipeline {
    fn drop(&mut self) {
        // SAFETY: the backend drops it after its queue's work is done. Null handles are let pass.
        unsafe {
            self.device.raw.destroy_pipeline(self.raw, None);
            for stage in self.stages.0 {
                self.device.raw.destroy_pipeline(stage, None);
            }
            self.device.raw.destroy_pipeline_layout(self.layout, None);
            self.device.raw.destroy_descriptor_set_layout(self.tlas_layout, None);
        }
    }
}

/// The layout of a [`TlasSet`] that shaders of some stages see.
pub(super) fn tlas_layout(device: &Device, stages: vk::ShaderStageFlags) -> Result<vk::DescriptorSetLayout> {
    let bindings = [vk::DescriptorSetLayoutBinding::default()
        .binding(0)
        .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
        .descriptor_count(1)
        .stage_flags(stages)];
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: the device lives; whoever asks for the layout destroys it.
    unsafe { device.raw.create_descriptor_set_layout(&info, None) }.during("cannot bind the TLAS")
}

impl TlasSet {
    /// A set of a layout, with a TLAS.
    pub(super) fn new(
        device: &Arc<Device>,
        layout: vk::DescriptorSetLayout,
        tlas: vk::AccelerationStructureKHR,
    ) -> Result<Self> {
        let what = "cannot bind the TLAS";
        let sizes =
            [vk::DescriptorPoolSize::default().ty(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR).descriptor_count(1)];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the device lives.
        let pool = unsafe { device.raw.create_descriptor_pool(&info, None) }.during(what)?;
        let mut set = Self { device: device.clone(), pool, raw: vk::DescriptorSet::null() };
        let layouts = [layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: the pool has room for one set of this layout.
        set.raw = unsafe { device.raw.allocate_descriptor_sets(&info) }.during(what)?[0];
        let structures = [tlas];
        let mut with = vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(&structures);
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(set.raw)
            .dst_binding(0)
            .descriptor_count(1)
            .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
            .push_next(&mut with)];
        // SAFETY: nothing uses the set yet.
        unsafe { device.raw.update_descriptor_sets(&write, &[]) };
        Ok(set)
    }
}

impl Drop for TlasSet {
    fn drop(&mut self) {
        // SAFETY: it is retired with the TLAS.
        unsafe { self.device.raw.destroy_descriptor_pool(self.pool, None) };
    }
}
