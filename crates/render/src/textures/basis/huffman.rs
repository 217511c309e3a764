//! BasisLZ's Huffman tables ("Compressed Huffman Tables"): canonical codes as in RFC 1951, with their lengths coded by
//! runs and a small table of their own.

use super::bits::Bits;

const MAX_LENGTH: u32 = 16;
/// Codes up to this length are found by one look-up.
const FAST: u32 = 10;

/// A canonical code.
pub(super) struct Huffman {
    /// By the next [`FAST`] bits: symbol << 8 | length; 0 for codes that are longer.
    fast: Vec<u32>,
    /// Symbols by code length, and in it by symbol.
    symbols: Vec<u16>,
    /// How many codes have each length.
    counts: [u32; MAX_LENGTH as usize + 1],
}

impl Huffman {
    /// From the code length of each symbol, 0 for none. `None` if more codes are asked for than there are.
    fn new(lengths: &[u8]) -> Option<Self> {
        let mut counts = [0u32; MAX_LENGTH as usize + 1];
        for &length in lengths {
            counts[usize::from(length)] += 1;
        }
        counts[0] = 0;
        let mut starts = [0u32; MAX_LENGTH as usize + 2];
        let (mut code, mut first) = (0u32, [0u32; MAX_LENGTH as usize + 1]);
        for length in 1..=MAX_LENGTH as usize {
            code <<= 1;
            first[length] = code;
            code += counts[length];
            if code > 1 << length {
                return None;
            }
            starts[length + 1] = starts[length] + counts[length];
        }
        let mut symbols = vec![0; starts[MAX_LENGTH as usize + 1] as usize];
        let mut fast = vec![0; 1 << FAST];
        let mut next = starts;
        for (symbol, &length) in lengths.iter().enumerate().filter(|(_, length)| **length > 0) {
            let n = usize::from(length);
            let code = first[n] + next[n] - starts[n];
            symbols[next[n] as usize] = symbol as u16;
            next[n] += 1;
            let length = u32::from(length);
            if length <= FAST {
                // Codes are sent from their highest bit, and bits are read from the lowest.
                let reversed = code.reverse_bits() >> (32 - length);
                for entry in fast.iter_mut().skip(reversed as usize).step_by(1 << length) {
                    *entry = (symbol as u32) << 8 | length;
                }
            }
        }
        Some(Self { fast, symbols, counts })
    }

    /// The next symbol; `None` where no code fits.
    #[inline]
    pub(super) fn decode(&self, bits: &mut Bits) -> Option<u32> {
        let entry = self.fast[bits.peek(FAST) as usize];
        if entry != 0 {
            bits.skip(entry & 255);
            return Some(entry >> 8);
        }
        self.decode_long(bits)
    }

    fn decode_long(&self, bits: &mut Bits) -> Option<u32> {
        let window = bits.peek(MAX_LENGTH);
        let (mut code, mut first, mut index) = (0u32, 0u32, 0u32);
        for length in 1..=MAX_LENGTH {
            code = code << 1 | (window >> (length - 1) & 1);
            first <<= 1;
            let count = self.counts[length as usize];
            if code.wrapping_sub(first) < count {
                bits.skip(length);
                return Some(u32::from(self.symbols[(index + code - first) as usize]));
            }
            index += count;
            first += count;
        }
        None
    }

    /// Reads a table.
    pub(super) fn read(bits: &mut Bits) -> Result<Self, String> {
        const ORDER: [usize; 21] = [17, 18, 19, 20, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 16];
        let broken = |what: &str| format!("a Huffman table is broken: {what}");
        let total = bits.read(14) as usize;
        let codes = bits.read(5) as usize;
        if codes == 0 || codes > ORDER.len() {
            return Err(broken("it has no lengths, or too many"));
        }
        let mut lengths_of_lengths = [0u8; 21];
        for &symbol in &ORDER[..codes] {
            lengths_of_lengths[symbol] = bits.read(3) as u8;
        }
        let table = Self::new(&lengths_of_lengths).ok_or_else(|| broken("more codes than there are"))?;
        let mut lengths: Vec<u8> = Vec::with_capacity(total);
        while lengths.len() < total {
            let symbol = table.decode(bits).ok_or_else(|| broken("a length has no code"))?;
            let (value, run) = match symbol {
                length @ 0..=16 => (length as u8, 1),
                17 => (0, 3 + bits.read(3)),
                18 => (0, 11 + bits.read(7)),
                _ => {
                    let previous = lengths.last().copied().filter(|&length| length > 0);
                    let previous = previous.ok_or_else(|| broken("it repeats a length that is not there"))?;
                    (previous, if symbol == 19 { 3 + bits.read(2) } else { 7 + bits.read(7) })
                }
            };
            lengths.extend(std::iter::repeat_n(value, run as usize));
            if bits.overran() {
                return Err(broken("it is cut off"));
            }
        }
        if lengths.len() > total {
            return Err(broken("a run passes its end"));
        }
        Self::new(&lengths).ok_or_else(|| broken("more codes than there are"))
    }
}
