//! Memory of loading third-party files: at its height, a small multiple of what they decode to, and never more than is
//! allowed. Every allocation of the process is counted, so this file has one test.

mod counting;

use counting::peak_of;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use orthant_scene::import::{ImportOptions, import_path};
use std::path::{Path, PathBuf};

/// What is not in proportion to a file: tables, threads, what decoders begin with.
const CONSTANT: u64 = 2 << 20;
const MAX_MEMORY: u64 = 1 << 30;

/// Loads a file as renderers do. Gives the bytes of what there is in the end.
fn decoded_bytes(path: &Path, max_memory: u64) -> Result<u64, String> {
    let mut options = ImportOptions::default();
    options.max_memory = max_memory;
    let imported = import_path(path, &options).map_err(|e| e.to_string())?;
    let max_bytes = max_memory - imported.charged_bytes;
    let derive = DeriveOptions { max_bytes, ..DeriveOptions::default() };
    let mut derived = DerivedScene::derive(&imported.scene, &derive).map_err(|e| e.to_string())?;
    let rows = derived.row_bytes() as u64;
    let batch = derived.load_batch();
    let texels: usize = batch.images.iter().filter_map(|write| write.image.as_ref()).map(|i| i.texels.len()).sum();
    Ok(source_bytes(&imported.scene) + rows + batch.upload_bytes() + texels as u64)
}

/// The document, with its buffers and encoded images.
fn source_bytes(scene: &Scene) -> u64 {
    let buffers: usize = scene.buffers().values().map(|b| b.data.len()).sum();
    let images: usize = scene.images().values().filter_map(|i| i.data.as_ref()).map(|data| data.len()).sum();
    scene.object_bytes() + buffers as u64 + images as u64
}

fn scene_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            scene_files(&path, found);
        } else if path.extension().is_some_and(|e| ["gltf", "glb", "obj", "crts"].iter().any(|known| e == *known)) {
            found.push(path);
        }
    }
}

#[test]
fn loading_takes_a_small_multiple_of_what_files_decode_to_and_never_more_than_is_allowed() {
    let Some(folder) = std::env::var_os("ORTHANT_ASSETS") else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    let mut files = Vec::new();
    scene_files(Path::new(&folder), &mut files);
    files.sort();
    assert!(files.len() > 100, "{} files", files.len());
    // The first load fills tables that stay.
    let _ = decoded_bytes(&files[0], MAX_MEMORY);
    let mut faults = Vec::new();
    for path in &files {
        let (peak, decoded) = peak_of(|| decoded_bytes(path, MAX_MEMORY));
        let bound = match &decoded {
            Ok(decoded) => 4 * decoded + CONSTANT,
            // What is refused is refused before it is decoded.
            Err(_) => 4 * std::fs::metadata(path).unwrap().len() + CONSTANT,
        };
        if peak > bound {
            faults.push(format!("{}: {peak} bytes, and {bound} are due ({decoded:?})", path.display()));
        }
        // With half as much, either less is taken, or nothing is loaded.
        for max_memory in [peak / 2, peak / 4 * 3] {
            let (peak, decoded) = peak_of(|| decoded_bytes(path, max_memory));
            if peak > max_memory + CONSTANT {
                let result = decoded.map(|_| "loaded");
                faults.push(format!("{}: {peak} bytes of {max_memory} ({result:?})", path.display()));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
