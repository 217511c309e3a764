use super::*;
use crate::import::{WarningKind, import_path};
use std::fs;
use std::path::Path;

const PNG: &[u8] = b"\x89PNG\r\n\x1a\n and so on";

fn load(folder: &Path, files: &[(&str, &[u8])]) -> Imported {
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    import_path(&folder.join("scene/a.obj"), &ImportOptions::default()).unwrap()
}

fn obj(head: &str) -> Vec<u8> {
    format!("{head}\n{TRIANGLE}usemtl red\nf 1 2 3\nusemtl green\nf 1 2 3\n").into_bytes()
}

fn said(imported: &Imported) -> Vec<String> {
    imported.warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn all_materials_of_all_libraries_are_in_their_order() {
    let folder = tempfile::tempdir().unwrap();
    let imported = load(
        folder.path(),
        &[
            ("scene/a.obj", &obj("mtllib one.mtl missing.mtl  my\\ two.mtl\nmtllib one.mtl")),
            ("scene/one.mtl", b"newmtl unused\r\nnewmtl green\r\nKd 0 1 0\r\n"),
            ("scene/my two.mtl", b"\xef\xbb\xbfnewmtl red\rKd 1 0 0\rnewmtl green\rKd 0 0 0\r"),
        ],
    );
    assert_eq!(material_names(&imported.scene), [Some("unused"), Some("green"), Some("red")]);
    let [red, green] = primitives(&imported.scene) else { panic!() };
    let color = |p: &Primitive| imported.scene.materials()[p.material.unwrap()].base_color;
    assert_eq!((color(red), color(green)), ([1., 0., 0., 1.], [0., 1., 0., 1.]));
    let said = said(&imported);
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(said[0].starts_with("line 1, column 1: ") && said[0].contains("missing.mtl does not exist"), "{said:?}");
    assert!(said[1].contains("\"green\" is defined before"), "{said:?}");
}

#[test]
fn a_library_with_spaces_in_its_name_is_one_file() {
    let folder = tempfile::tempdir().unwrap();
    let imported = load(
        folder.path(),
        &[("scene/a.obj", &obj("mtllib my own.mtl")), ("scene/my own.mtl", b"newmtl red\nnewmtl green\n")],
    );
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
}

#[test]
fn what_is_missing_or_outside_is_a_warning_and_never_read() {
    let folder = tempfile::tempdir().unwrap();
    let imported = load(
        folder.path(),
        &[
            ("scene/a.obj", &obj("mtllib ../secret.mtl\nmtllib a.mtl")),
            ("secret.mtl", b"newmtl green\n"),
            ("secret.png", PNG),
            (
                "scene/a.mtl",
                b"newmtl red\nmap_Kd ..\\secret.png\nmap_Ke C:\\x\\y.png\nnorm /etc/hostname\nmap_Bump b.png\nmap_d none.png\n",
            ),
        ],
    );
    let scene = &imported.scene;
    assert_eq!(material_names(scene), [Some("red"), Some("green")]);
    assert_eq!(scene.images().len(), 3);
    assert!(scene.images().iter().all(|(_, image)| image.data.is_none()));
    let kinds: Vec<_> = imported.warnings.iter().map(|w| &w.kind).collect();
    assert!(matches!(kinds[0], WarningKind::MissingMaterialLibrary(_)), "{kinds:?}");
    assert_eq!(kinds.iter().filter(|k| matches!(k, WarningKind::MissingImage(_))).count(), 3, "{kinds:?}");
    assert!(kinds.contains(&&WarningKind::UndefinedMaterial("green".to_owned())), "{kinds:?}");
}

#[test]
fn textures_are_found_beside_the_library_and_shared() {
    let folder = tempfile::tempdir().unwrap();
    let imported = load(
        folder.path(),
        &[
            ("scene/a.obj", &obj("mtllib lib\\m.mtl")),
            ("scene/lib/my wood #1.png", PNG),
            ("scene/top.png", PNG),
            (
                "scene/lib/m.mtl",
                b"newmtl red\nmap_Kd my wood #1.png\nnewmtl green\nmap_Kd -clamp on my wood #1.png\nmap_Ke my wood #1.png\nnorm top.png\n",
            ),
        ],
    );
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    let scene = &imported.scene;
    let uris: Vec<_> = scene.images().iter().map(|(_, image)| image.source.clone()).collect();
    let uri = |u: &str| ImageSource::Uri(u.to_owned());
    assert_eq!(uris, [uri("lib/my%20wood%20%231.png"), uri("top.png")]);
    assert_eq!(scene.textures().len(), 3, "repeated, clamped, and the normal map");
    assert_eq!(scene.samplers().len(), 1);
    assert!(scene.images().iter().all(|(_, image)| image.data.as_deref() == Some(PNG)));
}

#[test]
fn a_bump_map_is_a_normal_map_or_becomes_one() {
    let png = |texel: [u8; 3]| {
        let mut out = Vec::new();
        image::ImageEncoder::write_image(
            image::codecs::png::PngEncoder::new(&mut out),
            &texel,
            1,
            1,
            image::ExtendedColorType::Rgb8,
        )
        .unwrap();
        out
    };
    let folder = tempfile::tempdir().unwrap();
    let mtl = b"newmtl normals\nmap_Bump -bm 0.5 n.png\nnewmtl heights\nbump -bm 2 -s 3 3 h.png\n\
        newmtl again\nbump -bm 2 h.png\nnewmtl both\nbump h.png\nnorm n.png\nnewmtl broken\nbump b.png\n";
    let imported = load(
        folder.path(),
        &[
            ("scene/a.obj", &obj("mtllib m.mtl")),
            ("scene/m.mtl", mtl),
            ("scene/n.png", &png([128, 128, 255])),
            ("scene/h.png", &png([9, 9, 9])),
            ("scene/b.png", PNG),
        ],
    );
    let scene = &imported.scene;
    let map = |i: usize| scene.materials().iter().nth(i).unwrap().1.normal_texture.clone();
    let image = |i: usize| &scene.images()[scene.textures()[map(i).unwrap().texture].source.unwrap()];
    assert_eq!((map(0).unwrap().scale, &image(0).source), (0.5, &ImageSource::Uri("n.png".to_owned())));
    assert_eq!((map(1).unwrap().scale, image(1).name.as_deref()), (1.0, Some("h-normals")));
    assert_eq!(map(1).unwrap().transform.unwrap().scale, [3.0, 3.0]);
    assert!(std::ptr::eq(image(1), image(2)), "made once");
    assert_eq!(image(3).source, ImageSource::Uri("n.png".to_owned()));
    assert!(map(4).is_none());
    let said = said(&imported);
    let about_maps: Vec<_> = said.iter().filter(|w| w.contains(" map ")).collect();
    assert!(about_maps.len() == 1 && about_maps[0].contains("the bump map b.png cannot be decoded"), "{said:?}");
}

#[test]
fn extensions_that_materials_use_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let imported = load(
        folder.path(),
        &[
            ("scene/a.obj", &obj("mtllib m.mtl")),
            ("scene/m.mtl", b"newmtl red\nKs 1 1 1\nKe 5 5 5\nnewmtl green\nPc 1\nmap_Kd -s 2 2 a.png\n"),
        ],
    );
    let expected = [
        "KHR_materials_clearcoat",
        "KHR_materials_emissive_strength",
        "KHR_materials_specular",
        "KHR_texture_transform",
    ];
    assert_eq!(imported.scene.extensions_used(), expected);
}

#[test]
fn nonsense_in_a_library_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let mtl = b"Kd 1 1 1\nnewmtl red\nKd x\nKd nan 0 0\nKs spectral a.rfl\nNs\nd inf\nillum two\nmap_Kd\nfoo 1\nKd .5\n\xff\xfe\n";
    let imported = load(folder.path(), &[("scene/a.obj", &obj("mtllib m.mtl")), ("scene/m.mtl", mtl)]);
    let said = said(&imported);
    assert!(said[0].starts_with("line 1, column 1: in m.mtl: a statement before the first newmtl"), "{said:?}");
    assert!(said.len() >= 8, "{said:?}");
    let red = imported.scene.materials().iter().next().unwrap().1;
    assert_eq!(red.base_color, [0.5, 0.5, 0.5, 1.0]);
}
