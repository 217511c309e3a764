use super::*;

#[test]
fn a_file_is_one_node_with_one_mesh_and_one_primitive_per_material() {
    let text = format!("{TRIANGLE}usemtl a\nf 1 2 3\nusemtl b\nf 3 2 1\nusemtl a\nf 2 3 1\nusemtl unused\n");
    let scene = import(text);
    let [a, b] = primitives(&scene) else { panic!("two materials") };
    assert_eq!(indices(&scene, a), [0, 1, 2, 1, 2, 0]);
    assert_eq!(indices(&scene, b), [0, 1, 2]);
    assert_eq!(positions(&scene, b), [[0., 1., 0.], [1., 0., 0.], [0., 0., 0.]]);
    assert_eq!(material_names(&scene), [Some("a"), Some("b")]);
    let (_, node) = scene.nodes().iter().next().unwrap();
    assert_eq!(node.name.as_deref(), Some("thing"));
    let root = scene.default_scene().map(|id| scene.scenes()[id].roots.len());
    assert_eq!(root, Some(1));
}

#[test]
fn a_group_change_does_not_split_and_a_face_before_any_material_has_a_matte_one() {
    let scene = import(format!("{TRIANGLE}g one\nf 1 2 3\ng two three\nf 1 2 3\nusemtl m\no x\nf 1 2 3\no y\nf 1 2 3"));
    let [none, m] = primitives(&scene) else { panic!("two materials") };
    assert_eq!((indices(&scene, none).len(), indices(&scene, m).len()), (6, 6));
    let matte = &scene.materials()[none.material.unwrap()];
    assert_eq!((matte.name.as_deref(), matte.metallic, matte.roughness), (None, 0.0, 1.0));
    let extras = scene.meshes().iter().next().unwrap().1.extra.extras.clone().unwrap();
    assert_eq!(*extras, serde_json::json!({ "objects": ["x", "y"], "groups": ["one", "two three"] }));
    let one = import(format!("o only\n{TRIANGLE}f 1 2 3"));
    assert_eq!(one.meshes().iter().next().unwrap().1.name.as_deref(), Some("only"));
}

#[test]
fn equal_corners_are_one_vertex_in_order_of_first_use() {
    let scene = import(format!("{TRIANGLE}v 1 1 0\nvt 0 0\nvt 1 0\nf 2/1 4/1 3/1\nf 2/1 3/1 1/1\nf 2/2 3/1 4/1"));
    let [p] = primitives(&scene) else { panic!() };
    assert_eq!(indices(&scene, p), [0, 1, 2, 0, 2, 3, 4, 2, 1]);
    assert_eq!(positions(&scene, p)[0], [1., 0., 0.]);
    assert_eq!(positions(&scene, p).len(), 5);
}

#[test]
fn negative_indices_count_back_from_the_line_and_faces_may_come_first() {
    let scene = import(format!("f 1 2 3\n{TRIANGLE}f -3 -2 -1\nv 5 5 5\nf -1 -2 -3"));
    let [p] = primitives(&scene) else { panic!() };
    assert_eq!(indices(&scene, p), [0, 1, 2, 0, 1, 2, 3, 2, 1]);
    assert_eq!(positions(&scene, p)[3], [5.; 3]);
}

#[test]
fn texture_coordinates_run_down_and_corners_may_lack_them_one_by_one() {
    let scene = import(format!("{TRIANGLE}vt 0.25 0.75\nvt 0.5\nf 1/1 2/2 3\nusemtl plain\nf 1 2 3"));
    let [mixed, plain] = primitives(&scene) else { panic!() };
    assert_eq!(attribute(&scene, mixed, "TEXCOORD_0"), Some(vec![[0.25, 0.25], [0.5, 1.0], [0.0, 0.0]]));
    assert_eq!(plain.attributes.get("TEXCOORD_0"), None);
}

#[test]
fn vertex_colours_are_kept_and_positions_without_one_are_white() {
    let scene = import("v 0 0 0 1 0 0.5\nv 1 0 0\nv 0 1 0 0 1 0 1\nv 2 2 2 1\nf 1 2 3\nusemtl m\nf 2 2 4");
    let [colored, plain] = primitives(&scene) else { panic!() };
    assert_eq!(attribute(&scene, colored, "COLOR_0"), Some(vec![[1., 0., 0.5], [1.; 3], [0., 1., 0.]]));
    assert_eq!(plain.attributes.get("COLOR_0"), None);
    let read = accessor::read_colors(&scene, colored.attributes.get("COLOR_0").unwrap()).unwrap();
    assert_eq!(read[0], [1., 0., 0.5, 1.]);
}

#[test]
fn bounds_targets_and_views_are_those_of_a_valid_gltf() {
    let scene = import("v -1 5 0\nv 1 0 0\nv 0 1 -3\nv 9 9 9\nvn 0 0 2\nvt 0 0\nf 1/1/1 2/1/1 3/1/1");
    let [p] = primitives(&scene) else { panic!() };
    let position = &scene.accessors()[p.attributes.get("POSITION").unwrap()];
    assert_eq!(position.min.as_deref(), Some(&[-1., 0., -3.][..]));
    assert_eq!(position.max.as_deref(), Some(&[1., 5., 0.][..]));
    assert_eq!(scene.buffers().len(), 1);
    let mut end = 0;
    for (_, view) in scene.buffer_views().iter() {
        assert_eq!((view.offset, view.stride), (end, None));
        end += view.length;
    }
    assert_eq!(end, scene.buffers().iter().next().unwrap().1.data.len());
    assert!(scene.accessors().iter().all(|(id, _)| accessor::check(&scene, id).is_ok()));
    assert_eq!(attribute(&scene, p, "NORMAL"), Some(vec![[0., 0., 1.]; 3]));
}

#[test]
fn lines_and_points_are_primitives_of_their_own() {
    let scene = import(format!("{TRIANGLE}vt 0 0\nl 1/1 2/1 3/1\np 3 1\nf 1 2 3\nl 3 1\n"));
    let [lines, points, faces] = primitives(&scene) else { panic!() };
    assert_eq!((lines.mode, indices(&scene, lines)), (PrimitiveMode::Lines, vec![0, 1, 1, 2, 3, 4]));
    assert_eq!((points.mode, indices(&scene, points)), (PrimitiveMode::Points, vec![0, 1]));
    assert_eq!(positions(&scene, points), [[0., 1., 0.], [0., 0., 0.]]);
    assert_eq!((faces.mode, indices(&scene, faces)), (PrimitiveMode::Triangles, vec![0, 1, 2]));
}

#[test]
fn polygons_are_cut_inside_their_outline() {
    // A dart whose fan from the first corner would leave it.
    let scene = import("v 1 1 0\nv 0 4 0\nv 0 0 0\nv 4 0 0\nf 2 3 4 1\nf 1 2 3 4\nf 3 4 1 2");
    let [p] = primitives(&scene) else { panic!() };
    let (found, at) = (indices(&scene, p), positions(&scene, p));
    for t in found.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| glam::Vec3::from(at[i as usize]));
        assert!((b - a).cross(c - a).z > 0.0, "{t:?} lies outside");
    }
    assert_eq!(found.len(), 18);
}

#[test]
fn degenerate_polygons_and_short_elements_are_warnings() {
    let text = format!("{TRIANGLE}f 1 1 1 1\nf 1 2 1 2 1\nf 1\nf\nl 1\np\nf 1 2 3");
    let scene = import(&text);
    assert_eq!(indices(&scene, &primitives(&scene)[0]).len(), 6 + 9 + 3);
    let said = warnings(&text);
    assert!(
        said.iter()
            .any(|w| w.starts_with("line 4, column 1: a polygon has no area") && w.ends_with("(and in 1 more place)")),
        "{said:?}"
    );
    assert!(said.iter().any(|w| w.starts_with("line 6, column 1: a face has fewer than three corners")), "{said:?}");
    assert_eq!(said.len(), 4, "{said:?}");
}

#[test]
fn line_ends_tabs_continuations_marks_and_encodings_change_nothing() {
    let plain = "# c\no thing\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a b\nf 1 2 3\n";
    let reference = format!("{:?}", primitives(&import(plain)));
    let wide = |to: fn(u16) -> [u8; 2]| -> Vec<u8> {
        "\u{feff}".encode_utf16().chain(plain.encode_utf16()).flat_map(to).collect()
    };
    let forms: [Vec<u8>; 9] = [
        plain.replace('\n', "\r\n").into(),
        plain.replace('\n', "\r").into(),
        plain.replace('\n', "\n\n").into(),
        plain.replace(" 0", "\t \t0").into(),
        plain.replace("f 1 2 ", "f 1 \\\n2 \\\r\n ").into(),
        format!("\u{feff}{plain}").into(),
        wide(u16::to_le_bytes),
        wide(u16::to_be_bytes),
        format!("  {}\0\0\0", plain.replace('\n', " \n  ")).into(),
    ];
    for (i, form) in forms.into_iter().enumerate() {
        let imported = try_import(form).unwrap_or_else(|e| panic!("form {i}: {e}"));
        assert_eq!(format!("{:?}", primitives(&imported.scene)), reference, "form {i}");
        assert_eq!(material_names(&imported.scene), [Some("a b")], "form {i}");
    }
    let latin = import([&b"# caf\xe9\no caf\xe9\n"[..], TRIANGLE.as_bytes(), b"f 1 2 3"].concat());
    assert_eq!(latin.meshes().iter().next().unwrap().1.name.as_deref(), Some("café"));
}

#[test]
fn numbers_in_every_form_and_comments_behind_them_are_read() {
    let scene = import("v 1e1 -.5 +3 # here\nv 1. 0 0\nv 0 1E-1 0 #\nf 1 2 3 # 4");
    assert_eq!(positions(&scene, &primitives(&scene)[0])[0], [10., -0.5, 3.]);
    assert_eq!(positions(&scene, &primitives(&scene)[0])[2], [0., 0.1, 0.]);
}

#[test]
fn unknown_statements_and_curves_are_warnings_and_an_empty_file_shows_nothing() {
    let said = warnings(format!("{TRIANGLE}vp 1\ncstype bezier\nfrobnicate 3\nbevel on\ns x\nf 1 2 3"));
    assert_eq!(said.len(), 3, "{said:?}");
    let scene = import("v 0 0 0\n");
    assert!(scene.meshes().is_empty() && scene.nodes().len() == 1);
    assert_eq!(warnings("v 0 0 0\n").len(), 1);
}

#[test]
fn one_import_is_like_another() {
    let mut text = String::new();
    for i in 0..30_000 {
        text += &format!("v {i} {} 0\nvt 0 {i}\nusemtl m{}\ns {}\nf -1/1 1/-1 {}\n", i % 7, i % 13, i % 3, i / 2 + 1);
    }
    assert!(text.len() > 1 << 20, "several pieces");
    let (a, b) = (import(&text), import(&text));
    let bytes = |scene: &Scene| scene.buffers().iter().next().unwrap().1.data.clone();
    assert!(bytes(&a) == bytes(&b) && primitives(&a) == primitives(&b));
    assert_eq!(primitives(&a).len(), 13);
}
