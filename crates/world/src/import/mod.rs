//! Voxel files of other programs: MagicaVoxel (`.vox`), Sponge schematics (`.schem`, versions 1 to 3), MCEdit schematics
//! (`.schematic`) and Litematica (`.litematic`). All of it is three-dimensional: blocks of one unit in `0 <= w < 1`.
//!
//! The formats are small, and read here rather than by libraries: every length is compared with the bytes that are there before
//! memory is taken, nesting is bounded, and an error names the offset.

mod grid;
mod minecraft;
mod vox;

use crate::palette::PaletteError;
use crate::space::Aabb4Error;
use crate::world::{Applied, ApplyError, World, WorldPatch};
use std::path::Path;

/// How a file may be read.
#[derive(Clone, Copy, Debug)]
pub struct ImportOptions {
    /// Bytes that the import may take.
    pub max_memory: u64,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self { max_memory: 8 << 30 }
    }
}

/// What a file holds.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The content and its materials, authoritative about the box of the content; `None` if the file holds no block.
    pub patch: Option<WorldPatch>,
    /// Blocks.
    pub blocks: u64,
    /// What is not shown, or not as the file says.
    pub warnings: Vec<String>,
}

impl Imported {
    /// A world of what was imported.
    ///
    /// # Errors
    /// [`ApplyError`]; that is a fault of the importer.
    pub fn into_world(self) -> Result<World, ApplyError> {
        let mut world = World::new();
        let _: Option<Applied> = self.patch.map(|patch| world.apply(&patch)).transpose()?;
        Ok(world)
    }
}

/// A format that can be imported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelFormat {
    /// MagicaVoxel.
    Vox,
    /// Sponge.
    Schem,
    /// MCEdit.
    Schematic,
    /// Litematica.
    Litematic,
}

impl VoxelFormat {
    /// The format of an extension, without the dot, in whatever case.
    pub fn by_extension(extension: &str) -> Option<Self> {
        match extension.to_ascii_lowercase().as_str() {
            "vox" => Some(Self::Vox),
            "schem" => Some(Self::Schem),
            "schematic" => Some(Self::Schematic),
            "litematic" => Some(Self::Litematic),
            _ => None,
        }
    }
}

/// Why a file was refused: the file, the place in it, and what is wrong.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {}{fault}", place(*.offset))]
pub struct ImportError {
    /// The file, as the caller named it.
    pub file: String,
    /// The place in it; for compressed files the place in what is unpacked.
    pub offset: Option<u64>,
    /// What is wrong there.
    pub fault: ImportFault,
}

fn place(offset: Option<u64>) -> String {
    offset.map(|offset| format!("byte {offset}: ")).unwrap_or_default()
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportFault {
    /// It cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// No importer knows it.
    #[error("this is no voxel file that can be imported; use .vox, .schem, .schematic or .litematic")]
    UnknownFormat,
    /// It ends too early.
    #[error("the file ends within {0}; it is truncated")]
    Truncated(&'static str),
    /// It is not what the format asks for.
    #[error("{0}")]
    Content(String),
    /// More memory would be taken than is allowed.
    #[error("{needed} bytes of memory are needed, and {limit} are allowed; raise --max-memory")]
    OverBudget {
        /// Bytes that would be in use.
        needed: u64,
        /// Bytes that are allowed.
        limit: u64,
    },
    /// The content does not fit into space.
    #[error("the content leaves the space of a world: {0}")]
    Space(#[from] Aabb4Error),
    /// Its materials cannot be named.
    #[error(transparent)]
    Palette(#[from] PaletteError),
}

/// A fault and its place.
type Fault = (Option<u64>, ImportFault);

fn content<T>(offset: impl Into<Option<u64>>, what: impl Into<String>) -> Result<T, Fault> {
    Err((offset.into(), ImportFault::Content(what.into())))
}

/// Imports a file, by its extension.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path, options: &ImportOptions) -> Result<Imported, ImportError> {
    let file = path.display().to_string();
    let error = |fault| ImportError { file: file.clone(), offset: None, fault };
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let format = VoxelFormat::by_extension(extension).ok_or_else(|| error(ImportFault::UnknownFormat))?;
    let length = std::fs::metadata(path).map_err(|e| error(e.into()))?.len();
    if length > options.max_memory {
        return Err(error(ImportFault::OverBudget { needed: length, limit: options.max_memory }));
    }
    let bytes = std::fs::read(path).map_err(|e| error(e.into()))?;
    import_bytes(&file, format, &bytes, options)
}

/// Imports a file in memory. `name` is for errors.
///
/// # Errors
/// [`ImportError`].
pub fn import_bytes(
    name: &str,
    format: VoxelFormat,
    bytes: &[u8],
    options: &ImportOptions,
) -> Result<Imported, ImportError> {
    let limit = options.max_memory.saturating_sub(bytes.len() as u64);
    let imported = match format {
        VoxelFormat::Vox => vox::import(bytes, limit),
        VoxelFormat::Schem => minecraft::import_sponge(bytes, limit),
        VoxelFormat::Schematic => minecraft::import_mcedit(bytes, limit),
        VoxelFormat::Litematic => minecraft::import_litematic(bytes, limit),
    };
    imported.map_err(|(offset, fault)| ImportError { file: name.to_owned(), offset, fault })
}
