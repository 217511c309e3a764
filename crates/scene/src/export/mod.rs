//! Export: from a [`Scene`] to files.
//!
//! One folder per format. What they share is here: errors, notes on what the target cannot hold, outputs that are whole or
//! absent (`atomic`), and JSON. A format is chosen by the extension of the file; [`export_path`] is where a new one is
//! added.

mod atomic;
mod beside;
pub mod crts;
mod error;
pub mod gltf;
mod json;
mod names;
mod obj;
mod placed;
mod surface;

pub use error::{ExportError, ExportFault};

use crate::Scene;
use crate::import::Format;
use std::fmt;
use std::path::{Path, PathBuf};

/// Where images go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Images {
    /// Where they are: files stay files (and are copied beside the new document), data URIs and views stay what they are.
    #[default]
    Keep,
    /// Into the document's buffer.
    Embed,
    /// Into files beside the document.
    External,
}

/// How to export.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ExportOptions {
    /// Where images go. They are never decoded and encoded again.
    pub images: Images,
    /// Write also the bytes of buffers that no view refers to.
    pub keep_unused_bytes: bool,
}

/// Something that the target does not hold as the scene has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// Where in the scene: a JSON pointer in the terms of glTF.
    pub pointer: String,
    /// What is different.
    pub what: String,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.pointer.as_str() {
            "" => write!(f, "{}", self.what),
            pointer => write!(f, "{pointer}: {}", self.what),
        }
    }
}

const VARIANTS: &str = "/extensions/KHR_materials_variants";

/// What a format without variants writes of a scene that has some.
fn variants_left_out(scene: &Scene, format: &str) -> Option<String> {
    let written = match scene.shown_variant().and_then(|id| scene.variants().get(id)) {
        Some(shown) => format!("those of the variant {:?}, which is shown, are written", shown.name),
        None => "those that no variant chooses are written".to_owned(),
    };
    (!scene.variants().is_empty()).then(|| format!("{format} has no material variants: of the materials, {written}"))
}

/// What an export did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ExportReport {
    /// The files that belong to the result, the document last; also those that were there with the same content already.
    pub files: Vec<PathBuf>,
    /// Bytes that were written.
    pub bytes_written: u64,
    /// What the target does not hold as the scene has it.
    pub notes: Vec<Note>,
    /// Files that earlier exports to the same path made, and that this one does not use. They are kept: another document
    /// may refer to them.
    pub superseded: Vec<PathBuf>,
}

/// Exports a scene to a file, in the format of its extension. Until everything is on the disk, the old document stays, and
/// so do the files that it refers to: whoever opens `path`, whenever the program ends, finds the old scene or the new one.
///
/// # Errors
/// The file and what is wrong. The old document is untouched then.
pub fn export_path(scene: &Scene, path: &Path, options: &ExportOptions) -> Result<ExportReport, ExportError> {
    let failed = |fault| ExportError { file: path.to_owned(), fault };
    match Format::from_extension(path) {
        Some(format @ (Format::Gltf | Format::Glb)) => gltf::export(scene, path, format == Format::Glb, options),
        Some(Format::Crts) => {
            let (bytes_written, notes) = atomic::write(path, |w| crts::write(scene, w)).map_err(failed)?;
            Ok(ExportReport { files: vec![path.to_owned()], bytes_written, notes, superseded: Vec::new() })
        }
        Some(Format::Obj) => obj::export(scene, path, options),
        None => {
            let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            Err(failed(ExportFault::UnknownFormat(extension)))
        }
    }
}
