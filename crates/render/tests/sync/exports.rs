//! What random edits have led to, exported and loaded again, is the same scene.

use crate::{Live, scenes};
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::SceneBatch;
use orthant_resident::rows::{MaterialRow, MeshDesc, RenderNodeRow};
use orthant_scene::Scene;
use orthant_scene::edit::random::{Choices, operation};
use orthant_scene::export::{ExportOptions, gltf};
use orthant_scene::import::{ImportOptions, import_slice};

/// A render node, but for the numbering of everything.
#[derive(Debug, PartialEq)]
struct Shown {
    name: Option<String>,
    row: RenderNodeRow,
    desc: MeshDesc,
    material: Vec<u8>,
    positions: Vec<[f32; 3]>,
    indices: Vec<u32>,
}

fn slice<T: Clone>(rows: &[T], first: u32, count: u32) -> Vec<T> {
    rows[first as usize..(first + count) as usize].to_vec()
}

/// Texture references are numbered by use; here they only say whether there is one. Materials are numbered by their slot.
fn without_numbers(mut row: MaterialRow) -> MaterialRow {
    row.id = u32::from(row.id != orthant_resident::rows::NONE);
    for slot in [
        &mut row.base_color_texture,
        &mut row.metallic_roughness_texture,
        &mut row.normal_texture,
        &mut row.occlusion_texture,
        &mut row.emissive_texture,
    ] {
        slot.texture = u32::from(slot.texture != orthant_resident::rows::NONE);
    }
    row
}

fn shown(scene: &Scene) -> Vec<Shown> {
    // A document cannot say which variant is shown.
    let variant = scene.shown_variant();
    let mut derived = DerivedScene::derive(scene, &DeriveOptions { variant, ..DeriveOptions::default() }).unwrap();
    let SceneBatch { positions: from_positions, indices: from_indices, .. } = derived.load_batch();
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    from_positions.apply_to(&mut positions);
    from_indices.apply_to(&mut indices);
    let rows = derived.render_nodes.iter().enumerate();
    rows.map(|(i, row)| {
        let desc = derived.mesh_descs[row.primitive as usize];
        let node = derived.node_of(i as u32).unwrap();
        Shown {
            name: scene.nodes()[node].name.clone(),
            row: RenderNodeRow {
                node: 0,
                primitive: 0,
                material: 0,
                emitter: u32::from(row.emitter != u32::MAX),
                ..*row
            },
            positions: slice(&positions, desc.first_vertex, desc.vertex_count),
            indices: slice(&indices, desc.first_index, desc.index_count),
            // Where they lie in the arenas is free.
            desc: MeshDesc { first_vertex: 0, first_index: 0, first_tangent: 0, first_emitter_triangle: 0, ..desc },
            material: bytemuck::bytes_of(&without_numbers(derived.materials[row.material as usize])).to_vec(),
        }
    })
    .collect()
}

/// The document, loaded again, in both forms.
fn again(scene: &Scene) -> [Scene; 2] {
    let import = |bytes: Vec<u8>, name: &str, folder: Option<&std::path::Path>| {
        import_slice(bytes, folder, name, &ImportOptions::default()).unwrap().scene
    };
    let glb = gltf::to_glb(scene, &ExportOptions::default()).unwrap();
    let folder = std::env::temp_dir().join(format!("orthant-exports-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("a.gltf");
    orthant_scene::export::export_path(scene, &path, &ExportOptions::default()).unwrap();
    let text = std::fs::read(&path).unwrap();
    let both = [import(glb.document, "a.glb", None), import(text, "a.gltf", Some(&folder))];
    std::fs::remove_dir_all(&folder).unwrap();
    both
}

fn variant_of_the_same_name(scene: &Scene, again: &mut Scene) {
    let Some(shown) = scene.shown_variant() else { return };
    let name = &scene.variants()[shown].name;
    let variant = again.variants().iter().find(|(_, variant)| variant.name == *name).map(|(id, _)| id);
    assert!(variant.is_some(), "the variant is in the export");
    again.apply(orthant_scene::edit::Edit::SelectVariant { variant }).unwrap();
}

#[test]
fn what_random_edits_led_to_is_the_same_after_export_and_import() {
    for (number, (name, scene)) in scenes::all().into_iter().enumerate() {
        for seed in 0..12 {
            let mut live = Live::new(scene.clone());
            let mut script = String::new();
            for choice in Choices(seed * 31 + number as u64).take(10 + 8 * seed as usize) {
                let operation = operation(&live.scene, choice);
                if live.edit(&operation).is_ok() {
                    script.push_str(&format!("{}\n", serde_json::to_string(&operation).unwrap()));
                }
            }
            let before = shown(&live.scene);
            for mut again in again(&live.scene) {
                variant_of_the_same_name(&live.scene, &mut again);
                let after = shown(&again);
                assert_eq!(before.len(), after.len(), "{name}, after\n{script}");
                for (a, b) in before.iter().zip(&after) {
                    assert_eq!(a, b, "{name}, after\n{script}");
                }
            }
        }
    }
}
