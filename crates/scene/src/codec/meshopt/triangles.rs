//! Appendix A, mode 1: triangle lists by edges and vertices that were used lately.

use super::indices::{checked_body, write_index};
use super::reader::{Reader, unzigzag32};
use super::{MeshoptError, Mode};

const HEADER: u8 = 0xe1;
const TABLE: usize = 16;

/// The last 16 entries; index 0 is the newest. An entry that was never written cannot be read.
struct Fifo<T> {
    entries: [T; 16],
    written: usize,
}

impl<T: Copy + Default> Fifo<T> {
    fn new() -> Self {
        Self { entries: [T::default(); 16], written: 0 }
    }

    #[inline]
    fn push(&mut self, entry: T) {
        self.entries[self.written & 15] = entry;
        self.written += 1;
    }

    #[inline]
    fn get(&self, index: usize) -> Option<T> {
        (index < self.written).then(|| self.entries[(self.written - 1 - index) & 15])
    }
}

/// What one triangle hands on to the next.
struct State {
    next: u32,
    last: u32,
    edges: Fifo<(u32, u32)>,
    vertices: Fifo<u32>,
}

impl State {
    #[inline]
    fn take_next(&mut self) -> u32 {
        let index = self.next;
        self.next = self.next.wrapping_add(1);
        index
    }

    #[inline]
    fn read_index(&mut self, data: &mut Reader) -> Result<u32, MeshoptError> {
        self.last = self.last.wrapping_add(unzigzag32(data.varint()?));
        Ok(self.last)
    }

    /// A vertex by four bits: the next new one, one of the vertices used lately, or one that is written out.
    #[inline]
    fn vertex(&mut self, nibble: u8, data: &mut Reader, fifo: impl Fn() -> MeshoptError) -> Result<u32, MeshoptError> {
        match nibble {
            0 => Ok(self.take_next()),
            15 => self.read_index(data),
            n => self.vertices.get(usize::from(n) - 1).ok_or_else(fifo),
        }
    }
}

/// The data of `count` indices (a multiple of 3): a byte a triangle at least.
pub(super) fn body(stream: &[u8], count: usize) -> Result<Reader<'_>, MeshoptError> {
    checked_body(stream, Mode::Triangles, HEADER, "0xe1", count, count / 3, TABLE)
}

/// Decodes `count` indices (a multiple of 3) of `stride` bytes.
pub(super) fn decode(stream: &[u8], count: usize, stride: usize, out: &mut [u8]) -> Result<(), MeshoptError> {
    let mut data = body(stream, count)?;
    let codes = data.take(count / 3)?;
    let table = code_table(stream)?;
    let mut state = State { next: 0, last: 0, edges: Fifo::new(), vertices: Fifo::new() };
    for (i, (&code, out)) in codes.iter().zip(out.chunks_exact_mut(3 * stride)).enumerate() {
        let fifo = || MeshoptError::Fifo { offset: 1 + i };
        let triangle = if code < 0xf0 {
            edge_triangle(&mut state, code, &mut data, fifo)?
        } else {
            free_triangle(&mut state, code, table, &mut data, fifo)?
        };
        for (index, out) in triangle.into_iter().zip(out.chunks_exact_mut(stride)) {
            write_index(out, index);
        }
    }
    data.finish()
}

/// The 16 bytes at the end. No half of them is 15, so that a code from the table needs no data; the last two are 0.
fn code_table(stream: &[u8]) -> Result<&[u8], MeshoptError> {
    let start = stream.len() - TABLE;
    let table = &stream[start..];
    let bad = |&(i, &value): &(usize, &u8)| value & 15 == 15 || value >> 4 == 15 || (i >= 14 && value != 0);
    match table.iter().enumerate().find(bad) {
        Some((i, &value)) => Err(MeshoptError::CodeTable { offset: start + i, value }),
        None => Ok(table),
    }
}

/// Codes 0x00..=0xef: an edge that was used lately and a third vertex.
#[inline]
fn edge_triangle(
    state: &mut State,
    code: u8,
    data: &mut Reader,
    fifo: impl Fn() -> MeshoptError,
) -> Result<[u32; 3], MeshoptError> {
    let (a, b) = state.edges.get(usize::from(code >> 4)).ok_or_else(&fifo)?;
    let (c, new) = match code & 15 {
        0 => (state.take_next(), true),
        nibble @ (13 | 14) => {
            state.last = if nibble == 13 { state.last.wrapping_sub(1) } else { state.last.wrapping_add(1) };
            (state.last, true)
        }
        15 => (state.read_index(data)?, true),
        nibble => (state.vertices.get(usize::from(nibble)).ok_or_else(&fifo)?, false),
    };
    state.edges.push((c, b));
    state.edges.push((a, c));
    if new {
        state.vertices.push(c);
    }
    Ok([a, b, c])
}

/// Codes 0xf0..=0xff: three vertices.
#[inline]
fn free_triangle(
    state: &mut State,
    code: u8,
    table: &[u8],
    data: &mut Reader,
    fifo: impl Fn() -> MeshoptError,
) -> Result<[u32; 3], MeshoptError> {
    let nibble = code & 15;
    let pair = if nibble < 14 { table[usize::from(nibble)] } else { data.byte()? };
    if nibble >= 14 && pair == 0 {
        // Where independent lists were joined, their vertices are numbered from 0 again.
        state.next = 0;
    }
    let (z, w) = (pair >> 4, pair & 15);
    let a = if nibble == 15 { state.read_index(data)? } else { state.take_next() };
    let b = state.vertex(z, data, &fifo)?;
    let c = state.vertex(w, data, &fifo)?;
    state.edges.push((b, a));
    state.edges.push((c, b));
    state.edges.push((a, c));
    state.vertices.push(a);
    if z == 0 || z == 15 {
        state.vertices.push(b);
    }
    if w == 0 || w == 15 {
        state.vertices.push(c);
    }
    Ok([a, b, c])
}
