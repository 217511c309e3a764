//! The bytes of a section of regions.
//!
//! ```text
//! chunk count u32 | chunks | region count u32 | regions
//! chunk   palette length u16 (2 to 4,096) | palette u32 each (`Block::to_bits`) | 4,096 indices of 1, 2, 4, 8 or 16 bits, as
//!         narrow as the palette allows, from the low bits of each byte up
//! region  min i64 x 4 | max i64 x 4 (steps of 1/65,536) | 0 u8, block u32 | or 1 u8, scale i8, shape u8, chunk u32
//! ```

use crate::block::Block;
use crate::chunk::Chunk;
use crate::space::{Aabb4, CHUNK_BLOCKS, ChunkShape, Lattice, Scale};
use crate::world::{Content, Region};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Regions on their way into a section.
#[derive(Default)]
pub struct Encoder {
    chunks: Vec<u8>,
    chunk_count: u32,
    regions: Vec<u8>,
    region_count: u32,
    /// Where equal chunks are.
    known: FxHashMap<Arc<Chunk>, u32>,
}

impl Encoder {
    pub fn bytes(&self) -> usize {
        self.chunks.len() + self.regions.len()
    }

    pub fn count(&self) -> u32 {
        self.region_count
    }

    pub fn push(&mut self, region: &Region) {
        let out = &mut self.regions;
        for coordinate in region.bounds.min_raw().into_iter().chain(region.bounds.max_raw()) {
            out.extend(coordinate.to_le_bytes());
        }
        match &region.content {
            Content::Uniform(block) => {
                out.push(0);
                out.extend(block.to_bits().to_le_bytes());
            }
            Content::Chunk { lattice, chunk } => {
                let number = *self.known.entry(chunk.clone()).or_insert_with(|| {
                    encode_chunk(chunk, &mut self.chunks);
                    self.chunk_count += 1;
                    self.chunk_count - 1
                });
                out.extend([1, lattice.scale.get() as u8, (lattice.shape == ChunkShape::Flat) as u8]);
                out.extend(number.to_le_bytes());
            }
        }
        self.region_count += 1;
    }

    pub fn finish(self) -> Vec<u8> {
        let mut bytes = self.chunk_count.to_le_bytes().to_vec();
        bytes.extend(self.chunks);
        bytes.extend(self.region_count.to_le_bytes());
        bytes.extend(self.regions);
        bytes
    }
}

fn encode_chunk(chunk: &Chunk, out: &mut Vec<u8>) {
    let palette = chunk.palette();
    out.extend((palette.len() as u16).to_le_bytes());
    palette.iter().for_each(|block| out.extend(block.to_bits().to_le_bytes()));
    let indices = chunk.palette_indices();
    match chunk.bits_per_block() {
        16 => indices.iter().for_each(|index| out.extend(index.to_le_bytes())),
        bits => {
            let per_byte = 8 / bits as usize;
            let pack = |part: &[u16]| part.iter().rev().fold(0, |byte: u16, index| byte << (bits % 8) | index) as u8;
            out.extend(indices.chunks(per_byte).map(pack));
        }
    }
}

/// What is wrong, and where in the section's bytes.
pub type Fault = (usize, String);

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.bytes.len());
        let end = end.ok_or_else(|| (self.at, "a section of regions ends too early".to_owned()))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        self.take(N).map(|bytes| bytes.try_into().expect("as many bytes as were taken"))
    }

    fn fault<E: ToString>(&self, error: E) -> Fault {
        (self.at, error.to_string())
    }
}

/// The regions of a section, and the heap bytes that their chunks take.
pub fn decode(bytes: &[u8], mut charge: impl FnMut(u64) -> Result<(), Fault>) -> Result<Vec<Region>, Fault> {
    let mut cursor = Cursor { bytes, at: 0 };
    let chunk_count = u32::from_le_bytes(cursor.array()?) as usize;
    let mut chunks = Vec::new();
    for _ in 0..chunk_count {
        let chunk = decode_chunk(&mut cursor)?;
        charge((size_of::<Chunk>() + chunk.heap_bytes() + size_of::<Arc<Chunk>>() + 16) as u64)?;
        chunks.push(Arc::new(chunk));
    }
    let region_count = u32::from_le_bytes(cursor.array()?) as usize;
    let mut regions = Vec::new();
    for _ in 0..region_count {
        let corners: [i64; 8] = {
            let bytes: [u8; 64] = cursor.array()?;
            std::array::from_fn(|i| i64::from_le_bytes(std::array::from_fn(|j| bytes[8 * i + j])))
        };
        let corner = |first: usize| std::array::from_fn(|a| corners[first + a]);
        let bounds = Aabb4::from_raw(corner(0), corner(4)).map_err(|e| cursor.fault(e))?;
        let [kind] = cursor.array()?;
        let region = match kind {
            0 => {
                let block = Block::from_bits(u32::from_le_bytes(cursor.array()?)).map_err(|e| cursor.fault(e))?;
                Region::uniform(bounds, block)
            }
            1 => {
                let [scale, shape] = cursor.array()?;
                let scale = Scale::new(scale as i8).map_err(|e| cursor.fault(e))?;
                let lattice = match shape {
                    0 => Lattice::cube(scale),
                    1 => Lattice::flat(scale),
                    _ => return Err(cursor.fault(format!("there is no chunk shape {shape}"))),
                };
                let number = u32::from_le_bytes(cursor.array()?) as usize;
                let chunk = chunks.get(number).ok_or_else(|| cursor.fault(format!("there is no chunk {number}")))?;
                if !lattice.admits(&bounds) || bounds.cell_count(lattice.chunk_log2()) != 1 {
                    return Err(cursor.fault("a region leaves the chunk that it lies in"));
                }
                Region::chunk(bounds, lattice, chunk.clone())
            }
            _ => return Err(cursor.fault(format!("there is no kind of region {kind}"))),
        };
        regions.extend(region);
    }
    if cursor.at != bytes.len() {
        return Err(cursor.fault("a section of regions has bytes left over"));
    }
    Ok(regions)
}

fn decode_chunk(cursor: &mut Cursor) -> Result<Chunk, Fault> {
    let kinds = usize::from(u16::from_le_bytes(cursor.array()?));
    let bits: usize = match kinds {
        2 => 1,
        3..=4 => 2,
        5..=16 => 4,
        17..=256 => 8,
        257..=CHUNK_BLOCKS => 16,
        _ => return Err(cursor.fault(format!("a chunk has a palette of {kinds} blocks"))),
    };
    let mut palette = Vec::with_capacity(kinds);
    for _ in 0..kinds {
        palette.push(Block::from_bits(u32::from_le_bytes(cursor.array()?)).map_err(|e| cursor.fault(e))?);
    }
    let packed = cursor.take(CHUNK_BLOCKS * bits / 8)?;
    let mut blocks = Box::new([Block::AIR; CHUNK_BLOCKS]);
    for (i, slot) in blocks.iter_mut().enumerate() {
        let bit = i * bits;
        let index = match bits {
            16 => usize::from(u16::from_le_bytes([packed[2 * i], packed[2 * i + 1]])),
            _ => usize::from(packed[bit / 8] >> (bit % 8)) & ((1 << bits) - 1),
        };
        *slot = *palette.get(index).ok_or_else(|| cursor.fault(format!("a chunk has no block {index}")))?;
    }
    Ok(Chunk::from_blocks(&blocks))
}
