//! `bench load FILE`: from the file to decoded geometry and images, beside other importers of the format; and what comes
//! behind that until a backend can take the scene.

use super::{Measured, Settings, memory};
use crate::failure::{Exit, Failure};
use orthant_render::textures::mip_chain;
use orthant_render::{DecodedScene, DeriveOptions, DerivedScene};
use orthant_resident::image::ImageData;
use orthant_scene::Scene;
use orthant_scene::import::{Format, ImportOptions, Imported, import_path};
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// Another importer, and what it does: only that is compared.
struct Peer {
    name: &'static str,
    ratio: &'static str,
    decodes_images: bool,
    import: fn(&Path) -> Result<(), String>,
}

/// Reads buffers and decodes images; accessors stay as they are.
const GLTF_CRATE: Peer = Peer {
    name: "load_gltf_crate",
    ratio: "ratio_to_gltf_crate",
    decodes_images: true,
    import: |file| gltf::import(file).map(drop).map_err(|e| e.to_string()),
};

/// Gives triangles of indexed vertices, and reads the materials; their images stay files.
const TOBJ: Peer = Peer {
    name: "load_tobj",
    ratio: "ratio_to_tobj",
    decodes_images: false,
    import: |file| {
        let (models, materials) = tobj::load_obj(file, &tobj::GPU_LOAD_OPTIONS).map_err(|e| e.to_string())?;
        materials.map_err(|e| e.to_string())?;
        drop(models);
        Ok(())
    },
};

pub fn run(file: &Path, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let peer = match Format::from_extension(file) {
        Some(Format::Gltf | Format::Glb) => Some(GLTF_CRATE),
        Some(Format::Obj) => Some(TOBJ),
        _ => None,
    };
    let decodes_images = peer.as_ref().is_none_or(|peer| peer.decodes_images);
    let load = || load(file, decodes_images, settings);
    // Memory first: later runs find freed memory that the allocator kept.
    let (first, peak) = memory::peak_of(load);
    let (imported, decoded) = first?;
    let sizes = [imported.scene.object_bytes(), decoded.geometry_bytes(), decoded.image_bytes()];
    let base_levels: Vec<Arc<ImageData>> = decoded.images.iter().flatten().cloned().collect();
    drop(decoded);

    let bytes = std::fs::metadata(file).map_or(0, |m| m.len());
    let [mut ours, mut ready, mut derive, mut mips] =
        ["load", "ready", "derive", "mips"].map(|name| Measured::new(name, bytes));
    let mut theirs = peer.as_ref().map(|peer| Measured::new(peer.name, bytes));
    for _ in 0..settings.runs {
        ours.time(|| load().map(drop))?;
        if let (Some(peer), Some(theirs)) = (&peer, &mut theirs)
            && theirs.counters.is_empty()
            && let Err(error) = theirs.time(|| (peer.import)(file))
        {
            theirs.runs.clear();
            *theirs = theirs.clone().with("refused", error);
        }
        ready.time(|| super::load(file, settings).map(|mut loaded| drop(loaded.derived.load_batch())))?;
        derive.time(|| derive_rows(file, &imported.scene).map(drop))?;
        let images = base_levels.clone();
        mips.time(|| drop(with_mips(&images)));
    }
    if let (Some(peer), Some(theirs)) = (&peer, &theirs)
        && theirs.median_s() > 0.0
    {
        ours = ours.clone().with(peer.ratio, ours.median_s() / theirs.median_s());
    }
    let total: u64 = sizes.iter().sum();
    let mut memory = Measured::new("peak_bytes", bytes).with("bytes", peak);
    if let Some(peak) = peak.filter(|_| total > 0) {
        memory = memory.with("ratio_to_decoded", peak as f64 / total as f64);
    }
    let decoded = Measured::new("decoded_bytes", bytes)
        .with("bytes", total)
        .with("document", sizes[0])
        .with("geometry", sizes[1])
        .with("images", sizes[2]);
    Ok([ours].into_iter().chain(theirs).chain([ready, derive, mips, memory, decoded]).collect())
}

fn load(file: &Path, images: bool, settings: Settings) -> Result<(Imported, DecodedScene), Failure> {
    let mut options = ImportOptions::default();
    options.max_memory = settings.max_memory;
    let imported = import_path(file, &options).map_err(|e| Failure::new(Exit::BadInput, e.to_string()))?;
    let max_bytes = settings.max_memory.saturating_sub(imported.charged_bytes);
    let decoded = DecodedScene::decode(&imported.scene, images, max_bytes)
        .map_err(|e| Failure::bad_input(file, e.what).at(e.place).remedy(e.remedy))?;
    Ok((imported, decoded))
}

fn derive_rows(file: &Path, scene: &Scene) -> Result<DerivedScene, Failure> {
    let options = DeriveOptions { images: false, ..DeriveOptions::default() };
    DerivedScene::derive(scene, &options).map_err(|e| Failure::bad_input(file, e.what).at(e.place).remedy(e.remedy))
}

fn with_mips(images: &[Arc<ImageData>]) -> Vec<ImageData> {
    let chain = |image: &Arc<ImageData>| {
        let level = image.levels[0];
        mip_chain(image.format, level.width, level.height, image.texels.clone())
    };
    images.par_iter().map(chain).collect()
}
