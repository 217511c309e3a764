//! Appendix A, mode 2: indices by differences to one of two baselines.

use super::reader::{Reader, unzigzag32};
use super::{MeshoptError, Mode};

const HEADER: u8 = 0xd1;
const TAIL: usize = 4;

/// Decodes `count` indices of `stride` bytes.
pub(super) fn decode(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, MeshoptError> {
    let mut reader = checked_body(data, Mode::Indices, HEADER, "0xd1", count, count, TAIL)?;
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count * stride);
    for _ in 0..count {
        let v = reader.varint()?;
        let baseline = &mut last[(v & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag32(v >> 1));
        push_index(&mut out, *baseline, stride);
    }
    reader.finish()?;
    Ok(out)
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

/// Appends an index; one of two bytes wraps around.
#[inline]
pub(super) fn push_index(out: &mut Vec<u8>, index: u32, stride: usize) {
    if stride == 2 {
        out.extend_from_slice(&(index as u16).to_le_bytes());
    } else {
        out.extend_from_slice(&index.to_le_bytes());
    }
}
