//! What is written is what was read.

use super::*;
use crate::export::export_path;
use crate::import::{ImportOptions, Imported, import_path, import_slice};
use crate::model::*;
use crate::place::At;
use crate::testing::{but_for_buffers, every_slot, every_slot_scene, json_difference};
use crate::visit::{self, VisitorMut};
use serde_json::{Value, json};
use std::path::PathBuf;

fn import(document: &Value, folder: Option<&Path>) -> Scene {
    import_slice(document.to_string(), folder, "test.gltf", &ImportOptions::default()).unwrap().scene
}

fn reimport(path: &Path) -> Imported {
    import_path(path, &ImportOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn written(files: &Files) -> Value {
    serde_json::from_slice(&files.document).unwrap()
}

fn with_images(images: Images) -> ExportOptions {
    ExportOptions { images, ..ExportOptions::default() }
}

/// Names of the files below a folder, sorted.
fn listing(folder: &Path) -> Vec<String> {
    fn walk(folder: &Path, prefix: &str, names: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{prefix}{}", entry.file_name().to_str().unwrap());
            if entry.path().is_dir() {
                walk(&entry.path(), &format!("{name}/"), names);
            } else {
                names.push(name);
            }
        }
    }
    let mut names = Vec::new();
    walk(folder, "", &mut names);
    names.sort();
    names
}

#[test]
fn a_document_comes_back_as_it_was_but_for_buffers() {
    let (original, _) = every_slot(|_, index| index);
    let files = to_gltf(&every_slot_scene(), "x", &ExportOptions::default()).unwrap();
    let written = written(&files);
    assert_eq!(json_difference(&but_for_buffers(original), &but_for_buffers(written.clone()), ""), None);
    assert_eq!(written["buffers"], json!([{ "uri": "x.bin", "byteLength": 384 }]));
    assert_eq!(files.notes, []);
}

#[test]
fn every_reference_is_written_by_what_its_object_has_become() {
    // The visitor sends each reference to the next object of its kind; so does an independent rewrite of the JSON. A
    // reference that the visitor or the exporter did not know would stay behind.
    struct Next(Vec<Vec<AnyId>>);
    impl VisitorMut for Next {
        fn slot<K: Id>(&mut self, id: &mut K, _: &At<'_>) {
            let ids = &self.0[K::KIND as usize];
            let index = ids.iter().position(|&other| other == (*id).into()).unwrap();
            *id = Store::<K, ()>::nth_id((index + 1) % ids.len());
        }

        fn parent(&mut self, _: &mut NodeId) {}
    }
    let mut scene = every_slot_scene();
    let ids: Vec<Vec<AnyId>> = Kind::ALL.iter().map(|&kind| scene.ids_of(kind)).collect();
    let counts: Vec<usize> = ids.iter().map(Vec::len).collect();
    // Buffers become one, so that which one a view lies in cannot be told from the JSON.
    let views: Vec<BufferView> = scene.buffer_views.values().cloned().collect();
    visit::visit_mut(&mut scene, &mut Next(ids));
    for (view, old) in scene.buffer_views.values_mut().zip(views) {
        view.buffer = old.buffer;
    }
    let (expected, references) = every_slot(|kind, index| (index + 1) % counts[kind as usize]);
    for kind in Kind::ALL {
        let total = references.iter().filter(|r| r.kind == *kind).count();
        assert!(total == 0 || counts[*kind as usize] > 1, "{kind:?}: a shift has to change something");
    }
    let written = written(&to_gltf(&scene, "x", &ExportOptions::default()).unwrap());
    // Positions of another type need another extension.
    let but_for_declarations = |document: Value| {
        let mut document = but_for_buffers(document);
        for key in ["extensionsUsed", "extensionsRequired"] {
            document.as_object_mut().unwrap().shift_remove(key);
        }
        document
    };
    assert_eq!(json_difference(&but_for_declarations(expected), &but_for_declarations(written), ""), None);
}

#[test]
fn export_and_import_again_is_the_identity() {
    let scene = every_slot_scene();
    let folder = tempfile::tempdir().unwrap();
    let (gltf, glb, again) = (folder.path().join("a.gltf"), folder.path().join("a.glb"), folder.path().join("b.gltf"));
    export_path(&scene, &gltf, &ExportOptions::default()).unwrap();
    let first = reimport(&gltf).scene;
    scene.same_document(&first).unwrap();
    export_path(&first, &glb, &ExportOptions::default()).unwrap();
    let second = reimport(&glb).scene;
    scene.same_document(&second).unwrap();
    export_path(&second, &again, &ExportOptions::default()).unwrap();
    scene.same_document(&reimport(&again).scene).unwrap();
    let json = |path: &Path| serde_json::from_slice::<Value>(&std::fs::read(path).unwrap()).unwrap();
    assert_eq!(json_difference(&but_for_buffers(json(&gltf)), &but_for_buffers(json(&again)), ""), None);
}

#[test]
fn the_same_scene_gives_the_same_bytes() {
    let bytes = || {
        let files = to_glb(&every_slot_scene(), &ExportOptions::default()).unwrap();
        assert!(files.others.is_empty());
        files.document
    };
    assert_eq!(bytes(), bytes());
}

#[test]
fn numbers_are_written_as_they_were() {
    let text =
        r#"{"asset":{"version":"2.0"},"nodes":[{"translation":[0.1,1e-7,0.30000001192092896],"scale":[1,2.5,3]}]}"#;
    let scene = import_slice(text, None, "a.gltf", &ImportOptions::default()).unwrap().scene;
    let files = to_gltf(&scene, "x", &ExportOptions::default()).unwrap();
    let written = String::from_utf8(files.document).unwrap();
    assert!(written.contains(r#""translation":[0.1,1e-7,0.30000001192092896],"scale":[1,2.5,3]"#), "{written}");
}

#[test]
fn an_empty_document_has_no_buffer() {
    let scene = import(&json!({ "asset": { "version": "2.0" } }), None);
    let files = to_gltf(&scene, "x", &ExportOptions::default()).unwrap();
    assert_eq!(written(&files), json!({ "asset": { "version": "2.0" } }));
    assert!(files.others.is_empty());
    let glb = to_glb(&scene, &ExportOptions::default()).unwrap().document;
    assert_eq!(glb.len() % 4, 0);
    let again = import_slice(glb, None, "x.glb", &ImportOptions::default()).unwrap();
    scene.same_document(&again.scene).unwrap();
}

#[test]
fn extensions_are_declared_while_they_are_used() {
    let mut scene = import(
        &json!({
            "asset": { "version": "2.0" },
            "extensionsUsed": ["KHR_materials_ior", "KHR_lights_punctual", "X_declared_only"],
            "extensionsRequired": ["KHR_lights_punctual"],
            "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point" }] } },
            "nodes": [{ "extensions": { "KHR_lights_punctual": { "light": 0 } } }],
            "materials": [{ "extensions": { "KHR_materials_ior": {} } }],
        }),
        None,
    );
    let material = scene.materials.ids().next().unwrap();
    scene.materials.get_mut(material).unwrap().unlit = true;
    let declared = |scene: &Scene| {
        let document = written(&to_gltf(scene, "x", &ExportOptions::default()).unwrap());
        (document["extensionsUsed"].clone(), document["extensionsRequired"].clone())
    };
    let (used, required) = declared(&scene);
    let all = json!(["KHR_materials_ior", "KHR_lights_punctual", "X_declared_only", "KHR_materials_unlit"]);
    assert_eq!((used, required), (all, json!(["KHR_lights_punctual"])));

    let (node, light) = (scene.nodes.ids().next().unwrap(), scene.lights.ids().next().unwrap());
    scene.nodes.get_mut(node).unwrap().light = None;
    scene.lights.remove(light);
    let (used, required) = declared(&scene);
    assert_eq!((used, required), (json!(["KHR_materials_ior", "X_declared_only", "KHR_materials_unlit"]), Value::Null));
}

#[test]
fn a_reference_that_leads_nowhere_is_refused_with_its_place() {
    let mut scene = every_slot_scene();
    let texture = scene.textures.ids().nth(1).unwrap();
    scene.textures.remove(texture);
    let fault = to_glb(&scene, &ExportOptions::default()).unwrap_err();
    let first =
        "/extensions/EXT_structural_metadata/propertyTextures/0/properties/t/index: the reference leads nowhere";
    assert_eq!(fault.to_string(), first);
}

#[test]
fn a_number_that_json_has_not_is_refused_and_nothing_is_written() {
    let mut scene = every_slot_scene();
    let material = scene.materials.ids().next().unwrap();
    scene.materials.get_mut(material).unwrap().roughness = f64::NAN;
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.gltf", "a.glb"] {
        let error = export_path(&scene, &folder.path().join(name), &ExportOptions::default()).unwrap_err();
        assert!(error.to_string().contains("roughnessFactor"), "{error}");
    }
    assert_eq!(listing(folder.path()), Vec::<String>::new());
}

#[test]
fn a_format_that_cannot_be_written_is_refused() {
    let error = export_path(&every_slot_scene(), Path::new("a.fbx"), &ExportOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "a.fbx: a scene cannot be written as \"fbx\"; use .gltf, .glb, .obj or .crts");
}

/// A document with images of each kind in a folder of its own.
fn scene_with_images(folder: &Path) -> Scene {
    std::fs::create_dir_all(folder.join("tex tures")).unwrap();
    std::fs::write(folder.join("tex tures/ü.png"), b"\x89PNG file").unwrap();
    import(
        &json!({
            "asset": { "version": "2.0" },
            "images": [
                { "uri": "tex%20tures/%C3%BC.png" },
                { "uri": "data:image/jpeg;base64,/9j/AAE=" },
                { "bufferView": 0, "mimeType": "image/png", "name": "in/side" },
                { "uri": "missing.png" },
                { "uri": "data:;base64,AAEC" },
            ],
            "textures": [{ "source": 0 }, { "source": 1 }, { "source": 2 }, { "source": 3 }, { "source": 4 }],
            "accessors": [{ "componentType": 5121, "count": 2, "type": "SCALAR", "bufferView": 1 }],
            "bufferViews": [
                { "buffer": 0, "byteLength": 64 },
                { "buffer": 0, "byteOffset": 66, "byteLength": 2 },
            ],
            "buffers": [{ "byteLength": 68, "uri": "data:;base64,iVBORwAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAQI=" }],
        }),
        Some(folder),
    )
}

#[test]
fn images_are_kept_in_place() {
    let (source, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let scene = scene_with_images(source.path());
    let report = export_path(&scene, &target.path().join("a.glb"), &with_images(Images::Keep)).unwrap();
    assert_eq!(listing(target.path()), ["a.glb", "tex tures/ü.png"]);
    assert_eq!(std::fs::read(target.path().join("tex tures/ü.png")).unwrap(), b"\x89PNG file");
    assert_eq!(report.notes.len(), 1);
    assert!(report.notes[0].to_string().starts_with("/images/3: its file was not there"), "{}", report.notes[0]);
    scene.same_document(&reimport(&target.path().join("a.glb")).scene).unwrap();
}

#[test]
fn images_are_embedded_with_their_bytes() {
    let (source, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let scene = scene_with_images(source.path());
    for name in ["a.gltf", "a.glb"] {
        let path = target.path().join(name);
        let report = export_path(&scene, &path, &with_images(Images::Embed)).unwrap();
        // The missing file, and the one of no known kind.
        assert_eq!(report.notes.len(), 2, "{:?}", report.notes);
        let embedded = reimport(&path).scene;
        let images = |scene: &Scene| scene.images.values().map(|i| i.data.clone()).collect::<Vec<_>>();
        assert_eq!(images(&embedded), images(&scene));
        let sources: Vec<ImageSource> = embedded.images.values().map(|image| image.source.clone()).collect();
        assert!(
            matches!(sources[..3], [ImageSource::View(_), ImageSource::View(_), ImageSource::View(_)]),
            "{sources:?}"
        );
        let mime_types: Vec<_> = embedded.images.values().map(|image| image.mime_type.as_deref()).collect();
        assert_eq!(mime_types[..3], [Some("image/png"), Some("image/jpeg"), Some("image/png")]);
        // Views that were there stay where they were.
        assert_eq!(embedded.count(Kind::BufferView), 4);
        let view = embedded.accessors.values().next().unwrap().view.unwrap();
        assert_eq!(embedded.view_bytes(view).unwrap(), [1, 2]);
    }
    assert_eq!(listing(target.path()), ["a.bin", "a.glb", "a.gltf"]);
}

#[test]
fn an_image_that_only_an_extension_may_embed_stays_a_file_where_a_texture_uses_it_without_one() {
    let (source, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let ktx2 = b"\xabKTX 20\xbb";
    std::fs::write(source.path().join("a.ktx2"), ktx2).unwrap();
    let document = |texture: Value| {
        json!({
            "asset": { "version": "2.0" },
            "extensionsUsed": ["KHR_texture_basisu"],
            "images": [{ "uri": "a.ktx2" }],
            "textures": [texture],
        })
    };
    for (texture, stays) in
        [(json!({ "source": 0 }), true), (json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } }), false)]
    {
        let scene = import(&document(texture), Some(source.path()));
        let path = target.path().join("a.glb");
        let report = export_path(&scene, &path, &with_images(Images::Embed)).unwrap();
        assert_eq!(report.notes.len(), usize::from(stays), "{:?}", report.notes);
        let image = reimport(&path).scene.images.values().next().unwrap().clone();
        assert_eq!(matches!(image.source, ImageSource::Uri(_)), stays);
        assert_eq!(image.data.as_deref(), Some(&ktx2[..]));
    }
}

#[test]
fn images_go_to_files_and_take_their_views_with_them() {
    let (source, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let scene = scene_with_images(source.path());
    let path = target.path().join("a.gltf");
    export_path(&scene, &path, &with_images(Images::External)).unwrap();
    let names = ["a-image1.jpg", "a-image4.img", "a.bin", "a.gltf", "in_side.png", "tex tures/ü.png"];
    assert_eq!(listing(target.path()), names);
    let external = reimport(&path).scene;
    let images = |scene: &Scene| scene.images.values().map(|i| i.data.clone()).collect::<Vec<_>>();
    assert_eq!(images(&external), images(&scene));
    assert!(external.images.values().all(|image| matches!(image.source, ImageSource::Uri(_))));
    // The view of the image is gone with its bytes, the other one is not.
    assert_eq!(external.count(Kind::BufferView), 1);
    let view = external.accessors.values().next().unwrap().view.unwrap();
    assert_eq!(external.view_bytes(view).unwrap(), [1, 2]);
    assert!(std::fs::read(target.path().join("a.bin")).unwrap().len() < 20);
}

#[test]
fn a_file_with_other_content_is_never_overwritten() {
    let (source, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let scene = scene_with_images(source.path());
    let path = target.path().join("a.gltf");
    std::fs::create_dir(target.path().join("tex tures")).unwrap();
    std::fs::write(target.path().join("tex tures/ü.png"), b"someone else's").unwrap();
    std::fs::write(target.path().join("a.bin"), b"someone else's").unwrap();
    for _ in 0..2 {
        let report = export_path(&scene, &path, &with_images(Images::Keep)).unwrap();
        assert_eq!(report.files.len(), 3);
        assert_eq!(listing(target.path()).len(), 5, "{:?}", listing(target.path()));
        assert_eq!(std::fs::read(target.path().join("tex tures/ü.png")).unwrap(), b"someone else's");
        assert_eq!(std::fs::read(target.path().join("a.bin")).unwrap(), b"someone else's");
        let again = reimport(&path).scene;
        assert_eq!(again.images.values().next().unwrap().data.as_deref(), Some(&b"\x89PNG file"[..]));
    }
}

#[test]
fn two_images_of_one_name_become_two_files() {
    let target = tempfile::tempdir().unwrap();
    let source = tempfile::tempdir().unwrap();
    let mut scene = scene_with_images(source.path());
    let other = Image {
        name: None,
        source: ImageSource::Uri("tex%20tures/%C3%BC.png".to_owned()),
        mime_type: None,
        data: Some(Blob::new(b"\x89PNG another".to_vec())),
        extra: Extra::default(),
    };
    scene.images.insert(other);
    let path = target.path().join("a.glb");
    export_path(&scene, &path, &ExportOptions::default()).unwrap();
    let again = reimport(&path).scene;
    let data = |scene: &Scene| scene.images.values().map(|i| i.data.clone()).collect::<Vec<_>>();
    assert_eq!(data(&again), data(&scene));
    assert_eq!(listing(target.path()).len(), 3);
}

#[test]
fn images_from_outside_are_copied_beside_the_document() {
    let (source, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let inner = source.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(source.path().join("up.png"), b"\x89PNG").unwrap();
    let document = json!({ "asset": { "version": "2.0" }, "images": [{ "uri": "../up.png" }] });
    let options = ImportOptions { allow_external_files: true, ..ImportOptions::default() };
    let scene = import_slice(document.to_string(), Some(&inner), "a.gltf", &options).unwrap().scene;
    let folder = target.path().join("deep");
    std::fs::create_dir(&folder).unwrap();
    let report = export_path(&scene, &folder.join("a.glb"), &ExportOptions::default()).unwrap();
    assert_eq!(listing(target.path()), ["deep/a.glb", "deep/up.png"]);
    assert_eq!(report.notes.len(), 1);
    assert_eq!(reimport(&folder.join("a.glb")).warnings, []);
}

#[cfg(unix)]
#[test]
fn nothing_is_written_through_a_link_that_leaves_the_folder() {
    let (source, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let scene = scene_with_images(source.path());
    let (folder, outside) = (target.path().join("in"), target.path().join("out"));
    std::fs::create_dir(&folder).unwrap();
    std::fs::create_dir(&outside).unwrap();
    std::os::unix::fs::symlink(&outside, folder.join("tex tures")).unwrap();
    export_path(&scene, &folder.join("a.glb"), &ExportOptions::default()).unwrap();
    assert_eq!(std::fs::read_dir(&outside).unwrap().count(), 0);
    let again = reimport(&folder.join("a.glb")).scene;
    assert_eq!(again.images.values().next().unwrap().data.as_deref(), Some(&b"\x89PNG file"[..]));
}

#[test]
fn names_with_spaces_and_letters_of_any_script_work() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a b.gltf", "ü#1%20.gltf", "Ωмир?.gltf", "a:b.gltf", ".hidden.gltf", "UPPER.GLTF"] {
        let path = folder.path().join(name);
        let scene = every_slot_scene();
        export_path(&scene, &path, &ExportOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        scene.same_document(&reimport(&path).scene).unwrap();
    }
}

/// The old document and its files, as they are before an export over them ends.
fn files_of(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let names = listing(folder).into_iter().map(|name| folder.join(name));
    names.map(|path| (path.clone(), std::fs::read(&path).unwrap())).collect()
}

#[test]
fn an_export_over_a_document_leaves_its_old_files_until_the_document_itself_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let scene = every_slot_scene();
    export_path(&scene, &path, &ExportOptions::default()).unwrap();
    let old = files_of(folder.path());
    assert_eq!(listing(folder.path()), ["a.bin", "a.gltf"]);

    let mut changed = scene.clone();
    let buffer = changed.buffers.ids().next().unwrap();
    changed.buffers.get_mut(buffer).unwrap().data = Blob::new(vec![1; 128]);
    let report = export_path(&changed, &path, &ExportOptions::default()).unwrap();
    // All that has changed of what was there is the document.
    for (file, content) in &old {
        assert_eq!(std::fs::read(file).unwrap() == *content, *file != path, "{}", file.display());
    }
    assert_eq!(listing(folder.path()).len(), 3);
    assert_eq!(report.superseded, Vec::<PathBuf>::new());
    changed.same_document(&reimport(&path).scene).unwrap();

    // Back again: the first buffer is there still, and the second is nobody's.
    let report = export_path(&scene, &path, &ExportOptions::default()).unwrap();
    assert_eq!(report.files, [folder.path().join("a.bin"), path.clone()]);
    assert_eq!(report.superseded.len(), 1);
    assert!(std::fs::metadata(&report.superseded[0]).is_ok(), "it is kept all the same");
    scene.same_document(&reimport(&path).scene).unwrap();
}

#[test]
fn a_failed_export_leaves_the_old_document() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let scene = every_slot_scene();
    export_path(&scene, &path, &ExportOptions::default()).unwrap();
    let old = files_of(folder.path());
    let mut bad = scene.clone();
    let node = bad.nodes.ids().next().unwrap();
    bad.nodes.get_mut(node).unwrap().weights = Some(vec![f64::INFINITY]);
    export_path(&bad, &path, &ExportOptions::default()).unwrap_err();
    assert_eq!(files_of(folder.path()), old);
}

#[test]
fn views_of_no_bytes_keep_a_buffer() {
    let document = r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":1,"uri":"data:,%00"}],
        "bufferViews":[{"buffer":0,"byteLength":0}]}"#;
    let scene = import_slice(document, None, "a.gltf", &ImportOptions::default()).unwrap().scene;
    let glb = to_glb(&scene, &ExportOptions::default()).unwrap().document;
    let again = import_slice(glb, None, "b.glb", &ImportOptions::default()).unwrap().scene;
    scene.same_document(&again).unwrap();
}
