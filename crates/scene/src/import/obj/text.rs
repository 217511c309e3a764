//! From bytes to logical lines: encodings, line ends of every system, continued lines.

use crate::import::budget::{Budget, OverBudget};
use memchr::{memchr, memchr2};
use std::borrow::Cow;

/// The text without its byte order mark, in an encoding that agrees with ASCII. UTF-16 with a mark becomes UTF-8; its
/// bytes are charged. What follows no mark is taken byte by byte, and only names care whether it is UTF-8 or Latin-1.
pub fn decode<'a>(bytes: &'a [u8], budget: &Budget) -> Result<Cow<'a, [u8]>, OverBudget> {
    let wide: fn([u8; 2]) -> u16 = match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => return Ok(Cow::Borrowed(rest)),
        [0xff, 0xfe, ..] => u16::from_le_bytes,
        [0xfe, 0xff, ..] => u16::from_be_bytes,
        _ => return Ok(Cow::Borrowed(bytes)),
    };
    let units = bytes[2..].chunks_exact(2).map(|pair| wide([pair[0], pair[1]]));
    // A unit of UTF-16 is at most three bytes of UTF-8.
    let bound = bytes.len() as u64 / 2 * 3;
    budget.charge(bound)?;
    let mut text = String::with_capacity(bound as usize);
    text.extend(char::decode_utf16(units).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)));
    budget.release(bound - text.len() as u64);
    text.shrink_to_fit();
    Ok(Cow::Owned(text.into_bytes()))
}

/// Space, tab, NUL (some editors pad with it) and the other controls that separate words.
#[inline]
pub fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0 | 0x0b | 0x0c | b'\r' | b'\n')
}

/// Without blanks at both ends.
pub fn trim(mut text: &[u8]) -> &[u8] {
    while let [first, rest @ ..] = text
        && is_blank(*first)
    {
        text = rest;
    }
    while let [rest @ .., last] = text
        && is_blank(*last)
    {
        text = rest;
    }
    text
}

/// The first word and what follows it; `None` if there is no word.
#[inline]
pub fn word(text: &[u8]) -> Option<(&[u8], &[u8])> {
    let start = text.iter().position(|&b| !is_blank(b))?;
    let text = &text[start..];
    let end = text.iter().position(|&b| is_blank(b)).unwrap_or(text.len());
    Some(text.split_at(end))
}

/// A name: UTF-8, or Latin-1 where it is not valid UTF-8.
pub fn name(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// The logical lines of a text. Lines end with LF, CR LF or CR; a backslash at the end of a line that is no comment joins
/// the next one to it.
pub struct Lines<'t> {
    rest: &'t [u8],
    /// Number of the next line.
    next: usize,
}

/// A logical line.
pub struct Line<'t> {
    /// Number of its first physical line.
    pub number: usize,
    /// Without the line end; joined parts are separated by a space.
    pub text: Cow<'t, [u8]>,
}

impl<'t> Lines<'t> {
    /// `first` is the number of the text's first line.
    pub fn new(text: &'t [u8], first: usize) -> Self {
        Self { rest: text, next: first }
    }

    /// The number of the line that would come next.
    pub fn next_number(&self) -> usize {
        self.next
    }

    #[inline]
    fn physical(&mut self) -> Option<&'t [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.next += 1;
        let Some(end) = memchr2(b'\n', b'\r', self.rest) else {
            return Some(std::mem::take(&mut self.rest));
        };
        let line = &self.rest[..end];
        let is_crlf = self.rest[end] == b'\r' && self.rest.get(end + 1) == Some(&b'\n');
        self.rest = &self.rest[end + 1 + usize::from(is_crlf)..];
        Some(line)
    }
}

impl<'t> Iterator for Lines<'t> {
    type Item = Line<'t>;

    #[inline]
    fn next(&mut self) -> Option<Line<'t>> {
        let number = self.next;
        let first = self.physical()?;
        if first.last() != Some(&b'\\') || is_comment(first) {
            return Some(Line { number, text: Cow::Borrowed(first) });
        }
        let mut joined = Vec::new();
        let mut part = first;
        while let [before @ .., b'\\'] = part {
            joined.extend_from_slice(before);
            joined.push(b' ');
            part = self.physical().unwrap_or_default();
        }
        joined.extend_from_slice(part);
        Some(Line { number, text: Cow::Owned(joined) })
    }
}

fn is_comment(line: &[u8]) -> bool {
    line.iter().find(|&&b| !is_blank(b)) == Some(&b'#')
}

/// Cuts a text into pieces of about `size` bytes, each of whole logical lines: at LFs that no backslash precedes. A text
/// without LF is one piece.
pub fn pieces(text: &[u8], size: usize) -> Vec<&[u8]> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while rest.len() > size {
        let mut from = size;
        let cut = loop {
            match memchr(b'\n', &rest[from..]) {
                None => break rest.len(),
                Some(offset) => {
                    let end = from + offset;
                    let line = rest[..end].strip_suffix(b"\r").unwrap_or(&rest[..end]);
                    if line.last() != Some(&b'\\') {
                        break end + 1;
                    }
                    from = end + 1;
                }
            }
        };
        let (piece, after) = rest.split_at(cut);
        pieces.push(piece);
        rest = after;
    }
    if !rest.is_empty() {
        pieces.push(rest);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &[u8]) -> Vec<(usize, String)> {
        Lines::new(text, 1).map(|line| (line.number, name(&line.text))).collect()
    }

    #[test]
    fn lines_end_as_on_every_system_and_are_counted_alike() {
        for text in [&b"a\nb\n\nc"[..], b"a\r\nb\r\n\r\nc", b"a\rb\r\rc"] {
            let expected = [(1, "a"), (2, "b"), (3, ""), (4, "c")].map(|(n, t)| (n, t.to_owned()));
            assert_eq!(lines(text), expected);
        }
    }

    #[test]
    fn a_backslash_joins_lines_but_not_after_a_comment() {
        let expected = [(1, "f 1 2  3"), (3, "# c:\\"), (4, "v")].map(|(n, t)| (n, t.to_owned()));
        assert_eq!(lines(b"f 1 2 \\\n3\n# c:\\\nv"), expected);
        assert_eq!(lines(b"f 1 2 \\\r\n3\r\n# c:\\\r\nv"), expected);
        assert_eq!(lines(b"f\\"), [(1, "f ".to_owned())]);
    }

    #[test]
    fn pieces_are_whole_lines_and_together_the_text() {
        let text = b"v 1 2 3\nf 1 \\\n2 \\\r\n3\nv 1 2 3\r\nv 4 5 6";
        let whole = lines(text);
        for size in 1..text.len() + 1 {
            let pieces = pieces(text, size);
            assert_eq!(pieces.concat(), text);
            let mut first = 1;
            let mut found = Vec::new();
            for piece in pieces {
                let mut lines = Lines::new(piece, first);
                found.extend(lines.by_ref().map(|line| (line.number, name(&line.text))));
                first = lines.next_number();
            }
            assert_eq!(found, whole, "pieces of {size}");
        }
    }

    #[test]
    fn utf_16_of_both_orders_and_marks_are_understood() {
        let budget = Budget::new(1000);
        let units: Vec<u16> = "\u{feff}o é\n".encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|u| u.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|u| u.to_be_bytes()).collect();
        for bytes in [&little[..], &big, "\u{feff}o é\n".as_bytes(), "o é\n".as_bytes()] {
            assert_eq!(decode(bytes, &budget).unwrap(), "o é\n".as_bytes());
        }
        assert_eq!(name(b"caf\xe9"), "café");
        assert!(decode(&little, &Budget::new(3)).is_err());
    }
}
