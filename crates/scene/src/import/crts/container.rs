//! The container: a little-endian u64, a JSON header of that many bytes, and a blob.

use super::Fault;
use crate::import::budget::{Budget, OverBudget};
use crate::import::warning::{WarningKind, Warnings};
use crate::import::{ImportFault, Place};
use crate::json_words::plain;
use serde::de::DeserializeOwned;
use serde_path_to_error::Segment;
use std::ops::Range;

/// Bytes of the length in front of the header.
pub const LENGTH_BYTES: usize = 8;

/// Whether a file looks like CRTS, which has no magic number: a length, which is not the beginning of a text, and then a
/// JSON object.
pub fn is_crts(bytes: &[u8]) -> bool {
    let Some((length, header)) = bytes.split_at_checked(LENGTH_BYTES) else { return false };
    let is_text = length.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace());
    !is_text && header.iter().find(|b| !b.is_ascii_whitespace()) == Some(&b'{')
}

/// Where the header is; the blob follows it.
pub fn header_range(file: &[u8]) -> Result<Range<usize>, Fault> {
    let damaged = |what: String| Err((Place::Offset(0), ImportFault::Container(what)));
    let Some((length, rest)) = file.split_first_chunk::<LENGTH_BYTES>() else {
        let what = format!("a CRTS file begins with a length of 8 bytes, and this one has {} in all", file.len());
        return damaged(what);
    };
    let declared = u64::from_le_bytes(*length);
    match usize::try_from(declared).ok().filter(|&n| n <= rest.len()) {
        Some(n) => Ok(LENGTH_BYTES..LENGTH_BYTES + n),
        None => damaged(format!(
            "the header is said to have {declared} bytes, but only {} follow; the file is truncated or no CRTS file",
            rest.len()
        )),
    }
}

/// Parses the header. An upper bound of what `T` takes is charged before, and given back by the caller.
pub fn parse_header<T: DeserializeOwned>(
    file: &[u8],
    range: Range<usize>,
    budget: &Budget,
    warnings: &mut Warnings,
    bound: impl FnOnce(&str) -> u64,
) -> Result<(T, u64), Fault> {
    let start = range.start;
    let mut bytes = &file[range];
    if bytes.last() == Some(&0) {
        let end = bytes.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1);
        bytes = &bytes[..end];
        warnings.push(WarningKind::Tolerated("the JSON header is padded with zeros, not spaces"), || {
            Place::Offset((start + end) as u64)
        });
    }
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let what = "the JSON header is not valid UTF-8; the file is damaged".to_owned();
        (Place::Offset((start + e.valid_up_to()) as u64), ImportFault::Json(what))
    })?;
    let charged = bound(text);
    budget.charge(charged).map_err(|e: OverBudget| (Place::Whole, e.into()))?;
    let header = serde_json::from_str(text).map_err(|error| fault_of::<T>(text, start, &error))?;
    Ok((header, charged))
}

/// The place of a fault is found by a second, slower pass, which good files never need.
fn fault_of<T: DeserializeOwned>(text: &str, start: usize, error: &serde_json::Error) -> Fault {
    let message = plain(&error.to_string());
    if error.is_syntax() || error.is_eof() {
        let place = Place::Offset((start + offset_of(text, error.line(), error.column())) as u64);
        return (place, ImportFault::Json(format!("the header is not valid JSON: {message}")));
    }
    let mut pointer = String::new();
    let mut deserializer = serde_json::Deserializer::from_str(text);
    if let Err(found) = serde_path_to_error::deserialize::<_, T>(&mut deserializer) {
        for segment in found.path() {
            match segment {
                Segment::Seq { index } => pointer.push_str(&format!("/{index}")),
                Segment::Map { key } => pointer.push_str(&format!("/{}", key.replace('~', "~0").replace('/', "~1"))),
                Segment::Enum { .. } | Segment::Unknown => {}
            }
        }
    }
    (Place::Pointer(pointer), ImportFault::Json(message))
}

/// The byte at a line and column, both counted from 1.
fn offset_of(text: &str, line: usize, column: usize) -> usize {
    let before: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    (before + column.saturating_sub(1)).min(text.len())
}
