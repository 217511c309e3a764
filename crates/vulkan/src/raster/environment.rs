//! The environment's map, filtered on the device for image-based lighting.

use super::abi::EnvironmentPush;
use crate::device::Device;
use crate::error::Result;
use crate::memory::{Buffer, Commands, Place};
use crate::trace::compute::ComputePipeline;
use ash::vk;
use orthant_resident::environment::EnvironmentMap;
use std::sync::Arc;

// Those of `raster/lat_long.slang`.
const PYRAMID_WIDTH: u32 = 256;
const PYRAMID_LEVELS: u32 = 6;
const PYRAMID_TEXELS: u64 = 43_680;
const FILTERED_WIDTH: [u32; 8] = [128, 128, 64, 32, 32, 32, 32, 32];
const FILTERED_TEXELS: u64 = 20_992;

/// See the module.
pub(super) struct Surroundings {
    begin: ComputePipeline,
    reduce: ComputePipeline,
    filter: ComputePipeline,
    pyramid: Buffer,
    filtered: Buffer,
    /// What was filtered.
    map: Option<Arc<EnvironmentMap>>,
}

impl Surroundings {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let bytes = size_of::<EnvironmentPush>() as u32;
        let pipeline = |entry| ComputePipeline::new(device, crate::shaders::RASTER_ENVIRONMENT, entry, bytes);
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let texels = |count| Buffer::new(device, "filtered environment", 16 * count, usage, Place::Device);
        Ok(Self {
            begin: pipeline(c"begin_pyramid")?,
            reduce: pipeline(c"reduce_pyramid")?,
            filter: pipeline(c"filter_map")?,
            pyramid: texels(PYRAMID_TEXELS)?,
            filtered: texels(FILTERED_TEXELS)?,
            map: None,
        })
    }

    /// The device address of the filtered map.
    pub fn address(&self) -> u64 {
        self.filtered.address
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.pyramid.size + self.filtered.size
    }

    /// Filters a map, if it is another than the last one. Rotation and intensity are no part of it. `lights` is the device
    /// address of a [`crate::abi::LightTable`] with the map.
    pub fn follow(&mut self, commands: &mut Commands, lights: u64, map: Option<&Arc<EnvironmentMap>>) {
        let Some(map) = map else { return };
        if self.map.as_ref().is_some_and(|known| Arc::ptr_eq(known, map) || known == map) {
            return;
        }
        let mut push = EnvironmentPush {
            lights,
            pyramid: self.pyramid.address,
            filtered: self.filtered.address,
            level: 0,
            reserved: 0,
        };
        let groups = |width: u32| (width * width / 2).div_ceil(64);
        commands.full_barrier();
        self.begin.dispatch(commands, bytemuck::bytes_of(&push), groups(PYRAMID_WIDTH));
        for level in 1..PYRAMID_LEVELS {
            commands.full_barrier();
            push.level = level;
            self.reduce.dispatch(commands, bytemuck::bytes_of(&push), groups(PYRAMID_WIDTH >> level));
        }
        commands.full_barrier();
        for (level, width) in (1..).zip(FILTERED_WIDTH) {
            push.level = level;
            self.filter.dispatch(commands, bytemuck::bytes_of(&push), groups(width));
        }
        commands.full_barrier();
        self.map = Some(map.clone());
    }

    /// What is filtered may not be there: the commands that were to do it were not handed in.
    pub fn forget(&mut self) {
        self.map = None;
    }
}
