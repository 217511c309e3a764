//! MikkTSpace takes no more memory than it is charged for, whatever is welded. Every allocation of the process is counted, so
//! this file has one test.

#[allow(dead_code, reason = "shared by test binaries that need different parts of it")]
mod common;
mod counting;

use common::Document;
use counting::peak_of;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_scene::Scene;
use serde_json::json;

/// Triangles of a soup.
const TRIANGLES: usize = 20_000;

/// A mesh with a normal map and no tangents, whose vertices are `vertex(triangle, corner)`: position, normal, UV.
fn soup(vertex: impl Fn(usize, usize) -> ([f32; 3], [f32; 3], [f32; 2])) -> Scene {
    let vertices: Vec<_> = (0..3 * TRIANGLES).map(|i| vertex(i / 3, i % 3)).collect();
    let mut document = Document::new(json!({
        "images": [{ "uri": "data:image/png;base64,AAAA" }],
        "textures": [{ "source": 0 }],
        "materials": [{ "normalTexture": { "index": 0 } }],
        "nodes": [{ "mesh": 0 }],
        "scenes": [{ "nodes": [0] }],
    }));
    let positions = document.floats("VEC3", &vertices.iter().map(|v| v.0).collect::<Vec<_>>());
    let normals = document.floats("VEC3", &vertices.iter().map(|v| v.1).collect::<Vec<_>>());
    let uvs = document.floats("VEC2", &vertices.iter().map(|v| v.2).collect::<Vec<_>>());
    let attributes = json!({ "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs });
    document.json["meshes"] = json!([{ "primitives": [{ "attributes": attributes, "material": 0 }] }]);
    document.import()
}

fn random(seed: usize) -> f32 {
    (seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407) >> 40) as f32
        / (1 << 24) as f32
}

#[test]
fn tangents_take_no_more_than_they_are_charged_for() {
    let corner = |i: usize, c: usize| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][c].map(|v: f32| v + (i % 100) as f32);
    let up = [0.0, 0.0, 1.0];
    let apart = soup(|i, c| {
        let s = 8 * (3 * i + c);
        ([random(s), random(s + 1), random(s + 2)], up, [random(s + 3), random(s + 4)])
    });
    let shared = soup(|i, c| {
        let [x, y] = corner(i, c);
        ([x, y, 0.0], up, [x, y])
    });
    let fan = soup(|i, c| {
        let (centre, angle) = ((i / 40) as f32, (i % 40 + c) as f32 * 0.1);
        let [x, y] = if c == 0 { [0.0, 0.0] } else { [angle.cos(), angle.sin()] };
        ([x, y, centre], up, [x + centre, y])
    });
    let degenerate = soup(|_, _| ([1.0; 3], up, [0.5; 2]));
    for (what, scene) in [("apart", apart), ("shared", shared), ("fans", fan), ("degenerate", degenerate)] {
        // The least that is enough: what is charged.
        let options = |max_bytes| DeriveOptions { max_bytes, ..DeriveOptions::default() };
        let (mut refused, mut enough) = (0, 1 << 30);
        while enough - refused > 1000 {
            let middle = (refused + enough) / 2;
            let known = peak_of(|| DerivedScene::derive(&scene, &options(middle)).is_err());
            if known.1 { refused = middle } else { enough = middle }
        }
        let (peak, derived) = peak_of(|| DerivedScene::derive(&scene, &options(enough)));
        assert!(derived.is_ok(), "{what}");
        let per_corner = peak / (3 * TRIANGLES as u64);
        println!("{what}: {peak} bytes, {per_corner} a corner; {enough} are charged");
        assert!(peak <= enough + (1 << 18), "{what}: {peak} bytes are taken, {enough} are charged");
        assert!(peak >= enough / 2, "{what}: {enough} bytes are charged, and only {peak} are taken");
    }
}
