//! The hash of everything that decides the pixels of a rendering: two shares with the same hash belong together.

use orthant_resident::{Environment, Frame};
use orthant_scene::Scene;
use std::fmt::Write;
use std::path::Path;

/// Hashes the scene's content (the file and everything that it refers to), the choices made in it, the environment and
/// the frame, its tile, samples and threads apart.
///
/// # Errors
/// When the scene file cannot be read.
pub fn hash(
    file: &Path,
    scene: &Scene,
    choices: &str,
    environment: &Environment,
    frame: &Frame,
) -> std::io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    let mut part = |bytes: &[u8]| {
        // Lengths keep the parts apart.
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    part(&std::fs::read(file)?);
    for (_, buffer) in scene.buffers().iter() {
        part(&buffer.data);
    }
    for (_, image) in scene.images().iter() {
        part(image.data.as_deref().unwrap_or_default());
    }
    match &environment.map {
        Some(map) => part(bytemuck::cast_slice(map.texels.as_slice())),
        None => part(&[]),
    }

    // The debug form of a float is its shortest exact one, so that equal texts are equal settings.
    let mut text = String::new();
    let size = environment.map.as_ref().map(|m| (m.width, m.height));
    let light = (size, environment.rotation, environment.intensity, environment.sun);
    let Frame { camera, max_depth, roulette_depth, firefly_clamp, estimator, filter, .. } = frame;
    let paths = (max_depth, roulette_depth, firefly_clamp, estimator, filter);
    write!(text, "{choices} {light:?} {camera:?} {paths:?}").map_err(|_| std::io::ErrorKind::Other)?;
    part(text.as_bytes());
    Ok(hasher.finalize().to_hex().to_string())
}

/// The program, its version and the kind of machine: another one may compute other bits.
pub fn program() -> String {
    format!("orthant {} {} {}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH, std::env::consts::OS)
}
