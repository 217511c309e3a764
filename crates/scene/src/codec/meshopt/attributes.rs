//! Appendix A, mode 0: elements of any kind, as differences to the element before, byte position by byte position.

use super::reader::Reader;
use super::{MeshoptError, Mode};

/// Elements whose differences are packed together.
const GROUP: usize = 16;
/// Most elements of a block.
const MAX_BLOCK: usize = 256;
/// Bytes of a channel: four byte positions share the way in which their differences are taken.
const CHANNEL: usize = 4;

/// What the versions of the stream differ in.
pub(super) struct Layout {
    v1: bool,
    stride: usize,
    /// Bytes at the end of the stream, padding included.
    tail: usize,
}

/// How the differences of one byte position are stored in a block.
#[derive(Clone, Copy)]
enum Packing {
    /// By the widths of these bits, two header bits a group.
    Widths([u8; 4]),
    /// All are 0, and nothing is stored.
    Zero,
    /// As bytes, without headers.
    Bytes,
}

/// The layout of a stream, if the data is long enough for `count` elements of `stride` bytes.
pub(super) fn check(data: &[u8], count: usize, stride: usize) -> Result<Layout, MeshoptError> {
    let layout = match data.first() {
        None => return Err(MeshoptError::TooShort { count, needed: 1, available: 0 }),
        Some(0xa0) => Layout { v1: false, stride, tail: stride.max(32) },
        Some(0xa1) => Layout { v1: true, stride, tail: (stride + stride / CHANNEL).max(24) },
        Some(&found) => {
            return Err(MeshoptError::Header { found, mode: Mode::Attributes, expected: "0xa0 or 0xa1" });
        }
    };
    let needed = layout.least_length(count);
    if (data.len() as u64) < needed {
        return Err(MeshoptError::TooShort { count, needed, available: data.len() });
    }
    Ok(layout)
}

/// Decodes `count` elements of `stride` bytes.
pub(super) fn decode(data: &[u8], count: usize, stride: usize, out: &mut [u8]) -> Result<(), MeshoptError> {
    let layout = check(data, count, stride)?;
    let modes = layout.channel_modes(data)?;
    let mut last = layout.baseline(data).to_vec();
    let mut reader = Reader::new(&data[..data.len() - layout.tail], 1);
    for block in out.chunks_mut(layout.block_elements() * stride) {
        decode_block(&mut reader, &layout, modes, &mut last, block)?;
    }
    reader.finish()
}

impl Layout {
    fn block_elements(&self) -> usize {
        (8192 / self.stride / GROUP * GROUP).min(MAX_BLOCK)
    }

    /// The shortest stream: every difference is 0, in whatever way takes the fewest bytes.
    fn least_length(&self, count: usize) -> u64 {
        let block = self.block_elements();
        let block_least = |elements: usize| match self.v1 {
            true => self.stride / CHANNEL,
            false => self.stride * elements.div_ceil(GROUP).div_ceil(4),
        };
        let (full, rest) = (count / block, count % block);
        let rest = if rest == 0 { 0 } else { block_least(rest) };
        1 + (full as u64).saturating_mul(block_least(block) as u64).saturating_add((rest + self.tail) as u64)
    }

    /// One byte a channel; version 0 has none, which means byte differences everywhere.
    fn channel_modes<'a>(&self, data: &'a [u8]) -> Result<&'a [u8], MeshoptError> {
        if !self.v1 {
            return Ok(&[]);
        }
        let start = data.len() - self.stride / CHANNEL;
        let modes = &data[start..];
        match modes.iter().position(|&m| m & 15 > 2 || (m & 15 < 2 && m >> 4 != 0)) {
            Some(i) => Err(MeshoptError::ChannelMode { offset: start + i, mode: modes[i] }),
            None => Ok(modes),
        }
    }

    fn baseline<'a>(&self, data: &'a [u8]) -> &'a [u8] {
        let end = data.len() - if self.v1 { self.stride / CHANNEL } else { 0 };
        &data[end - self.stride..end]
    }
}

/// Decodes the elements of one block and leaves the last of them in `last`.
fn decode_block(
    reader: &mut Reader,
    layout: &Layout,
    modes: &[u8],
    last: &mut [u8],
    block: &mut [u8],
) -> Result<(), MeshoptError> {
    let stride = layout.stride;
    let control = if layout.v1 { reader.take(stride / CHANNEL)? } else { &[] };
    let elements = block.len() / stride;
    let mut deltas = [[0u8; MAX_BLOCK]; CHANNEL];
    for channel in 0..stride / CHANNEL {
        for (k, deltas) in deltas.iter_mut().enumerate() {
            let packing = match control.get(channel).map(|&c| (c >> (2 * k)) & 3) {
                None => Packing::Widths([0, 2, 4, 8]),
                Some(0) => Packing::Widths([0, 1, 2, 4]),
                Some(1) => Packing::Widths([1, 2, 4, 8]),
                Some(2) => Packing::Zero,
                Some(_) => Packing::Bytes,
            };
            unpack(reader, packing, &mut deltas[..], elements)?;
        }
        let at = channel * CHANNEL;
        let mut previous: [u8; CHANNEL] = std::array::from_fn(|k| last[at + k]);
        accumulate(modes.get(channel).copied().unwrap_or(0), &deltas, &mut previous, &mut block[at..], stride);
        last[at..at + CHANNEL].copy_from_slice(&previous);
    }
    Ok(())
}

/// Reads the differences of one byte position.
fn unpack(reader: &mut Reader, packing: Packing, out: &mut [u8], elements: usize) -> Result<(), MeshoptError> {
    match packing {
        Packing::Zero => out[..elements].fill(0),
        Packing::Bytes => out[..elements].copy_from_slice(reader.take(elements)?),
        Packing::Widths(widths) => {
            let groups = elements.div_ceil(GROUP);
            let header = reader.take(groups.div_ceil(4))?;
            for (g, group) in out.chunks_exact_mut(GROUP).take(groups).enumerate() {
                let width = widths[usize::from(header[g / 4] >> (2 * (g % 4)) & 3)];
                unpack_group(reader, width, group)?;
            }
        }
    }
    Ok(())
}

/// Reads 16 differences of a number of bits; those of all ones stand for a whole byte behind the group.
#[inline]
fn unpack_group(reader: &mut Reader, width: u8, group: &mut [u8]) -> Result<(), MeshoptError> {
    match width {
        0 => group.fill(0),
        1 => {
            let bits = reader.take(2)?;
            for (i, delta) in group.iter_mut().enumerate() {
                // The narrowest codes alone begin with the least significant bit.
                *delta = bits[i / 8] >> (i % 8) & 1;
            }
            fill_escapes(reader, 1, group)?;
        }
        2 => {
            let bits = reader.take(4)?;
            for (i, delta) in group.iter_mut().enumerate() {
                *delta = bits[i / 4] >> (6 - 2 * (i % 4)) & 3;
            }
            fill_escapes(reader, 3, group)?;
        }
        4 => {
            let bits = reader.take(8)?;
            for (i, delta) in group.iter_mut().enumerate() {
                *delta = bits[i / 2] >> (4 - 4 * (i % 2)) & 15;
            }
            fill_escapes(reader, 15, group)?;
        }
        _ => group.copy_from_slice(reader.take(GROUP)?),
    }
    Ok(())
}

#[inline]
fn fill_escapes(reader: &mut Reader, sentinel: u8, group: &mut [u8]) -> Result<(), MeshoptError> {
    let escapes = group.iter().filter(|&&d| d == sentinel).count();
    let mut bytes = reader.take(escapes)?.iter();
    for delta in group.iter_mut().filter(|d| **d == sentinel) {
        *delta = *bytes.next().expect("as many bytes were taken as there are escapes");
    }
    Ok(())
}

/// Adds up the differences of a channel and writes its bytes of each element. `previous` is the element before, and
/// then the last one.
fn accumulate(
    mode: u8,
    deltas: &[[u8; MAX_BLOCK]; CHANNEL],
    previous: &mut [u8; CHANNEL],
    out: &mut [u8],
    stride: usize,
) {
    let columns = out.chunks_mut(stride).enumerate();
    match mode & 15 {
        0 => {
            for (i, element) in columns {
                for k in 0..CHANNEL {
                    let d = deltas[k][i];
                    previous[k] = previous[k].wrapping_add((d >> 1) ^ (d & 1).wrapping_neg());
                }
                element[..CHANNEL].copy_from_slice(&previous[..]);
            }
        }
        1 => {
            let mut pair = [0, 2].map(|k| u16::from_le_bytes([previous[k], previous[k + 1]]));
            for (i, element) in columns {
                for (h, value) in pair.iter_mut().enumerate() {
                    let d = u16::from_le_bytes([deltas[2 * h][i], deltas[2 * h + 1][i]]);
                    *value = value.wrapping_add((d >> 1) ^ (d & 1).wrapping_neg());
                    element[2 * h..2 * h + 2].copy_from_slice(&value.to_le_bytes());
                }
            }
            previous.copy_from_slice(pair.map(u16::to_le_bytes).as_flattened());
        }
        _ => {
            // The specification's `rotate` is what the encoder did: here it is undone.
            let rotation = u32::from(mode >> 4);
            let mut value = u32::from_le_bytes(*previous);
            for (i, element) in columns {
                value ^= u32::from_le_bytes(std::array::from_fn(|k| deltas[k][i])).rotate_right(rotation);
                element[..CHANNEL].copy_from_slice(&value.to_le_bytes());
            }
            *previous = value.to_le_bytes();
        }
    }
}
