//! glTF 2.0, `.gltf` and `.glb`.
//!
//! Three steps: the container gives a JSON text and perhaps a binary chunk; the text is parsed to `schema`, which is what
//! the file says, with indices; `convert` follows and checks every index and builds the scene. Geometry and images stay
//! the bytes that were read: buffers and images of a GLB are parts of the one block that the file was read into.

mod convert;
pub(crate) mod extensions;
mod glb;
mod nodes;
mod parse;
mod schema;
#[cfg(test)]
mod tests;

pub(crate) use convert::convert_object;
pub use glb::GLB_MAGIC;

use super::budget::{Budget, OverBudget};
use super::files::Files;
use super::warning::{Warning, WarningKind, Warnings};
use super::{ImportFault, Place};
use crate::Scene;
use crate::model::{self, Blob};
use crate::place::At;

/// U+FEFF in UTF-8: not allowed before the JSON, but some editors write it.
pub const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// What is wrong, and where.
type Fault = (Place, ImportFault);

/// A scene and what is to be said of it.
type Imported = Result<(Scene, Vec<Warning>), Fault>;

/// Imports a glTF file. Its own bytes have been charged already.
pub fn import(bytes: Vec<u8>, is_glb: bool, files: &Files<'_>, budget: &Budget) -> Imported {
    import_document(bytes, is_glb, files, budget, nodes::MIN_BYTES)
}

/// As [`import`]. Nodes whose texts have `min_node_bytes` together are read apart from the rest.
fn import_document(
    bytes: Vec<u8>,
    is_glb: bool,
    files: &Files<'_>,
    budget: &Budget,
    min_node_bytes: usize,
) -> Imported {
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
    let source = Source { text, bin, is_glb };
    let charged = budget.used();
    if let Some(texts) = nodes::NodeTexts::find(text, min_node_bytes) {
        if let Ok(imported) = source.import_split(&texts, files, budget, warnings.clone()) {
            return Ok(imported);
        }
        // The whole is parsed again, to say what is wrong.
        budget.release(budget.used() - charged);
    }
    source.import_whole(files, budget, warnings)
}

/// A document.
struct Source<'a> {
    text: &'a str,
    /// The second chunk of a GLB.
    bin: Option<Blob>,
    is_glb: bool,
}

impl Source<'_> {
    fn import_whole(self, files: &Files<'_>, budget: &Budget, warnings: Warnings) -> Imported {
        let root = parse::parse(self.text, &At::Root)?;
        convert::convert(root, None, self.bin, self.is_glb, files, budget, warnings)
    }

    /// With the nodes apart from the rest. An error is not always the one that [`Source::import_whole`] gives.
    fn import_split(
        &self,
        nodes: &nodes::NodeTexts<'_>,
        files: &Files<'_>,
        budget: &Budget,
        warnings: Warnings,
    ) -> Imported {
        let rest = nodes.rest();
        let root = parse::parse(&rest, &At::Root)?;
        convert::convert(root, Some(nodes), self.bin.clone(), self.is_glb, files, budget, warnings)
    }
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

/// An upper bound for the memory that a JSON text takes as schema and as scene, before any of it is parsed. It counts
/// what a text can hold of values at most, and takes each for the largest of its kind; strings may be counted too, which
/// errs on the safe side.
fn parsed_bound(text: &str) -> u64 {
    /// Vectors double when they grow, and hold the old and the new block meanwhile.
    const GROWTH: u64 = 3;
    const OBJECT: u64 = GROWTH * largest(&SCHEMA) + largest(&MODEL);
    /// A member of a map or array: key, value, hash and table slot, where tables double too.
    const VALUE: u64 = GROWTH * (24 + 8 + size_of::<serde_json::Value>() as u64);
    /// A vector of unknown values begins with room for four.
    const ARRAY: u64 = 4 * size_of::<serde_json::Value>() as u64 + VALUE;
    let [objects, arrays, members] = count_bytes(text.as_bytes(), [b'{', b'[', b',']);
    // Strings are copied at most once into the schema and once into the scene, and what is not a node once before that.
    3 * text.len() as u64 + OBJECT * objects + ARRAY * arrays + VALUE * members
}

/// How often each of some bytes occurs. Counters of one byte, emptied before they can overflow, let the compiler count
/// many bytes at once.
fn count_bytes<const N: usize>(bytes: &[u8], wanted: [u8; N]) -> [u64; N] {
    let mut counts = [0; N];
    for block in bytes.chunks(192) {
        for (count, byte) in counts.iter_mut().zip(wanted) {
            *count += u64::from(block.iter().map(|&b| u8::from(b == byte)).sum::<u8>());
        }
    }
    counts
}

/// The objects that a list of the document can hold.
const SCHEMA: [usize; 8] = [
    size_of::<schema::Node<'_>>(),
    size_of::<schema::Material<'_>>(),
    size_of::<schema::Accessor<'_>>(),
    size_of::<schema::Image<'_>>(),
    size_of::<schema::Camera<'_>>(),
    size_of::<schema::Primitive<'_>>(),
    size_of::<schema::Light<'_>>(),
    size_of::<schema::AnimationChannel<'_>>(),
];
const MODEL: [usize; 8] = [
    size_of::<model::Node>(),
    size_of::<model::Material>(),
    size_of::<model::Accessor>(),
    size_of::<model::Image>(),
    size_of::<model::Camera>(),
    size_of::<model::Primitive>(),
    size_of::<model::Light>(),
    size_of::<model::AnimationChannel>(),
];

const fn largest(sizes: &[usize]) -> u64 {
    let (mut largest, mut i) = (0, 0);
    while i < sizes.len() {
        if sizes[i] > largest {
            largest = sizes[i];
        }
        i += 1;
    }
    largest as u64
}
