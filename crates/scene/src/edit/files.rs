//! The documents that edits merge: read from files, and known by the hash of their content.

use super::EditError;
use super::ops::MergedFile;
use crate::Scene;
use crate::import::{ImportOptions, import_path};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A document that was read to be merged.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Read {
    /// What the edit takes.
    pub file: MergedFile,
    /// The files that were read: the document's own, and those that it refers to.
    pub files: Vec<PathBuf>,
    /// What was read although it is not as it should be, each as `file: place: what`.
    pub warnings: Vec<String>,
}

/// Reads the documents that edits merge from where the paths in a script or a log begin.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
    import: ImportOptions,
}

impl Folder {
    /// `path` is where relative paths begin; `import` is how files are read.
    pub fn new(path: &Path, import: ImportOptions) -> Self {
        Self { path: path.to_owned(), import }
    }

    /// Reads a document for `Edit::MergeScene`, which will know it by the hash of what has been read. It may take
    /// `max_memory` bytes.
    ///
    /// # Errors
    /// The file and why it cannot be read.
    pub fn read(&self, path: &str, max_memory: u64) -> Result<Read, EditError> {
        if path.is_empty() {
            return Err(EditError::value("/path", "it is empty: name the file that is to be merged"));
        }
        let full = self.path.join(path);
        let import = ImportOptions { max_memory: max_memory.min(self.import.max_memory), ..self.import.clone() };
        let imported = import_path(&full, &import).map_err(|error| EditError::File(error.to_string()))?;
        let blake3 = hash(&full, &imported.scene)
            .map_err(|error| EditError::File(format!("{}: cannot be read: {error}", full.display())))?;
        let mut files = imported.files;
        files.insert(0, full);
        let warnings = imported.warnings.iter().map(|warning| format!("{path}: {warning}")).collect();
        let file = MergedFile { path: path.to_owned(), blake3, scene: Some(Arc::new(imported.scene)) };
        Ok(Read { file, files, warnings })
    }

    /// Reads the document that an edit of a log names.
    ///
    /// # Errors
    /// The file, and why it cannot be read, or that its content is not what it was when the log was made.
    pub fn read_again(&self, file: &MergedFile) -> Result<Arc<Scene>, EditError> {
        let found = self.read(&file.path, self.import.max_memory)?.file;
        let full = self.path.join(&file.path);
        match found.scene {
            Some(scene) if found.blake3 == file.blake3 => Ok(scene),
            _ => Err(EditError::File(format!(
                "{}: the file is not the one that was merged: the BLAKE3 of its content is {}, and was {}; put the old \
                 file back",
                full.display(),
                found.blake3,
                file.blake3
            ))),
        }
    }
}

/// BLAKE3 of a file, and of the buffers and images of its document, which may be in other files.
fn hash(path: &Path, scene: &Scene) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(std::fs::File::open(path)?)?;
    let buffers = scene.buffers.values().map(|buffer| Some(&buffer.data));
    let images = scene.images.values().map(|image| image.data.as_ref());
    for data in buffers.chain(images) {
        // Where one ends is told by its length, so that bytes cannot move from one to the next unseen.
        let bytes = data.map_or(&[][..], |data| data.as_slice());
        hasher.update(&[u8::from(data.is_some())]);
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    }
    Ok(hasher.finalize().to_hex().to_string())
}
