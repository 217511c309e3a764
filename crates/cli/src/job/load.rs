//! From a scene file to a derived scene.

use super::animation::{self, Moment};
use crate::failure::{Exit, Failure};
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use orthant_scene::import::{Format, ImportOptions, import_path};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What to load, and how.
#[derive(Clone, Debug)]
pub struct LoadOptions<'a> {
    /// The scene of the file, by index.
    pub scene: Option<usize>,
    /// The material variant, by name.
    pub variant: Option<&'a str>,
    /// The time of an animation to show; `None` is the rest pose.
    pub moment: Option<Moment<'a>>,
    /// Whether the scene may refer to files outside its own folder tree.
    pub allow_external_files: bool,
    /// Bytes that loading may take.
    pub max_memory: u64,
}

/// A scene, loaded and derived.
#[derive(Debug)]
pub struct Loaded {
    /// The file.
    pub path: PathBuf,
    /// What it was.
    pub format: Format,
    /// The files that it refers to.
    pub files: Vec<PathBuf>,
    /// The document.
    pub scene: Scene,
    /// What a renderer needs of it.
    pub derived: DerivedScene,
    /// How it was derived.
    pub options: DeriveOptions,
    /// What was loaded or is shown otherwise than the file says, each as `place: what`.
    pub warnings: Vec<String>,
    /// Time of the import.
    pub load_time: Duration,
    /// Time of the derivation, geometry and images decoded.
    pub derive_time: Duration,
}

/// Loads and derives.
///
/// # Errors
/// A bad file (bad input), or a scene, variant or animation that it does not have (usage).
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, Failure> {
    let start = Instant::now();
    let mut import = ImportOptions::default();
    import.max_memory = options.max_memory;
    import.allow_external_files = options.allow_external_files;
    // The message has the file and the place in it already.
    let imported = import_path(path, &import).map_err(|e| Failure::new(Exit::BadInput, e.to_string()))?;
    let load_time = start.elapsed();

    let scene = imported.scene;
    let shown = options
        .scene
        .map(|index| {
            scene.scenes().ids().nth(index).ok_or_else(|| {
                let what = format!("--scene {index}: the file has {} scenes", scene.scenes().len());
                Failure::usage(what).in_file(path)
            })
        })
        .transpose()?;
    let variant = options
        .variant
        .map(|name| {
            scene.variants().iter().find(|(_, v)| v.name == name).map(|(id, _)| id).ok_or_else(|| {
                let names: Vec<&str> = scene.variants().iter().map(|(_, v)| v.name.as_str()).collect();
                let known = if names.is_empty() { "no variants".into() } else { format!("only {}", names.join(", ")) };
                Failure::usage(format!("--variant {name}: the file has {known}")).in_file(path)
            })
        })
        .transpose()?;

    let start = Instant::now();
    let max_bytes = options.max_memory.saturating_sub(imported.charged_bytes);
    let (pose, animation_warnings) = match options.moment {
        Some(moment) => animation::pose(&scene, moment, path, max_bytes)?,
        None => Default::default(),
    };
    let derive = DeriveOptions { scene: shown, variant, max_bytes, pose, ..DeriveOptions::default() };
    let derived = DerivedScene::derive(&scene, &derive)
        .map_err(|e| Failure::bad_input(path, e.what).at(e.place).remedy(e.remedy))?;
    let derive_time = start.elapsed();
    let warnings = imported
        .warnings
        .iter()
        .map(ToString::to_string)
        .chain(animation_warnings.iter().map(ToString::to_string))
        .chain(derived.warnings.iter().map(ToString::to_string))
        .collect();
    let (path, format, files) = (path.to_owned(), imported.format, imported.files);
    Ok(Loaded { path, format, files, scene, derived, options: derive, warnings, load_time, derive_time })
}

impl Loaded {
    /// Prints the warnings on stderr, one line each.
    pub fn print_warnings(&self) {
        for warning in &self.warnings {
            let line = warning.split_whitespace().collect::<Vec<_>>().join(" ");
            eprintln!("warning: {}: {line}", self.path.display());
        }
    }
}
