use super::*;
use crate::import::{Format, ImportFault, ObjFault, Place};
use std::path::Path;

/// Refused at this line and column.
fn refused(text: &str) -> (usize, usize, ObjFault) {
    let error = try_import(text).expect_err(text);
    assert_eq!(error.file, "folder/thing.obj");
    match (error.place, error.fault) {
        (Place::Line { line, column }, ImportFault::Obj(fault)) => (line, column, fault),
        other => panic!("{text:?}: {other:?}"),
    }
}

#[test]
fn numbers_that_are_none_or_not_finite_are_refused_where_they_are() {
    assert_eq!(refused("v 0 0 0\nv 0 x 0\n"), (2, 5, ObjFault::NotANumber("x".into())));
    assert_eq!(refused("v 0 0 nan\n"), (1, 7, ObjFault::NotFinite("nan".into())));
    assert_eq!(refused("\r\n\r\nvt inf 0\n").0, 3);
    assert_eq!(refused("vn 0 -inf 0").2, ObjFault::NotFinite("-inf".into()));
    assert_eq!(refused("v 0 1e39 0").2, ObjFault::NotFinite("1e39".into()));
    assert_eq!(refused("v 0 0 0 0 0 nan").2, ObjFault::NotFinite("nan".into()));
    let found = |statement, needed, found| ObjFault::TooFewNumbers { statement, needed, found };
    assert_eq!(refused("v 0 0").2, found("v", 3, 2));
    assert_eq!(refused("vn").2, found("vn", 3, 0));
    assert_eq!(refused("vt # 1").2, found("vt", 1, 0));
}

#[test]
fn indices_to_nothing_are_refused_where_they_are() {
    assert_eq!(refused(&format!("{TRIANGLE}f 1 0 2")), (4, 5, ObjFault::ZeroIndex("v")));
    assert_eq!(refused(&format!("{TRIANGLE}vt 0 0\nf 1/0 2/1 3/1")).2, ObjFault::ZeroIndex("vt"));
    let range = |kind, index, total, before| ObjFault::IndexRange { kind, index, total, before };
    assert_eq!(refused(&format!("{TRIANGLE}f 1 2 4")), (4, 7, range("v", 4, 3, 3)));
    assert_eq!(refused(&format!("f -1 -2 -3\n{TRIANGLE}")), (1, 3, range("v", -1, 3, 0)));
    assert_eq!(refused(&format!("{TRIANGLE}f 1/1 2/1 3/1")).2, range("vt", 1, 0, 0));
    assert_eq!(refused(&format!("{TRIANGLE}l 1 9999999999")).2, range("v", 9_999_999_999, 3, 3));
    assert_eq!(refused(&format!("{TRIANGLE}f 1 2 x")).2, ObjFault::NotACorner("x".into()));
}

#[test]
fn the_first_error_of_the_file_is_reported_whatever_thread_finds_it() {
    let mut text = "v 0 0 0\n".repeat(200_000);
    for line in [150_000, 30_000, 60_000] {
        text.replace_range(line * 8 - 2..line * 8 - 1, "x");
    }
    for _ in 0..5 {
        assert_eq!(refused(&text).0, 30_000);
    }
}

#[test]
fn content_and_extension_must_agree() {
    let format = |name: &str, bytes: &[u8]| import_slice(bytes, None, name, &ImportOptions::default());
    assert_eq!(format("a.OBJ", b"v 0 0 0").unwrap().format, Format::Obj);
    assert_eq!(format("a", b"# made by x\nexporter 3\no x\n").unwrap().format, Format::Obj);
    for (name, bytes) in [("a.obj", &b"{}"[..]), ("a.gltf", b"v 0 0 0\n"), ("a.obj", b"glTF\x02\0\0\0")] {
        assert!(matches!(format(name, bytes).unwrap_err().fault, ImportFault::FormatMismatch { .. }), "{name}");
    }
    // The second is an object file of a compiler.
    for bytes in [&b""[..], b"\x64\x86\x02\0\nv 1 2 3\n", b"# nothing\n", b"\x89PNG\r\n\x1a\n", b"hello, world"] {
        assert!(matches!(format("a.obj", bytes).unwrap_err().fault, ImportFault::UnknownFormat(_)), "{bytes:?}");
    }
    assert_eq!(Format::from_extension(Path::new("x.obj")), Some(Format::Obj));
}

#[test]
fn no_more_memory_is_taken_than_allowed() {
    let text = format!("{TRIANGLE}{}", "f 1 2 3\n".repeat(10_000));
    let mut options = ImportOptions::default();
    let needed = import_slice(text.as_bytes(), None, "a.obj", &options).unwrap().charged_bytes;
    assert!((36 + 120_000..2_000_000).contains(&needed), "{needed}");
    for limit in [0, 1000, text.len() as u64, needed - 1] {
        options.max_memory = limit;
        let error = import_slice(text.as_bytes(), None, "a.obj", &options).unwrap_err();
        assert!(error.to_string().contains("--max-memory"), "{error}");
    }
}
