//! `bench derive`: model to rows at growing sizes, beside copying the same bytes.

use super::{Measured, Settings};
use crate::failure::{Exit, Failure};
use crate::generate;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use orthant_scene::import::{ImportOptions, import_path};

/// Nodes of the generated city at each size; each node with a mesh is a render node.
const SIZES: [u32; 4] = [1_000, 10_000, 100_000, 1_000_000];

pub fn run(settings: Settings) -> Result<Vec<Measured>, Failure> {
    SIZES.iter().map(|&n| measure(n, settings)).collect()
}

fn measure(nodes: u32, settings: Settings) -> Result<Measured, Failure> {
    let scene = city(nodes, settings)?;
    let options = DeriveOptions { images: false, ..DeriveOptions::default() };
    let derive = || {
        DerivedScene::derive(&scene, &options)
            .map_err(|e| Failure::new(Exit::Internal, format!("generated scene: {e}")))
    };
    let first = derive()?;
    let mut derived = Measured::new("derive", first.render_nodes.len() as u64);
    let mut copied = Measured::new("copy", first.render_nodes.len() as u64);
    let bytes = first.row_bytes();
    // What a copy of the same bytes costs: fresh memory, as the derivation writes.
    let source = vec![1u8; bytes];
    for _ in 0..settings.runs {
        derived.time(derive).map(drop)?;
        copied.time(|| drop(std::hint::black_box(source.clone())));
    }
    let ratio = derived.median_s() / copied.median_s();
    Ok(derived
        .with("nodes", nodes)
        .with("bytes_written", bytes)
        .with("copy_s", copied.median_s())
        .with("memcpy_ratio", ratio))
}

/// A generated city, as a file that is read back.
fn city(nodes: u32, settings: Settings) -> Result<Scene, Failure> {
    let internal = |e: String| Failure::new(Exit::Internal, format!("generated scene: {e}"));
    let generator = generate::find("city").ok_or_else(|| internal("there is no city".into()))?;
    let folder = tempfile::tempdir().map_err(|e| internal(e.to_string()))?;
    let path = folder.path().join("city.glb");
    (generator.build)(nodes, 0).write(&path)?;
    let mut options = ImportOptions::default();
    options.max_memory = settings.max_memory;
    import_path(&path, &options).map(|i| i.scene).map_err(|e| internal(e.to_string()))
}
