//! Import: from files to a [`Scene`].
//!
//! One folder per format. What they share is here: the bound on memory (`budget`), the files beside the scene file
//! (`files`), data URIs, errors and warnings. An importer returns a complete scene or an error; it never panics on what
//! a file holds, and takes no more memory than [`ImportOptions::max_memory`].

pub(crate) mod budget;
pub(crate) mod crts;
pub(crate) mod data_uri;
mod error;
pub(crate) mod files;
pub(crate) mod gltf;
mod obj;
mod warning;

pub use budget::OverBudget;
pub use error::{ImportError, ImportFault, Place};
pub use files::FileFault;
pub use obj::ObjFault;
pub use warning::{Warning, WarningKind};

use crate::Scene;
use budget::Budget;
use files::Files;
use std::path::{Path, PathBuf};

/// How to import.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ImportOptions {
    /// Bytes that the import may take, files included.
    pub max_memory: u64,
    /// Whether the scene may refer to files outside its own folder tree.
    pub allow_external_files: bool,
}

impl Default for ImportOptions {
    /// 8 GiB, no external files.
    fn default() -> Self {
        Self { max_memory: 8 << 30, allow_external_files: false }
    }
}

/// A format of scene files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// glTF 2.0, JSON.
    Gltf,
    /// glTF 2.0, binary container.
    Glb,
    /// CRTS, the format of ChameleonRT.
    Crts,
    /// Wavefront OBJ.
    Obj,
}

impl Format {
    /// As the command line names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::Crts => "crts",
            Self::Obj => "obj",
        }
    }

    /// The format that a file's name promises, whatever its case. `None` if it has no extension that is known.
    pub fn from_extension(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        [Self::Gltf, Self::Glb, Self::Crts, Self::Obj].into_iter().find(|f| extension.eq_ignore_ascii_case(f.name()))
    }

    /// The format that the content is. `None` if it is none that is known.
    pub fn from_content(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(gltf::GLB_MAGIC) {
            return Some(Self::Glb);
        }
        if crts::is_crts(bytes) {
            return Some(Self::Crts);
        }
        let text = bytes.strip_prefix(gltf::BYTE_ORDER_MARK).unwrap_or(bytes);
        let first = text.iter().find(|b| !b.is_ascii_whitespace());
        if first == Some(&b'{') {
            return Some(Self::Gltf);
        }
        obj::looks_like(bytes).then_some(Self::Obj)
    }
}

/// What an import gives.
#[derive(Debug)]
#[non_exhaustive]
pub struct Imported {
    /// The scene. Its stores are in the order of the file: [`crate::model::Store::slot`] is the file's index.
    pub scene: Scene,
    /// What was loaded although it is not as it should be, or is not shown.
    pub warnings: Vec<Warning>,
    /// What the file was.
    pub format: Format,
    /// Bytes that were counted against [`ImportOptions::max_memory`]: an upper bound of what the scene holds.
    pub charged_bytes: u64,
    /// The files that the scene file refers to and that were read: buffers, images, material libraries. Sorted, each once,
    /// without the scene file.
    pub files: Vec<PathBuf>,
}

/// Imports a file. The format follows from the content and must agree with the extension.
///
/// # Errors
/// The file, the place in it and what is wrong there. Nothing is imported in part.
pub fn import_path(path: &Path, options: &ImportOptions) -> Result<Imported, ImportError> {
    let name = path.display().to_string();
    let budget = Budget::new(options.max_memory);
    let bytes = files::read_file(path, None, &budget).map_err(|fault| ImportError {
        file: name.clone(),
        place: Place::Whole,
        fault: fault.into(),
    })?;
    import_bytes(bytes, path.parent(), path, &name, options, &budget)
}

/// Imports a file that is in memory. `base` is the folder of the files that it refers to, if it may refer to any; `name`
/// is for messages, and its extension, if it has one, must agree with the content.
///
/// # Errors
/// As [`import_path`].
pub fn import_slice(
    bytes: impl Into<Vec<u8>>,
    base: Option<&Path>,
    name: &str,
    options: &ImportOptions,
) -> Result<Imported, ImportError> {
    let bytes = bytes.into();
    let budget = Budget::new(options.max_memory);
    budget.charge(bytes.len() as u64).map_err(|fault| ImportError {
        file: name.to_owned(),
        place: Place::Whole,
        fault: fault.into(),
    })?;
    import_bytes(bytes, base, Path::new(name), name, options, &budget)
}

fn import_bytes(
    bytes: Vec<u8>,
    base: Option<&Path>,
    path: &Path,
    name: &str,
    options: &ImportOptions,
    budget: &Budget,
) -> Result<Imported, ImportError> {
    let whole = |fault| ImportError { file: name.to_owned(), place: Place::Whole, fault };
    let format = agreed_format(&bytes, path).map_err(whole)?;
    let files = Files::new(base, options.allow_external_files, budget);
    let (scene, warnings) = match format {
        Format::Gltf | Format::Glb => gltf::import(bytes, format == Format::Glb, &files, budget),
        Format::Crts => crts::import(bytes, budget),
        Format::Obj => {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            obj::import(bytes, &stem, &files, budget)
        }
    }
    .map_err(|(place, fault)| ImportError { file: name.to_owned(), place, fault })?;
    Ok(Imported { scene, warnings, format, charged_bytes: budget.used(), files: files.into_found() })
}

fn agreed_format(bytes: &[u8], path: &Path) -> Result<Format, ImportFault> {
    let (extension, content) = (Format::from_extension(path), Format::from_content(bytes));
    match (extension, content) {
        (None, Some(content)) if path.extension().is_none() => Ok(content),
        (None, _) => {
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            Err(ImportFault::UnknownFormat(format!("extension \"{extension}\"")))
        }
        // It has no magic number: its importer says what is wrong.
        (Some(Format::Crts), None) => Ok(Format::Crts),
        (Some(_), None) if bytes.is_empty() => Err(ImportFault::UnknownFormat("the file is empty".to_owned())),
        (Some(_), None) => {
            Err(ImportFault::UnknownFormat("neither a JSON object nor a GLB nor the lines of an OBJ".to_owned()))
        }
        (Some(extension), Some(content)) if extension != content => {
            Err(ImportFault::FormatMismatch { extension: extension.name(), content: content.name() })
        }
        (Some(_), Some(content)) => Ok(content),
    }
}
