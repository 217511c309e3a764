//! What every target does with bytes that it made up: all that the program would do with such a file short of rendering.

use orthant_render::derived::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use orthant_scene::export::{ExportOptions, crts, gltf};
use orthant_scene::import::{ImportOptions, import_slice};

/// Bytes that an import and what follows from it may take: libFuzzer's own limit on a process is above.
const MAX_BYTES: u64 = 256 << 20;

/// Imports a file of a format that its name says. `None` if it was refused.
pub fn import(bytes: &[u8], name: &str) -> Option<Scene> {
    let mut options = ImportOptions::default();
    options.max_memory = MAX_BYTES;
    import_slice(bytes, None, name, &options).ok().map(|imported| imported.scene)
}

/// Derives a scene and exports it to every format that is written in memory. What was written has to be read again, as
/// the same document; if the scene comes from another format, what is written of that has to be.
pub fn exercise(scene: &Scene, is_gltf: bool) {
    let _ = DerivedScene::derive(scene, &DeriveOptions { max_bytes: MAX_BYTES, ..DeriveOptions::default() });
    let _ = crts::write(scene, &mut std::io::sink());
    let Some((again, is_whole)) = through_glb(scene) else { return };
    let (from, to) = if is_gltf {
        (scene, again)
    } else {
        // Which members a file states is known of glTF only.
        let Some((twice, _)) = through_glb(&again) else { panic!("what could be exported once cannot be again") };
        (&again, twice)
    };
    if is_whole && let Err(difference) = from.same_document(&to) {
        panic!("the exported document differs at {difference}");
    }
}

/// A scene that was written and read, and whether all of it could be written. `None` if it is refused, or needs files.
fn through_glb(scene: &Scene) -> Option<(Scene, bool)> {
    let files = gltf::to_glb(scene, &ExportOptions::default()).ok().filter(|files| files.others.is_empty())?;
    let again = import_slice(files.document, None, "again.glb", &ImportOptions::default());
    Some((again.expect("what was exported can be imported").scene, files.notes.is_empty()))
}
