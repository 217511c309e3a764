//! The files beside a document. A file that is there is never overwritten with other content: the old document, or another
//! one, may refer to it.

use super::{ExportError, ExportFault, ExportReport, atomic, names};
use crate::model::Blob;
use std::io;
use std::path::{Path, PathBuf};

/// A file beside the document.
pub struct SideFile {
    /// Its path relative to the document, with `/` between names.
    pub path: String,
    pub data: Blob,
}

/// Writes files beside a document, and reports them.
pub struct Output<'a> {
    folder: &'a Path,
    pub report: ExportReport,
}

/// A name for a file.
pub struct Name {
    /// Relative to the folder.
    pub path: String,
    /// Whether the file is there already, with the same content.
    is_there: bool,
}

impl<'a> Output<'a> {
    /// `document` is the file that the others stand beside.
    pub fn new(document: &'a Path) -> Self {
        Self { folder: atomic::folder(document), report: ExportReport::default() }
    }

    /// Writes a file under the name that [`Output::place`] gives it. Returns the path that it has got.
    pub fn side_file(&mut self, file: &SideFile) -> Result<String, ExportError> {
        let name = self.place(file)?;
        let path = name.path.clone();
        self.write(name, [file.data.as_slice()])?;
        Ok(path)
    }

    /// The name of a file that is to be written: its own or, if that is taken by other content, one that follows from its
    /// content. Nothing is written yet.
    pub fn place(&self, file: &SideFile) -> Result<Name, ExportError> {
        let failed = |fault| ExportError { file: self.folder.join(&file.path), fault };
        let mut path = file.path.clone();
        if let Some((inner, name)) = file.path.rsplit_once('/')
            && !self.is_inside(inner).map_err(|error| failed(error.into()))?
        {
            name.clone_into(&mut path);
        }
        self.free_name(path, [file.data.as_slice()].into_iter()).map_err(failed)
    }

    /// Whether a folder is below, or will be when it is made. False if symbolic links lead it elsewhere.
    fn is_inside(&self, inner: &str) -> io::Result<bool> {
        let folder = self.folder.join(inner);
        let there = folder.ancestors().find(|folder| folder.exists()).unwrap_or(self.folder);
        Ok(there.canonicalize()?.starts_with(self.folder.canonicalize()?))
    }

    /// The name itself, if there is no such file or one with the same content; else one that follows from the content.
    pub fn free_name<'p>(
        &self,
        path: String,
        pieces: impl Iterator<Item = &'p [u8]> + Clone,
    ) -> Result<Name, ExportFault> {
        let full = self.folder.join(&path);
        if atomic::has_content(&full, pieces.clone())? {
            return Ok(Name { path, is_there: true });
        }
        if std::fs::symlink_metadata(&full).is_err() {
            return Ok(Name { path, is_there: false });
        }
        let path = names::with_hash(&path, pieces.clone());
        let is_there = atomic::has_content(&self.folder.join(&path), pieces)?;
        Ok(Name { path, is_there })
    }

    pub fn write<'p>(&mut self, name: Name, pieces: impl IntoIterator<Item = &'p [u8]>) -> Result<(), ExportError> {
        let path = self.folder.join(&name.path);
        if !name.is_there {
            if name.path.contains('/') {
                let folder = atomic::folder(&path);
                let failed = |error: io::Error| ExportError { file: folder.to_owned(), fault: error.into() };
                std::fs::create_dir_all(folder).map_err(failed)?;
            }
            let mut bytes = 0;
            let written = atomic::write(&path, |w| {
                pieces.into_iter().try_for_each(|piece| {
                    bytes += piece.len() as u64;
                    w.write_all(piece)
                })
            });
            written.map_err(|error| ExportError { file: path.clone(), fault: error.into() })?;
            self.report.bytes_written += bytes;
        }
        self.report.files.push(path);
        Ok(())
    }
}

/// The files `STEM-HASH.EXTENSION` of earlier exports to this path that this one does not use.
pub fn superseded(path: &Path, stem: &str, extension: &str, report: &ExportReport) -> Vec<PathBuf> {
    let folder = atomic::folder(path);
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_ours = |name: &str| names::is_hashed(name, stem, extension);
    let ours = entries.filter(|entry| entry.file_name().to_str().is_some_and(is_ours));
    let paths = ours.map(|entry| folder.join(entry.file_name())).filter(|path| !report.files.contains(path));
    let mut paths: Vec<_> = paths.collect();
    paths.sort();
    paths
}
