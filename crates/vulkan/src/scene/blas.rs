//! BLAS: one for each RenderPrimitive with triangles, built from the geometry arenas themselves.
//!
//! Builds go in passes that share a bounded scratch memory. Static geometry is built to be traced and compacted; deformed
//! geometry is built to be updated in its place. Compaction needs sizes that only the device knows: when a scene is loaded
//! the host waits for them, pass by pass, so that memory never holds two copies of everything; after an edit they are
//! asked for later, with the next batch that has the TLAS built anew anyway.

#![allow(unsafe_code, reason = "Vulkan is a C interface")]

use super::accel::{Accel, Pages, Scratch};
use crate::device::Device;
use crate::error::{During, Result};
use crate::memory::{Arena, Stage, Uploads};
use ash::vk;
use orthant_resident::batch::{RowRange, RowWrites};
use orthant_resident::rows::{MeshDesc, MeshFlags};
use std::sync::Arc;
use std::time::Duration;

/// Scratch bytes of one pass, unless a single BLAS asks for more.
const SCRATCH_BUDGET: u64 = 512 << 20;
/// BLAS that one pass builds at most: their number bounds what the host has to describe at once.
const PASS: usize = 4096;
/// A BLAS that is smaller than this is not worth a compaction of its own.
const WORTH_COMPACTION: u64 = 64 << 10;

/// Where the geometry is.
#[derive(Clone, Copy)]
pub(crate) struct Streams {
    pub positions: u64,
    pub indices: u64,
}

struct Blas {
    accel: Accel,
    /// It may be updated in place.
    deformed: bool,
}

/// Sizes that were asked for.
struct Pending {
    submission: u64,
    queries: Queries,
    /// RenderPrimitives, each with the address of what was built: if it is another now, there is nothing to compact.
    built: Vec<(u32, u64)>,
}

/// A pool of queries for compacted sizes.
struct Queries {
    device: Arc<Device>,
    raw: vk::QueryPool,
}

/// All BLAS, by RenderPrimitive.
pub(crate) struct BlasSet {
    device: Arc<Device>,
    pages: Pages,
    blas: Vec<Option<Blas>>,
    /// Their device addresses, for the instances.
    pub addresses: Arena,
    scratch: Scratch,
    pending: Vec<Pending>,
}

/// What following a batch has done.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BlasWork {
    pub built: u32,
    pub updated: u32,
    /// An address has changed that instances may hold.
    pub moved: bool,
}

impl BlasSet {
    pub fn new(device: &Arc<Device>, pages: &Pages) -> Self {
        Self {
            device: device.clone(),
            pages: pages.clone(),
            blas: Vec::new(),
            addresses: Arena::new("the table of BLAS addresses", 8, vk::BufferUsageFlags::empty()),
            scratch: Scratch::default(),
            pending: Vec::new(),
        }
    }

    /// The address of a primitive's BLAS; 0 for none.
    pub fn address(&self, primitive: u32) -> u64 {
        self.blas.get(primitive as usize).and_then(Option::as_ref).map_or(0, |blas| blas.accel.address)
    }

    /// Bytes of the structures, of the table of addresses, and of scratch memory.
    pub fn bytes(&self) -> (u64, u64, u64) {
        let structures = self.blas.iter().flatten().map(|blas| blas.accel.size).sum();
        (structures, self.addresses.bytes(), self.scratch.bytes())
    }

    /// Follows a batch: frees, builds and updates. `loading` says that nothing is in flight and that the host may wait.
    pub fn follow(
        &mut self,
        uploads: &mut Uploads<'_>,
        streams: Streams,
        descs: &[MeshDesc],
        frees: &[u32],
        builds: &[u32],
        updates: &[u32],
        loading: bool,
    ) -> Result<BlasWork> {
        let mut work = BlasWork::default();
        let mut changed: Vec<u32> = Vec::new();
        for gone in descs.len()..self.blas.len() {
            if let Some(blas) = self.blas[gone].take() {
                uploads.queue.retire(blas.accel);
                work.moved = true;
            }
        }
        self.blas.resize_with(descs.len(), || None);
        for &primitive in frees {
            if let Some(blas) = self.blas[primitive as usize].take() {
                uploads.queue.retire(blas.accel);
                changed.push(primitive);
            }
        }
        let (updates, again): (Vec<u32>, Vec<u32>) =
            updates.iter().partition(|&&p| self.blas[p as usize].as_ref().is_some_and(|blas| blas.deformed));
        let has_triangles = |&p: &u32| descs[p as usize].index_count > 0;
        let list: Vec<u32> = builds.iter().chain(&again).copied().filter(has_triangles).collect();
        self.build(uploads, streams, descs, &list, loading)?;
        work.built = list.len() as u32;
        changed.extend(&list);
        self.update(uploads, streams, descs, &updates)?;
        work.updated = updates.len() as u32;
        work.moved |= !changed.is_empty();
        self.write_addresses(uploads, changed)?;
        Ok(work)
    }

    /// Compacts what was built by earlier batches, as far as the device has told the sizes. Whether addresses have changed.
    pub fn compact_pending(&mut self, uploads: &mut Uploads<'_>) -> Result<bool> {
        let done = uploads.queue.done()?;
        let mut changed = Vec::new();
        for pending in std::mem::take(&mut self.pending) {
            if pending.submission > done {
                self.pending.push(pending);
                continue;
            }
            changed.extend(self.compact(uploads, &pending)?);
        }
        let has_changed = !changed.is_empty();
        self.write_addresses(uploads, changed)?;
        Ok(has_changed)
    }

    fn write_addresses(&mut self, uploads: &mut Uploads<'_>, mut changed: Vec<u32>) -> Result<()> {
        let len = self.blas.len() as u32;
        changed.extend(self.addresses.len.min(len)..len);
        changed.sort_unstable();
        changed.dedup();
        let range = |run: &[u32]| RowRange { first: run[0], rows: run.iter().map(|&p| self.address(p)).collect() };
        let ranges = changed.chunk_by(|a, b| a + 1 == *b).map(range).collect();
        let device = self.device.clone();
        uploads.overhead(|uploads| uploads.rows(&device, &mut self.addresses, &RowWrites { len, ranges }).map(|_| ()))
    }

    fn build(
        &mut self,
        uploads: &mut Uploads<'_>,
        streams: Streams,
        descs: &[MeshDesc],
        list: &[u32],
        loading: bool,
    ) -> Result<()> {
        let alignment = self.device.info.limits.scratch_alignment;
        let sizes: Vec<_> = list.iter().map(|&p| self.sizes(streams, &descs[p as usize])).collect();
        let mut at = 0;
        while at < list.len() {
            // A pass: as many as fit.
            let (mut end, mut scratch) = (at, 0);
            while end < list.len() && end - at < PASS {
                let more = sizes[end].build_scratch_size.next_multiple_of(alignment);
                if end > at && scratch + more > SCRATCH_BUDGET {
                    break;
                }
                scratch += more;
                end += 1;
            }
            let (queue, commands) = uploads.parts();
            let mut scratch = self.scratch.at_least(&self.device, queue, scratch)?;
            let mut geometries = Vec::with_capacity(end - at);
            let mut ranges = Vec::with_capacity(end - at);
            let mut targets = Vec::with_capacity(end - at);
            for i in at..end {
                let desc = &descs[list[i] as usize];
                let kind = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
                let accel = Accel::new(&self.device, &self.pages, kind, sizes[i].acceleration_structure_size)?;
                let deformed = desc.flags & MeshFlags::DEFORMED != 0;
                geometries.push([geometry(streams, desc)]);
                ranges.push([range(desc)]);
                targets.push((accel.raw, scratch, deformed));
                scratch += sizes[i].build_scratch_size.next_multiple_of(alignment);
                if let Some(old) = self.blas[list[i] as usize].replace(Blas { accel, deformed }) {
                    queue.retire(old.accel);
                }
            }
            let infos: Vec<_> = geometries
                .iter()
                .zip(&targets)
                .map(|(geometry, &(target, scratch, deformed))| {
                    info(geometry, deformed)
                        .dst_acceleration_structure(target)
                        .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch })
                })
                .collect();
            commands.stage(Stage::BlasBuild);
            commands.build(&infos, &ranges);
            commands.stage(Stage::Upload);
            let compactable: Vec<(u32, u64)> = (at..end)
                .filter(|&i| loading || sizes[i].acceleration_structure_size >= WORTH_COMPACTION)
                .filter(|&i| !targets[i - at].2)
                .map(|i| (list[i], self.address(list[i])))
                .collect();
            self.ask_sizes(uploads, compactable, loading)?;
            at = end;
        }
        Ok(())
    }

    /// Asks for the sizes of what has just been built, and if the host may wait, compacts it.
    fn ask_sizes(&mut self, uploads: &mut Uploads<'_>, built: Vec<(u32, u64)>, wait: bool) -> Result<()> {
        if built.is_empty() {
            return Ok(());
        }
        let queries = Queries::new(&self.device, built.len() as u32)?;
        let raws: Vec<_> =
            built.iter().filter_map(|&(p, _)| self.blas[p as usize].as_ref().map(|blas| blas.accel.raw)).collect();
        uploads.commands().stage(Stage::Compaction);
        uploads.commands().ask_compacted_sizes(&raws, queries.raw);
        uploads.commands().stage(Stage::Upload);
        let pending = Pending { submission: uploads.queue.next(), queries, built };
        if !wait {
            self.pending.push(pending);
            return Ok(());
        }
        let number = uploads.flush()?;
        // SYNC: loading: the sizes of this pass decide where the next one goes; no frame is in flight.
        uploads.queue.wait(number, Duration::MAX)?;
        self.compact(uploads, &pending)?;
        Ok(())
    }

    /// Copies what was built to where it takes less. Which have changed.
    fn compact(&mut self, uploads: &mut Uploads<'_>, pending: &Pending) -> Result<Vec<u32>> {
        let sizes = pending.queries.read(pending.built.len())?;
        let mut changed = Vec::new();
        for (&(primitive, address), size) in pending.built.iter().zip(sizes) {
            let Some(slot) = self.blas.get_mut(primitive as usize) else { continue };
            let Some(old) = slot.take_if(|blas| blas.accel.address == address && size > 0 && size < blas.accel.size)
            else {
                continue;
            };
            let kind = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
            let accel = match Accel::new(&self.device, &self.pages, kind, size) {
                Ok(accel) => accel,
                Err(error) => {
                    *slot = Some(old);
                    return Err(error);
                }
            };
            let (queue, commands) = uploads.parts();
            commands.stage(Stage::Compaction);
            commands.copy_compacted(old.accel.raw, accel.raw);
            queue.retire(old.accel);
            *slot = Some(Blas { accel, deformed: false });
            changed.push(primitive);
        }
        if !changed.is_empty() {
            uploads.commands().full_barrier();
            uploads.commands().stage(Stage::Upload);
        }
        Ok(changed)
    }

    fn update(&mut self, uploads: &mut Uploads<'_>, streams: Streams, descs: &[MeshDesc], list: &[u32]) -> Result<()> {
        let alignment = self.device.info.limits.scratch_alignment;
        for pass in list.chunks(PASS) {
            let sizes: Vec<u64> = pass
                .iter()
                .map(|&p| self.sizes(streams, &descs[p as usize]).update_scratch_size.next_multiple_of(alignment))
                .collect();
            let (queue, commands) = uploads.parts();
            let mut scratch = self.scratch.at_least(&self.device, queue, sizes.iter().sum())?;
            let geometries: Vec<_> = pass.iter().map(|&p| [geometry(streams, &descs[p as usize])]).collect();
            let ranges: Vec<_> = pass.iter().map(|&p| [range(&descs[p as usize])]).collect();
            let mut infos = Vec::with_capacity(pass.len());
            for ((&p, geometry), size) in pass.iter().zip(&geometries).zip(sizes) {
                let Some(blas) = &self.blas[p as usize] else { continue };
                infos.push(
                    info(geometry, true)
                        .mode(vk::BuildAccelerationStructureModeKHR::UPDATE)
                        .src_acceleration_structure(blas.accel.raw)
                        .dst_acceleration_structure(blas.accel.raw)
                        .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch }),
                );
                scratch += size;
            }
            commands.stage(Stage::BlasUpdate);
            commands.build(&infos, &ranges);
            commands.stage(Stage::Upload);
        }
        Ok(())
    }

    fn sizes(&self, streams: Streams, desc: &MeshDesc) -> vk::AccelerationStructureBuildSizesInfoKHR<'static> {
        let geometry = [geometry(streams, desc)];
        let info = info(&geometry, desc.flags & MeshFlags::DEFORMED != 0);
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        let kind = vk::AccelerationStructureBuildTypeKHR::DEVICE;
        // SAFETY: `info` is complete but for addresses, which this does not read.
        unsafe {
            let counts = [desc.triangle_count()];
            self.device.accel.get_acceleration_structure_build_sizes(kind, &info, &counts, &mut sizes);
        }
        sizes
    }
}

/// The triangles of a primitive, in the arenas.
fn geometry(streams: Streams, desc: &MeshDesc) -> vk::AccelerationStructureGeometryKHR<'static> {
    let address = |device_address| vk::DeviceOrHostAddressConstKHR { device_address };
    let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(address(streams.positions + 12 * u64::from(desc.first_vertex)))
        .vertex_stride(12)
        .max_vertex(desc.vertex_count.saturating_sub(1))
        .index_type(vk::IndexType::UINT32)
        .index_data(address(streams.indices + 4 * u64::from(desc.first_index)));
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
        // Each triangle decides once whether it is there (alpha), by a number of its own; instances say whether it has to.
        .flags(vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION)
}

fn range(desc: &MeshDesc) -> vk::AccelerationStructureBuildRangeInfoKHR {
    vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(desc.triangle_count())
}

fn info<'g>(
    geometry: &'g [vk::AccelerationStructureGeometryKHR<'g>; 1],
    deformed: bool,
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'g> {
    use vk::BuildAccelerationStructureFlagsKHR as Flags;
    let flags = if deformed {
        Flags::PREFER_FAST_BUILD | Flags::ALLOW_UPDATE
    } else {
        Flags::PREFER_FAST_TRACE | Flags::ALLOW_COMPACTION
    };
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL)
        .flags(flags)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometry)
}

impl Queries {
    fn new(device: &Arc<Device>, count: u32) -> Result<Self> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR)
            .query_count(count);
        // SAFETY: the device lives and has the extension.
        let raw = unsafe { device.raw.create_query_pool(&info, None) }.during("cannot make queries")?;
        // SAFETY: nothing uses it yet.
        unsafe { device.raw.reset_query_pool(raw, 0, count) };
        Ok(Self { device: device.clone(), raw })
    }

    fn read(&self, count: usize) -> Result<Vec<u64>> {
        let mut sizes = vec![0u64; count];
        // SYNC: the flag asks for a wait, but the submission is done: the host knows.
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the pool has this many queries, and all were written.
        unsafe { self.device.raw.get_query_pool_results(self.raw, 0, &mut sizes, flags) }
            .during("cannot read the sizes of acceleration structures")?;
        Ok(sizes)
    }
}

impl Drop for Queries {
    fn drop(&mut self) {
        // SAFETY: it is dropped when its submission is done, or with the scene, after everything.
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}
