//! Every third-party scene that can be imported can be derived, and has the render nodes that its JSON asks for.
//!
//! Needs the folder that `ORTHANT_ASSETS` names.

use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::rows::NodeFlags;
use orthant_scene::import::{ImportOptions, import_path};
use orthant_scene::model::{NodeId, PrimitiveMode};
use orthant_scene::{Scene, accessor};
use std::path::{Path, PathBuf};

fn scenes(folder: &Path, out: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            scenes(&path, out);
        } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
            out.push(path);
        }
    }
}

/// Triangle primitives times instances below the shown roots, counted by a plain walk of the model.
fn expected_render_nodes(scene: &Scene) -> usize {
    let roots: Vec<NodeId> = match scene.default_scene().or_else(|| scene.scenes().ids().next()) {
        Some(id) => scene.scenes()[id].roots.iter().collect(),
        None => scene.nodes().iter().filter(|(_, n)| n.parent.is_none()).map(|(id, _)| id).collect(),
    };
    let (mut stack, mut count) = (roots, 0);
    while let Some(id) = stack.pop() {
        let node = &scene.nodes()[id];
        stack.extend(node.children.iter());
        let Some(mesh) = node.mesh else { continue };
        let primitives = scene.meshes()[mesh].primitives.iter().filter(|p| {
            let Some(position) = p.attributes.get("POSITION") else { return false };
            let elements = scene.accessors()[p.indices.unwrap_or(position)].count;
            elements >= 3
                && matches!(
                    p.mode,
                    PrimitiveMode::Triangles | PrimitiveMode::TriangleStrip | PrimitiveMode::TriangleFan
                )
        });
        let instances = node.instancing.as_ref().map_or(1, |i| {
            let any = i.translation.or(i.rotation).or(i.scale).or(i.custom.first().map(|c| c.1));
            any.map_or(0, |a| scene.accessors()[a].count)
        });
        count += primitives.count() * instances;
    }
    count
}

#[test]
fn every_scene_that_loads_is_derived_with_the_render_nodes_of_its_json() {
    let Some(assets) = std::env::var_os("ORTHANT_ASSETS") else {
        eprintln!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    let assets = PathBuf::from(assets);
    let mut files = Vec::new();
    for folder in ["gltf-khronos", "gltf-ext", "gltf-scenes", "gltf-suites"] {
        scenes(&assets.join(folder), &mut files);
    }
    files.sort();
    let mut derived_count = 0;
    for file in &files {
        // What is refused is the importer's to test.
        let Ok(imported) = import_path(file, &ImportOptions::default()) else { continue };
        let scene = imported.scene;
        let derived = DerivedScene::derive(&scene, &DeriveOptions { images: false, ..DeriveOptions::default() })
            .unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        assert_eq!(derived.render_nodes.len(), expected_render_nodes(&scene), "{}", file.display());
        for (index, row) in derived.render_nodes.iter().enumerate() {
            let desc = &derived.mesh_descs[row.primitive as usize];
            assert!(desc.index_count > 0, "{}: render node {index}", file.display());
            let node = derived.node_of(index as u32).expect("every row has a node");
            assert!(derived.render_nodes_of(node).contains(&(index as u32)), "{}", file.display());
            if row.flags & NodeFlags::VISIBLE != 0 {
                let p = glam::Vec3::from_array(desc.bounds_min);
                let back = row.inverse.transform_point(row.world.transform_point(p));
                let size = (glam::Vec3::from_array(desc.bounds_max) - p).length().max(p.length());
                let stretch = row.inverse.rows.iter().flatten().fold(0.0f32, |m, v| m.max(v.abs()))
                    * row.world.rows.iter().flatten().fold(0.0f32, |m, v| m.max(v.abs()));
                assert!(
                    (back - p).length() <= 1e-5 * stretch.max(1.0) * size.max(1.0),
                    "{}: {back} {p}",
                    file.display()
                );
            }
        }
        for primitive in derived.primitives.iter().filter(|p| p.deformed_by.is_none()) {
            let attributes = &scene.meshes()[primitive.mesh].primitives[primitive.primitive].attributes;
            let position = attributes.get("POSITION").expect("a RenderPrimitive has positions");
            assert!(accessor::read_f32::<3>(&scene, position).is_ok());
        }
        derived_count += 1;
    }
    assert!(derived_count > 200, "only {derived_count} of {} scenes could be derived", files.len());
    eprintln!("{derived_count} of {} scenes derived", files.len());
}
