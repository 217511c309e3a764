//! Blocks as indices of a local palette, 1, 2, 4, 8 or 16 bits each.

use crate::block::Block;
use crate::space::CHUNK_BLOCKS;
use rustc_hash::FxHashMap;

/// At least two distinct blocks. The palette is in the order of first appearance and has no block twice or unused.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) struct Packed {
    palette: Box<[Block]>,
    /// Index `i` is in word `i / (64 / bits)`, from the low bits up.
    words: Box<[u64]>,
}

/// Palettes up to this length are searched from the front; longer ones by a table.
const SEARCHED: usize = 16;

/// Bits for an index of a palette of this length.
fn bits_for(kinds: usize) -> u32 {
    match kinds {
        0..=2 => 1,
        3..=4 => 2,
        5..=16 => 4,
        17..=256 => 8,
        _ => 16,
    }
}

impl Packed {
    pub fn new(blocks: &[Block; CHUNK_BLOCKS]) -> Self {
        let mut palette: Vec<Block> = Vec::with_capacity(8);
        let mut table: FxHashMap<Block, u16> = FxHashMap::default();
        let mut indices = [0_u16; CHUNK_BLOCKS];
        let mut last = (blocks[0], 0_u16);
        palette.push(blocks[0]);
        for (index, &block) in indices.iter_mut().zip(blocks) {
            if block != last.0 {
                last = (block, find_or_add(&mut palette, &mut table, block));
            }
            *index = last.1;
        }
        let bits = bits_for(palette.len());
        let per_word = 64 / bits as usize;
        let pack = |part: &[u16]| part.iter().rev().fold(0, |word, &index| word << bits | u64::from(index));
        Self { palette: palette.into(), words: indices.chunks(per_word).map(pack).collect() }
    }

    pub fn bits(&self) -> u32 {
        bits_for(self.palette.len())
    }

    #[inline]
    pub fn get(&self, index: usize) -> Block {
        let bits = self.bits();
        let per_word = 64 / bits as usize;
        let word = self.words[index / per_word] >> (index % per_word * bits as usize);
        self.palette[(word & ((1 << bits) - 1)) as usize]
    }

    pub fn palette(&self) -> &[Block] {
        &self.palette
    }

    pub fn words(&self) -> &[u64] {
        &self.words
    }

    fn for_each(&self, mut visit: impl FnMut(usize, usize)) {
        let bits = self.bits();
        let per_word = 64 / bits as usize;
        let mask = (1_u64 << bits) - 1;
        for (i, &word) in self.words.iter().enumerate() {
            let mut word = word;
            for j in 0..per_word {
                visit(i * per_word + j, (word & mask) as usize);
                word >>= bits;
            }
        }
    }

    pub fn unpack(&self, blocks: &mut [Block; CHUNK_BLOCKS]) {
        self.for_each(|i, index| blocks[i] = self.palette[index]);
    }

    pub fn unpack_indices(&self, indices: &mut [u16; CHUNK_BLOCKS]) {
        self.for_each(|i, index| indices[i] = index as u16);
    }

    pub fn occupancy(&self) -> [u64; CHUNK_BLOCKS / 64] {
        let mut occupied = [0; CHUNK_BLOCKS / 64];
        if let [zero, one] = &*self.palette {
            for (occupied, &word) in occupied.iter_mut().zip(&*self.words) {
                *occupied = if zero.is_air() { 0 } else { !word } | if one.is_air() { 0 } else { word };
            }
            return occupied;
        }
        let solid: Vec<bool> = self.palette.iter().map(|block| !block.is_air()).collect();
        self.for_each(|i, index| occupied[i / 64] |= u64::from(solid[index]) << (i % 64));
        occupied
    }

    pub fn heap_bytes(&self) -> usize {
        size_of_val(&*self.palette) + size_of_val(&*self.words)
    }
}

/// The block's index in the palette, to which it is added if it is new.
fn find_or_add(palette: &mut Vec<Block>, table: &mut FxHashMap<Block, u16>, block: Block) -> u16 {
    let known = if palette.len() <= SEARCHED {
        palette.iter().position(|&b| b == block).map(|i| i as u16)
    } else {
        table.get(&block).copied()
    };
    known.unwrap_or_else(|| {
        let index = palette.len() as u16;
        palette.push(block);
        match palette.len() {
            0..=SEARCHED => {}
            length if length == SEARCHED + 1 => {
                table.extend(palette.iter().enumerate().map(|(i, &b)| (b, i as u16)));
            }
            _ => {
                table.insert(block, index);
            }
        }
        index
    })
}
