//! Which devices there are, what each can do, and why one is unfit.

use super::Instance;
use crate::error::{During, Result, VulkanError};
use ash::{khr, vk};
use std::ffi::CStr;

/// Extensions without which nothing can be traced; besides, one of the tracers has to be there.
pub(super) const REQUIRED: [&CStr; 2] = [khr::deferred_host_operations::NAME, khr::acceleration_structure::NAME];

/// How rays are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tracer {
    /// By the ray tracing pipeline, `VK_KHR_ray_tracing_pipeline`.
    Pipeline,
    /// By ray queries in a compute shader, `VK_KHR_ray_query`.
    Query,
}

/// What a device can do beyond what every fit one can.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// `VK_KHR_ray_tracing_pipeline`; without it, `ray_query` is required.
    pub ray_tracing_pipeline: bool,
    /// `VK_KHR_ray_query`.
    pub ray_query: bool,
    /// `VK_NV_ray_tracing_invocation_reorder`, where it does sort.
    pub invocation_reorder: bool,
    /// `VK_KHR_ray_tracing_position_fetch`.
    pub position_fetch: bool,
    /// `VK_EXT_opacity_micromap`.
    pub opacity_micromap: bool,
    /// `VK_EXT_mesh_shader`.
    pub mesh_shader: bool,
    /// What the raster preview takes: multi-draw indirect with first instances, and blending by target.
    pub raster: bool,
    /// Indirect draws whose number the device reads.
    pub draw_indirect_count: bool,
}

/// A device as it is listed.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceInfo {
    /// Place in the list.
    pub index: usize,
    /// Its name.
    pub name: String,
    /// The driver and its version, in the driver's own words.
    pub driver: String,
    /// Version of Vulkan that it speaks, such as `1.3.296`.
    pub api: String,
    /// What it is: `discrete`, `integrated`, `virtual`, `cpu` or `other`.
    pub kind: &'static str,
    /// Bytes of its own memory.
    pub memory: u64,
    /// What it can do beyond what is required.
    pub features: Features,
    /// Why it cannot be used, each with what is missing; empty for one that can.
    pub unfit: Vec<String>,
    pub(crate) queue_family: u32,
    /// A queue beside the first one, for copies in the background.
    pub(crate) background: Option<QueueChoice>,
    pub(crate) limits: Limits,
}

/// A queue of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct QueueChoice {
    pub family: u32,
    /// Its number in the family.
    pub index: u32,
    /// Bits of a timestamp that count; 0 where there are none.
    pub timestamp_bits: u32,
}

/// A queue for copies beside queue 0 of the family `main`: one of a copy engine, which takes nothing from whoever computes; else
/// of a family that computes and draws nothing; else a second one of the same family.
fn background_queue(families: &[vk::QueueFamilyProperties], main: usize) -> Option<QueueChoice> {
    use vk::QueueFlags as Flags;
    let does = |family: &vk::QueueFamilyProperties| family.queue_flags & !(Flags::SPARSE_BINDING | Flags::PROTECTED);
    let others = || families.iter().enumerate().filter(|(i, family)| *i != main && family.queue_count > 0);
    let copies = others().find(|(_, family)| does(family) == Flags::TRANSFER);
    let computes = || {
        others().find(|(_, family)| {
            family.queue_flags.contains(Flags::COMPUTE) && !family.queue_flags.contains(Flags::GRAPHICS)
        })
    };
    let choice = |(i, family): (usize, &vk::QueueFamilyProperties), index| QueueChoice {
        family: i as u32,
        index,
        timestamp_bits: family.timestamp_valid_bits,
    };
    let second = families.get(main).filter(|family| family.queue_count > 1).map(|family| choice((main, family), 1));
    copies.or_else(computes).map(|found| choice(found, 0)).or(second)
}

/// Sizes and alignments that the device asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Limits {
    pub handle_size: u32,
    pub handle_alignment: u32,
    pub base_alignment: u32,
    pub scratch_alignment: u64,
    /// Nanoseconds of a tick, and bits of a timestamp that count; 0 where there are none.
    pub timestamp_period: f32,
    pub timestamp_bits: u32,
    /// Bytes of a buffer, at most.
    pub max_buffer: u64,
    pub max_images: u32,
    pub max_image_size: u32,
    pub max_dispatch: u32,
    pub max_dispatch_rows: u32,
    /// Commands of one indirect draw.
    pub max_draws: u32,
    /// Targets of 32-bit floats can be blended.
    pub blends_floats: bool,
}

impl DeviceInfo {
    /// Whether it can trace rays so.
    pub fn has(&self, tracer: Tracer) -> bool {
        match tracer {
            Tracer::Pipeline => self.features.ray_tracing_pipeline,
            Tracer::Query => self.features.ray_query,
        }
    }

    /// Whether it is a processor that pretends to be a device.
    pub fn is_software(&self) -> bool {
        self.kind == "cpu"
    }
}

/// The devices of this machine, fit ones first, discrete ones before others.
///
/// # Errors
/// If there is no loader or no driver.
pub fn list() -> Result<Vec<DeviceInfo>> {
    let instance = Instance::new(false)?;
    Ok(list_of(&instance.raw)?.into_iter().map(|(_, info)| info).collect())
}

pub(super) fn list_of(instance: &ash::Instance) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>> {
    // SAFETY: the instance lives.
    let physical = unsafe { instance.enumerate_physical_devices() }.during("cannot list the Vulkan devices")?;
    let mut all: Vec<_> = physical.into_iter().map(|device| (device, probe(instance, device))).collect();
    all.sort_by_key(|(_, info)| (!info.unfit.is_empty(), rank(info.kind)));
    for (index, (_, info)) in all.iter_mut().enumerate() {
        info.index = index;
    }
    Ok(all)
}

fn rank(kind: &str) -> usize {
    ["discrete", "integrated", "virtual", "other", "cpu"].iter().position(|k| *k == kind).unwrap_or(3)
}

/// The device that is asked for.
pub(super) fn choose(
    all: Vec<(vk::PhysicalDevice, DeviceInfo)>,
    asked: Option<&str>,
) -> Result<(vk::PhysicalDevice, DeviceInfo)> {
    let listed = |all: &[(vk::PhysicalDevice, DeviceInfo)]| {
        let line = |(_, info): &(_, DeviceInfo)| match info.unfit.is_empty() {
            true => format!("{} {}", info.index, info.name),
            false => format!("{} {} (unfit: {})", info.index, info.name, info.unfit.join(", ")),
        };
        all.iter().map(line).collect::<Vec<_>>().join("; ")
    };
    let refuse = |what: String| Err(VulkanError::NoDevice(what));
    if all.is_empty() {
        return refuse("there is no Vulkan device; install a driver, or use --backend cpu".to_owned());
    }
    let found = match asked {
        None => all.iter().position(|(_, info)| info.unfit.is_empty()),
        Some(asked) => match asked.parse::<usize>() {
            Ok(index) => (index < all.len()).then_some(index),
            Err(_) => {
                let names: Vec<&str> = all.iter().map(|(_, info)| info.name.as_str()).collect();
                match named(asked, &names).as_slice() {
                    [] => None,
                    [found] => Some(*found),
                    _ => {
                        return refuse(format!(
                            "several Vulkan devices have {asked:?} in their name: {}",
                            listed(&all)
                        ));
                    }
                }
            }
        },
    };
    let Some(found) = found else {
        return match asked {
            Some(asked) => refuse(format!("there is no Vulkan device {asked:?}; there are: {}", listed(&all))),
            None => refuse(format!("no Vulkan device can trace rays: {}; use --backend cpu", listed(&all))),
        };
    };
    let mut all = all;
    let (physical, info) = all.swap_remove(found);
    if !info.unfit.is_empty() {
        let what = format!("{} cannot be used: {}; use --backend cpu", info.name, info.unfit.join(", "));
        return refuse(what);
    }
    Ok((physical, info))
}

/// Which of the names a text means: the one that it is, else those of which it is a part, whatever its case; nothing without any
/// text.
fn named(asked: &str, names: &[&str]) -> Vec<usize> {
    let asked = asked.to_lowercase();
    let of = |is_it: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..names.len()).filter(|&i| !asked.is_empty() && is_it(&names[i].to_lowercase())).collect()
    };
    let exact = of(&|name| name == asked);
    if exact.is_empty() { of(&|name| name.contains(&asked)) } else { exact }
}

/// The features that are switched on.
#[derive(Default)]
pub(super) struct Enabled {
    v11: vk::PhysicalDeviceVulkan11Features<'static>,
    v12: vk::PhysicalDeviceVulkan12Features<'static>,
    v13: vk::PhysicalDeviceVulkan13Features<'static>,
    accel: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    tracing: vk::PhysicalDeviceRayTracingPipelineFeaturesKHR<'static>,
    query: vk::PhysicalDeviceRayQueryFeaturesKHR<'static>,
    reorder: vk::PhysicalDeviceRayTracingInvocationReorderFeaturesNV<'static>,
}

/// Threads are sorted by what their rays have hit: `VK_NV_ray_tracing_invocation_reorder`.
const REORDER: &CStr = c"VK_NV_ray_tracing_invocation_reorder";

/// The extensions that are switched on: those of one tracer, so that nothing counts on the other.
pub(super) fn extensions(features: Features, tracer: Tracer) -> impl Iterator<Item = &'static CStr> {
    let tracing: &[&CStr] = match tracer {
        Tracer::Pipeline if features.invocation_reorder => &[khr::ray_tracing_pipeline::NAME, REORDER],
        Tracer::Pipeline => &[khr::ray_tracing_pipeline::NAME],
        Tracer::Query => &[khr::ray_query::NAME],
    };
    REQUIRED.into_iter().chain(tracing.iter().copied())
}

/// What is required, as (name, from the device's features, in what is switched on).
macro_rules! features {
    ($($part:ident . $field:ident $name:literal;)*) => {
        impl Enabled {
            fn missing(&self) -> impl Iterator<Item = &'static str> {
                [$((self.$part.$field == vk::TRUE, $name)),*].into_iter().filter(|(has, _)| !has).map(|(_, name)| name)
            }

            /// All of them, and what is there of the others, to be switched on.
            pub fn chain(&mut self, optional: Features, tracer: Tracer) -> vk::PhysicalDeviceFeatures2<'_> {
                *self = Self::default();
                self.tracing.ray_tracing_pipeline = vk::TRUE;
                self.query.ray_query = vk::TRUE;
                self.reorder.ray_tracing_invocation_reorder = vk::TRUE;
                $(self.$part.$field = vk::TRUE;)*
                self.v12.draw_indirect_count = optional.draw_indirect_count.into();
                self.v13.dynamic_rendering = vk::TRUE;
                let core = vk::PhysicalDeviceFeatures::default()
                    .shader_int64(true)
                    .multi_draw_indirect(optional.raster)
                    .draw_indirect_first_instance(optional.raster)
                    .independent_blend(optional.raster);
                let chain = vk::PhysicalDeviceFeatures2::default()
                    .features(core)
                    .push_next(&mut self.v11)
                    .push_next(&mut self.v12)
                    .push_next(&mut self.v13)
                    .push_next(&mut self.accel);
                match tracer {
                    Tracer::Query => chain.push_next(&mut self.query),
                    Tracer::Pipeline if optional.invocation_reorder => {
                        chain.push_next(&mut self.tracing).push_next(&mut self.reorder)
                    }
                    Tracer::Pipeline => chain.push_next(&mut self.tracing),
                }
            }
        }
    };
}

features! {
    v12.buffer_device_address "buffer device address";
    v12.descriptor_indexing "descriptor indexing";
    v12.runtime_descriptor_array "runtime descriptor arrays";
    v12.shader_sampled_image_array_non_uniform_indexing "non-uniform indexing of images";
    v12.descriptor_binding_partially_bound "partially bound descriptors";
    v12.descriptor_binding_sampled_image_update_after_bind "update of images after binding";
    v12.descriptor_binding_variable_descriptor_count "variable descriptor counts";
    v12.descriptor_binding_update_unused_while_pending "update of unused descriptors";
    v12.timeline_semaphore "timeline semaphores";
    v12.scalar_block_layout "scalar block layout";
    v12.host_query_reset "reset of queries by the host";
    v12.vulkan_memory_model "the Vulkan memory model";
    v12.vulkan_memory_model_device_scope "device scope of the Vulkan memory model";
    v13.synchronization2 "synchronization2";
    v13.maintenance4 "maintenance4";
    accel.acceleration_structure "acceleration structures";
}

/// Whether targets of a format can be blended.
fn blends(instance: &ash::Instance, device: vk::PhysicalDevice, format: vk::Format) -> bool {
    // SAFETY: the device is of this instance.
    let properties = unsafe { instance.get_physical_device_format_properties(device, format) };
    properties.optimal_tiling_features.contains(vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND)
}

fn probe(instance: &ash::Instance, device: vk::PhysicalDevice) -> DeviceInfo {
    // SAFETY: the device is of this instance.
    let extensions = unsafe { instance.enumerate_device_extension_properties(device) }.unwrap_or_default();
    let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));

    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut indexing = vk::PhysicalDeviceDescriptorIndexingProperties::default();
    let mut tracing = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
    let mut accel = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut reorder = vk::PhysicalDeviceRayTracingInvocationReorderPropertiesNV::default();
    let mut sizes = vk::PhysicalDeviceMaintenance4Properties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut indexing);
    // SAFETY: the device is of this instance.
    if unsafe { instance.get_physical_device_properties(device) }.api_version >= super::API_VERSION {
        properties = properties.push_next(&mut sizes);
    }
    if has(REORDER) {
        properties = properties.push_next(&mut reorder);
    }
    if has(khr::ray_tracing_pipeline::NAME) {
        properties = properties.push_next(&mut tracing);
    }
    if has(khr::acceleration_structure::NAME) {
        properties = properties.push_next(&mut accel);
    }
    // SAFETY: the chain holds structures that the device knows.
    unsafe { instance.get_physical_device_properties2(device, &mut properties) };
    let base = properties.properties;

    let mut unfit = Vec::new();
    if base.api_version < super::API_VERSION {
        unfit.push("Vulkan 1.3".to_owned());
    }
    let absent = REQUIRED.iter().filter(|name| !has(name));
    unfit.extend(absent.map(|name| name.to_string_lossy().into_owned()));
    let mut found = Enabled::default();
    let mut core = vk::PhysicalDeviceFeatures::default();
    if unfit.is_empty() {
        let mut chain = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut found.v11)
            .push_next(&mut found.v12)
            .push_next(&mut found.v13)
            .push_next(&mut found.accel);
        if has(khr::ray_tracing_pipeline::NAME) {
            chain = chain.push_next(&mut found.tracing);
        }
        if has(khr::ray_query::NAME) {
            chain = chain.push_next(&mut found.query);
        }
        if has(REORDER) {
            chain = chain.push_next(&mut found.reorder);
        }
        // SAFETY: the chain holds structures that the device knows.
        unsafe { instance.get_physical_device_features2(device, &mut chain) };
        core = chain.features;
        if core.shader_int64 == vk::FALSE {
            unfit.push("64-bit integers in shaders".to_owned());
        }
        unfit.extend(found.missing().map(str::to_owned));
        if found.tracing.ray_tracing_pipeline == vk::FALSE && found.query.ray_query == vk::FALSE {
            unfit.push("ray tracing pipelines or ray queries".to_owned());
        }
    }
    // SAFETY: the device is of this instance.
    let families = unsafe { instance.get_physical_device_queue_family_properties(device) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let family = families.iter().position(|family| family.queue_flags.contains(wanted));
    if family.is_none() {
        unfit.push("a queue for graphics and compute".to_owned());
    }
    // SAFETY: the device is of this instance.
    let memory = unsafe { instance.get_physical_device_memory_properties(device) };
    let own = memory.memory_heaps_as_slice().iter().filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    let words = |text: std::result::Result<&CStr, _>| {
        text.map_or_else(|_| String::new(), |t: &CStr| t.to_string_lossy().into_owned())
    };
    let api = base.api_version;
    DeviceInfo {
        index: 0,
        name: words(base.device_name_as_c_str()),
        driver: format!("{} {}", words(driver.driver_name_as_c_str()), words(driver.driver_info_as_c_str())),
        api: format!("{}.{}.{}", vk::api_version_major(api), vk::api_version_minor(api), vk::api_version_patch(api)),
        kind: match base.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => "discrete",
            vk::PhysicalDeviceType::INTEGRATED_GPU => "integrated",
            vk::PhysicalDeviceType::VIRTUAL_GPU => "virtual",
            vk::PhysicalDeviceType::CPU => "cpu",
            _ => "other",
        },
        memory: own.map(|heap| heap.size).sum(),
        features: Features {
            ray_tracing_pipeline: found.tracing.ray_tracing_pipeline == vk::TRUE,
            ray_query: found.query.ray_query == vk::TRUE,
            // A device may know the extension and sort nothing: it says so.
            invocation_reorder: found.reorder.ray_tracing_invocation_reorder == vk::TRUE
                && reorder.ray_tracing_invocation_reorder_reordering_hint
                    == vk::RayTracingInvocationReorderModeNV::REORDER,
            position_fetch: has(c"VK_KHR_ray_tracing_position_fetch"),
            opacity_micromap: has(c"VK_EXT_opacity_micromap"),
            mesh_shader: has(c"VK_EXT_mesh_shader"),
            raster: [core.multi_draw_indirect, core.draw_indirect_first_instance, core.independent_blend]
                .into_iter()
                .all(|feature| feature == vk::TRUE),
            draw_indirect_count: found.v12.draw_indirect_count == vk::TRUE,
        },
        unfit,
        background: family.and_then(|family| background_queue(&families, family)),
        queue_family: family.unwrap_or(0) as u32,
        limits: Limits {
            handle_size: tracing.shader_group_handle_size,
            handle_alignment: tracing.shader_group_handle_alignment,
            base_alignment: tracing.shader_group_base_alignment,
            scratch_alignment: u64::from(accel.min_acceleration_structure_scratch_offset_alignment).max(1),
            timestamp_period: base.limits.timestamp_period,
            timestamp_bits: family.map_or(0, |family| families[family].timestamp_valid_bits),
            // 0 says that the driver knows no limit of its own.
            max_buffer: if sizes.max_buffer_size == 0 { u64::MAX } else { sizes.max_buffer_size },
            max_images: indexing.max_per_stage_descriptor_update_after_bind_sampled_images,
            max_image_size: base.limits.max_image_dimension2_d,
            max_dispatch: base.limits.max_compute_work_group_count[0],
            max_dispatch_rows: base.limits.max_compute_work_group_count[1],
            max_draws: base.limits.max_draw_indirect_count,
            blends_floats: blends(instance, device, vk::Format::R32G32B32A32_SFLOAT)
                && blends(instance, device, vk::Format::R32_SFLOAT),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vk::QueueFlags as Flags;

    fn families(of: &[(Flags, u32)]) -> Vec<vk::QueueFamilyProperties> {
        let family = |&(flags, count): &(Flags, u32)| {
            vk::QueueFamilyProperties::default().queue_flags(flags).queue_count(count).timestamp_valid_bits(count)
        };
        of.iter().map(family).collect()
    }

    #[test]
    fn copies_in_the_background_go_to_the_queue_that_takes_the_least_from_frames() {
        let all = Flags::GRAPHICS | Flags::COMPUTE | Flags::TRANSFER;
        let computes = Flags::COMPUTE | Flags::TRANSFER;
        let copies = Flags::TRANSFER | Flags::SPARSE_BINDING;
        let decodes = Flags::TRANSFER | Flags::VIDEO_DECODE_KHR;
        let chosen = |of: &[(Flags, u32)]| background_queue(&families(of), 0).map(|queue| (queue.family, queue.index));
        assert_eq!(chosen(&[(all, 16), (decodes, 1), (computes, 8), (copies, 2)]), Some((3, 0)));
        assert_eq!(chosen(&[(all, 16), (decodes, 1), (computes, 8)]), Some((2, 0)));
        assert_eq!(chosen(&[(all, 2), (decodes, 1)]), Some((0, 1)));
        assert_eq!(chosen(&[(all, 1)]), None);
    }

    #[test]
    fn an_exact_name_wins_and_no_text_names_nothing() {
        let names = ["Card", "Card Ti", "other"];
        assert_eq!(named("card", &names), [0]);
        assert_eq!(named("car", &names), [0, 1]);
        assert_eq!(named("", &names), [] as [usize; 0]);
    }
}
