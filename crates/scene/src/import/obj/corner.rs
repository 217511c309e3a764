//! Corners of elements: `v`, `v/vt`, `v//vn`, `v/vt/vn`, counted from 1 or, negative, back from the line.

use super::ObjFault;
use super::parse::{Counts, excerpt};

/// Indices from 0 of a corner's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Corner {
    /// Position.
    pub v: u32,
    /// Texture coordinate, or [`NONE`].
    pub t: u32,
    /// Normal, or [`NONE`].
    pub n: u32,
}

/// A value that a corner does not have.
pub const NONE: u32 = u32::MAX;

/// What indices of a line may refer to.
pub struct Indexer {
    /// Values of the whole file: a face may come before its vertices.
    pub total: Counts,
    /// Values before the line: negative indices count back from here.
    pub before: Counts,
}

impl Indexer {
    #[inline]
    pub fn corner(&self, token: &[u8]) -> Result<Corner, ObjFault> {
        let (total, before) = (&self.total, &self.before);
        let refuse = || ObjFault::NotACorner(excerpt(token));
        let (v, rest) = integer(token).ok_or_else(refuse)?;
        let mut corner = Corner { v: resolve("v", v, total.positions, before.positions)?, t: NONE, n: NONE };
        let [b'/', rest @ ..] = rest else {
            return if rest.is_empty() { Ok(corner) } else { Err(refuse()) };
        };
        // Exporters leave trailing slashes where there is no value: "1/", "1//", "1/2/".
        let mut rest = rest;
        if !rest.is_empty() && rest[0] != b'/' {
            let (t, after) = integer(rest).ok_or_else(refuse)?;
            corner.t = resolve("vt", t, total.uvs, before.uvs)?;
            rest = after;
        }
        let [b'/', rest @ ..] = rest else {
            return if rest.is_empty() { Ok(corner) } else { Err(refuse()) };
        };
        if rest.is_empty() {
            return Ok(corner);
        }
        let (n, rest) = integer(rest).ok_or_else(refuse)?;
        corner.n = resolve("vn", n, total.normals, before.normals)?;
        if rest.is_empty() { Ok(corner) } else { Err(refuse()) }
    }
}

/// A whole number with an optional sign, and what follows it. Numbers beyond 18 digits saturate: no file has so many.
#[inline]
fn integer(text: &[u8]) -> Option<(i64, &[u8])> {
    let (is_negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, text),
    };
    let end = digits.iter().position(|b| !b.is_ascii_digit()).unwrap_or(digits.len());
    if end == 0 {
        return None;
    }
    let value = if end <= 18 {
        digits[..end].iter().fold(0i64, |value, &b| value * 10 + i64::from(b - b'0'))
    } else {
        std::str::from_utf8(&digits[..end]).ok()?.parse().unwrap_or(i64::MAX)
    };
    Some((if is_negative { -value } else { value }, &digits[end..]))
}

#[inline]
fn resolve(kind: &'static str, index: i64, total: usize, before: usize) -> Result<u32, ObjFault> {
    let resolved = match index {
        1.. => index - 1,
        0 => return Err(ObjFault::ZeroIndex(kind)),
        _ => before as i64 + index,
    };
    if resolved < 0 || resolved >= total as i64 {
        return Err(ObjFault::IndexRange { kind, index, total, before });
    }
    Ok(resolved as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(token: &str) -> Result<Corner, ObjFault> {
        let total = Counts { positions: 9, uvs: 8, normals: 7 };
        let before = Counts { positions: 5, uvs: 4, normals: 3 };
        Indexer { total, before }.corner(token.as_bytes())
    }

    #[test]
    fn all_forms_are_read_and_negative_indices_count_back() {
        for (token, v, t, n) in [
            ("1", 0, NONE, NONE),
            ("+2", 1, NONE, NONE),
            ("9/8/7", 8, 7, 6),
            ("1/2", 0, 1, NONE),
            ("1//3", 0, NONE, 2),
            ("1/", 0, NONE, NONE),
            ("1//", 0, NONE, NONE),
            ("1/2/", 0, 1, NONE),
            ("-1/-1/-1", 4, 3, 2),
            ("-5/-4/-3", 0, 0, 0),
            ("00000000000000000001", 0, NONE, NONE),
        ] {
            assert_eq!(corner(token), Ok(Corner { v, t, n }), "{token}");
        }
    }

    #[test]
    fn what_is_not_there_or_not_a_corner_is_refused() {
        assert_eq!(corner("0"), Err(ObjFault::ZeroIndex("v")));
        assert_eq!(corner("1/0"), Err(ObjFault::ZeroIndex("vt")));
        assert_eq!(corner("1//0"), Err(ObjFault::ZeroIndex("vn")));
        assert_eq!(corner("10"), Err(ObjFault::IndexRange { kind: "v", index: 10, total: 9, before: 5 }));
        assert_eq!(corner("1/-5"), Err(ObjFault::IndexRange { kind: "vt", index: -5, total: 8, before: 4 }));
        for token in ["99999999999999999999999", "-99999999999999999999999", "-9223372036854775808", "4294967297"] {
            assert!(matches!(corner(token), Err(ObjFault::IndexRange { kind: "v", .. })), "{token}");
        }
        for token in ["x", "1.0", "/1", "-", "1/x", "1/2/3/4", "1/2x", "1 /2"] {
            assert_eq!(corner(token), Err(ObjFault::NotACorner(token.to_owned())), "{token}");
        }
    }
}
