//! How the writes of a list reach the arenas.
//!
//! The active set is written by a compute pass, in the order of frames: a list is read where it lies in the staging ring, and
//! every thread writes 16 bytes of a row or a word of payload. The staging set is written by copies, which the queue of a copy
//! engine can do too: writes to neighbouring slots are one copy, and what fills a set is mostly that.

use super::abi::{ScatterPush, WorldTable};
use super::list::{List, ROW};
use crate::error::Result;
use crate::memory::{Commands, Order, Stage, Uploads};
use crate::trace::compute::ComputePipeline;
use ash::vk;

/// Threads of a group of the pass.
const GROUP: usize = 64;

/// Where an arena is, as a buffer and as a device address: nodes, leaves, payload, palette.
pub(super) type Targets = [(vk::Buffer, u64); 4];

/// See the module.
pub(super) enum Writer<'p> {
    /// By the compute pass.
    Scatter(&'p ComputePipeline),
    /// By copies.
    Copies,
}

impl Writer<'_> {
    /// What it is measured as.
    pub fn stage(&self) -> Stage {
        match self {
            Self::Scatter(_) => Stage::WorldScatter,
            Self::Copies => Stage::WorldStaging,
        }
    }

    /// What its writes wait for.
    pub fn order(&self) -> Order {
        match self {
            Self::Scatter(_) => Order::Frames,
            Self::Copies => Order::Background,
        }
    }

    /// Between copies to an arena's new place and writes there.
    pub fn after_growth(&self, commands: &mut Commands) {
        match self {
            Self::Scatter(_) => commands.full_barrier(),
            Self::Copies => commands.transfer_barrier(),
        }
    }

    /// Puts a list into the ring and has it written. How many commands that took.
    pub fn write(&self, uploads: &mut Uploads<'_>, targets: Targets, list: &List<'_>) -> Result<u64> {
        match self {
            Self::Scatter(pipeline) => scatter(pipeline, uploads, targets, list),
            Self::Copies => copy(uploads, targets, list),
        }
    }
}

fn scatter(pipeline: &ComputePipeline, uploads: &mut Uploads<'_>, targets: Targets, list: &List<'_>) -> Result<u64> {
    let (_, address) = uploads.put(list.bytes() as u64, |to| list.write(to))?;
    let [nodes, leaves, payload, palette] = targets.map(|(_, address)| address);
    let push = ScatterPush {
        world: WorldTable { nodes, leaves, payload, palette, ..WorldTable::default() },
        list: address,
        node_rows: list.nodes.len() as u32,
        leaf_rows: list.leaves.len() as u32,
        palette_rows: list.palette.len() as u32,
        span_count: list.spans.len() as u32,
        word_count: list.words() as u32,
        reserved: 0,
    };
    let threads = list.rows() * (ROW / 16) + list.words();
    pipeline.dispatch(uploads.commands(), bytemuck::bytes_of(&push), threads.div_ceil(GROUP) as u32);
    Ok(1)
}

fn copy(uploads: &mut Uploads<'_>, targets: Targets, list: &List<'_>) -> Result<u64> {
    let (place, _) = uploads.put(list.content_bytes() as u64, |to| list.write_content(to))?;
    let row = ROW as u64;
    let slots = [
        (0, list.nodes.iter().map(|write| write.0).collect::<Vec<_>>()),
        (1, list.leaves.iter().map(|write| write.0).collect()),
        (3, list.palette.iter().map(|write| write.0).collect()),
    ];
    let (ring, mut at, mut commands) = (uploads.ring(), place, 0);
    let mut copy = |to: usize, parts: &[vk::BufferCopy]| {
        if !parts.is_empty() {
            uploads.commands().copy(ring, targets[to].0, parts);
            commands += 1;
        }
    };
    for (to, slots) in slots {
        copy(to, &parts(slots.iter().map(|&slot| (u64::from(slot) * row, row)), &mut at));
    }
    let words = list.spans.iter().map(|&(first, words)| (4 * u64::from(first), 4 * words.len() as u64));
    copy(2, &parts(words, &mut at));
    Ok(commands)
}

/// Stretches of an arena (place and size) as copies from the ring, where they lie one after the other from `at` on.
fn parts(stretches: impl Iterator<Item = (u64, u64)>, at: &mut u64) -> Vec<vk::BufferCopy> {
    let mut parts: Vec<vk::BufferCopy> = Vec::new();
    for (to, size) in stretches {
        match parts.last_mut().filter(|part| part.dst_offset + part.size == to) {
            Some(part) => part.size += size,
            None => parts.push(vk::BufferCopy { src_offset: *at, dst_offset: to, size }),
        }
        *at += size;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_to_neighbouring_slots_are_one_copy() {
        let mut at = 1000;
        let found = parts([(0, 80), (80, 80), (240, 80), (320, 40)].into_iter(), &mut at);
        let found: Vec<_> = found.iter().map(|part| (part.src_offset, part.dst_offset, part.size)).collect();
        assert_eq!(found, [(1000, 0, 160), (1160, 240, 120)]);
        assert_eq!(at, 1280);
    }
}
