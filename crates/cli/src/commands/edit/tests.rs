//! What is refused changes nothing, anywhere.

use super::*;
use crate::args::{Cli, Command};
use crate::job::backend::AnyBackend;
use clap::Parser;
use std::collections::BTreeSet;

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Node 0 scales unevenly above node 1, which is turned; node 2 shows what has joints; mesh 1 is like no other.
fn scene() -> Value {
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"scale": [1, 3, 1], "children": [1]},
            {"mesh": 0, "camera": 0, "rotation": [0, 0, 0.6, 0.8], "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"mesh": 1, "skin": 0, "children": [3]},
            {},
        ],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]},
            {"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}}]},
        ],
        "skins": [{"joints": [2, 3]}, {"joints": [3]}],
        "materials": [{"emissiveFactor": [1, 1, 1]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
        "animations": [{"samplers": [{"input": 4, "output": 5}],
            "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5121, "count": 3, "type": "VEC4"},
            {"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC4"},
            {"bufferView": 4, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
            {"bufferView": 5, "componentType": 5126, "count": 2, "type": "VEC3"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 3},
            {"buffer": 0, "byteOffset": 40, "byteLength": 12}, {"buffer": 0, "byteOffset": 52, "byteLength": 48},
            {"buffer": 0, "byteOffset": 100, "byteLength": 8}, {"buffer": 0, "byteOffset": 108, "byteLength": 24},
        ],
        "buffers": [{"byteLength": 132, "uri": "data.bin"}],
    })
}

/// The same, with an index that leads past the vertices.
fn data(third_index: u8) -> Vec<u8> {
    let weights = [1.0, 0.0, 0.0, 0.0];
    let mut bytes = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    bytes.extend([0, 1, third_index, 0]);
    bytes.extend([0, 1, 0, 0].repeat(3));
    bytes.extend(floats(&weights.repeat(3)));
    bytes.extend(floats(&[0., 1.]));
    bytes.extend(floats(&[0., 0., 0., 1., 2., 3.]));
    bytes
}

fn editor(folder: &Path) -> Editor {
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).expect("a file");
    write("scene.gltf", scene().to_string().as_bytes());
    write("data.bin", &data(2));
    write("broken.gltf", scene().to_string().replace("data.bin", "broken.bin").as_bytes());
    write("broken.bin", &data(7));
    let path = folder.join("scene.gltf");
    let imported = import_path(&path, &ImportOptions::default()).expect("a scene");
    let path = path.to_str().expect("UTF-8");
    let line = ["orthant", "edit", path, "--ops", "none", "--verify", "--backend", "cpu"];
    let Command::Edit(args) = Cli::parse_from(line).command else { panic!("it is `edit`") };
    let session = Session::new(folder, ImportOptions::default());
    Editor::new(imported.scene, &args, session, 1 << 30, true).unwrap_or_else(|failure| panic!("{failure}"))
}

/// Everything that may not change: exported bytes, the rows of the derived scene, what is resident.
#[derive(PartialEq)]
struct State(Vec<(&'static str, Vec<u8>)>);

impl State {
    fn of(editor: &Editor, folder: &Path) -> Self {
        let path = folder.join("state.glb");
        export_path(&editor.live.scene, &path, &ExportOptions::default()).expect("exported");
        let derived = &editor.live.derived;
        let Some(AnyBackend::Cpu(backend)) = &editor.live.backend else { panic!("the CPU follows") };
        let resident = backend.scene();
        let blas: Vec<u8> = resident.blas.iter().map(|blas| blas.is_some().into()).collect();
        let bytes = |name, bytes: &[u8]| (name, bytes.to_vec());
        Self(vec![
            ("the document", std::fs::read(&path).expect("the file")),
            (
                "the history",
                format!("{} {:?}", editor.live.session.history.done().len(), editor.live.pose).into_bytes(),
            ),
            ("the hierarchy", format!("{:?}", derived.hierarchy.nodes).into_bytes()),
            bytes("render nodes", bytemuck::cast_slice(&derived.render_nodes)),
            bytes("owners", bytemuck::cast_slice(&derived.owners)),
            bytes("mesh descs", bytemuck::cast_slice(&derived.mesh_descs)),
            bytes("materials", bytemuck::cast_slice(&derived.materials)),
            bytes("textures", bytemuck::cast_slice(&derived.textures)),
            bytes("lights", bytemuck::cast_slice(&derived.lights)),
            bytes("emitters", bytemuck::cast_slice(&derived.emitters)),
            bytes("resident positions", bytemuck::cast_slice(&resident.positions)),
            bytes("resident vertices", bytemuck::cast_slice(&resident.vertices)),
            bytes("resident indices", bytemuck::cast_slice(&resident.indices)),
            bytes("resident tangents", bytemuck::cast_slice(&resident.tangents)),
            bytes("resident emitter triangles", bytemuck::cast_slice(&resident.emitter_triangles)),
            bytes("resident mesh descs", bytemuck::cast_slice(&resident.mesh_descs)),
            bytes("resident textures", bytemuck::cast_slice(&resident.textures)),
            bytes("resident materials", bytemuck::cast_slice(&resident.materials)),
            bytes("resident lights", bytemuck::cast_slice(&resident.lights)),
            bytes("resident emitters", bytemuck::cast_slice(&resident.emitters)),
            bytes("resident render nodes", bytemuck::cast_slice(&resident.render_nodes)),
            ("BLAS", blas),
        ])
    }

    fn assert_is(&self, other: &Self, line: &str) {
        for (a, b) in self.0.iter().zip(&other.0) {
            // A slot that a material has had and lost keeps its row, which nothing shows; material rows are counted by slots.
            let is_same = if a.0.ends_with("materials") { b.1.starts_with(&a.1) } else { a.1 == b.1 };
            assert!(is_same, "{line}: {} changed", a.0);
        }
    }
}

/// Lines that are refused, and a word of the reason. At least one of every operation that can be refused.
const REFUSED: [(&str, &str); 53] = [
    (r#"{"op": "set_transform", "node": 9, "translation": [0, 0, 0]}"#, "/node: there is no node 9"),
    (r#"{"op": "set_transform", "node": 0, "matrix": [1,0,0,0, 1,1,0,0, 0,0,1,0, 0,0,0,1]}"#, "shear"),
    (r#"{"op": "set_transform", "node": 0, "rotation": [0, 0, 0, 0]}"#, "rotation"),
    (r#"{"op": "set_transform", "node": "name:nobody", "scale": [1, 1, 1]}"#, "of the name \"nobody\""),
    (r#"{"op": "add_node", "parent": 9}"#, "/parent: there is no node 9"),
    (r#"{"op": "add_node", "matrix": [1,0,0,0, 1,1,0,0, 0,0,1,0, 0,0,0,1], "as": "a"}"#, "shear"),
    (r#"{"op": "add_shape", "shape": "sphere", "material": 9}"#, "/material: there is no material 9"),
    (r#"{"op": "add_shape", "shape": "teapot"}"#, "teapot"),
    (r#"{"op": "add_light", "light": {"type": "torch"}}"#, "/light/type"),
    (r#"{"op": "add_light", "light": {"type": "point", "intensity": -1}}"#, "/light/intensity"),
    (r#"{"op": "delete", "node": "$nothing"}"#, "label \"nothing\""),
    (r#"{"op": "delete", "node": 9}"#, "/node: there is no node 9"),
    (r#"{"op": "duplicate", "node": 9}"#, "/node: there is no node 9"),
    (r#"{"op": "reparent", "node": 2, "parent": 3}"#, "cannot go under node 3"),
    (r#"{"op": "reparent", "node": 2, "parent": 2}"#, "cannot be its own parent"),
    (r#"{"op": "reparent", "node": 1, "parent": null, "keep_world": true}"#, "sheared"),
    (r#"{"op": "reparent", "node": 1}"#, "parent"),
    (r#"{"op": "rename", "node": 9, "name": "x"}"#, "/node: there is no node 9"),
    (r#"{"op": "rename", "name": "x"}"#, "node"),
    (r#"{"op": "set_visible", "node": 9, "visible": true}"#, "/node: there is no node 9"),
    (r#"{"op": "set_mesh", "node": 1, "mesh": 9}"#, "/mesh: there is no mesh 9"),
    (r#"{"op": "set_camera", "node": 1, "camera": 9}"#, "/camera: there is no camera 9"),
    (r#"{"op": "set_skin", "node": 1, "skin": 0}"#, "JOINTS_0"),
    (r#"{"op": "set_skin", "node": 0, "skin": 0}"#, "no mesh"),
    (r#"{"op": "set_skin", "node": 2, "skin": 1}"#, "fewer joints"),
    (r#"{"op": "assign_material", "mesh": 0, "primitive": 5, "material": null}"#, "primitive"),
    (r#"{"op": "assign_material", "mesh": 0, "primitive": 0, "material": 9}"#, "/material: there is no material 9"),
    (r#"{"op": "duplicate_material", "material": 9}"#, "/material: there is no material 9"),
    (
        r#"{"op": "set_material", "material": 0, "set": {"pbrMetallicRoughness": {"roughnessFactor": 2}}}"#,
        "/set/pbrMetallicRoughness/roughnessFactor",
    ),
    (r#"{"op": "set_material", "material": 0, "set": {"doubleSided": "yes"}}"#, "/set/doubleSided"),
    (r#"{"op": "set_material", "material": 0, "set": {"normalTexture": {"index": 4}}}"#, "/set/normalTexture/index"),
    (r#"{"op": "set_material", "material": 0, "set": 7}"#, "/set"),
    (r#"{"op": "set_light", "light": 0, "set": {"range": -2}}"#, "/set/range"),
    (r#"{"op": "set_light", "light": 0, "set": {"type": "spot", "spot": {"outerConeAngle": 9}}}"#, "/set/spot"),
    (
        r#"{"op": "set_camera_params", "camera": 0, "set": {"perspective": {"znear": "near"}}}"#,
        "/set/perspective/znear",
    ),
    (r#"{"op": "set_camera_params", "camera": 0, "set": {"type": "fisheye"}}"#, "/set"),
    (r#"{"op": "split_mesh", "node": 0}"#, "no mesh"),
    (r#"{"op": "merge_mesh", "node": 1}"#, "no other mesh"),
    (r#"{"op": "merge_mesh", "node": 0}"#, "no mesh"),
    (r#"{"op": "select_variant", "variant": "red"}"#, "no such variant"),
    (r#"{"op": "select_variant", "variant": 3}"#, "variant"),
    (r#"{"op": "merge_scene", "path": "nothing.gltf"}"#, "nothing.gltf"),
    (r#"{"op": "merge_scene", "path": "scene.gltf", "parent": 9}"#, "/parent: there is no node 9"),
    // Only the sync finds these: the document takes the file, and its geometry cannot be decoded.
    (r#"{"op": "merge_scene", "path": "broken.gltf"}"#, "vertex index 7"),
    (r#"{"op": "merge_scene", "path": "broken.gltf", "parent": 1, "as": "b"}"#, "vertex index 7"),
    (r#"{"op": "remove_unused", "node": 1}"#, "node"),
    (r#"{"op": "undo"}"#, "cannot undo 1"),
    (r#"{"op": "redo", "count": 2}"#, "cannot redo 2"),
    (r#"{"op": "set_time", "seconds": 1, "animation": 9}"#, "/animation: there is no animation 9"),
    (r#"{"op": "set_time", "seconds": "now"}"#, "it has to be a number"),
    (r#"{"op": "melt", "node": 1}"#, "melt"),
    (r#"{"op": "delete", "node": 1, "nodes": 2}"#, "nodes"),
    (r#"{"op": "delete""#, "EOF"),
];

fn refuse(editor: &mut Editor, line: &str, word: &str) {
    match editor.line(line) {
        Err(Stopped::Refused(what)) => assert!(what.contains(word), "{line}: no {word:?} in {what:?}"),
        Err(Stopped::Failed(failure)) => panic!("{line}: {failure}"),
        Ok(entry) => panic!("{line} is not refused: {entry}"),
    }
    editor.check().unwrap_or_else(|failure| panic!("{line}: {failure}"));
}

#[test]
fn what_is_refused_leaves_scene_derived_state_and_resident_state_as_they_were() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = editor(folder.path());
    let before = State::of(&editor, folder.path());
    for (line, word) in REFUSED {
        refuse(&mut editor, line, word);
        before.assert_is(&State::of(&editor, folder.path()), line);
    }
    // The parser names every operation that there is.
    let error = Operation::parse(r#"{"op": "?"}"#).expect_err("there is no such operation").to_string();
    let all: BTreeSet<&str> = error.split_once("known are: ").expect("the list").1.split(", ").collect();
    assert!(all.len() >= 25, "{error}");
    let refused: Vec<String> = REFUSED.iter().map(|(line, _)| line.replace(r#"{"op": ""#, "")).collect();
    for name in all {
        assert!(refused.iter().any(|line| line.starts_with(&format!("{name}\""))), "{name} is never refused here");
    }
}

#[test]
fn what_is_refused_after_other_edits_leaves_what_they_led_to() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = editor(folder.path());
    for line in [
        r#"{"op": "duplicate", "node": 0, "as": "copy"}"#,
        r#"{"op": "delete", "node": 1}"#,
        r#"{"op": "set_visible", "node": "$copy", "visible": false}"#,
        r#"{"op": "set_time", "seconds": 0.5}"#,
    ] {
        editor.line(line).unwrap_or_else(|_| panic!("{line} is refused"));
    }
    let document = |editor: &Editor| State::of(editor, folder.path()).0.swap_remove(0).1;
    let before = document(&editor);
    for (line, word) in [
        (
            r#"{"op": "set_visible", "node": 1, "visible": true}"#,
            "there is no node 1: it never was, or has been deleted",
        ),
        (r#"{"op": "merge_scene", "path": "broken.gltf", "as": "copy"}"#, "vertex index 7"),
        (r#"{"op": "redo"}"#, "cannot redo"),
    ] {
        refuse(&mut editor, line, word);
        assert!(document(&editor) == before, "{line}");
    }
    // Label, history and pose are those of before: all of it can be taken back.
    for line in [
        r#"{"op": "delete", "node": "$copy"}"#,
        r#"{"op": "undo", "count": 4}"#,
        r#"{"op": "set_time", "seconds": 0, "animation": null}"#,
    ] {
        editor.line(line).unwrap_or_else(|_| panic!("{line} is refused"));
    }
}
