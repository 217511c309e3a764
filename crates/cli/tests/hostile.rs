//! Files that were made to do harm: each is refused with file, place and reason, or does none.

mod common;

use common::{fail, orthant, succeed};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

fn write(folder: &Path, name: &str, content: impl AsRef<[u8]>) {
    std::fs::write(folder.join(name), content).expect("written");
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("folder")
}

/// Ends in time, and not by a fault of the program.
fn survives(folder: &Path, args: &[&str]) {
    let begun = Instant::now();
    let output = orthant(folder, args);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{args:?}: {:?}: {said}", output.status);
    assert!(begun.elapsed() < Duration::from_secs(10), "{args:?} took {:?}", begun.elapsed());
}

#[test]
fn uris_that_leave_the_folder_are_refused_in_every_form() {
    let outer = folder();
    let inner = outer.path().join("scene");
    std::fs::create_dir(&inner).expect("folder");
    write(outer.path(), "secret.bin", [0; 4]);
    let absolute = outer.path().join("secret.bin").display().to_string();
    let mut uris = vec![
        "../secret.bin".to_owned(),
        "%2e%2e/secret.bin".to_owned(),
        "%2E%2E%2fsecret.bin".to_owned(),
        "a/../../secret.bin".to_owned(),
        format!("file://{absolute}"),
        absolute,
        "..\\secret.bin".to_owned(),
        "C:\\secret.bin".to_owned(),
        "C:/secret.bin".to_owned(),
        "\\\\host\\share\\secret.bin".to_owned(),
        "//host/share/secret.bin".to_owned(),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.bin", inner.join("link.bin")).expect("a link");
        uris.push("link.bin".to_owned());
    }
    for uri in uris {
        let document = json!({ "asset": { "version": "2.0" }, "buffers": [{ "uri": uri, "byteLength": 4 }] });
        write(&inner, "a.gltf", document.to_string());
        fail(&inner, &["info", "a.gltf"], 3, &["a.gltf: /buffers/0", "is not inside the folder"]);
        let document = json!({ "asset": { "version": "2.0" }, "images": [{ "uri": uri }] });
        write(&inner, "b.gltf", document.to_string());
        fail(&inner, &["convert", "b.gltf", "c.glb"], 3, &["b.gltf: /images/0/uri", "is not inside the folder"]);
        // In OBJ it is a warning, and the file is not read.
        write(&inner, "c.obj", "mtllib c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
        write(&inner, "c.mtl", format!("newmtl m\nmap_Kd {uri}\n"));
        let info = common::json(&succeed(&inner, &["info", "c.obj", "--json"]));
        let warnings = info["warnings"].to_string();
        assert!(
            warnings.contains("is not inside the folder") || warnings.contains("does not exist"),
            "{uri}: {warnings}"
        );
    }
}

/// A PNG of the size that its header says, with the data of a few texels.
fn png_bomb(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8; 4], data: &[u8]| {
        bytes.extend((data.len() as u32).to_be_bytes());
        let body = [&kind[..], data].concat();
        bytes.extend(&body);
        bytes.extend(crc32(&body).to_be_bytes());
    };
    chunk(b"IHDR", &[&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 6, 0, 0, 0]].concat());
    // An empty stream of zlib.
    chunk(b"IDAT", &[0x78, 0x9c, 0x03, 0x00, 0x00, 0x00, 0x00, 0x01]);
    chunk(b"IEND", &[]);
    bytes
}

/// ISO 3309, as PNG has it.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, &b| (0..8).fold(crc ^ u32::from(b), |crc, _| step(crc)))
}

#[test]
fn an_image_that_would_fill_the_memory_is_refused_before_it_is_decoded() {
    let folder = folder();
    let f = folder.path();
    // 40,000 x 40,000 texels are 6.4 GB.
    write(f, "bomb.png", png_bomb(40_000, 40_000));
    let document = json!({
        "asset": { "version": "2.0" },
        "images": [{ "uri": "bomb.png" }],
        "textures": [{ "source": 0 }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
    });
    write(f, "a.gltf", document.to_string());
    let begun = Instant::now();
    fail(f, &["info", "a.gltf", "--max-memory", "256MiB"], 3, &["a.gltf: /images/0", "--max-memory"]);
    assert!(begun.elapsed() < Duration::from_secs(10));
    // One that fits is broken, which is a warning.
    write(f, "bomb.png", png_bomb(1000, 1000));
    survives(f, &["info", "a.gltf", "--max-memory", "256MiB"]);
}

#[test]
fn a_file_that_declares_a_billion_of_anything_is_refused() {
    let folder = folder();
    let f = folder.path();
    let zeros = json!({ "componentType": 5126, "count": 1_000_000_000, "type": "VEC3" });
    let shown = |mesh: Value, node: Value| {
        json!({
            "asset": { "version": "2.0" }, "accessors": [zeros], "meshes": [mesh], "nodes": [node],
            "scenes": [{ "nodes": [0] }], "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        })
    };
    let vertices = shown(json!({ "primitives": [{ "attributes": { "POSITION": 0 } }] }), json!({ "mesh": 0 }));
    let mut instances = shown(
        json!({ "primitives": [{ "attributes": { "POSITION": 1 } }] }),
        json!({ "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0 } } } }),
    );
    let few = json!({ "componentType": 5126, "count": 3, "type": "VEC3" });
    instances["accessors"].as_array_mut().expect("a list").push(few);
    for (name, document) in [("vertices.gltf", vertices), ("instances.gltf", instances)] {
        write(f, name, document.to_string());
        let begun = Instant::now();
        fail(f, &["info", name, "--max-memory", "1GiB"], 3, &[name, "--max-memory"]);
        fail(f, &["render", name, "-o", "a.png", "--max-memory", "1GiB"], 3, &[name]);
        assert!(begun.elapsed() < Duration::from_secs(10));
    }
}

#[test]
fn json_of_a_million_levels_is_refused_in_both_formats() {
    let folder = folder();
    let f = folder.path();
    let deep = ["[".repeat(1_000_000), "{\"a\":".repeat(1_000_000)];
    for (i, open) in deep.iter().enumerate() {
        let name = format!("{i}.gltf");
        write(f, &name, format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{open}"));
        fail(f, &["info", &name], 3, &[&name]);
        // CRTS: in a member that is known, and in one that is not.
        for (k, member) in ["objects", "unknown"].into_iter().enumerate() {
            let header = format!("{{\"{member}\":{open}");
            let name = format!("{i}{k}.crts");
            write(f, &name, [&(header.len() as u64).to_le_bytes()[..], header.as_bytes()].concat());
            fail(f, &["info", &name], 3, &[&name]);
        }
    }
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for part in bytes.chunks(3) {
        let bits = (0..3).fold(0u32, |bits, i| bits << 8 | u32::from(part.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= part.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

/// A scene in which accessor `bad` holds nothing but this value: all attributes, a skin, instances.
fn with_value(bad: usize, value: f32) -> Value {
    let kinds = ["VEC3", "VEC3", "VEC2", "VEC4", "VEC4", "VEC4", "MAT4", "VEC3"];
    let mut bytes = Vec::new();
    let mut views = Vec::new();
    let mut accessors = Vec::new();
    for (i, kind) in kinds.iter().enumerate() {
        let components = match *kind {
            "VEC2" => 2,
            "VEC3" => 3,
            "MAT4" => 16,
            _ => 4,
        };
        let start = bytes.len();
        for v in 0..3 {
            for c in 0..components {
                let usual = if c % 5 == v % components.min(5) { 1.0f32 } else { 0.0 };
                bytes.extend((if i == bad { value } else { usual }).to_le_bytes());
            }
        }
        views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": bytes.len() - start }));
        accessors.push(json!({ "bufferView": i, "componentType": 5126, "count": 3, "type": kind }));
    }
    let joints = bytes.len();
    bytes.extend([0u8; 12]);
    views.push(json!({ "buffer": 0, "byteOffset": joints, "byteLength": 12 }));
    accessors.push(json!({ "bufferView": 8, "componentType": 5121, "count": 3, "type": "VEC4" }));
    let attributes = json!({ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TANGENT": 3, "COLOR_0": 4 });
    let mut skinned = attributes.clone();
    skinned["WEIGHTS_0"] = json!(5);
    skinned["JOINTS_0"] = json!(8);
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [
            { "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 7 } } } },
            { "mesh": 1, "skin": 0 }, {},
        ],
        "skins": [{ "joints": [2, 2, 2], "inverseBindMatrices": 6 }],
        "materials": [{ "emissiveFactor": [1, 1, 1] }],
        "meshes": [
            { "primitives": [{ "attributes": attributes, "material": 0 }] },
            { "primitives": [{ "attributes": skinned }] },
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:;base64,{}", base64(&bytes)) }],
    })
}

#[test]
fn numbers_that_are_not_finite_do_no_harm_wherever_they_are() {
    let folder = folder();
    let f = folder.path();
    for (k, value) in [f32::NAN, f32::INFINITY, f32::MAX, 1e-45].into_iter().enumerate() {
        for bad in 0..8 {
            let name = format!("{bad}-{k}.gltf");
            write(f, &name, with_value(bad, value).to_string());
            survives(f, &["render", &name, "-o", "a.png", "--size", "8x8", "--spp", "4", "--env", "none"]);
            for target in ["a.glb", "a.obj", "a.crts"] {
                survives(f, &["convert", &name, target]);
                if f.join(target).exists() {
                    survives(f, &["info", target]);
                }
            }
        }
    }
}

#[test]
fn numbers_that_json_cannot_hold_are_refused_where_they_are() {
    let folder = folder();
    let f = folder.path();
    for (i, number) in ["NaN", "1e999", "-1e999", "Infinity"].iter().enumerate() {
        let name = format!("{i}.gltf");
        let node = format!("{{\"translation\":[0,{number},0]}}");
        write(f, &name, format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{node}]}}"));
        fail(f, &["info", &name], 3, &[&name, "line 1, column"]);
    }
    // What an f64 holds may be more than an f32 does.
    for (i, value) in [1e300, -1e300, 1e-300].into_iter().enumerate() {
        let mut document = with_value(99, 0.0);
        document["nodes"][1]["scale"] = json!([value, value, value]);
        document["nodes"][2]["translation"] = json!([value, 0, 0]);
        let name = format!("large-{i}.gltf");
        write(f, &name, document.to_string());
        survives(f, &["render", &name, "-o", "a.png", "--size", "8x8", "--spp", "4", "--env", "none"]);
        ["a.glb", "a.obj", "a.crts"].iter().for_each(|target| survives(f, &["convert", &name, target]));
    }
}

#[test]
fn crts_and_obj_hold_no_harmful_numbers_either() {
    let folder = folder();
    let f = folder.path();
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    for value in [f32::NAN, f32::NEG_INFINITY, f32::MAX] {
        let positions: Vec<u8> = [value; 9].iter().flat_map(|v| v.to_le_bytes()).collect();
        let indices: Vec<u8> = [0u32, 1, 2].iter().flat_map(|v| v.to_le_bytes()).collect();
        let header = json!({
            "buffer_views": [
                { "byte_offset": 0, "byte_length": 36, "type": "VEC3_F32" },
                { "byte_offset": 36, "byte_length": 12, "type": "VEC3_U32" },
            ],
            "meshes": [{ "name": "m", "positions": 0, "indices": 1, "normals": 0 }],
            "materials": [], "images": [],
            "objects": [
                { "name": "o", "type": "MESH", "matrix": identity, "mesh": 0, "material": -1 },
                { "name": "l", "type": "LIGHT", "matrix": identity, "color": [1, 1, 1], "energy": 1e300, "size": [1e300, 1] },
            ],
        });
        let header = header.to_string();
        let bytes = [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &positions, &indices].concat();
        write(f, "a.crts", bytes);
        survives(f, &["render", "a.crts", "-o", "a.png", "--size", "8x8", "--spp", "4", "--env", "none"]);
        ["a.glb", "a.obj"].iter().for_each(|target| survives(f, &["convert", "a.crts", target]));
    }
    for number in ["nan", "inf", "-inf", "1e999", "1e39"] {
        write(f, "a.obj", format!("v 0 0 0\nv 1 0 0\nv 0 {number} 0\nf 1 2 3\n"));
        fail(f, &["info", "a.obj"], 3, &["a.obj: line 3, column 5: "]);
    }
}

#[test]
fn a_cycle_is_refused_with_the_node() {
    let folder = folder();
    let f = folder.path();
    let nodes = json!([{ "children": [1] }, { "name": "x", "children": [2] }, { "children": [0] }]);
    write(f, "a.gltf", json!({ "asset": { "version": "2.0" }, "nodes": nodes }).to_string());
    fail(f, &["info", "a.gltf"], 3, &["a.gltf: /nodes", "ancestor"]);
}
