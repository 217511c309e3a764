//! `info --mesh-descs` against figures that were worked out by hand.

mod common;

use common::{json, succeed};
use serde_json::{Value, json};
use std::path::Path;

/// Counts of a file: materials, render primitives, render nodes, triangles of the document and with instances; and of each
/// MeshDesc first vertex, vertices, first index, indices.
#[derive(Debug, PartialEq)]
struct Counts {
    materials: u64,
    render_primitives: u64,
    render_nodes: u64,
    triangles: u64,
    instanced_triangles: u64,
    ranges: Vec<[u64; 4]>,
    has: Vec<String>,
}

fn counts(folder: &Path, name: &str) -> Counts {
    let info = json(&succeed(folder, &["info", name, "--json", "--mesh-descs"]));
    let number = |value: &Value| value.as_u64().unwrap_or_else(|| panic!("{value} is no count"));
    let rows = info["mesh_descs"].as_array().expect("a list");
    let range =
        |row: &Value| ["first_vertex", "vertex_count", "first_index", "index_count"].map(|key| number(&row[key]));
    let has = |row: &Value| {
        row["has"].as_array().expect("a list").iter().filter_map(Value::as_str).collect::<Vec<_>>().join(" ")
    };
    Counts {
        materials: number(&info["materials"]),
        render_primitives: number(&info["render_primitives"]),
        render_nodes: number(&info["render_nodes"]),
        triangles: number(&info["triangles"]),
        instanced_triangles: number(&info["instanced_triangles"]),
        ranges: rows.iter().map(range).collect(),
        has: rows.iter().map(has).collect(),
    }
}

#[test]
fn a_cube_of_an_obj_file() {
    let folder = tempfile::tempdir().expect("folder");
    // Eight positions, four texture coordinates, six normals. Top and bottom have a material of their own.
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
        vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
        vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 0 1 0\nvn -1 0 0\nvn 1 0 0\n\
        usemtl caps\nf 4/1/1 3/2/1 2/3/1 1/4/1\nf 5/1/2 6/2/2 7/3/2 8/4/2\n\
        usemtl sides\nf 1/1/3 2/2/3 6/3/3 5/4/3\nf 3/1/4 4/2/4 8/3/4 7/4/4\nf 4/1/5 1/2/5 5/3/5 8/4/5\nf 2/1/6 3/2/6 7/3/6 6/4/6\n";
    std::fs::write(folder.path().join("cube.obj"), text).expect("written");
    // No two faces share a normal, so each has four vertices of its own: 2 x 4, then 4 x 4; two triangles a face.
    let expected = Counts {
        materials: 2,
        render_primitives: 2,
        render_nodes: 2,
        triangles: 12,
        instanced_triangles: 12,
        ranges: vec![[0, 8, 0, 12], [8, 16, 12, 24]],
        has: vec!["normal uv0".to_owned(); 2],
    };
    assert_eq!(counts(folder.path(), "cube.obj"), expected);
    // The same without normals and texture coordinates: corners are shared.
    let bare: String = text
        .lines()
        .filter(|line| !line.starts_with("vt") && !line.starts_with("vn"))
        .map(|line| {
            let words = line.split(' ').map(|word| word.split('/').next().unwrap_or_default());
            words.collect::<Vec<_>>().join(" ") + "\n"
        })
        .collect();
    std::fs::write(folder.path().join("bare.obj"), &bare).expect("written");
    // The caps have all eight corners, and so do the four sides.
    let ranges = vec![[0, 8, 0, 12], [8, 8, 12, 24]];
    let expected = Counts { ranges, has: vec![String::new(); 2], ..expected };
    assert_eq!(counts(folder.path(), "bare.obj"), expected);
    // Smooth, they have normals; across materials too, and no vertex is split for it.
    std::fs::write(folder.path().join("smooth.obj"), format!("s 1\n{bare}")).expect("written");
    let expected = Counts { has: vec!["normal".to_owned(); 2], ..expected };
    assert_eq!(counts(folder.path(), "smooth.obj"), expected);
}

#[test]
fn a_gltf_file_with_shared_geometry_strips_and_fans() {
    let folder = tempfile::tempdir().expect("folder");
    // Without a view, all elements are zero: what counts is how many there are.
    let accessor = |count: usize| json!({ "componentType": 5126, "count": count, "type": "VEC3" });
    let indices = json!({ "componentType": 5121, "count": 4, "type": "SCALAR" });
    let primitive = |position: usize, mode: usize, material: usize| json!({ "attributes": { "POSITION": position }, "mode": mode, "material": material });
    let mut fan = primitive(2, 6, 0);
    fan["indices"] = json!(3);
    let document = json!({
        "asset": { "version": "2.0" },
        "materials": [{ "name": "a" }, { "name": "b" }],
        "accessors": [accessor(3), accessor(5), accessor(7), indices],
        "meshes": [
            { "primitives": [primitive(0, 4, 0), primitive(1, 5, 1)] },
            // The geometry of the first one under another material; points; a fan of four of seven vertices.
            { "primitives": [primitive(0, 4, 1), primitive(2, 0, 0), fan] },
        ],
        "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [{ "mesh": 0 }, { "mesh": 1 }, { "mesh": 1 }],
    });
    std::fs::write(folder.path().join("a.gltf"), document.to_string()).expect("written");
    let expected = Counts {
        materials: 2,
        render_primitives: 3,
        // Two primitives under the first node, two with triangles under each of the others.
        render_nodes: 6,
        // 1 + 3 (a strip of five) + 1 + 2 (a fan of four).
        triangles: 7,
        // 4 once and 3 twice.
        instanced_triangles: 10,
        ranges: vec![[0, 3, 0, 3], [3, 5, 3, 9], [8, 7, 12, 6]],
        has: vec![String::new(); 3],
    };
    assert_eq!(counts(folder.path(), "a.gltf"), expected);
}

#[test]
fn a_crts_file_with_one_mesh_under_two_materials() {
    let folder = tempfile::tempdir().expect("folder");
    let positions: Vec<u8> =
        [0f32, 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.].iter().flat_map(|v| v.to_le_bytes()).collect();
    let indices: Vec<u8> = [0u32, 1, 2, 2, 1, 3].iter().flat_map(|v| v.to_le_bytes()).collect();
    let identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
    let object =
        |material: i32| json!({ "name": "o", "type": "MESH", "matrix": identity, "mesh": 0, "material": material });
    let header = json!({
        "buffer_views": [
            { "byte_offset": 0, "byte_length": 48, "type": "VEC3_F32" },
            { "byte_offset": 48, "byte_length": 24, "type": "VEC3_U32" },
        ],
        "meshes": [{ "name": "quad", "positions": 0, "indices": 1 }],
        "images": [],
        "materials": [{ "name": "a" }, { "name": "b" }],
        "objects": [object(0), object(1), object(0)],
    })
    .to_string();
    let bytes = [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &positions, &indices].concat();
    std::fs::write(folder.path().join("a.crts"), bytes).expect("written");
    let found = counts(folder.path(), "a.crts");
    // Two meshes of the document share the geometry, which is there once.
    assert_eq!((found.render_primitives, found.render_nodes, found.instanced_triangles), (1, 3, 6));
    assert_eq!((found.materials, found.ranges), (2, vec![[0, 4, 0, 6]]));
}

#[test]
fn the_cornell_box_in_every_format() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    succeed(f, &["generate", "cornell", "-o", "a.glb"]);
    // Five walls of a quad each, two blocks of five quads, a lamp of one; four materials. As glTF, every object is a mesh.
    let quads = [1, 1, 1, 1, 1, 5, 5, 1];
    let mut first = 0;
    let ranges: Vec<[u64; 4]> = quads
        .iter()
        .map(|&n| {
            let range = [4 * first, 4 * n, 6 * first, 6 * n];
            first += n;
            range
        })
        .collect();
    for name in ["a.glb", "b.gltf", "c.crts"] {
        if name != "a.glb" {
            succeed(f, &["convert", "a.glb", name]);
        }
        let found = counts(f, name);
        assert_eq!((found.materials, found.render_nodes, &found.ranges), (4, 8, &ranges), "{name}");
    }
    // As OBJ, it is one mesh of one geometry for each material: white (three walls and two blocks), green, red, lamp.
    succeed(f, &["convert", "a.glb", "d.obj"]);
    let found = counts(f, "d.obj");
    let expected = vec![[0, 52, 0, 78], [52, 4, 78, 6], [56, 4, 84, 6], [60, 4, 90, 6]];
    assert_eq!((found.materials, found.render_nodes, found.ranges), (4, 4, expected));
}

#[test]
fn well_known_models_have_the_counts_that_are_known_of_them() {
    let Some(assets) = std::env::var_os("ORTHANT_ASSETS").map(std::path::PathBuf::from) else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    // A cube with a normal for each face: 24 vertices, 36 indices.
    let cube = counts(&assets, "gltf-khronos/Box/Box.glb");
    assert_eq!((cube.materials, cube.ranges), (1, vec![[0, 24, 0, 36]]));
    // 2,399 vertices and 4,212 triangles, as the inventory says.
    let duck = counts(&assets, "gltf-khronos/Duck/Duck.glb");
    assert_eq!((duck.triangles, duck.ranges), (4212, vec![[0, 2399, 0, 3 * 4212]]));
    assert_eq!(duck.has, ["normal uv0"]);
}
