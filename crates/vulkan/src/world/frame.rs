//! A frame that shows a world: what it writes and reads beside a frame's film.

use super::abi::WorldTable;
use super::pipeline::{Pass, Variant, WorldPipelines};
use super::view::{LayerRow, WorldFrame, WorldPush};
use crate::abi::{Address, TracePush};
use crate::error::{Result, VulkanError};
use crate::memory::{Buffer, Commands, Place};
use crate::trace::RayTracer;
use ash::vk;
use orthant_resident::Frame;
use orthant_resident::frame::Aov;
use orthant_resident::world::{BlockRow, LeafRow, MutationBatch, Shade, WorldCounts, WorldView, rows};

/// Sets of eight counters of one dispatch; `COUNTER_SETS` of the shaders.
const COUNTER_SETS: u64 = 64;
/// Bytes of them.
const COUNTERS: u64 = 32 * COUNTER_SETS;
/// Bytes that one command may carry, as whole layers.
const UPDATE: usize = 65_536 / size_of::<LayerRow>() * size_of::<LayerRow>();

/// What rays have to reckon with in a set. It is never taken back while the set lives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Contents {
    /// Transparent materials.
    pub has_media: bool,
    /// Chunks of more than one block.
    pub has_chunks: bool,
}

impl Contents {
    /// Adds what a batch brings.
    pub fn add(&mut self, batch: &MutationBatch) {
        let is_medium = |row: &BlockRow| row.flags & rows::flags::TRANSPARENT != 0;
        let is_dense = |leaf: &LeafRow| leaf.kind() == rows::kind::CHUNK_ARRAY && leaf.payload != rows::NO_PAYLOAD;
        self.has_media |= batch.palette_writes.iter().any(|(_, row)| is_medium(row));
        self.has_chunks |= batch.leaf_writes.iter().any(|(_, leaf)| is_dense(leaf));
    }
}

/// The set that a frame shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WorldSource {
    pub table: WorldTable,
    pub contents: Contents,
    /// A frame shows the scene that is resident too.
    pub with_scene: bool,
}

/// See the module.
pub(crate) struct WorldPart {
    buffer: Buffer,
    counters: Buffer,
    read_counters: Buffer,
    shading: Shading,
    layers: u32,
}

/// How hits are shaded.
#[derive(Clone, Copy)]
enum Shading {
    Preview(Variant),
    Paths { with_scene: bool },
}

/// Where layers begin in the buffer: after the [`WorldFrame`].
const LAYERS_AT: u64 = 512;
const _: () = assert!(size_of::<WorldFrame>() as u64 <= LAYERS_AT);

impl WorldPart {
    /// Makes its buffers and pipelines, and has them filled by `commands`. `ahead` dispatches may be under way at once.
    pub fn new(
        commands: &mut Commands,
        pipelines: &mut WorldPipelines,
        images: vk::DescriptorSetLayout,
        frame: &Frame,
        view: &WorldView,
        source: &WorldSource,
        ahead: u64,
    ) -> Result<Self> {
        let width = frame.tile.width;
        if width > pipelines.widest() {
            return Err(VulkanError::Limit(format!(
                "rows of {width} pixels are wider than the device's {}; render the image by tiles",
                pipelines.widest()
            )));
        }
        let layers = view.layers.len() as u32;
        let shading = if view.shade == Shade::Path {
            pipelines.prepare_paths(images, source.with_scene)?;
            Shading::Paths { with_scene: source.with_scene }
        } else {
            let averaged = |aov: &Aov| matches!(aov, Aov::Albedo | Aov::Normal);
            let variant = Variant {
                has_media: source.contents.has_media,
                has_chunks: source.contents.has_chunks,
                has_averages: frame.aovs.iter().any(averaged),
                layer_slots: pipelines.slots(layers),
            };
            pipelines.prepare(variant, frame.aovs.iter().any(|aov| !averaged(aov)))?;
            Shading::Preview(variant)
        };
        let device = &pipelines.device().clone();
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let rows: Vec<LayerRow> = view.layers.iter().map(LayerRow::new).collect();
        let rows: &[u8] = bytemuck::cast_slice(&rows);
        let buffer = Buffer::new(device, "a view of a world", LAYERS_AT + rows.len() as u64, usage, Place::Device)?;
        let counters = Buffer::new(device, "counters of a world", COUNTERS * ahead, usage, Place::Device)?;
        let read_counters = Buffer::new(device, "counters of a world", COUNTERS * ahead, usage, Place::Readback)?;
        let table = WorldFrame {
            layers: buffer.address + LAYERS_AT,
            counters: counters.address,
            place: if source.with_scene { frame.camera.position } else { [0.0; 3] },
            ..WorldFrame::new(view, source.table)
        };
        commands.update(buffer.raw, 0, bytemuck::bytes_of(&table));
        for (i, part) in rows.chunks(UPDATE).enumerate() {
            commands.update(buffer.raw, LAYERS_AT + (i * UPDATE) as u64, part);
        }
        Ok(Self { buffer, counters, read_counters, shading, layers })
    }

    /// Layers of each sample.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Whether it is shaded without light transport.
    pub fn is_preview(&self) -> bool {
        matches!(self.shading, Shading::Preview(_))
    }

    /// What traces its paths, if it has any.
    pub fn paths<'p>(&self, pipelines: &'p WorldPipelines) -> Option<&'p RayTracer> {
        match self.shading {
            Shading::Preview(_) => None,
            Shading::Paths { with_scene } => pipelines.paths(with_scene),
        }
    }

    /// Seconds that a ray is expected to take, if that is known.
    pub fn pace(&self, pipelines: &WorldPipelines) -> Option<f64> {
        pipelines.pace.filter(|_| self.is_preview())
    }

    /// The push constants of a dispatch of so many rows.
    pub fn push(&self, trace: TracePush, rows: u32) -> WorldPush {
        WorldPush { trace, world: self.address(), rows, reserved: 0 }
    }

    /// Of the [`WorldFrame`].
    pub fn address(&self) -> Address {
        self.buffer.address
    }

    /// Clears the counters of a dispatch.
    pub fn clear_counters(&self, commands: &mut Commands, slot: u32) {
        commands.fill(self.counters.raw, u64::from(slot) * COUNTERS, COUNTERS, 0);
    }

    /// Has the counters of a dispatch copied to where the host reads them.
    pub fn copy_counters(&self, commands: &mut Commands, slot: u32) {
        let at = u64::from(slot) * COUNTERS;
        let copy = vk::BufferCopy { src_offset: at, dst_offset: at, size: COUNTERS };
        commands.copy(self.counters.raw, self.read_counters.raw, &[copy]);
    }

    /// What a dispatch that is done has counted.
    pub fn counts(&self, slot: u32) -> WorldCounts {
        let at = slot as usize * COUNTERS as usize;
        let counters: &[u32] = bytemuck::cast_slice(&self.read_counters.mapped()[at..at + COUNTERS as usize]);
        let of = |k: usize| counters.iter().skip(k).step_by(8).map(|&count| u64::from(count)).sum::<u64>();
        WorldCounts { rays: of(0), node_visits: of(1), leaf_visits: of(2), dda_steps: of(3), exhausted: of(4) }
    }

    /// Records a pass of a preview over `rows` rows of the tile.
    pub fn record(
        &self,
        commands: &mut Commands,
        pipelines: &WorldPipelines,
        pass: Pass,
        trace: TracePush,
        (width, rows): (u32, u32),
    ) {
        let Shading::Preview(variant) = self.shading else { return };
        pipelines.record(commands, pass, variant, self.push(trace, rows), width);
    }
}
