//! The hash of everything that decides the pixels of a rendering: two shares with the same hash belong together.

use crate::failure::Failure;
use orthant_resident::{Environment, Frame};
use orthant_scene::Scene;
use std::fmt::Write;
use std::path::Path;

/// Hashes the content (the files, and everything that the scene refers to), the choices made in it, the environment and
/// the frame, its tile, samples and threads apart.
///
/// # Errors
/// When a file cannot be read.
pub fn hash(
    files: &[&Path],
    scene: Option<&Scene>,
    choices: &str,
    environment: &Environment,
    frame: &Frame,
) -> Result<String, Failure> {
    let mut hasher = blake3::Hasher::new();
    let mut part = |bytes: &[u8]| {
        // Lengths keep the parts apart.
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    for file in files {
        part(&std::fs::read(file).map_err(|e| Failure::io(file, "read the file", &e))?);
    }
    for (_, buffer) in scene.iter().flat_map(|scene| scene.buffers().iter()) {
        part(&buffer.data);
    }
    for (_, image) in scene.iter().flat_map(|scene| scene.images().iter()) {
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
    let Frame { camera, max_depth, roulette_depth, firefly_clamp, estimator, filter, world, .. } = frame;
    let paths = (max_depth, roulette_depth, firefly_clamp, estimator, filter);
    // Writing to a string does not fail.
    let _ok = write!(text, "{choices} {light:?} {camera:?} {paths:?} {world:?}");
    part(text.as_bytes());
    Ok(hasher.finalize().to_hex().to_string())
}

/// The program, its version and the kind of machine: another one may compute other bits.
pub fn program() -> String {
    format!("orthant {} {} {}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH, std::env::consts::OS)
}
