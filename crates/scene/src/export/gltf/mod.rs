//! glTF 2.0, `.gltf` and `.glb`: lossless. What the scene was loaded from is written again, in the same order and with
//! the same numbers; only buffers are put together, into one `.bin` or the BIN chunk.
//!
//! First it is decided where bytes go (`indices`, `buffers`, `images`), then the JSON is written (`document`), then the
//! files: those that the document refers to first, the document last.

mod buffers;
mod document;
mod glb;
mod images;
mod indices;

use super::beside::{self, Output};
use super::{ExportError, ExportFault, ExportOptions, ExportReport, Images, Note, VARIANTS, atomic, names};
use crate::Scene;
use crate::model::{AnyId, Blob, Extra};
use buffers::Packed;
use document::Document;
use glb::Glb;
use images::Plan;
use indices::Indices;
use std::collections::HashSet;
use std::path::Path;

/// A document in memory.
#[derive(Debug)]
#[non_exhaustive]
pub struct Files {
    /// The `.gltf` or `.glb`.
    pub document: Vec<u8>,
    /// The files that it refers to: path relative to the document, with `/` between names, and content.
    pub others: Vec<(String, Blob)>,
    /// What the document does not hold as the scene has it.
    pub notes: Vec<Note>,
}

/// Exports to a GLB in memory. Images that stay files are in [`Files::others`].
///
/// # Errors
/// What [`ExportFault`] says, but for files.
pub fn to_glb(scene: &Scene, options: &ExportOptions) -> Result<Files, ExportFault> {
    let layout = Layout::new(scene, options, "scene", &[])?;
    let json = layout.document(scene, None)?;
    let glb = Glb::new(&json, &layout.packed)?;
    let mut document = Vec::with_capacity(glb.len() as usize);
    glb.write(&mut document)?;
    Ok(layout.into_files(document))
}

/// Exports to a `.gltf` in memory. `stem` names the `.bin`, which is the first of [`Files::others`].
///
/// # Errors
/// What [`ExportFault`] says, but for files.
pub fn to_gltf(scene: &Scene, stem: &str, options: &ExportOptions) -> Result<Files, ExportFault> {
    let stem = names::file_name(stem, "scene");
    let bin = format!("{stem}.bin");
    let layout = Layout::new(scene, options, &stem, std::slice::from_ref(&bin))?;
    let document = layout.document(scene, Some(&names::uri(&bin)))?;
    let mut bytes = Vec::with_capacity(layout.packed.len());
    layout.packed.write(&mut bytes)?;
    let mut files = layout.into_files(document);
    if !bytes.is_empty() {
        files.others.insert(0, (bin, Blob::new(bytes)));
    }
    Ok(files)
}

/// The JSON text of one material, light or camera. Its indices are slots.
pub(crate) fn object_text(scene: &Scene, id: AnyId) -> Result<Vec<u8>, ExportFault> {
    let (indices, packed, images) = (Indices::slots(), Packed::default(), Plan::default());
    Document { scene, indices: &indices, packed: &packed, images: &images, buffer_uri: None }.object(id)
}

/// Where everything goes.
struct Layout {
    indices: Indices,
    packed: Packed,
    images: Plan,
    notes: Vec<Note>,
}

impl Layout {
    fn new(scene: &Scene, options: &ExportOptions, stem: &str, reserved: &[String]) -> Result<Self, ExportFault> {
        let left_out = match options.images {
            Images::External => indices::views_of_images_only(scene),
            Images::Keep | Images::Embed => HashSet::new(),
        };
        let indices = Indices::new(scene, &left_out)?;
        let mut packed = Packed::new(scene, &left_out, options.keep_unused_bytes);
        let mut images = Plan::new(scene, &indices, options.images, stem, reserved, &mut packed);
        let mut notes = std::mem::take(&mut images.notes);
        if let Some(variant) = scene.shown_variant.and_then(|id| scene.variants.get(id)) {
            let what = format!(
                "all variants are kept, but glTF does not say which one is shown: {:?} has to be selected again",
                variant.name
            );
            notes.push(Note { pointer: VARIANTS.to_owned(), what });
        }
        if scene.buffers.len() > 1 {
            for (i, buffer) in scene.buffers.values().enumerate() {
                let other = Extra { stated: Default::default(), ..buffer.extra.clone() };
                if buffer.name.is_some() || other != Extra::default() {
                    let what = "the buffers become one, and this one's name, extensions and extras go".to_owned();
                    notes.push(Note { pointer: format!("/buffers/{i}"), what });
                }
            }
        }
        Ok(Self { indices, packed, images, notes })
    }

    fn document(&self, scene: &Scene, buffer_uri: Option<&str>) -> Result<Vec<u8>, ExportFault> {
        let Self { indices, packed, images, .. } = self;
        Document { scene, indices, packed, images, buffer_uri }.write()
    }

    fn into_files(self, document: Vec<u8>) -> Files {
        let others = self.images.files.into_iter().map(|file| (file.path, file.data)).collect();
        Files { document, others, notes: self.notes }
    }
}

/// Exports to files.
pub(super) fn export(
    scene: &Scene,
    path: &Path,
    is_glb: bool,
    options: &ExportOptions,
) -> Result<ExportReport, ExportError> {
    let failed = |fault| ExportError { file: path.to_owned(), fault };
    let stem = names::stem(path);
    let own_name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let bin = format!("{stem}.bin");
    let mut layout = Layout::new(scene, options, &stem, &[own_name, bin.clone()]).map_err(failed)?;
    let mut output = Output::new(path);
    layout.images.write(&mut output)?;
    let bytes = if is_glb {
        let json = layout.document(scene, None).map_err(failed)?;
        let glb = Glb::new(&json, &layout.packed).map_err(failed)?;
        atomic::write(path, |w| glb.write(w)).map(|()| glb.len())
    } else {
        let bin = output.free_name(bin, layout.packed.pieces()).map_err(failed)?;
        let json = layout.document(scene, Some(&names::uri(&bin.path))).map_err(failed)?;
        if layout.packed.len() > 0 {
            output.write(bin, layout.packed.pieces())?;
        }
        atomic::write(path, |w| w.write_all(&json)).map(|()| json.len() as u64)
    };
    output.report.bytes_written += bytes.map_err(|error| failed(error.into()))?;
    let mut report = output.report;
    report.superseded = beside::superseded(path, &stem, "bin", &report);
    report.files.push(path.to_owned());
    report.notes = layout.notes;
    Ok(report)
}

#[cfg(test)]
mod tests;
