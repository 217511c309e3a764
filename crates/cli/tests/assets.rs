//! `info` on every third-party scene, the malformed ones too: its counts are those of the file's JSON, or the file is
//! refused as bad input, with the reason, and at once. The folder is named by `ORTHANT_ASSETS`.

mod common;

use common::{json, orthant};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

fn scenes(folder: &Path, list: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())).flatten() {
        let path = entry.path();
        if path.is_dir() {
            scenes(&path, list);
        } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb" || e == "obj") {
            list.push(path);
        }
    }
}

/// A refusal is one line that says the file and, behind it, what is wrong.
fn assert_says_why(name: &str, stderr: &str) {
    let line = stderr.trim_end();
    let reason =
        line.strip_prefix("error: ").and_then(|rest| rest.strip_prefix(name)).and_then(|r| r.strip_prefix(": "));
    assert!(reason.is_some_and(|reason| reason.len() > 10) && !line.contains('\n'), "{name}: {stderr}");
}

/// The longest that a damaged file may take. Those that are whole may be large, and are decoded.
const LONGEST: Duration = Duration::from_secs(10);

/// The JSON of a file that was loaded, so it is there.
fn document(path: &Path) -> Value {
    let bytes = std::fs::read(path).expect("a file");
    let text = if bytes.starts_with(b"glTF") {
        let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
        &bytes[20..20 + length]
    } else {
        &bytes[..]
    };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    serde_json::from_slice(text).expect("JSON")
}

/// Primitives, triangles and vertices of all meshes.
fn geometry(document: &Value) -> (u64, u64, u64) {
    let list = |v: &Value| v.as_array().cloned().unwrap_or_default();
    let count = |accessor: &Value| accessor.as_u64().and_then(|i| document["accessors"][i as usize]["count"].as_u64());
    let (mut primitives, mut triangles, mut vertices) = (0, 0, 0);
    for primitive in list(&document["meshes"]).iter().flat_map(|m| list(&m["primitives"])) {
        primitives += 1;
        let Some(position) = count(&primitive["attributes"]["POSITION"]) else { continue };
        let indices = count(&primitive["indices"]).unwrap_or(position);
        vertices += position;
        triangles += match primitive["mode"].as_u64().unwrap_or(4) {
            4 => indices / 3,
            5 | 6 => indices.saturating_sub(2),
            _ => 0,
        };
    }
    (primitives, triangles, vertices)
}

#[test]
fn info_counts_what_the_json_of_every_asset_says() {
    let Some(assets) = std::env::var_os("ORTHANT_ASSETS") else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    let mut files = Vec::new();
    scenes(Path::new(&assets), &mut files);
    let (mut counted, mut refused) = (0, 0);
    for path in files {
        let name = path.to_str().expect("the assets have UTF-8 names");
        let begun = Instant::now();
        let output = orthant(Path::new("."), &["info", name, "--json"]);
        assert!(!name.contains("malformed") || begun.elapsed() < LONGEST, "{name} took {:?}", begun.elapsed());
        let code = output.status.code();
        if code == Some(3) {
            assert_says_why(name, &String::from_utf8_lossy(&output.stderr));
            refused += 1;
            continue;
        }
        assert_eq!(code, Some(0), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let info = json(&String::from_utf8(output.stdout).expect("UTF-8"));
        if path.extension().is_some_and(|e| e == "obj") {
            counted += 1;
            continue;
        }
        let document = document(&path);
        for key in ["scenes", "nodes", "meshes", "materials", "textures", "images", "animations", "skins", "cameras"] {
            assert_eq!(info[key], document[key].as_array().map_or(0, Vec::len), "{name}: {key}");
        }
        let (primitives, triangles, vertices) = geometry(&document);
        assert_eq!(info["primitives"], primitives, "{name}: primitives");
        assert_eq!(info["triangles"], triangles, "{name}: triangles");
        assert_eq!(info["vertices"], vertices, "{name}: vertices");
        counted += 1;
    }
    println!("{counted} scenes counted, {refused} refused");
    assert!(counted > 100, "only {counted} scenes were counted");
}
