use crate::Scene;
use crate::accessor;
use crate::export::{ExportOptions, ExportReport, Images, export_path};
use crate::import::{ImportOptions, Imported, import_path, import_slice};
use crate::model::*;
use crate::testing::documents::{TRIANGLE, data_uri, floats, skinned, triangle};
use base64::Engine;
use serde_json::{Value, json};
use std::path::Path;

fn gltf(document: &Value) -> Scene {
    import_slice(document.to_string(), None, "a.gltf", &ImportOptions::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

fn obj(folder: &Path, name: &str, text: &str) -> Scene {
    std::fs::write(folder.join(name), text).unwrap();
    reimport(folder, name).scene
}

fn reimport(folder: &Path, name: &str) -> Imported {
    import_path(&folder.join(name), &ImportOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn export(scene: &Scene, folder: &Path, name: &str) -> ExportReport {
    export_path(scene, &folder.join(name), &ExportOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

fn text(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn primitives(scene: &Scene) -> &[Primitive] {
    scene.meshes().iter().next().map_or(&[], |(_, mesh)| &mesh.primitives)
}

fn read<const N: usize>(scene: &Scene, p: &Primitive, semantic: &str) -> Option<Vec<[f32; N]>> {
    p.attributes.get(semantic).map(|id| accessor::read_f32(scene, id).unwrap())
}

/// Every value of every primitive.
fn geometry(scene: &Scene) -> Vec<String> {
    let of = |p: &Primitive| {
        format!(
            "{:?} {:?} {:?} {:?} {:?} {:?}",
            p.mode,
            accessor::read_indices(scene, p.indices.unwrap()).unwrap(),
            read::<3>(scene, p, "POSITION"),
            read::<3>(scene, p, "NORMAL"),
            read::<2>(scene, p, "TEXCOORD_0"),
            read::<3>(scene, p, "COLOR_0"),
        )
    };
    primitives(scene).iter().map(of).collect()
}

/// The corners of all triangles of the first primitive.
fn triangles(scene: &Scene) -> Vec<[glam::Vec3; 3]> {
    let p = &primitives(scene)[0];
    let positions = read::<3>(scene, p, "POSITION").unwrap();
    let indices = accessor::read_indices(scene, p.indices.unwrap()).unwrap();
    indices.as_chunks::<3>().0.iter().map(|t| t.map(|i| glam::Vec3::from(positions[i as usize]))).collect()
}

#[test]
fn an_obj_file_keeps_its_geometry() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let source = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0.25\nv 0 1 0\nv 0.1 0.30000001 -7e-30\nvt 0.1 0.9\nvt 1 0\nvn 0 0 1\nvn 0 1 0\n\
        o thing\nusemtl a b\nf 1/1/1 2/2/1 3/1/2 4/2/2\nusemtl c\nf 1 2 5\nf 3 2 5\nusemtl d\ns 1\nf 1/1 4/2 5/1\nl 1 2 3\np 1 4\n";
    let first = obj(f, "in.obj", source);
    let report = export(&first, f, "out.obj");
    assert_eq!(report.notes, []);
    assert_eq!(report.files, [f.join("out.mtl"), f.join("out.obj")]);
    let second = reimport(f, "out.obj");
    assert_eq!(second.warnings, []);
    assert_eq!(geometry(&second.scene), geometry(&first));
    let names = |s: &Scene| s.materials().iter().map(|(_, m)| m.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&second.scene), names(&first));
    assert_eq!(second.scene.nodes().iter().next().unwrap().1.name.as_deref(), Some("thing"));
    // Equal corners are written once.
    let written = text(f, "out.obj");
    assert_eq!(written.lines().filter(|line| line.starts_with("v ")).count(), 5, "{written}");
    export(&second.scene, f, "out.obj");
    assert_eq!(text(f, "out.obj"), written, "written again, it is the same file");
    assert_eq!(std::fs::read_dir(f).unwrap().count(), 3, "and there are no others");
}

#[test]
fn a_hierarchy_is_written_in_world_space_and_mirrors_keep_the_front() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let scene = gltf(&triangle(json!({
        "scenes": [{ "nodes": [1] }],
        "nodes": [
            { "name": "inner", "mesh": 0, "translation": [1, 0, 0] },
            { "name": "outer", "children": [0], "scale": [-2, 1, 1] },
        ],
    })));
    let report = export(&scene, f, "out.obj");
    assert!(report.notes.iter().any(|note| note.what.contains("no hierarchy")), "{:?}", report.notes);
    let again = reimport(f, "out.obj").scene;
    let [[a, b, c]] = triangles(&again)[..] else { panic!("one triangle") };
    assert_eq!([a, b, c].map(|p| p.to_array()), [[-2., 0., 0.], [-2., 1., 0.], [-4., 0., 0.]]);
    assert!((b - a).cross(c - a).z > 0.0, "the front is where it was");
    assert_eq!(read::<3>(&again, &primitives(&again)[0], "NORMAL").unwrap(), [[0.0, 0.0, 1.0]; 3]);
    assert!(text(f, "out.obj").contains("\no inner\n"));
}

#[test]
fn every_instance_and_every_node_of_a_mesh_is_an_object() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let mut document = triangle(json!({
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [
            { "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 1 } } } },
            { "mesh": 0, "name": "again" },
        ],
    }));
    // The normals as places: three times (0, 0, 1).
    document["accessors"][1]["count"] = json!(2);
    document["meshes"][0]["primitives"][0]["attributes"] = json!({ "POSITION": 0 });
    let report = export(&gltf(&document), f, "out.obj");
    assert!(report.notes.iter().any(|note| note.what.contains("no instances")), "{:?}", report.notes);
    let again = reimport(f, "out.obj").scene;
    let heights: Vec<f32> = triangles(&again).iter().map(|t| t[0].z).collect();
    assert_eq!(heights, [1.0, 1.0, 0.0]);
    let objects = text(f, "out.obj").lines().filter(|l| l.starts_with("o ")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(objects, ["o node0", "o node0", "o again"]);
}

#[test]
fn a_skinned_mesh_is_written_where_its_joints_put_it() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let report = export(&gltf(&skinned()), f, "out.obj");
    assert!(report.notes.iter().any(|note| note.what.contains("no skins")), "{:?}", report.notes);
    let again = reimport(f, "out.obj").scene;
    assert_eq!(triangles(&again)[0].map(|p| p.to_array()), [[0., 0., 3.], [1., 0., 3.], [0., 1., 3.]]);
}

#[test]
fn a_morphed_mesh_is_written_with_its_weights() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let mut document = triangle(json!({}));
    document["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 1 }]);
    document["meshes"][0]["weights"] = json!([0.5]);
    document["nodes"] = json!([{ "mesh": 0, "translation": [0, 0, 1] }]);
    export(&gltf(&document), f, "out.obj");
    let again = reimport(f, "out.obj").scene;
    assert!(triangles(&again)[0].iter().all(|p| p.z == 1.5), "{:?}", triangles(&again));
}

#[test]
fn a_material_comes_back_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let mtl = "newmtl paint\nKd .5 .25 .125\nKs .25 .125 .125\nKe 17 12 4\nPr .3\nPm .4\nPc .5\nPcr .6\nPs .7\naniso .8\nanisor .25\n\
        newmtl glass\nKd .1 .2 .3\nTf .9 1 .8\nNi 1.4\nillum 7\nPr 0.1\n\
        newmtl veil\nKd 1 1 1\nd .25\nPr 1\n";
    std::fs::write(f.join("in.mtl"), mtl).unwrap();
    let first = obj(f, "in.obj", "mtllib in.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\nf 1 2 3\n");
    let report = export(&first, f, "out.obj");
    assert_eq!(report.notes, []);
    let second = reimport(f, "out.obj").scene;
    for ((_, a), (_, b)) in first.materials().iter().zip(second.materials().iter()) {
        assert_eq!(a, b);
    }
    assert_eq!(second.materials().len(), 3);
    for statement in ["\nNs ", "\nillum 2\n", "\nKs 0.25 0.125 0.125\n"] {
        assert!(text(f, "out.mtl").contains(statement), "{statement:?} is for readers that know only Phong");
    }
}

/// An image by its first bytes alone: nothing decodes it.
const PNG: &[u8] = b"\x89PNG one";

#[test]
fn textures_are_copied_beside_with_their_options() {
    let (source, target) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (f, t) = (source.path(), target.path());
    std::fs::create_dir(f.join("maps")).unwrap();
    std::fs::write(f.join("maps/wood 1.png"), PNG).unwrap();
    std::fs::write(f.join("n.png"), b"\x89PNG two").unwrap();
    let mtl = "newmtl m\nKe 1 1 1\nPr 1\nPm 1\nmap_Kd -s 2 3 1 -o 0.5 0.25 0 maps/wood 1.png\nmap_d maps/wood 1.png\nmap_Ke maps/wood 1.png\n\
        map_Pr n.png\nmap_Pm n.png\nnorm -bm 0.5 -clamp on n.png\n";
    std::fs::write(f.join("in.mtl"), mtl).unwrap();
    let first = obj(f, "in.obj", "mtllib in.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n");
    export(&first, t, "out.obj");
    let second = reimport(t, "out.obj");
    assert_eq!(second.warnings, []);
    let (a, b) = (first.materials().iter().next().unwrap().1, second.scene.materials().iter().next().unwrap().1);
    let transform = |m: &Material| m.base_color_texture.as_ref().unwrap().transform.clone();
    assert_eq!(transform(a), transform(b));
    assert_eq!((a.alpha_mode, b.alpha_mode), (AlphaMode::Blend, AlphaMode::Blend));
    assert_eq!(b.normal_texture.as_ref().unwrap().scale, 0.5);
    assert_eq!((a.textures_in_use(), b.textures_in_use()), (4, 4));
    let images = |s: &Scene| s.images().iter().map(|(_, i)| (i.source.clone(), i.data.clone())).collect::<Vec<_>>();
    assert_eq!(images(&first), images(&second.scene));
    let sampler = |s: &Scene, m: &Material| {
        s.textures()[m.normal_texture.as_ref().unwrap().texture].sampler.map(|id| s.samplers()[id].clone())
    };
    assert_eq!(sampler(&first, a), sampler(&second.scene, b));
}

impl Material {
    fn textures_in_use(&self) -> usize {
        let all =
            [&self.base_color_texture, &self.metallic_roughness_texture, &self.normal_texture, &self.emissive_texture];
        all.into_iter().flatten().count()
    }
}

#[test]
fn embedded_images_become_files_with_names_that_a_map_can_hold() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let uri =
        |bytes: &[u8]| format!("data:image/png;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes));
    let info = |index: usize| json!({ "index": index });
    let scene = gltf(&triangle(json!({
        "images": [
            { "uri": uri(PNG), "name": "-bm 2/a\\b" }, { "uri": uri(b"\x89PNG two"), "name": "same" },
            { "uri": uri(b"\x89PNG three"), "name": "SAME" }, { "uri": uri(b"\x89PNG two") },
        ],
        "textures": [{ "source": 0 }, { "source": 1 }, { "source": 2 }, { "source": 3 }],
        "materials": [{
            "pbrMetallicRoughness": { "baseColorTexture": info(0), "metallicRoughnessTexture": info(1) },
            "normalTexture": info(2), "emissiveTexture": info(3),
        }],
    })));
    let options = ExportOptions { images: Images::Embed, ..ExportOptions::default() };
    let report = export_path(&scene, &f.join("out.obj"), &options).unwrap();
    assert!(report.notes.iter().any(|note| note.what.contains("cannot embed")), "{:?}", report.notes);
    let again = reimport(f, "out.obj");
    assert_eq!(again.warnings, [], "{}", text(f, "out.mtl"));
    let material = again.scene.materials().iter().next().unwrap().1;
    let bytes = |info: &Option<TextureInfo>| {
        let image = again.scene.textures()[info.as_ref().unwrap().texture].source.unwrap();
        again.scene.images()[image].data.clone().unwrap().to_vec()
    };
    assert_eq!(bytes(&material.base_color_texture), PNG);
    assert_eq!(bytes(&material.metallic_roughness_texture), b"\x89PNG two");
    assert_eq!(bytes(&material.normal_texture), b"\x89PNG three");
    assert_eq!(bytes(&material.emissive_texture), b"\x89PNG two");
}

#[test]
fn what_obj_does_not_hold_is_noted_once() {
    let folder = tempfile::tempdir().unwrap();
    let scene = crate::testing::every_slot_scene();
    let report = export(&scene, folder.path(), "out.obj");
    let notes: Vec<&str> = report.notes.iter().map(|note| note.what.as_str()).collect();
    for word in ["hierarchy", "cameras", "punctual lights", "animations", "skins", "variants", "one scene"] {
        assert_eq!(notes.iter().filter(|note| note.contains(word)).count(), 1, "{word}: {notes:?}");
    }
    assert!(report.notes.iter().all(|note| note.pointer.starts_with('/')));
    reimport(folder.path(), "out.obj");
}

#[test]
fn an_empty_scene_is_a_file_that_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    export(&gltf(&json!({ "asset": { "version": "2.0" } })), folder.path(), "out.obj");
    assert!(reimport(folder.path(), "out.obj").scene.meshes().is_empty());
    assert!(!folder.path().join("out.mtl").exists());
}

#[test]
fn names_cannot_break_out_of_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let mut document = triangle(json!({
        "nodes": [{ "mesh": 0, "name": "a\nv 9 9 9\\" }],
        "materials": [{ "name": "x\r\nKd 0 0 0 \\" }, { "name": "x  Kd 0 0 0" }, {}],
    }));
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    export(&gltf(&document), f, "out.obj");
    let again = reimport(f, "out.obj");
    assert_eq!(again.warnings, []);
    assert_eq!(triangles(&again.scene).len(), 1);
    let names: Vec<_> = again.scene.materials().iter().map(|(_, m)| m.name.clone().unwrap()).collect();
    assert_eq!(names, ["x  Kd 0 0 0", "x  Kd 0 0 0.2", "material2"]);
    assert_eq!(again.scene.nodes().iter().next().unwrap().1.name.as_deref(), Some("a v 9 9 9"));
}

#[test]
fn numbers_that_are_not_finite_are_left_out_and_the_file_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let mut values = [TRIANGLE, TRIANGLE].concat();
    (values[4], values[17]) = (f32::NAN, f32::INFINITY);
    values.extend(TRIANGLE);
    let bytes = floats(&values);
    let scene = gltf(&triangle(json!({
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 9, "type": "VEC3" },
            { "bufferView": 0, "componentType": 5126, "count": 9, "type": "VEC3" },
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "buffers": [{ "byteLength": bytes.len(), "uri": data_uri(&bytes) }],
    })));
    let report = export(&scene, f, "out.obj");
    assert!(report.notes.iter().any(|note| note.what.starts_with("2 elements")), "{:?}", report.notes);
    assert_eq!(triangles(&reimport(f, "out.obj").scene).len(), 1);
}

#[test]
fn files_of_other_content_stay_and_the_old_obj_with_its_materials() {
    let folder = tempfile::tempdir().unwrap();
    let f = folder.path();
    let colored = |kd: &str| {
        std::fs::write(f.join("in.mtl"), format!("newmtl m\nKd {kd}\n")).unwrap();
        obj(f, "in.obj", "mtllib in.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    };
    let (red, green) = (colored("1 0 0"), colored("0 1 0"));
    export(&red, f, "out.obj");
    let old = (text(f, "out.obj"), text(f, "out.mtl"));
    let report = export(&green, f, "out.obj");
    assert_eq!(text(f, "out.mtl"), old.1, "the old OBJ would still find it");
    assert_eq!(reimport(f, "out.obj").scene.materials().iter().next().unwrap().1.base_color, [0.0, 1.0, 0.0, 1.0]);
    let hashed = report.files[0].clone();
    assert!(hashed.file_name().unwrap().to_str().unwrap().starts_with("out-"), "{hashed:?}");
    let report = export(&red, f, "out.obj");
    assert_eq!((report.superseded, text(f, "out.obj")), (vec![hashed], old.0));
}
