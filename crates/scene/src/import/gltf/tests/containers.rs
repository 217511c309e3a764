//! GLB, files beside the document, and which format a file is.

use super::*;
use crate::import::{Format, ImportFault, import_path};
use crate::model::{Buffer, ImageSource};
use std::path::Path;

/// A GLB of a document and perhaps a binary chunk, padded as it should be.
fn glb(document: &Value, bin: Option<&[u8]>) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = [b"glTF".as_slice(), &2u32.to_le_bytes(), &[0; 4]].concat();
    let mut chunk = |kind: &[u8; 4], data: &[u8]| {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    };
    chunk(b"JSON", &json);
    if let Some(bin) = bin {
        let mut bin = bin.to_vec();
        bin.resize(bin.len().next_multiple_of(4), 0);
        chunk(b"BIN\0", &bin);
    }
    let length = (out.len() as u32).to_le_bytes();
    out[8..12].copy_from_slice(&length);
    out
}

fn buffer(scene: &Scene) -> &Buffer {
    scene.buffers().iter().next().unwrap().1
}

#[test]
fn the_binary_chunk_is_the_first_buffer_without_its_padding() {
    let doc = document(json!({ "buffers": [{ "byteLength": 5 }] }));
    let imported = import_slice(glb(&doc, Some(b"12345")), None, "a.glb", &ImportOptions::default()).unwrap();
    assert_eq!(imported.format, Format::Glb);
    assert!(imported.warnings.is_empty());
    assert_eq!(&*buffer(&imported.scene).data, b"12345");
    assert_eq!(buffer(&imported.scene).uri, None);
}

#[test]
fn the_binary_chunk_is_not_copied() {
    let doc = document(json!({ "buffers": [{ "byteLength": 8 }], "bufferViews": [{ "buffer": 0, "byteLength": 8 }],
        "images": [{ "bufferView": 0, "mimeType": "image/png" }] }));
    let file = glb(&doc, Some(b"\x89PNGdata"));
    let range = file.as_ptr_range();
    let scene = import_slice(file, None, "a.glb", &ImportOptions::default()).unwrap().scene;
    assert!(range.contains(&buffer(&scene).data.as_ptr()));
    let image = scene.images().iter().next().unwrap().1;
    assert!(matches!(image.source, ImageSource::View(_)));
    assert!(range.contains(&image.data.as_ref().unwrap().as_ptr()));
}

#[test]
fn a_binary_chunk_that_is_missing_or_too_short_is_refused_where_it_is_used() {
    let doc = document(json!({ "buffers": [{ "byteLength": 8 }], "bufferViews": [{ "buffer": 0, "byteLength": 8 }] }));
    let message = |file: Vec<u8>| {
        import_slice(file, None, "a.glb", &ImportOptions::default()).map(|_| ()).unwrap_err().to_string()
    };
    assert!(message(glb(&doc, None)).starts_with("a.glb: /bufferViews/0: the view's buffer has no data"));
    let short = message(glb(&doc, Some(b"1234")));
    assert!(short.starts_with("a.glb: /buffers/0: byteLength is 8, but there are only 4 bytes"), "{short}");
}

#[test]
fn the_format_follows_the_content_and_must_agree_with_the_extension() {
    let (text, binary) = (triangle().to_string().into_bytes(), glb(&triangle(), None));
    let format = |name: &str, bytes: &[u8]| {
        import_slice(bytes, None, name, &ImportOptions::default()).map(|i| i.format).map_err(|e| e.to_string())
    };
    for name in ["a.gltf", "a.GLTF", "noname"] {
        assert_eq!(format(name, &text).unwrap(), Format::Gltf);
    }
    for name in ["a.glb", "dir.gltf/A.GlB", "noname"] {
        assert_eq!(format(name, &binary).unwrap(), Format::Glb);
    }
    assert!(format("a.glb", &text).unwrap_err().contains("the extension says glb, but the content is gltf"));
    assert!(format("a.gltf", &binary).unwrap_err().contains("the extension says gltf, but the content is glb"));
    assert!(format("a.png", &text).unwrap_err().contains("extension \"png\""));
    assert!(format("a.glb", b"").unwrap_err().contains("the file is empty"));
    assert!(format("a.gltf", b"[1]").unwrap_err().contains("neither a JSON object nor a GLB"));
}

#[test]
fn files_beside_the_document_are_read() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("maps")).unwrap();
    std::fs::write(dir.path().join("a b.bin"), b"12345678").unwrap();
    std::fs::write(dir.path().join("maps/c.png"), b"\x89PNG").unwrap();
    let doc = document(json!({
        "buffers": [{ "byteLength": 6, "uri": "a%20b.bin" }],
        "images": [{ "uri": "maps/c.png" }, { "uri": "maps/absent.png" }],
        "textures": [{ "source": 1 }],
    }));
    let path = dir.path().join("scene.gltf");
    std::fs::write(&path, doc.to_string()).unwrap();
    let imported = import_path(&path, &ImportOptions::default()).unwrap();
    assert_eq!(&*buffer(&imported.scene).data, b"123456");
    assert_eq!(buffer(&imported.scene).uri.as_deref(), Some("a%20b.bin"));
    let data: Vec<Option<&[u8]>> = imported.scene.images().iter().map(|(_, i)| i.data.as_deref()).collect();
    assert_eq!(data, [Some(&b"\x89PNG"[..]), None]);
    let warning = imported.warnings[0].to_string();
    assert!(warning.starts_with("/images/1/uri: the file ") && warning.contains("does not exist"), "{warning}");
}

#[test]
fn files_elsewhere_are_refused_unless_they_are_allowed() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("scene")).unwrap();
    std::fs::write(dir.path().join("up.bin"), b"1234").unwrap();
    let path = dir.path().join("scene/a.gltf");
    for members in [
        json!({ "buffers": [{ "byteLength": 4, "uri": "../up.bin" }] }),
        json!({ "images": [{ "uri": "%2e%2e/up.bin" }] }),
    ] {
        std::fs::write(&path, document(members).to_string()).unwrap();
        let message = import_path(&path, &ImportOptions::default()).map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("0/uri: ") && message.contains("--allow-external-files"), "{message}");
        let options = ImportOptions { allow_external_files: true, ..ImportOptions::default() };
        import_path(&path, &options).unwrap();
    }
    std::fs::write(&path, document(json!({ "buffers": [{ "byteLength": 4, "uri": "gone.bin" }] })).to_string())
        .unwrap();
    let message = import_path(&path, &ImportOptions::default()).map(|_| ()).unwrap_err().to_string();
    assert!(message.contains("/buffers/0/uri: the file ") && message.contains("does not exist"), "{message}");
}

#[test]
fn a_file_that_is_not_there_is_an_error_of_its_own() {
    let error = import_path(Path::new("/nowhere/a.glb"), &ImportOptions::default()).unwrap_err();
    assert!(matches!(error.fault, ImportFault::File(_)));
    assert_eq!(error.to_string(), "/nowhere/a.glb: the file /nowhere/a.glb does not exist");
}
