//! The crate `gltf` reads the same accessors by code of its own.

use crate::corpus::*;
use gltf::mesh::util::{ReadIndices, ReadTexCoords};
use orthant_scene::accessor::{read_colors, read_f32, read_indices, read_joints};
use orthant_scene::model::{Accessor, AccessorId, ComponentType, Store};
use orthant_scene::{Scene, accessor};
use std::path::Path;

/// The peer's buffers, if it can read the file at all.
fn peer(path: &Path) -> Option<(gltf::Document, Vec<gltf::buffer::Data>)> {
    let bytes = std::fs::read(path).ok()?;
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice_without_validation(&bytes).ok()?;
    // The peer reads the plain form, whose triangles may begin with another corner than those of the compressed one.
    let compressions = ["EXT_meshopt_compression", "KHR_draco_mesh_compression"];
    if document.extensions_used().any(|name| compressions.contains(&name)) {
        return None;
    }
    let buffers = gltf::import_buffers(&document, path.parent(), blob).ok()?;
    Some((document, buffers))
}

#[test]
fn attributes_and_indices_are_those_that_the_gltf_crate_reads() {
    let Some(assets) = assets() else { return };
    let (mut files, mut attributes) = (0, 0);
    for path in models(&assets) {
        let Ok(imported) = import(&path) else { continue };
        let Some((document, buffers)) = peer(&path) else { continue };
        files += 1;
        for mesh in document.meshes() {
            for primitive in mesh.primitives() {
                attributes += compare(&imported.scene, &primitive, &buffers, &path);
            }
        }
    }
    println!("{attributes} attributes of {files} files agree");
    assert!(files > 100 && attributes > 2000, "{attributes} attributes of {files} files");
}

fn compare(scene: &Scene, primitive: &gltf::Primitive<'_>, buffers: &[gltf::buffer::Data], path: &Path) -> usize {
    use gltf::Semantic;
    let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()]));
    let mut compared = 0;
    let mut equal = |what: &str, same: bool| {
        assert!(same, "{}: {what} of primitive {}", path.display(), primitive.index());
        compared += 1;
    };
    for (semantic, peer_accessor) in primitive.attributes() {
        let id = id(scene, &peer_accessor);
        let is_float = scene.accessors()[id].component_type == ComponentType::F32;
        match semantic {
            // The peer reads quantised positions, normals and tangents as if they were floats.
            Semantic::Positions if is_float => {
                let theirs: Vec<_> = reader.read_positions().unwrap().collect();
                equal("POSITION", bits(&read_f32::<3>(scene, id).unwrap()) == bits(&theirs));
            }
            Semantic::Normals if is_float => {
                let theirs: Vec<_> = reader.read_normals().unwrap().collect();
                equal("NORMAL", bits(&read_f32::<3>(scene, id).unwrap()) == bits(&theirs));
            }
            Semantic::Tangents if is_float => {
                let theirs: Vec<_> = reader.read_tangents().unwrap().collect();
                equal("TANGENT", bits(&read_f32::<4>(scene, id).unwrap()) == bits(&theirs));
            }
            Semantic::TexCoords(set) => {
                let a = &scene.accessors()[id];
                let unit =
                    is_float || a.normalized && matches!(a.component_type, ComponentType::U8 | ComponentType::U16);
                if !unit {
                    continue;
                }
                let theirs: Vec<_> = match reader.read_tex_coords(set).unwrap() {
                    ReadTexCoords::U8(i) => ReadTexCoords::U8(i).into_f32().collect(),
                    other => other.into_f32().collect(),
                };
                equal("TEXCOORD", close(&read_f32::<2>(scene, id).unwrap(), &theirs));
            }
            Semantic::Colors(set) => {
                let theirs: Vec<_> = reader.read_colors(set).unwrap().into_rgba_f32().collect();
                equal("COLOR", close(&read_colors(scene, id).unwrap(), &theirs));
            }
            Semantic::Joints(set) => {
                let theirs: Vec<_> = reader.read_joints(set).unwrap().into_u16().collect();
                equal("JOINTS", read_joints(scene, id).unwrap() == theirs);
            }
            Semantic::Weights(set) => {
                let theirs: Vec<_> = reader.read_weights(set).unwrap().into_f32().collect();
                equal("WEIGHTS", close(&read_f32::<4>(scene, id).unwrap(), &theirs));
            }
            _ => accessor::check(scene, id).unwrap(),
        }
    }
    if let Some(peer_accessor) = primitive.indices() {
        let theirs: Vec<u32> = match reader.read_indices().unwrap() {
            ReadIndices::U8(i) => i.map(u32::from).collect(),
            ReadIndices::U16(i) => i.map(u32::from).collect(),
            ReadIndices::U32(i) => i.collect(),
        };
        equal("indices", read_indices(scene, id(scene, &peer_accessor)).unwrap() == theirs);
    }
    for (target, (positions, normals, _)) in primitive.morph_targets().zip(reader.read_morph_targets()) {
        if let (Some(a), Some(theirs)) = (target.positions(), positions) {
            let ours = read_f32::<3>(scene, id(scene, &a)).unwrap();
            equal("morph POSITION", bits(&ours) == bits(&theirs.collect::<Vec<_>>()));
        }
        if let (Some(a), Some(theirs)) = (target.normals(), normals) {
            let ours = read_f32::<3>(scene, id(scene, &a)).unwrap();
            equal("morph NORMAL", bits(&ours) == bits(&theirs.collect::<Vec<_>>()));
        }
    }
    compared
}

/// The id of the accessor with the same index.
fn id(scene: &Scene, accessor: &gltf::Accessor<'_>) -> AccessorId {
    let id = scene.accessors().ids().nth(accessor.index()).unwrap();
    assert_eq!(Store::<AccessorId, Accessor>::slot(id), accessor.index());
    id
}

/// Compared as bits: files hold NaN.
fn bits<const N: usize>(values: &[[f32; N]]) -> Vec<u32> {
    values.as_flattened().iter().map(|v| v.to_bits()).collect()
}

/// Equal but for the rounding of a division.
fn close<const N: usize>(a: &[[f32; N]], b: &[[f32; N]]) -> bool {
    let same = |(x, y): (&f32, &f32)| (x - y).abs() <= 1e-6 || x.to_bits() == y.to_bits();
    a.len() == b.len() && a.as_flattened().iter().zip(b.as_flattened()).all(same)
}
