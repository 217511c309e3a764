//! [`WorldSet`]: the arenas of a world on the device.

use super::abi::WorldTable;
use super::frame::Contents;
use super::list::List;
use super::write::Writer;
use crate::device::Device;
use crate::error::{Result, VulkanError};
use crate::memory::{Arena, Buffer, Commands, Queue, Staging, Uploads};
use orthant_resident::BackendError;
use orthant_resident::world::arenas::check_batch;
use orthant_resident::world::{ArenaLens, MutationBatch, Root, WorldApplied, WorldBytes};
use std::sync::Arc;

/// Bytes of the staging ring that one list takes at most: while the device follows it, the host writes the next.
const PIECE: usize = 4 << 20;

/// A set of arenas. What of them is past their length is zero.
pub(super) struct WorldSet {
    pub device: Arc<Device>,
    pub origin: [i64; 4],
    pub root: Root,
    pub revision: u64,
    /// Nodes, leaves, payload, palette.
    pub arenas: [Arena; 4],
    /// Bytes that the arenas may take together.
    pub most: u64,
    /// What rays have to reckon with.
    pub contents: Contents,
    /// The last submission of the background queue that writes here.
    pub filled: u64,
    /// A batch failed when a part of it was on its way: the set is in no state.
    broken: Option<VulkanError>,
}

/// What writing a batch took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Written {
    pub bytes: u64,
    pub commands: u64,
    pub submissions: u64,
    pub grown: u64,
}

/// Larger buffers in the place of those without room, as far as they are needed.
type Growth = [Option<Buffer>; 4];

fn rows(lens: ArenaLens) -> [u32; 4] {
    [lens.nodes, lens.leaves, lens.payload, lens.palette]
}

/// Rows with room for edits, so that the first of them need not move the arenas: an eighth, and at least some hundred edits'.
fn with_slack(lens: ArenaLens) -> [u32; 4] {
    const LEAST: [u32; 4] = [1 << 10, 1 << 10, 1 << 16, 1 << 6];
    let rows = rows(lens);
    std::array::from_fn(|i| rows[i].saturating_add((rows[i] / 8).max(LEAST[i])))
}

impl WorldSet {
    /// An empty one, which takes no memory, and will take at most so many bytes.
    pub fn new(device: &Arc<Device>, origin: [i64; 4], most: u64) -> Self {
        let arenas = [("nodes of a world", 80), ("leaves of a world", 80), ("the payload of a world", 4)];
        let arenas = arenas.map(|(what, stride)| Arena::shared(what, stride));
        let [nodes, leaves, payload] = arenas;
        Self {
            device: device.clone(),
            origin,
            root: Root::EMPTY,
            revision: 0,
            arenas: [nodes, leaves, payload, Arena::shared("materials of a world", 80)],
            most,
            contents: Contents::default(),
            filled: 0,
            broken: None,
        }
    }

    /// Lengths of the arenas.
    pub fn lens(&self) -> ArenaLens {
        let [nodes, leaves, payload, palette] = self.arenas.each_ref().map(|arena| arena.len);
        ArenaLens { nodes, leaves, payload, palette }
    }

    /// What they take on the device, with what is free in them.
    pub fn bytes(&self) -> WorldBytes {
        let [nodes, leaves, payload, palette] = self.arenas.each_ref().map(Arena::bytes);
        WorldBytes { nodes, leaves, payload, palette }
    }

    /// Where everything is, for shaders.
    pub fn table(&self) -> WorldTable {
        let lens = self.lens();
        WorldTable {
            nodes: self.arenas[0].address(),
            leaves: self.arenas[1].address(),
            payload: self.arenas[2].address(),
            palette: self.arenas[3].address(),
            origin: self.origin,
            root: self.root,
            node_count: lens.nodes,
            leaf_count: lens.leaves,
            payload_count: lens.payload,
            palette_count: lens.palette,
            reserved: 0,
        }
    }

    /// That nothing can be done with it, if so.
    pub fn usable(&self) -> std::result::Result<(), BackendError> {
        match &self.broken {
            Some(error) => Err(error.as_backend_error(format!("an earlier batch of this world failed: {error}"))),
            None => Ok(()),
        }
    }

    /// Takes memory for lengths that are to come, and a little more. An error leaves the set as it is.
    pub fn reserve(&mut self, queue: &mut Queue, ring: &mut Staging, lens: ArenaLens) -> Result<Written> {
        let growth = self.growth(with_slack(lens))?;
        let before = queue.last();
        let mut written = Written::default();
        let outcome = self.record(queue, ring, &Writer::Copies, &growth, &[], &mut written);
        self.settle(queue, before, growth, outcome)?;
        written.submissions = queue.last() - before;
        Ok(written)
    }

    /// Brings the set up to date, by a queue and its ring. An error leaves it as it is, except when the device gives up in the
    /// middle of a batch that is more than the ring takes at once: the set is then in no state, and says so.
    pub fn apply(
        &mut self,
        queue: &mut Queue,
        ring: &mut Staging,
        writer: &Writer<'_>,
        batch: &MutationBatch,
    ) -> std::result::Result<(WorldApplied, Written), BackendError> {
        check_batch(batch, self.root, self.revision, self.lens())?;
        self.usable()?;
        let growth = self.growth(rows(batch.lens))?;
        let before = queue.last();
        let mut written = Written::default();
        let lists = List::all(batch, PIECE);
        if !lists.is_empty() || growth.iter().any(Option::is_some) {
            let outcome = self.record(queue, ring, writer, &growth, &lists, &mut written);
            self.settle(queue, before, growth, outcome)?;
        }
        for (arena, len) in self.arenas.iter_mut().zip(rows(batch.lens)) {
            arena.len = len;
        }
        (self.root, self.revision) = (batch.new_root, batch.new_revision);
        self.contents.add(batch);
        written.submissions = queue.last() - before;
        Ok((WorldApplied { bytes: written.bytes }, written))
    }

    /// Buffers for arenas that have no room for so many rows.
    fn growth(&self, rows: [u32; 4]) -> Result<Growth> {
        let asked: u64 = self.arenas.iter().zip(rows).map(|(arena, rows)| u64::from(rows) * arena.stride()).sum();
        if asked > self.most {
            return Err(VulkanError::ArenaFull { what: "the arenas of a world", bytes: asked, most: self.most });
        }
        let mut growth = Growth::default();
        for ((arena, rows), new) in self.arenas.iter().zip(rows).zip(&mut growth) {
            *new = arena.allocate(&self.device, rows)?;
        }
        Ok(growth)
    }

    fn record(
        &self,
        queue: &mut Queue,
        ring: &mut Staging,
        writer: &Writer<'_>,
        growth: &Growth,
        lists: &[List<'_>],
        written: &mut Written,
    ) -> Result<()> {
        let mut uploads = Uploads::begin_stage(queue, ring, writer.stage(), writer.order())?;
        self.record_growth(uploads.commands(), growth, written);
        if written.grown > 0 {
            writer.after_growth(uploads.commands());
        }
        let targets = std::array::from_fn(|i| match &growth[i] {
            Some(new) => (new.raw, new.address),
            None => (self.arenas[i].raw(), self.arenas[i].address()),
        });
        for (i, list) in lists.iter().enumerate() {
            if i > 0 {
                uploads.flush()?;
            }
            written.commands += writer.write(&mut uploads, targets, list)?;
        }
        written.bytes += uploads.bytes;
        uploads.finish()?;
        Ok(())
    }

    /// Has rows copied to where the arenas go, and the rest of it cleared.
    fn record_growth(&self, commands: &mut Commands, growth: &Growth, written: &mut Written) {
        for (arena, new) in self.arenas.iter().zip(growth) {
            let Some(new) = new else { continue };
            arena.copy_to(commands, new);
            let live = u64::from(arena.len) * arena.stride();
            commands.fill(new.raw, live, new.size - live, 0);
            commands.transfer_barrier();
            written.commands += if live > 0 { 2 } else { 1 };
            written.grown += 1;
        }
    }

    /// Takes over what has grown once everything was handed in; else gives it up.
    fn settle(&mut self, queue: &mut Queue, before: u64, growth: Growth, outcome: Result<()>) -> Result<()> {
        let last = queue.last();
        if let Err(error) = outcome {
            queue.retire_after(last, growth);
            if last > before {
                self.broken = Some(error.clone());
            }
            return Err(error);
        }
        for (arena, new) in self.arenas.iter_mut().zip(growth) {
            if let Some(old) = new.and_then(|new| arena.adopt(new)) {
                queue.retire_after(last, old);
            }
        }
        Ok(())
    }
}
