//! Damaged files: each loads or is refused; none panics or takes long.

use crate::corpus::*;
use orthant_scene::accessor;
use orthant_scene::model::ElementType;
use std::time::{Duration, Instant};

#[test]
fn damaged_files_are_refused_or_loaded_and_never_panic() {
    let Some(assets) = assets() else { return };
    let start = Instant::now();
    let (mut loaded, mut refused) = (0, 0);
    for path in files(&assets.join("gltf-malformed"), &["gltf", "glb"]) {
        let scene = match import(&path) {
            Ok(imported) => imported.scene,
            Err(error) => {
                assert!(error.to_string().starts_with(&format!("{}: ", path.display())), "{error}");
                refused += 1;
                continue;
            }
        };
        loaded += 1;
        // Import has checked every accessor, so reading one as what it is cannot fail.
        for (id, a) in scene.accessors().iter() {
            match a.element_type {
                ElementType::Scalar => drop(accessor::read_f32::<1>(&scene, id).unwrap()),
                ElementType::Vec3 => drop(accessor::read_f32::<3>(&scene, id).unwrap()),
                _ => accessor::check(&scene, id).unwrap(),
            }
            let _ = accessor::read_vertex_indices_into(&scene, id, 3, &mut Vec::new());
        }
    }
    println!("{loaded} loaded, {refused} refused, in {:?}", start.elapsed());
    assert!(start.elapsed() < Duration::from_secs(60));
    assert!(loaded > 50 && refused > 50, "{loaded} loaded, {refused} refused");
}
