//! The files, and which of them must be refused.

use orthant_scene::import::{ImportError, ImportOptions, Imported, import_path};
use std::path::{Path, PathBuf};

/// The folder of the assets; `None` (said once per test) where the environment does not name one.
pub fn assets() -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("ORTHANT_ASSETS") else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return None;
    };
    let folder = PathBuf::from(folder);
    assert!(folder.is_dir(), "ORTHANT_ASSETS names {}, which is no folder", folder.display());
    Some(folder)
}

/// All files below a folder whose extension is one of these, sorted.
pub fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        for entry in entries {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| extensions.iter().any(|x| e.eq_ignore_ascii_case(x))) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Every well-formed glTF of the assets.
pub fn models(assets: &Path) -> Vec<PathBuf> {
    let malformed = assets.join("gltf-malformed");
    let mut models = files(assets, &["gltf", "glb"]);
    models.retain(|path| !path.starts_with(&malformed));
    assert!(models.len() > 100, "only {} models below {}", models.len(), assets.display());
    models
}

pub fn import(path: &Path) -> Result<Imported, ImportError> {
    import_path(path, &ImportOptions::default())
}

/// The document of a file, by a reader of its own.
pub fn json(path: &Path) -> serde_json::Value {
    let bytes = std::fs::read(path).unwrap();
    let text = if bytes.starts_with(b"glTF") {
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        &bytes[20..20 + length]
    } else {
        &bytes
    };
    serde_json::from_slice(text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}
