//! The structure of a JSON text without its values: Langdale and Lemire 2019, "Parsing Gigabytes of JSON per Second",
//! section 3.1. Sixty-four bytes at a time become masks of quotes, backslashes and brackets; what is inside a string is the
//! prefix sum (modulo 2) of the quotes that no backslash escapes.

use std::ops::Range;

/// One bit for each byte of a block, the lowest for the first.
#[derive(Clone, Copy, Default)]
struct Masks {
    quotes: u64,
    backslashes: u64,
    /// `{` and `[`.
    opens: u64,
    /// `}` and `]`.
    closes: u64,
}

/// Where the list `nodes` of a document is (between its brackets), and each object in it. `None` where there is no such
/// list, or two, or brackets that do not match in number. Nothing else of the syntax is checked.
pub fn nodes(text: &[u8]) -> Option<(Range<usize>, Vec<Range<u32>>)> {
    let mut list: Option<Range<usize>> = None;
    let mut nodes: Vec<Range<u32>> = Vec::new();
    let (mut depth, mut is_in_list, mut start) = (0usize, false, 0);
    for_each_bracket(text, |at, opens| {
        if opens {
            depth += 1;
            if depth == 2 && text[at] == b'[' && is_key(&text[..at], b"\"nodes\"") {
                if list.is_some() {
                    return false;
                }
                (list, is_in_list) = (Some(at + 1..at + 1), true);
            } else if depth == 3 && is_in_list {
                start = at;
            }
            return true;
        }
        if depth == 0 {
            return false;
        }
        if depth == 3 && is_in_list {
            nodes.push(start as u32..at as u32 + 1);
        } else if depth == 2 && is_in_list {
            is_in_list = false;
            if let Some(list) = &mut list {
                list.end = at;
            }
        }
        depth -= 1;
        true
    })?;
    (depth == 0).then_some((list?, nodes))
}

/// Whether a text ends with a key and its colon.
fn is_key(before: &[u8], key: &[u8]) -> bool {
    let Some((b':', before)) = before.trim_ascii_end().split_last().map(|(&last, rest)| (last, rest)) else {
        return false;
    };
    let before = before.trim_ascii_end();
    // A quote that is escaped begins no key.
    before.strip_suffix(key).is_some_and(|before| before.last() != Some(&b'\\'))
}

/// Calls `see(position, opens)` for every bracket outside strings, in order, until it returns `false`; then, and where a
/// string does not end, the result is `None`.
fn for_each_bracket(text: &[u8], mut see: impl FnMut(usize, bool) -> bool) -> Option<()> {
    let (blocks, tail) = text.as_chunks::<64>();
    let mut state = State::default();
    let mut block = |first: usize, masks: Masks| {
        let in_string = state.in_string(masks);
        let opens = masks.opens & !in_string;
        let mut brackets = opens | (masks.closes & !in_string);
        while brackets != 0 {
            let bit = brackets.trailing_zeros();
            if !see(first + bit as usize, opens >> bit & 1 == 1) {
                return false;
            }
            brackets &= brackets - 1;
        }
        true
    };
    for (i, bytes) in blocks.iter().enumerate() {
        if !block(64 * i, masks(bytes)) {
            return None;
        }
    }
    let mut last = [b' '; 64];
    last[..tail.len()].copy_from_slice(tail);
    (block(64 * blocks.len(), masks(&last)) && !state.is_in_string()).then_some(())
}

/// What a block hands on to the next one.
#[derive(Default)]
struct State {
    /// All ones if the block begins inside a string.
    string: u64,
    /// 1 if the first byte is escaped.
    escaped: u64,
}

impl State {
    fn is_in_string(&self) -> bool {
        self.string != 0
    }

    /// The bytes inside strings, each with its opening quote and without its closing one.
    fn in_string(&mut self, masks: Masks) -> u64 {
        let quotes = masks.quotes & !self.escapes(masks.backslashes);
        let in_string = prefix_xor(quotes) ^ self.string;
        self.string = ((in_string as i64) >> 63) as u64;
        in_string
    }

    /// The bytes that a backslash escapes: those behind an odd run of them.
    fn escapes(&mut self, backslashes: u64) -> u64 {
        if backslashes == 0 {
            return std::mem::take(&mut self.escaped);
        }
        let mut escaped = self.escaped;
        self.escaped = 0;
        let mut left = backslashes & !escaped;
        while left != 0 {
            let bit = left.trailing_zeros();
            left &= left - 1;
            if bit == 63 {
                self.escaped = 1;
            } else {
                escaped |= 2 << bit;
                left &= !(2 << bit);
            }
        }
        escaped
    }
}

/// Bit i becomes the sum of bits 0 to i, modulo 2.
fn prefix_xor(mut bits: u64) -> u64 {
    for shift in [1, 2, 4, 8, 16, 32] {
        bits ^= bits << shift;
    }
    bits
}

#[cfg(target_arch = "x86_64")]
#[inline]
fn masks(block: &[u8; 64]) -> Masks {
    // SAFETY: SSE2 is part of x86-64.
    unsafe { sse2_masks(block) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "sse2")]
fn sse2_masks(block: &[u8; 64]) -> Masks {
    use std::arch::x86_64::{__m128i, _mm_and_si128, _mm_cmpeq_epi8, _mm_movemask_epi8, _mm_set1_epi8};
    let mut masks = Masks::default();
    let (lanes, _) = block.as_chunks::<16>();
    for (i, lane) in lanes.iter().enumerate() {
        let bytes: __m128i = bytemuck::cast(*lane);
        // `[` and `{`, and `]` and `}`, differ in this bit alone.
        let folded = _mm_and_si128(bytes, _mm_set1_epi8(!0x20));
        let equal = |v: __m128i, b: u8| u64::from(_mm_movemask_epi8(_mm_cmpeq_epi8(v, _mm_set1_epi8(b as i8))) as u16);
        masks.quotes |= equal(bytes, b'"') << (16 * i);
        masks.backslashes |= equal(bytes, b'\\') << (16 * i);
        masks.opens |= equal(folded, b'[') << (16 * i);
        masks.closes |= equal(folded, b']') << (16 * i);
    }
    masks
}

#[cfg(not(target_arch = "x86_64"))]
fn masks(block: &[u8; 64]) -> Masks {
    plain_masks(block)
}

#[cfg(any(test, not(target_arch = "x86_64")))]
fn plain_masks(block: &[u8; 64]) -> Masks {
    let mut masks = Masks::default();
    for (i, &b) in block.iter().enumerate() {
        masks.quotes |= u64::from(b == b'"') << i;
        masks.backslashes |= u64::from(b == b'\\') << i;
        masks.opens |= u64::from(matches!(b, b'[' | b'{')) << i;
        masks.closes |= u64::from(matches!(b, b']' | b'}')) << i;
    }
    masks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Brackets outside strings, one byte at a time. A backslash makes a quote plain, wherever it is.
    fn plain(text: &[u8]) -> Option<Vec<(usize, bool)>> {
        let (mut in_string, mut escaped, mut found) = (false, false, Vec::new());
        for (i, &b) in text.iter().enumerate() {
            let was_escaped = std::mem::take(&mut escaped);
            match b {
                b'\\' => escaped = !was_escaped,
                b'"' if !was_escaped => in_string = !in_string,
                b'[' | b'{' if !in_string => found.push((i, true)),
                b']' | b'}' if !in_string => found.push((i, false)),
                _ => {}
            }
        }
        (!in_string).then_some(found)
    }

    #[test]
    fn brackets_are_those_that_a_walk_over_the_bytes_finds() {
        let mut random = 1u64;
        for length in 0..700 {
            let mut text = Vec::new();
            for _ in 0..length {
                random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                text.push(b"\"\\\\[]{}a ,\"x"[(random >> 33) as usize % 12]);
            }
            let mut found = Vec::new();
            let whole = for_each_bracket(&text, |at, opens| {
                found.push((at, opens));
                true
            });
            assert_eq!(whole.map(|()| found), plain(&text), "{}", text.escape_ascii());
        }
    }

    #[test]
    fn masks_are_those_of_the_bytes() {
        for first in 0..=255u8 {
            let block = std::array::from_fn(|i| first.wrapping_add(i as u8));
            let (a, b) = (masks(&block), plain_masks(&block));
            assert_eq!((a.quotes, a.backslashes, a.opens, a.closes), (b.quotes, b.backslashes, b.opens, b.closes));
        }
    }
}
