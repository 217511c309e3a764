//! OBJ files: each loads or is refused for a known reason, with the counts of the inventory and of `tobj`.

use crate::corpus::*;
use orthant_scene::Scene;
use orthant_scene::import::{ImportFault, ImportOptions, ObjFault, WarningKind, import_slice};
use orthant_scene::model::PrimitiveMode;
use std::path::{Path, PathBuf};

fn obj_files(assets: &Path) -> Vec<PathBuf> {
    let found = files(&assets.join("obj"), &["obj"]);
    assert!(found.len() > 60, "only {} OBJ files", found.len());
    found
}

/// Files that must be refused, and what for.
fn expected_refusal(path: &Path) -> Option<fn(&ObjFault) -> bool> {
    let name = path.file_name()?.to_str()?;
    match name {
        "invalid-relative-texture-index.obj" | "invalid-relative-vertex-index.obj" | "invalid_index.obj" => {
            Some(|fault| matches!(fault, ObjFault::IndexRange { .. }))
        }
        // They name vn 1, and have no vn.
        "catmark_torus_creases0.obj" | "smoothing-group-two-squares.obj" => {
            Some(|fault| matches!(fault, ObjFault::IndexRange { kind: "vn", .. }))
        }
        "issue-140-zero-face-idx.obj" => Some(|fault| matches!(fault, ObjFault::ZeroIndex(_))),
        "test-nan.obj" => Some(|fault| matches!(fault, ObjFault::NotFinite(_))),
        _ => None,
    }
}

fn triangles(scene: &Scene) -> usize {
    let primitives = scene.meshes().iter().flat_map(|(_, mesh)| &mesh.primitives);
    let triangles = primitives.filter(|p| p.mode == PrimitiveMode::Triangles);
    triangles.map(|p| scene.accessors()[p.indices.unwrap()].count / 3).sum()
}

#[test]
fn every_obj_loads_or_is_refused_for_its_reason() {
    let Some(assets) = assets() else { return };
    for path in obj_files(&assets) {
        match (import(&path), expected_refusal(&path)) {
            (Ok(imported), None) => {
                assert!(imported.scene.nodes().len() == 1, "{}", path.display());
            }
            (Err(error), Some(is_expected)) => {
                assert!(matches!(&error.fault, ImportFault::Obj(fault) if is_expected(fault)), "{error}");
                assert!(error.to_string().contains(": line "), "{error}");
            }
            (Ok(_), Some(_)) => panic!("{} loads, but should be refused", path.display()),
            (Err(error), None) => panic!("{error}"),
        }
    }
}

#[test]
fn triangles_and_materials_are_those_of_the_inventory() {
    let Some(assets) = assets() else { return };
    let inventory = std::fs::read_to_string(assets.join("INVENTORY.md")).unwrap();
    let mut checked = 0;
    for row in inventory.lines().filter(|line| line.starts_with("| obj/") && line.contains(".obj |")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let (path, wanted) = (assets.join(cells[1]), cells[4].parse::<usize>().unwrap());
        let scene = import(&path).unwrap_or_else(|e| panic!("{e}")).scene;
        assert_eq!(triangles(&scene), wanted, "{}", path.display());
        let materials: usize = cells[5].split('/').next().unwrap().parse().unwrap();
        let primitives = scene.meshes().iter().next().unwrap().1.primitives.len();
        assert_eq!(primitives, materials.max(1), "{}", path.display());
        checked += 1;
    }
    assert!(checked > 20, "{checked} rows");
}

#[test]
fn triangles_and_materials_are_those_that_tobj_finds() {
    let Some(assets) = assets() else { return };
    let (mut compared, mut with_materials) = (0, 0);
    let options =
        tobj::LoadOptions { triangulate: true, ignore_lines: true, ignore_points: true, ..Default::default() };
    for path in obj_files(&assets) {
        let (Ok(ours), Ok((models, materials))) = (import(&path), tobj::load_obj(&path, &options)) else { continue };
        // It takes a polyline for a polygon.
        let modes = ours.scene.meshes().iter().flat_map(|(_, mesh)| &mesh.primitives).map(|p| p.mode);
        if modes.into_iter().any(|mode| mode != PrimitiveMode::Triangles) {
            continue;
        }
        let theirs: usize = models.iter().map(|model| model.mesh.indices.len() / 3).sum();
        assert_eq!(triangles(&ours.scene), theirs, "{}", path.display());
        compared += 1;
        let all_known = ours.warnings.iter().all(|w| {
            !matches!(w.kind, WarningKind::UndefinedMaterial(_) | WarningKind::MissingMaterialLibrary(_))
                && !w.to_string().contains("is defined before")
        });
        let named = ours.scene.materials().iter().filter(|(_, m)| m.name.is_some()).count();
        if let (true, Ok(materials)) = (all_known, materials) {
            assert_eq!(named, materials.len(), "{}", path.display());
            with_materials += 1;
        }
    }
    println!("{compared} files compared, {with_materials} of them with their materials");
    assert!(compared > 40 && with_materials > 20, "{compared} compared, {with_materials} with materials");
}

#[test]
fn damaged_files_are_no_panic() {
    let Some(assets) = assets() else { return };
    for path in obj_files(&assets) {
        let bytes = std::fs::read(&path).unwrap();
        if bytes.len() > 4000 {
            continue;
        }
        let mut changed = bytes.clone();
        for i in (0..bytes.len()).step_by(7) {
            let _ = import_slice(&bytes[..i], None, "a.obj", &ImportOptions::default());
            changed[i] ^= 1 << (i % 8);
            let _ = import_slice(&changed[..], None, "a.obj", &ImportOptions::default());
            changed[i] = bytes[i];
        }
    }
}
