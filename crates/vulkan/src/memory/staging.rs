//! [`Staging`]: the ring of mapped memory through which bytes go to the device, and [`Uploads`]: one batch's use of it.

use super::{Arena, Buffer, Commands, Place, Queue, Stage};
use crate::device::Device;
use crate::error::{Result, VulkanError};
use ash::vk;
use orthant_resident::batch::{RowRange, RowWrites};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// The ring. What lies between `tail` and `head` (both count bytes from the start, and never go back) is in use.
pub(crate) struct Staging {
    buffer: Buffer,
    head: u64,
    tail: u64,
    /// Up to where the ring is in use by a submission and those before it.
    marks: VecDeque<(u64, u64)>,
    /// Bytes that went through it so far.
    pub bytes: u64,
}

/// Rows that lie apart and are no more than this take one piece of the ring, and one command.
const TOGETHER: u64 = 1 << 20;

/// Texel copies ask for at most this alignment.
const ALIGNMENT: u64 = 16;

impl Staging {
    pub fn new(device: &Arc<Device>, size: u64) -> Result<Self> {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::STORAGE_BUFFER;
        let buffer = Buffer::new(device, "the staging ring", size.next_multiple_of(ALIGNMENT), usage, Place::Upload)?;
        Ok(Self { buffer, head: 0, tail: 0, marks: VecDeque::new(), bytes: 0 })
    }

    /// Begins at the start again where nothing is in use, so that a piece as large as the ring finds room in it.
    fn begin_again(&mut self) {
        if self.marks.is_empty() {
            (self.head, self.tail) = (0, 0);
        }
    }

    /// Room for up to `wanted` bytes in one piece: its place in the ring, and how many there are, at least `least`. `None`
    /// while less is free.
    fn take(&mut self, wanted: u64, least: u64) -> Option<(u64, u64)> {
        let size = self.buffer.size;
        let head = self.head.next_multiple_of(ALIGNMENT);
        let (at, to_end) = (head % size, size - head % size);
        let free = |head: u64| size.saturating_sub(head - self.tail);
        let here = to_end.min(free(head)).min(wanted);
        if here >= least {
            self.head = head + here;
            return Some((at, here));
        }
        // Begin again at the start.
        let head = head + to_end;
        let here = free(head).min(wanted);
        (head >= self.tail && free(head) <= size && here >= least).then(|| {
            self.head = head + here;
            (0, here)
        })
    }

    /// All that was taken so far is free when a submission is done.
    fn mark(&mut self, number: u64) {
        self.marks.push_back((number, self.head));
    }

    fn collect(&mut self, done: u64) {
        while let Some(&(number, head)) = self.marks.front() {
            if number > done {
                break;
            }
            self.tail = head;
            self.marks.pop_front();
        }
    }
}

/// Bytes on their way to the device. When the ring is full, what is recorded is handed in, and the host waits for the oldest
/// submission: nothing is limited by the ring's size.
pub(crate) struct Uploads<'q> {
    pub queue: &'q mut Queue,
    staging: &'q mut Staging,
    order: Order,
    commands: Option<Commands>,
    /// Bytes of the batch that went through the ring.
    pub bytes: u64,
    /// Bytes that went through it besides: images, addresses, what the batch does not name.
    pub extra: u64,
}

/// What uploads wait for on the device, and what waits for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// They come after everything that was handed in before them, and before everything after: they write what frames read.
    Frames,
    /// They come after one another. No frame reads what they write before a semaphore says that it is there.
    Background,
}

impl<'q> Uploads<'q> {
    /// Begins; what follows waits on the device for the frames before it.
    pub fn begin(queue: &'q mut Queue, staging: &'q mut Staging) -> Result<Self> {
        Self::begin_stage(queue, staging, Stage::Upload, Order::Frames)
    }

    /// Begins a stage that is measured by itself.
    pub fn begin_stage(queue: &'q mut Queue, staging: &'q mut Staging, stage: Stage, order: Order) -> Result<Self> {
        let commands = begin(queue, order, Some(stage))?;
        Ok(Self { queue, staging, order, commands: Some(commands), bytes: 0, extra: 0 })
    }

    /// The commands under way.
    pub fn commands(&mut self) -> &mut Commands {
        self.commands.as_mut().expect("commands are taken at the end only")
    }

    /// The queue and the commands under way.
    pub fn parts(&mut self) -> (&mut Queue, &mut Commands) {
        (self.queue, self.commands.as_mut().expect("commands are taken at the end only"))
    }

    /// Puts bytes into the ring, in pieces of at least `granule` bytes, and has each copied by `record` (buffer, place in it,
    /// offset of the piece in `bytes`, length).
    pub fn write(
        &mut self,
        bytes: &[u8],
        granule: u64,
        mut record: impl FnMut(&mut Commands, vk::Buffer, u64, u64, u64),
    ) -> Result<()> {
        let mut at = 0;
        while at < bytes.len() as u64 {
            let (place, room) = self.room(bytes.len() as u64 - at, granule)?;
            let room = if at + room < bytes.len() as u64 { room / granule * granule } else { room };
            let (from, to) = (at as usize, (at + room) as usize);
            self.staging.buffer.mapped_mut()[place as usize..(place + room) as usize].copy_from_slice(&bytes[from..to]);
            let raw = self.staging.buffer.raw;
            record(self.commands.as_mut().expect("commands are taken at the end only"), raw, place, at, room);
            at += room;
        }
        self.bytes += bytes.len() as u64;
        self.staging.bytes += bytes.len() as u64;
        Ok(())
    }

    /// Counts what a function writes as no part of the batch.
    pub fn overhead<T>(&mut self, write: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        let before = self.bytes;
        let result = write(self);
        self.extra += self.bytes - before;
        self.bytes = before;
        result
    }

    /// Puts a few bytes into the ring, to be read by shaders: their device address.
    pub fn place(&mut self, bytes: &[u8]) -> Result<u64> {
        let (place, room) = self.room(bytes.len() as u64, bytes.len() as u64)?;
        self.staging.buffer.mapped_mut()[place as usize..(place + room) as usize].copy_from_slice(bytes);
        self.extra += room;
        self.staging.bytes += room;
        Ok(self.staging.buffer.address + place)
    }

    /// Has bytes written to the ring in one piece: where they are, as a place in [`Uploads::ring`] and as a device address.
    pub fn put(&mut self, size: u64, write: impl FnOnce(&mut [u8])) -> Result<(u64, u64)> {
        let (place, _) = self.room(size, size)?;
        write(&mut self.staging.buffer.mapped_mut()[place as usize..(place + size) as usize]);
        self.bytes += size;
        self.staging.bytes += size;
        Ok((place, self.staging.buffer.address + place))
    }

    /// The buffer of the ring.
    pub fn ring(&self) -> vk::Buffer {
        self.staging.buffer.raw
    }

    fn room(&mut self, wanted: u64, least: u64) -> Result<(u64, u64)> {
        let least = least.min(wanted);
        if least > self.staging.buffer.size {
            let what = format!("a piece of {least} bytes is larger than the staging ring; split the scene");
            return Err(VulkanError::Limit(what));
        }
        loop {
            self.staging.collect(self.queue.done()?);
            if let Some(found) = self.staging.take(wanted, least) {
                return Ok(found);
            }
            self.flush()?;
            if let Some(&(oldest, _)) = self.staging.marks.front() {
                // SYNC: back-pressure: more bytes are on their way than the ring holds.
                self.queue.wait(oldest, Duration::MAX)?;
            }
            self.staging.collect(self.queue.done()?);
            self.staging.begin_again();
        }
    }

    /// Hands in what is recorded, and goes on with new commands.
    pub fn flush(&mut self) -> Result<u64> {
        let stage = self.commands().current_stage();
        let number = self.submit()?;
        self.commands = Some(begin(self.queue, self.order, stage)?);
        Ok(number)
    }

    fn submit(&mut self) -> Result<u64> {
        let Some(mut commands) = self.commands.take() else { return Ok(self.queue.last()) };
        if self.order == Order::Frames {
            commands.full_barrier();
        }
        let number = self.queue.submit(commands)?;
        self.staging.mark(number);
        Ok(number)
    }

    /// Hands in the rest.
    pub fn finish(mut self) -> Result<(u64, u64)> {
        let number = self.submit()?;
        Ok((number, self.bytes))
    }

    /// Writes rows of an arena, which grows to the length that they say. Whether it has moved.
    pub fn rows<T: bytemuck::Pod>(
        &mut self,
        device: &Arc<Device>,
        arena: &mut Arena,
        writes: &RowWrites<T>,
    ) -> Result<bool> {
        let (queue, commands) = self.parts();
        let moved = arena.resize(device, queue, commands, writes.len)?;
        let stride = arena.stride();
        let raw = arena.raw();
        let rows: usize = writes.ranges.iter().map(|range| range.rows.len()).sum();
        if writes.ranges.len() > 1 && rows as u64 * stride <= TOGETHER {
            self.scattered(raw, stride, &writes.ranges, rows as u64 * stride)?;
            return Ok(moved);
        }
        for range in &writes.ranges {
            let first = u64::from(range.first) * stride;
            self.write(bytemuck::cast_slice(&range.rows), stride, |commands, from, place, at, size| {
                let part = vk::BufferCopy { src_offset: place, dst_offset: first + at, size };
                commands.copy(from, raw, &[part]);
            })?;
        }
        Ok(moved)
    }

    /// Writes ranges that lie apart in one piece of the ring, and has them copied by one command.
    fn scattered<T: bytemuck::Pod>(
        &mut self,
        to: vk::Buffer,
        stride: u64,
        ranges: &[RowRange<T>],
        bytes: u64,
    ) -> Result<()> {
        if bytes == 0 {
            return Ok(());
        }
        let (mut place, _) = self.room(bytes, bytes)?;
        let mut parts = Vec::with_capacity(ranges.len());
        for range in ranges.iter().filter(|range| !range.rows.is_empty()) {
            let rows: &[u8] = bytemuck::cast_slice(&range.rows);
            let size = rows.len() as u64;
            self.staging.buffer.mapped_mut()[place as usize..(place + size) as usize].copy_from_slice(rows);
            parts.push(vk::BufferCopy { src_offset: place, dst_offset: u64::from(range.first) * stride, size });
            place += size;
        }
        let raw = self.staging.buffer.raw;
        self.commands().copy(raw, to, &parts);
        self.bytes += bytes;
        self.staging.bytes += bytes;
        Ok(())
    }
}

fn begin(queue: &mut Queue, order: Order, stage: Option<Stage>) -> Result<Commands> {
    let mut commands = queue.begin()?;
    match order {
        Order::Frames => commands.begin_writes(),
        Order::Background => commands.transfer_barrier(),
    }
    commands.stage(stage);
    Ok(commands)
}

impl Drop for Uploads<'_> {
    fn drop(&mut self) {
        // An error on the way: what is recorded so far is not handed in.
        if let Some(commands) = self.commands.take() {
            self.queue.abandon(commands);
        }
    }
}
