//! Runs the program as a user would.

#![allow(dead_code, reason = "each test file uses a part of this")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Runs `orthant` in a folder. What it keeps between runs stays beside what is built, and not in the user's folder.
pub fn orthant(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orthant"));
    command.env("ORTHANT_PIPELINE_CACHE", env!("CARGO_TARGET_TMPDIR"));
    command.current_dir(folder).args(args).output().expect("the program runs")
}

/// Runs `orthant`, which must succeed, and gives its stdout.
pub fn succeed(folder: &Path, args: &[&str]) -> String {
    let output = orthant(folder, args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Runs `orthant`, which must end with `code` and one line on stderr that contains every one of `words`.
pub fn fail(folder: &Path, args: &[&str], code: i32, words: &[&str]) {
    let output = orthant(folder, args);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {stderr}");
    assert!(code == 2 || stderr.trim_end().lines().count() == 1, "{args:?}: more than one line: {stderr}");
    for word in words {
        assert!(stderr.contains(word), "{args:?}: no {word:?} in {stderr}");
    }
    assert!(output.stdout.is_empty() || code == 5, "{args:?}: results on stdout of a failed command");
}

/// A folder with a small Cornell box, `box.glb`.
pub fn folder_with_box() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("folder");
    succeed(folder.path(), &["generate", "cornell", "-o", "box.glb"]);
    let path = folder.path().to_owned();
    (folder, path)
}

/// One JSON document and nothing else.
pub fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).expect("one JSON document")
}

/// The bytes of a file in a folder.
pub fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}
