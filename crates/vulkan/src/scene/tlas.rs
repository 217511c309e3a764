//! The TLAS over the render nodes, and the pass that writes its instances from their rows.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::accel::{Accel, Pages, Scratch};
use crate::abi::{InstancePush, RowSpan};
use crate::device::Device;
use crate::error::Result;
use crate::memory::{Arena, Commands, Stage, Uploads};
use crate::trace::compute::ComputePipeline;
use ash::vk;
use orthant_resident::batch::TlasAction;
use std::sync::Arc;

/// Bytes of `VkAccelerationStructureInstanceKHR`.
const INSTANCE: usize = 64;

/// See the module.
pub(crate) struct Tlas {
    device: Arc<Device>,
    pages: Pages,
    pub instances: Arena,
    accel: Option<Accel>,
    scratch: Scratch,
    /// Instances that `accel` has room for.
    capacity: u32,
    /// Instances at the last build; an update asks for as many.
    built: u32,
    writer: ComputePipeline,
}

/// Threads of a group of the shader that writes instances.
const WRITER_GROUP: u32 = 64;
/// Spans of one dispatch: a search in more of them takes longer than another dispatch, and their list fits into the ring.
const MOST_SPANS: usize = 1 << 16;

/// Spans of rows, given as (first, count), as dispatches of at most `most` rows: their spans, and how many rows they are.
fn dispatches(spans: &[(u32, u32)], most: u32) -> Vec<(Vec<RowSpan>, u32)> {
    let mut dispatches: Vec<(Vec<RowSpan>, u32)> = Vec::new();
    for &(first, count) in spans {
        let (mut first, mut left) = (first, count);
        while left > 0 {
            if dispatches.last().is_none_or(|(rows, taken)| *taken == most || rows.len() == MOST_SPANS) {
                dispatches.push((Vec::new(), 0));
            }
            let Some((rows, taken)) = dispatches.last_mut() else { break };
            let part = left.min(most - *taken);
            rows.push(RowSpan { first, before: *taken });
            *taken += part;
            (first, left) = (first + part, left - part);
        }
    }
    dispatches
}

impl Tlas {
    pub fn new(device: &Arc<Device>, pages: &Pages) -> Result<Self> {
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        Ok(Self {
            device: device.clone(),
            pages: pages.clone(),
            instances: Arena::new("TLAS instances", INSTANCE, usage),
            accel: None,
            scratch: Scratch::default(),
            capacity: 0,
            built: 0,
            writer: ComputePipeline::new(
                device,
                crate::shaders::INSTANCES,
                c"write_instances",
                size_of::<InstancePush>() as u32,
            )?,
        })
    }

    /// The structure, if there is one.
    pub fn raw(&self) -> Option<vk::AccelerationStructureKHR> {
        self.accel.as_ref().map(|accel| accel.raw)
    }

    /// Bytes of the structure, of the instances, and of scratch memory.
    pub fn bytes(&self) -> (u64, u64, u64) {
        (self.accel.as_ref().map_or(0, |accel| accel.size), self.instances.bytes(), self.scratch.bytes())
    }

    /// Writes the instances of some rows anew, given as (first, count), ascending; there are `len` rows.
    pub fn write_instances(
        &mut self,
        uploads: &mut Uploads<'_>,
        render_nodes: u64,
        blas: &Arena,
        len: u32,
        spans: &[(u32, u32)],
    ) -> Result<()> {
        let (queue, commands) = uploads.parts();
        self.instances.resize(&self.device, queue, commands, len)?;
        let most = self.device.info.limits.max_dispatch.saturating_mul(WRITER_GROUP);
        for (rows, row_count) in dispatches(spans, most) {
            let spans = uploads.place(bytemuck::cast_slice(&rows))?;
            let push = InstancePush {
                render_nodes,
                blas: blas.address(),
                instances: self.instances.address(),
                spans,
                span_count: rows.len() as u32,
                row_count,
                blas_count: blas.len,
                reserved: 0,
            };
            let commands = uploads.commands();
            commands.stage(Stage::Instances);
            commands.full_barrier();
            self.writer.dispatch(commands, bytemuck::bytes_of(&push), row_count.div_ceil(WRITER_GROUP));
            commands.full_barrier();
            commands.stage(Stage::Upload);
        }
        Ok(())
    }

    /// Updates the structure or builds it anew. Whether its handle has changed.
    pub fn follow(&mut self, uploads: &mut Uploads<'_>, action: TlasAction, len: u32) -> Result<bool> {
        if action == TlasAction::None && self.accel.is_some() && self.built == len {
            return Ok(false);
        }
        let update = action == TlasAction::Update && self.built == len && self.accel.is_some();
        let mut replaced = false;
        let geometry = [self.geometry()];
        let mut sizes = self.sizes(&geometry, self.capacity);
        if self.accel.is_none() || len > self.capacity {
            self.capacity = if self.accel.is_some() { len + len / 2 } else { len };
            sizes = self.sizes(&geometry, self.capacity);
            let kind = vk::AccelerationStructureTypeKHR::TOP_LEVEL;
            let new = Accel::new(&self.device, &self.pages, kind, sizes.acceleration_structure_size)?;
            if let Some(old) = self.accel.replace(new) {
                uploads.queue.retire(old);
            }
            replaced = true;
        }
        let Some(accel) = &self.accel else { return Ok(replaced) };
        let update = update && !replaced;
        let (queue, commands) = uploads.parts();
        let room = sizes.build_scratch_size.max(sizes.update_scratch_size);
        let scratch = self.scratch.at_least(&self.device, queue, room)?;
        let mut info = info(&geometry)
            .dst_acceleration_structure(accel.raw)
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch });
        if update {
            info = info.mode(vk::BuildAccelerationStructureModeKHR::UPDATE).src_acceleration_structure(accel.raw);
        }
        let range = vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(len);
        commands.stage(if update { Stage::TlasUpdate } else { Stage::TlasBuild });
        commands.build(&[info], &[[range]]);
        commands.stage(Stage::Upload);
        self.built = len;
        Ok(replaced)
    }

    fn geometry(&self) -> vk::AccelerationStructureGeometryKHR<'static> {
        let data = vk::DeviceOrHostAddressConstKHR { device_address: self.instances.address() };
        let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default().data(data);
        vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { instances })
    }

    fn sizes(
        &self,
        geometry: &[vk::AccelerationStructureGeometryKHR<'static>; 1],
        count: u32,
    ) -> vk::AccelerationStructureBuildSizesInfoKHR<'static> {
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        let kind = vk::AccelerationStructureBuildTypeKHR::DEVICE;
        // SAFETY: what is passed is complete.
        unsafe {
            self.device.accel.get_acceleration_structure_build_sizes(kind, &info(geometry), &[count], &mut sizes);
        }
        sizes
    }
}

fn info<'g>(
    geometry: &'g [vk::AccelerationStructureGeometryKHR<'g>; 1],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'g> {
    use vk::BuildAccelerationStructureFlagsKHR as Flags;
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(vk::AccelerationStructureTypeKHR::TOP_LEVEL)
        .flags(Flags::PREFER_FAST_TRACE | Flags::ALLOW_UPDATE)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometry)
}

impl Commands {
    /// Builds or updates acceleration structures, each of one geometry; all before and after is separated by barriers.
    pub fn build(
        &mut self,
        infos: &[vk::AccelerationStructureBuildGeometryInfoKHR<'_>],
        ranges: &[[vk::AccelerationStructureBuildRangeInfoKHR; 1]],
    ) {
        if infos.is_empty() {
            return;
        }
        self.full_barrier();
        let ranges: Vec<&[_]> = ranges.iter().map(|range| &range[..]).collect();
        // SAFETY: sources, targets and scratch memory live until the commands are done, and were sized for these builds.
        unsafe { self.device().accel.cmd_build_acceleration_structures(self.raw, infos, &ranges) };
        self.full_barrier();
    }

    /// Asks for the compacted sizes of structures that were built before.
    pub fn ask_compacted_sizes(&mut self, structures: &[vk::AccelerationStructureKHR], queries: vk::QueryPool) {
        let kind = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
        // SAFETY: the pool has a query for each, and is reset.
        unsafe {
            self.device().accel.cmd_write_acceleration_structures_properties(self.raw, structures, kind, queries, 0);
        }
    }

    /// Copies a structure to one of its compacted size.
    pub fn copy_compacted(&mut self, from: vk::AccelerationStructureKHR, to: vk::AccelerationStructureKHR) {
        let info = vk::CopyAccelerationStructureInfoKHR::default()
            .src(from)
            .dst(to)
            .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
        // SAFETY: `to` has the size that the device asked for, and both live until the commands are done.
        unsafe { self.device().accel.cmd_copy_acceleration_structure(self.raw, &info) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_rows_than_a_dispatch_takes_go_in_several() {
        let covered = |spans: &[(u32, u32)], most: u32| {
            let mut rows = Vec::new();
            for (spans, count) in dispatches(spans, most) {
                assert!((1..=most).contains(&count));
                let ends = spans.iter().skip(1).map(|span| span.before).chain([count]);
                for (span, end) in spans.iter().zip(ends) {
                    rows.extend(span.first..span.first + (end - span.before));
                }
            }
            rows
        };
        assert_eq!(covered(&[], 4), []);
        assert_eq!(covered(&[(3, 0)], 4), []);
        assert_eq!(covered(&[(0, 4), (9, 1)], 4), [0, 1, 2, 3, 9]);
        assert_eq!(covered(&[(5, 3), (10, 7), (20, 1)], 4), [5, 6, 7, 10, 11, 12, 13, 14, 15, 16, 20]);
        let all: Vec<u32> = (7..1007).collect();
        assert_eq!(covered(&[(7, 1000)], 64), all);
    }
}
