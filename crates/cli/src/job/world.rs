//! From a world file, or a voxel file of another program, to a world.

use crate::failure::{Exit, Failure};
use orthant_world::file::{self, ReadOptions};
use orthant_world::import::{self, ImportOptions, VoxelFormat};
use orthant_world::{BlockId, Content, World};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What a world is read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorldFormat {
    /// Orthant's own.
    Orw,
    /// Another program's.
    Voxels(VoxelFormat),
}

impl WorldFormat {
    /// By the extension, in whatever case; `None` for what is no world.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        if extension.eq_ignore_ascii_case(file::EXTENSION) {
            return Some(Self::Orw);
        }
        VoxelFormat::by_extension(extension).map(Self::Voxels)
    }

    /// The extension that it has.
    pub fn name(self) -> &'static str {
        match self {
            Self::Orw => file::EXTENSION,
            Self::Voxels(VoxelFormat::Vox) => "vox",
            Self::Voxels(VoxelFormat::Schem) => "schem",
            Self::Voxels(VoxelFormat::Schematic) => "schematic",
            Self::Voxels(VoxelFormat::Litematic) => "litematic",
        }
    }
}

/// A world, loaded.
#[derive(Debug)]
pub struct LoadedWorld {
    /// The file.
    pub path: PathBuf,
    /// What it was.
    pub format: WorldFormat,
    /// Bytes of the file.
    pub file_bytes: u64,
    /// The world.
    pub world: World,
    /// What is not as the file says, or not in it any more.
    pub warnings: Vec<String>,
    /// Time of the import.
    pub load_time: Duration,
}

impl LoadedWorld {
    /// Prints the warnings on stderr, one line each.
    pub fn print_warnings(&self) {
        for warning in &self.warnings {
            let line = warning.split_whitespace().collect::<Vec<_>>().join(" ");
            eprintln!("warning: {}: {line}", self.path.display());
        }
    }
}

/// Loads a world. With `salvage` a damaged `.orw` file gives what is intact of it, and a warning for each thing that is not.
///
/// # Errors
/// A file that is no world, is damaged, or needs more than `max_memory` bytes (bad input); `salvage` of another program's file (usage).
pub fn load_world(path: &Path, salvage: bool, max_memory: u64) -> Result<LoadedWorld, Failure> {
    let start = Instant::now();
    let Some(format) = WorldFormat::of(path) else {
        let what = "the extension says no world: use .orw, .vox, .schem, .schematic or .litematic";
        return Err(Failure::bad_input(path, what));
    };
    let metadata = std::fs::metadata(path).map_err(|e| Failure::io(path, "read the file", &e))?;
    if !metadata.is_file() {
        let is = if metadata.is_dir() { "is a folder" } else { "is no regular file" };
        return Err(Failure::bad_input(path, is).remedy("name a world file"));
    }
    // Messages have the file and the place in it already, and most what to do.
    let fault = |error: &dyn std::fmt::Display, remedy: Option<&str>| {
        let failure = Failure::new(Exit::BadInput, error.to_string());
        if let Some(remedy) = remedy { failure.remedy(remedy) } else { failure }
    };
    let of_file = |e: &file::FileError| {
        let remedy = match e.fault {
            file::FileFault::NotAWorld => Some("give the file the extension of its format"),
            file::FileFault::Trailing => Some("cut them off, or write the world again"),
            _ => None,
        };
        fault(e, remedy)
    };
    let of_import = |e: &import::ImportError| {
        let is_damaged = matches!(e.fault, import::ImportFault::Content(_) | import::ImportFault::Truncated(_));
        fault(e, is_damaged.then_some("give the file the extension of its format, or write it again by its program"))
    };
    let (world, mut warnings): (World, Vec<String>) = match format {
        WorldFormat::Orw => {
            let options = ReadOptions { max_memory };
            if salvage {
                let salvaged = file::salvage(path, &options).map_err(|e| of_file(&e))?;
                let lost = |(offset, fault): &(u64, file::FileFault)| {
                    // What to do about it was done.
                    let what = fault.to_string().replace("; --salvage reads what is intact", "");
                    format!("byte {offset}: {what}; what is intact was taken")
                };
                (salvaged.world, salvaged.damage.iter().map(lost).collect())
            } else {
                (file::read(path, &options).map_err(|e| of_file(&e))?, Vec::new())
            }
        }
        WorldFormat::Voxels(_) if salvage => {
            return Err(Failure::usage("--salvage is for .orw files").in_file(path).remedy("leave it out"));
        }
        WorldFormat::Voxels(_) => {
            let mut imported = import::import(path, &ImportOptions { max_memory }).map_err(|e| of_import(&e))?;
            let warnings = std::mem::take(&mut imported.warnings);
            (imported.into_world().map_err(|e| Failure::bad_input(path, e.to_string()))?, warnings)
        }
    };
    if world.keeps_unknown_bodies() {
        warnings.push("moving bodies are kept, and not shown".into());
    }
    let (path, load_time) = (path.to_owned(), start.elapsed());
    Ok(LoadedWorld { path, format, file_bytes: metadata.len(), world, warnings, load_time })
}

/// Writes a world, whole or not at all.
///
/// # Errors
/// An I/O error that names the file.
pub fn write_world(path: &Path, world: &World) -> Result<(), Failure> {
    file::write(path, world).map_err(|e| match &e.fault {
        file::FileFault::Io(io) => Failure::io(path, "write the file", io),
        fault => Failure::bad_input(path, fault.to_string()),
    })
}

/// Numbers of blocks that the world has and its palette has not, in ascending order.
fn unknown_blocks(world: &World) -> Vec<u16> {
    let mut numbers = BTreeSet::new();
    for (_, region) in world.regions() {
        match &region.content {
            Content::Uniform(block) => numbers.extend([block.id()]),
            Content::Chunk { chunk, .. } => numbers.extend(chunk.palette().iter().map(|block| block.id())),
        }
    }
    let is_unknown = |id: &BlockId| *id != BlockId::AIR && world.palette().get(*id).is_none();
    numbers.into_iter().filter(is_unknown).map(|id| id.0).collect()
}

/// Warns once of blocks that the palette has no material of.
pub fn warn_of_unknown_blocks(path: &Path, world: &World) {
    let unknown: Vec<_> = unknown_blocks(world).iter().map(ToString::to_string).collect();
    if !unknown.is_empty() {
        let what = "the palette has no material of the blocks";
        eprintln!("warning: {}: {what} {}, which are drawn in magenta", path.display(), unknown.join(", "));
    }
}

/// Refuses an output whose extension is not that of a world file.
///
/// # Errors
/// The option and the file (usage).
pub fn check_extension(name: &str, path: &Path) -> Result<(), Failure> {
    if WorldFormat::of(path) == Some(WorldFormat::Orw) {
        return Ok(());
    }
    let what = format!("{name} {}: a world is written as .orw: change the extension", path.display());
    Err(Failure::usage(what))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worlds_are_known_by_their_extensions_in_any_case() {
        assert_eq!(WorldFormat::of(Path::new("a/b.ORW")), Some(WorldFormat::Orw));
        for name in ["vox", "Schem", "SCHEMATIC", "litematic"] {
            let format = WorldFormat::of(Path::new(&format!("x.{name}"))).expect("a format");
            assert_eq!(format.name(), name.to_ascii_lowercase());
        }
        for other in ["a.glb", "orw", "a.orw.glb", ".orw"] {
            assert_eq!(WorldFormat::of(Path::new(other)), None, "{other}");
        }
    }
}
