//! Appendix A, mode 2: indices by differences to one of two baselines.

use super::reader::{Reader, unzigzag32};
use super::{MeshoptError, Mode};

const HEADER: u8 = 0xd1;
const TAIL: usize = 4;

/// The data of `count` indices, which take a byte each at least.
pub(super) fn body(data: &[u8], count: usize) -> Result<Reader<'_>, MeshoptError> {
    checked_body(data, Mode::Indices, HEADER, "0xd1", count, count, TAIL)
}

/// Decodes `count` indices of `stride` bytes.
pub(super) fn decode(data: &[u8], count: usize, stride: usize, out: &mut [u8]) -> Result<(), MeshoptError> {
    let mut reader = body(data, count)?;
    let mut last = [0u32; 2];
    for out in out.chunks_exact_mut(stride) {
        let v = reader.varint()?;
        let baseline = &mut last[(v & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag32(v >> 1));
        write_index(out, *baseline);
    }
    reader.finish()
}

/// The body of a stream of indices, between the header byte and the tail, after a check that it can hold `least` bytes.
pub(super) fn checked_body<'a>(
    data: &'a [u8],
    mode: Mode,
    header: u8,
    expected: &'static str,
    count: usize,
    least: usize,
    tail: usize,
) -> Result<Reader<'a>, MeshoptError> {
    let needed = least as u64 + tail as u64 + 1;
    if (data.len() as u64) < needed {
        return Err(MeshoptError::TooShort { count, needed, available: data.len() });
    }
    if data[0] != header {
        return Err(MeshoptError::Header { found: data[0], mode, expected });
    }
    Ok(Reader::new(&data[..data.len() - tail], 1))
}

/// Writes an index of 4 bytes, or of 2, where it wraps around.
#[inline]
pub(super) fn write_index(out: &mut [u8], index: u32) {
    let bytes = index.to_le_bytes();
    out.copy_from_slice(&bytes[..out.len()]);
}
