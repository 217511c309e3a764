//! The device: loader, instance, choice among the devices that are there, queue, extensions.
//!
//! The loader is opened at run time; a machine without Vulkan runs everything but this backend.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

mod cache;
mod debug;
mod probe;

pub use cache::CacheFolder;
pub use debug::Messages;
pub use probe::{DeviceInfo, Features, Tracer, list};

use crate::error::{During, Result, VulkanError};
use ash::{khr, vk};
use debug::Messenger;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, Allocator, AllocatorCreateDesc};
use std::ffi::{CStr, c_char};
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The version that is asked for.
pub(crate) const API_VERSION: u32 = vk::API_VERSION_1_3;

/// Which device, and how it is watched.
#[derive(Clone, Debug, Default)]
pub struct DeviceOptions {
    /// Index in [`list`], or the name or a part of it that only one has, whatever its case. Without it the first fit one:
    /// discrete ones come first.
    pub device: Option<String>,
    /// Run under the validation layers, which have to be installed.
    pub validate: bool,
    /// How rays are traced; without it by the ray tracing pipeline where there is one, else by ray queries.
    pub tracer: Option<Tracer>,
    /// Where compiled pipelines are kept between runs.
    pub cache: CacheFolder,
    /// Most bytes that buffers and images may take on the device and in mapped host memory; what would exceed it is refused
    /// as if the device had no more.
    pub memory: Option<u64>,
}

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Whether the validation layers are installed.
///
/// # Errors
/// If there is no loader.
pub fn can_validate() -> Result<bool> {
    // SAFETY: the loader is the system's; nothing else is run by opening it.
    let entry = unsafe { ash::Entry::load() }.map_err(|e| VulkanError::NoLoader(e.to_string()))?;
    has_validation_layers(&entry)
}

fn has_validation_layers(entry: &ash::Entry) -> Result<bool> {
    // SAFETY: the entry is loaded.
    let known = unsafe { entry.enumerate_instance_layer_properties() }.during("cannot list Vulkan's layers")?;
    Ok(known.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION)))
}

/// An instance of the loader.
pub(crate) struct Instance {
    // Never read, but what the functions below were loaded from.
    _entry: ash::Entry,
    pub raw: ash::Instance,
    messenger: Option<Messenger>,
}

impl Instance {
    pub fn new(validate: bool) -> Result<Self> {
        // SAFETY: the loader is the system's; nothing else is run by opening it.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| VulkanError::NoLoader(e.to_string()))?;
        let application = vk::ApplicationInfo::default().application_name(c"orthant").api_version(API_VERSION);
        let mut layers: Vec<*const c_char> = Vec::new();
        let mut extensions: Vec<*const c_char> = Vec::new();
        if validate {
            if !has_validation_layers(&entry)? {
                let what = "the Vulkan validation layers are not installed; install them, or go on without";
                return Err(VulkanError::NoDevice(what.to_owned()));
            }
            layers.push(VALIDATION.as_ptr());
            extensions.push(ash::ext::debug_utils::NAME.as_ptr());
        }
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        let mut messages = debug::create_info();
        if validate {
            info = info.push_next(&mut messages);
        }
        // SAFETY: all that `info` points to lives until the call returns.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|source| match source {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
                VulkanError::NoDevice("no Vulkan driver is installed; install one, or use --backend cpu".to_owned())
            }
            // What the loader says of a driver's description that it cannot read.
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => VulkanError::NoDevice(
                "no Vulkan driver could be loaded; check what VK_DRIVER_FILES names and the drivers that are installed, or use \
                 --backend cpu"
                    .to_owned(),
            ),
            source => VulkanError::Call { what: "cannot open Vulkan", source },
        })?;
        let mut instance = Self { _entry: entry, raw, messenger: None };
        if validate {
            instance.messenger = Some(Messenger::new(&instance._entry, &instance.raw)?);
        }
        Ok(instance)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        drop(self.messenger.take());
        // SAFETY: everything made from the instance holds it alive, and is gone.
        unsafe { self.raw.destroy_instance(None) };
    }
}

/// A device with a queue that takes all work of frames in the order in which it is handed in, and one for copies in the
/// background, which may be the same.
pub struct Device {
    pub(crate) raw: ash::Device,
    pub(crate) queue: QueueHandle,
    pub(crate) background: QueueHandle,
    pub(crate) accel: khr::acceleration_structure::Device,
    pub(crate) tracing: khr::ray_tracing_pipeline::Device,
    pub(crate) info: DeviceInfo,
    pub(crate) tracer: Tracer,
    pub(crate) pipelines: cache::PipelineCache,
    allocator: Mutex<ManuallyDrop<Allocator>>,
    /// Bytes that are in use, and that may be at most.
    used: AtomicU64,
    budget: AtomicU64,
    lost: AtomicBool,
    /// Submissions after which it is as if lost; negative: none.
    left: AtomicI64,
    instance: Instance,
}

/// A queue that was asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QueueHandle {
    pub raw: vk::Queue,
    pub family: u32,
    /// Bits of a timestamp that count; 0 where there are none.
    pub timestamp_bits: u32,
}

impl Device {
    /// Opens a device.
    ///
    /// # Errors
    /// If there is no loader, no device, none of that name, or the one that is asked for (or every one) is unfit: the error
    /// says of each why.
    pub fn open(options: &DeviceOptions) -> Result<Arc<Self>> {
        let instance = Instance::new(options.validate)?;
        let all = probe::list_of(&instance.raw)?;
        let (physical, info) = probe::choose(all, options.device.as_deref())?;
        let wanted = if info.has(Tracer::Pipeline) { Tracer::Pipeline } else { Tracer::Query };
        let tracer = options.tracer.unwrap_or(wanted);
        if !info.has(tracer) {
            let what = match tracer {
                Tracer::Pipeline => "ray tracing pipelines; trace by ray queries",
                Tracer::Query => "ray queries; trace by the ray tracing pipeline",
            };
            return Err(VulkanError::NoDevice(format!("{} has no {what}, or use --backend cpu", info.name)));
        }
        // What is done in the background may wait.
        let priorities = [1.0, 0.0];
        let of_family = |family, count| {
            vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&priorities[..count])
        };
        let second = info.background.filter(|queue| queue.family == info.queue_family);
        let mut queues = vec![of_family(info.queue_family, 1 + usize::from(second.is_some()))];
        if let Some(other) = info.background.filter(|_| second.is_none()) {
            queues.push(of_family(other.family, 1));
        }
        let names: Vec<*const c_char> = probe::extensions(info.features, tracer).map(CStr::as_ptr).collect();
        let mut enabled = probe::Enabled::default();
        let mut features = enabled.chain(info.features, tracer);
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&names)
            .push_next(&mut features);
        // SAFETY: the physical device is of this instance, and all that `create` points to lives until the call returns.
        let raw =
            unsafe { instance.raw.create_device(physical, &create, None) }.during("cannot open the Vulkan device")?;
        let queue = QueueHandle {
            // SAFETY: the queue was asked for above.
            raw: unsafe { raw.get_device_queue(info.queue_family, 0) },
            family: info.queue_family,
            timestamp_bits: info.limits.timestamp_bits,
        };
        let background = info.background.map_or(queue, |choice| QueueHandle {
            // SAFETY: as above.
            raw: unsafe { raw.get_device_queue(choice.family, choice.index) },
            family: choice.family,
            timestamp_bits: choice.timestamp_bits,
        });
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: true,
            allocation_sizes: Default::default(),
        });
        let allocator = match allocator {
            Ok(allocator) => allocator,
            Err(error) => {
                // SAFETY: nothing has been made from the device yet.
                unsafe { raw.destroy_device(None) };
                let (what, why) = ("cannot set up device memory", error.to_string());
                return Err(VulkanError::Allocation { what, bytes: 0, why });
            }
        };
        tracing::debug!(device = info.name, driver = info.driver, ?tracer, "opened a Vulkan device");
        // SAFETY: the physical device is of this instance.
        let properties = unsafe { instance.raw.get_physical_device_properties(physical) };
        let pipelines = cache::PipelineCache::open(&raw, &properties, &options.cache);
        Ok(Arc::new(Self {
            accel: khr::acceleration_structure::Device::new(&instance.raw, &raw),
            tracing: khr::ray_tracing_pipeline::Device::new(&instance.raw, &raw),
            queue,
            background,
            info,
            tracer,
            pipelines,
            allocator: Mutex::new(ManuallyDrop::new(allocator)),
            used: AtomicU64::new(0),
            budget: AtomicU64::new(options.memory.unwrap_or(u64::MAX)),
            lost: AtomicBool::new(false),
            left: AtomicI64::new(-1),
            raw,
            instance,
        }))
    }

    /// What it is and can do.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Whether copies in the background have a queue of their own.
    pub fn has_background_queue(&self) -> bool {
        self.background.raw != self.queue.raw
    }

    /// How it traces rays.
    pub fn tracer(&self) -> Tracer {
        self.tracer
    }

    /// Keeps what pipelines have been compiled to, for the next run. It never fails: what cannot be kept is compiled again.
    pub(crate) fn keep_pipelines(&self) {
        self.pipelines.keep(&self.raw);
    }

    /// What the validation layers have said so far; `None` without them.
    pub fn messages(&self) -> Option<Messages> {
        self.instance.messenger.as_ref().map(Messenger::messages)
    }

    /// Sets the bound on memory anew; what is in use stays.
    pub fn set_memory_limit(&self, bytes: Option<u64>) {
        self.budget.store(bytes.unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    /// Bytes of buffers and images that are in use.
    pub fn used(&self) -> u64 {
        self.used.load(Ordering::Relaxed)
    }

    /// Takes memory for a buffer or an image.
    pub(crate) fn allocate(&self, what: &AllocationCreateDesc<'static>) -> Result<Allocation> {
        let (bytes, budget) = (what.requirements.size, self.budget.load(Ordering::Relaxed));
        let refuse = |why: String| VulkanError::Allocation { what: what.name, bytes, why };
        if self.used().saturating_add(bytes) > budget {
            return Err(refuse(format!("more than the limit of {budget} bytes of device memory")));
        }
        let allocated = self.allocator.lock().unwrap_or_else(PoisonError::into_inner).allocate(what);
        let allocated = allocated.map_err(|error| refuse(error.to_string()))?;
        self.used.fetch_add(allocated.size(), Ordering::Relaxed);
        Ok(allocated)
    }

    /// Gives it back.
    pub(crate) fn free(&self, allocation: Allocation) {
        self.used.fetch_sub(allocation.size(), Ordering::Relaxed);
        let freed = self.allocator.lock().unwrap_or_else(PoisonError::into_inner).free(allocation);
        debug_assert!(freed.is_ok(), "the allocation came from this allocator");
    }

    /// Whether it was lost: all that is on it is gone, and nothing more can be done with it.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    pub(crate) fn lose(&self) {
        self.lost.store(true, Ordering::Relaxed);
    }

    /// Treats the device as lost after so many further submissions, to see what becomes of its users.
    #[doc(hidden)]
    pub fn lose_after(&self, submissions: u32) {
        self.left.store(submissions.into(), Ordering::Relaxed);
    }

    pub(crate) fn count_submission(&self) {
        if self.left.load(Ordering::Relaxed) >= 0 && self.left.fetch_sub(1, Ordering::Relaxed) == 0 {
            self.lose();
        }
    }

    /// Bytes that are allocated on the device and of mapped host memory, and allocations.
    pub fn allocated(&self) -> (u64, usize) {
        let allocator = self.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        let report = allocator.generate_report();
        (report.total_allocated_bytes, report.allocations.len())
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        let allocator = self.allocator.get_mut().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: it is dropped once, here; all allocations hold the device alive and are gone. Work that was handed in has
        // been waited for by whoever handed it in (`Queue`).
        unsafe {
            ManuallyDrop::drop(allocator);
            self.pipelines.destroy(&self.raw);
            self.raw.destroy_device(None);
        }
    }
}
