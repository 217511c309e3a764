//! glTF 2.0, `.gltf` and `.glb`.
//!
//! Three steps: the container gives a JSON text and perhaps a binary chunk; the text is parsed to `schema`, which is what
//! the file says, with indices; `convert` follows and checks every index and builds the scene. Geometry and images stay
//! the bytes that were read: buffers and images of a GLB are parts of the one block that the file was read into.

mod convert;
mod extensions;
mod glb;
mod parse;
mod place;
mod schema;
#[cfg(test)]
mod tests;

pub use glb::GLB_MAGIC;

use super::budget::{Budget, OverBudget};
use super::files::Files;
use super::warning::{Warning, WarningKind, Warnings};
use super::{ImportFault, Place};
use crate::Scene;
use crate::model::{Blob, Node};
use place::At;

/// U+FEFF in UTF-8: not allowed before the JSON, but some editors write it.
pub const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// What is wrong, and where.
type Fault = (Place, ImportFault);

/// Imports a glTF file. Its own bytes have been charged already.
pub fn import(
    bytes: Vec<u8>,
    is_glb: bool,
    files: &Files<'_>,
    budget: &Budget,
) -> Result<(Scene, Vec<Warning>), Fault> {
    let mut warnings = Warnings::default();
    let file = Blob::new(bytes);
    let (json, bin) = if is_glb {
        let chunks = glb::chunks(&file, &mut warnings)?;
        (chunks.json, chunks.bin)
    } else {
        (0..file.len(), None)
    };
    let bin = bin.and_then(|range| file.slice(range));
    let text = json_text(&file, json.start, json.end, &mut warnings)?;
    budget.charge(parsed_bound(text)).map_err(|e: OverBudget| (Place::Whole, e.into()))?;
    let root = parse::parse(text, &At::Root)?;
    convert::convert(root, bin, is_glb, files, budget, warnings)
}

fn json_text<'a>(file: &'a [u8], start: usize, end: usize, warnings: &mut Warnings) -> Result<&'a str, Fault> {
    let mut bytes = &file[start..end];
    if let Some(rest) = bytes.strip_prefix(BYTE_ORDER_MARK) {
        bytes = rest;
        warnings.push(WarningKind::Tolerated("the JSON begins with a byte order mark"), || Place::Offset(start as u64));
    }
    if bytes.last() == Some(&0) {
        while let [rest @ .., 0] = bytes {
            bytes = rest;
        }
        warnings
            .push(WarningKind::Tolerated("the JSON is padded with zeros, not spaces"), || Place::Offset(end as u64));
    }
    std::str::from_utf8(bytes).map_err(|e| {
        let offset = bytes.as_ptr() as usize - file.as_ptr() as usize + e.valid_up_to();
        (Place::Offset(offset as u64), ImportFault::Json("the JSON is not valid UTF-8".to_owned()))
    })
}

/// An upper bound for the memory that a JSON text takes as schema and as scene, before any of it is parsed. The dearest
/// object per byte of text is an empty node, `{}`; the dearest other value is a member of an unknown object.
fn parsed_bound(text: &str) -> u64 {
    /// Vectors double when they grow, and hold the old and the new block meanwhile.
    const GROWTH: u64 = 3;
    const OBJECT: u64 = GROWTH * size_of::<schema::Node>() as u64 + size_of::<Node>() as u64 + 64;
    /// A member of a JSON map: key, value, hash and table slot.
    const VALUE: u64 = GROWTH * 64;
    let count = |byte: u8| text.as_bytes().iter().filter(|&&b| b == byte).count() as u64;
    // Strings are copied at most once into the schema and once into the scene.
    2 * text.len() as u64 + OBJECT * count(b'{') + VALUE * (count(b',') + count(b'['))
}
