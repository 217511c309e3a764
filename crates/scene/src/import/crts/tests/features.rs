use super::*;
use crate::import::Format;

#[test]
fn a_triangle_is_what_the_file_says() {
    let file = triangle();
    let imported = file.import().unwrap();
    assert_eq!((imported.format, imported.warnings.len()), (Format::Crts, 0));
    let scene = imported.scene;
    let node = nth_node(&scene, 0);
    assert_eq!((node.name.as_deref(), &node.transform), (Some("object 0"), &Transform::Matrix(Box::new(IDENTITY))));
    let roots = &scene.scenes()[scene.default_scene().unwrap()].roots;
    assert_eq!(roots.iter().collect::<Vec<_>>(), scene.nodes().ids().collect::<Vec<_>>());
    let primitive = primitive_of(&scene, node);
    assert_eq!(read::<3>(&scene, primitive, "POSITION").as_flattened(), POSITIONS);
    assert_eq!(read::<3>(&scene, primitive, "NORMAL").as_flattened(), NORMALS);
    assert_eq!(accessor::read_indices(&scene, primitive.indices.unwrap()).unwrap(), [0, 1, 2]);
    let positions = &scene.accessors()[primitive.attributes.get("POSITION").unwrap()];
    assert_eq!(positions.min, Some(vec![0.0, 0.0, 0.0]));
    assert_eq!(positions.max, Some(vec![1.0, 1.0, 0.0]));
    let material = &scene.materials()[primitive.material.unwrap()];
    assert_eq!(material.name.as_deref(), Some("paint"));
    assert_eq!(material.base_color, [0.5, 0.25, 0.125, 1.0]);
}

#[test]
fn keys_that_are_missing_mean_the_defaults_of_the_exporter() {
    let scene = triangle().with("/materials/0", json!({})).load();
    let material = nth_material(&scene, 0);
    assert_eq!(material.base_color, [0.9, 0.9, 0.9, 1.0]);
    assert_eq!((material.metallic, material.roughness, material.ior), (0.0, 1.0, None));
    assert!(material.specular.is_none() && material.clearcoat.is_none() && material.transmission.is_none());
    assert_eq!(material.extra, Extra::default());
}

#[test]
fn missing_arrays_are_empty_and_unknown_keys_are_ignored() {
    let file = File { header: json!({ "nobody": [{ "knows": 1 }] }), blob: vec![1, 2, 3] };
    let scene = file.load();
    assert_eq!((scene.nodes().len(), scene.meshes().len(), scene.scenes().len()), (0, 0, 1));
}

#[test]
fn the_default_material_stands_behind_the_others() {
    let mut file = triangle();
    file.object(0, -1);
    let scene = file.load();
    assert_eq!(scene.materials().len(), 2);
    let material = primitive_of(&scene, nth_node(&scene, 1)).material.unwrap();
    assert_eq!(scene.materials()[material].base_color, [0.9, 0.9, 0.9, 1.0]);
}

#[test]
fn a_mesh_under_two_materials_has_its_geometry_once() {
    let mut file = triangle();
    file.add("materials", json!({ "name": "other" }));
    file.object(0, 1);
    file.object(0, 0);
    let scene = file.load();
    let primitive = |i| primitive_of(&scene, nth_node(&scene, i));
    assert_eq!(scene.meshes().len(), 2, "one for each material");
    assert_eq!(primitive(0), primitive(2));
    assert_ne!(primitive(0).material, primitive(1).material);
    assert_eq!(primitive(0).attributes, primitive(1).attributes);
    assert_eq!(primitive(0).indices, primitive(1).indices);
    assert_eq!(scene.accessors().len(), 4);
}

#[test]
fn a_blob_at_any_offset_is_read() {
    for padding in 0..9 {
        let mut file = File::new();
        file.view("UINT_8", &vec![7; padding]);
        let mesh = file.triangle("shifted");
        file.object(mesh, -1);
        // The header's own length shifts the blob too.
        for spaces in 0..4 {
            let header = file.header.to_string() + &" ".repeat(spaces);
            let scene = import(file.bytes_of(&header)).unwrap().scene;
            let primitive = primitive_of(&scene, nth_node(&scene, 0));
            assert_eq!(read::<3>(&scene, primitive, "POSITION").as_flattened(), POSITIONS);
            assert_eq!(accessor::read_indices(&scene, primitive.indices.unwrap()).unwrap(), [0, 1, 2]);
            for (_, accessor) in scene.accessors().iter() {
                let offset = scene.buffer_views()[accessor.view.unwrap()].offset;
                assert!(offset.is_multiple_of(4), "glTF needs aligned elements, but one is at {offset}");
            }
        }
    }
}

#[test]
fn an_image_of_two_rows_has_its_lower_row_at_v_0() {
    const RED: [u8; 4] = [255, 0, 0, 255];
    const BLUE: [u8; 4] = [0, 0, 255, 255];
    let mut file = triangle();
    // As any viewer shows it: red above blue.
    let image = file.image(&[RED, BLUE], 1, "sRGB");
    let file = file.with("/materials/0/base_color_texture", json!(image));
    let encoded = {
        let view = &file.header["buffer_views"][4];
        let start = view["byte_offset"].as_u64().unwrap() as usize;
        file.blob[start..start + view["byte_length"].as_u64().unwrap() as usize].to_vec()
    };
    let scene = file.load();
    assert_eq!(scene.images().iter().next().unwrap().1.data.as_deref(), Some(&encoded[..]), "as it was encoded");
    let primitive = primitive_of(&scene, nth_node(&scene, 0));
    let material = nth_material(&scene, 0);
    let rows = texels(&scene, &material.base_color_texture);
    // glTF: v = 0 is the upper edge of the image.
    let at = |v: f32| rows[((v * 2.0) as usize).min(1)];
    let v: Vec<f32> = read::<2>(&scene, primitive, "TEXCOORD_0").iter().map(|uv| uv[1]).collect();
    // In the file they are 0, 0.25 and 1 from the bottom.
    assert_eq!(v, [1.0, 0.75, 0.0]);
    assert_eq!([at(v[0]), at(v[1]), at(v[2])], [BLUE, BLUE, RED]);
    let u: Vec<f32> = read::<2>(&scene, primitive, "TEXCOORD_0").iter().map(|uv| uv[0]).collect();
    assert_eq!(u, [0.0, 1.0, 0.5]);
    assert_eq!(material.base_color, [1.0; 4], "a texture replaces the factor");
}

const TEXEL: [u8; 4] = [10, 20, 30, 40];

fn with_texture(key: &str, channel: usize, color_space: &str) -> Scene {
    let mut file = triangle();
    let image = file.image(&[TEXEL, TEXEL], 2, color_space);
    file.with(&format!("/materials/0/{key}_texture"), json!({ "texture": image, "channel": channel })).load()
}

#[test]
fn a_textured_scalar_is_taken_from_its_channel() {
    for channel in 0..4 {
        let scene = with_texture("roughness", channel, "LINEAR");
        let material = nth_material(&scene, 0);
        assert_eq!((material.roughness, material.metallic), (1.0, 0.0));
        for texel in texels(&scene, &material.metallic_roughness_texture) {
            assert_eq!(texel[1], TEXEL[channel], "channel {channel}");
        }
        // Where the channel is glTF's own, the image is used as it is.
        assert_eq!(scene.images().len(), if channel == 1 { 1 } else { 2 });

        let scene = with_texture("metallic", channel, "LINEAR");
        let material = nth_material(&scene, 0);
        assert_eq!((material.roughness, material.metallic), (1.0, 1.0));
        for texel in texels(&scene, &material.metallic_roughness_texture) {
            assert_eq!((texel[1], texel[2]), (255, TEXEL[channel]), "channel {channel}");
        }
    }
}

#[test]
fn the_other_textured_scalars_go_to_their_lobes() {
    for channel in 0..4 {
        let texel = |key: &str, info: fn(&Material) -> Option<TextureInfo>| {
            let scene = with_texture(key, channel, "LINEAR");
            let info = info(nth_material(&scene, 0));
            assert!(info.is_some(), "{key}");
            texels(&scene, &info)[1]
        };
        let value = TEXEL[channel];
        assert_eq!(texel("clearcoat", |m| m.clearcoat.as_ref()?.texture.clone())[0], value);
        assert_eq!(texel("clearcoat_roughness", |m| m.clearcoat.as_ref()?.roughness_texture.clone())[1], value);
        assert_eq!(texel("transmission", |m| m.transmission.as_ref()?.texture.clone())[0], value);
        assert_eq!(texel("specular", |m| m.specular.as_ref()?.texture.clone())[3], value);
        assert_eq!(texel("anisotropic", |m| m.anisotropy.as_ref()?.texture.clone())[..3], [255, 128, value]);
    }
}

#[test]
fn values_of_an_srgb_image_are_made_linear_for_a_slot_that_is() {
    let scene = with_texture("roughness", 0, "sRGB");
    // ((10 / 255) / 12.92) * 255 rounds to 1.
    assert_eq!(texels(&scene, &nth_material(&scene, 0).metallic_roughness_texture)[0][1], 1);
    let scene = with_texture("roughness", 3, "sRGB");
    assert_eq!(texels(&scene, &nth_material(&scene, 0).metallic_roughness_texture)[0][1], 40, "alpha is linear");
}

#[test]
fn a_texture_without_a_place_in_a_material_is_kept_with_a_link() {
    let mut file = triangle();
    let image = file.image(&[TEXEL], 1, "LINEAR");
    let file = file.with("/materials/0/ior_texture", json!({ "texture": image, "channel": 2 }));
    assert_eq!(file.warnings(), ["/materials/0: a textured ior is kept, but has no effect"]);
    let scene = file.import().unwrap().scene;
    let extra = &nth_material(&scene, 0).extra;
    let kept = &extra.extensions.as_ref().unwrap()["ORTHANT_materials_disney"];
    assert_eq!(kept["textures"]["ior"], json!({ "index": 0, "channel": 2 }));
    assert_eq!(extra.links().len(), 1, "the index follows the texture");
    assert_eq!(scene.extensions_used(), ["ORTHANT_materials_disney"]);
}

fn scaled(z: f64) -> [f64; 16] {
    [2.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0, z, 0.0, 10.0, 20.0, 30.0, 1.0]
}

/// Two opposite corners of the quad in world space, and the direction in which its front looks.
fn quad(file: &File) -> ([f32; 3], [f32; 3], glam::DVec3) {
    let scene = file.load();
    let node = nth_node(&scene, 0);
    let primitive = primitive_of(&scene, node);
    let positions = read::<3>(&scene, primitive, "POSITION");
    let indices = accessor::read_indices(&scene, primitive.indices.unwrap()).unwrap();
    let affine = node.transform.to_affine();
    let world = |i: u32| affine.transform_point3(glam::Vec3::from(positions[i as usize]).as_dvec3());
    let [a, b, c] = [0, 1, 2].map(|k| world(indices[k]));
    let front = (b - a).cross(c - a).normalize() * affine.matrix3.determinant().signum();
    let material = &scene.materials()[primitive.material.unwrap()];
    assert!(!material.double_sided);
    assert_eq!((material.emissive, material.emissive_strength), ([1.0, 0.5, 0.0], Some(8.0)));
    assert_eq!(material.base_color, [0.0, 0.0, 0.0, 1.0]);
    let corners: Vec<_> = (0..4).map(|i| world(i).as_vec3()).collect();
    let min = corners.iter().copied().reduce(glam::Vec3::min).unwrap();
    let max = corners.iter().copied().reduce(glam::Vec3::max).unwrap();
    (min.to_array(), max.to_array(), front)
}

fn light(z: f64) -> File {
    let mut file = File::new();
    let light = json!({ "color": [1.0, 0.5, 0.0], "energy": 8.0, "size": [4.0, 2.0] });
    file.add("objects", placed("LIGHT", scaled(z), light));
    file
}

#[test]
fn a_light_of_the_older_exporter_is_centred_and_shines_against_column_2() {
    let (min, max, front) = quad(&light(1.0));
    assert_eq!((min, max), ([8.0, 19.0, 30.0], [12.0, 21.0, 30.0]));
    assert_eq!(front, -glam::DVec3::Z);
}

#[test]
fn a_light_of_the_newer_exporter_begins_at_its_corner_and_shines_along_column_2() {
    let (min, max, front) = quad(&light(-1.0));
    assert_eq!((min, max), ([10.0, 20.0, 30.0], [14.0, 22.0, 30.0]));
    assert_eq!(front, -glam::DVec3::Z);
}

#[test]
fn the_keys_of_the_header_say_what_a_light_is() {
    let (min, _, front) = quad(&light(1.0).with("/light_origin", json!("corner")));
    assert_eq!((min, front), ([10.0, 20.0, 30.0], -glam::DVec3::Z));
    let (min, max, front) = quad(&light(1.0).with("/light_emits", json!("+z")));
    assert_eq!((min, max, front), ([8.0, 19.0, 30.0], [12.0, 21.0, 30.0], glam::DVec3::Z));
    let (min, _, front) = quad(&light(-1.0).with("/light_emits", json!("-z")).with("/light_origin", json!("center")));
    assert_eq!((min, front), ([8.0, 19.0, 30.0], glam::DVec3::Z));
}

#[test]
fn a_light_without_area_does_not_shine() {
    let file = light(1.0).with("/objects/0/matrix/0", json!(0.0));
    assert!(file.warnings()[0].starts_with("/objects/0/matrix: the axes of the light span no area"));
    assert_eq!(nth_node(&file.import().unwrap().scene, 0).mesh, None);
}

#[test]
fn a_mirroring_matrix_is_kept() {
    let mut mirrored = IDENTITY;
    mirrored[0] = -1.0;
    mirrored[12] = f64::from(0.1f32);
    let scene = triangle().with("/objects/0/matrix", json!(mirrored)).load();
    assert_eq!(nth_node(&scene, 0).transform, Transform::Matrix(Box::new(mirrored)));
    assert!(nth_node(&scene, 0).transform.to_affine().matrix3.determinant() < 0.0);
}

#[test]
fn a_camera_has_the_angle_of_a_sensor_that_is_fitted_to_the_picture() {
    let mut file = File::new();
    file.add("objects", placed("CAMERA", IDENTITY, json!({ "fov_y": 60.0 })));
    let scene = file.load();
    let camera = &scene.cameras()[nth_node(&scene, 0).camera.unwrap()];
    let tangent = |aspect| (0.5 * camera.vertical_fov(aspect).unwrap()).tan();
    let written = 30f64.to_radians().tan();
    for (aspect, factor) in [(1.5, 1.0), (1.0, 1.5), (2.0, 0.75), (3.0, 0.5), (0.5, 1.5)] {
        assert!((tangent(aspect) - written * factor).abs() < 1e-12, "aspect {aspect}");
    }
    assert!(matches!(camera.projection, CameraProjection::Perspective { yfov, .. } if yfov == 60f64.to_radians()));
}

#[test]
fn normals_that_point_at_view_0_are_left_out_with_a_warning() {
    // A writer that has no texture coordinates says view 0, whatever that is.
    for dtype_of_view_0 in ["VEC2_F32", "VEC3_F32"] {
        let mut file = File::new();
        file.floats(dtype_of_view_0, &[0.0; 12]);
        let mesh = file.triangle("bare");
        file.object(mesh, -1);
        let mut file = file.with("/meshes/0/normals", json!(0));
        file.header["meshes"][0].as_object_mut().unwrap().remove("texcoords");
        let warnings = file.warnings();
        assert_eq!(warnings.len(), 1);
        assert!(
            warnings[0].starts_with("/meshes/0/normals: the normals are no VEC3_F32 view of as many"),
            "{warnings:?}"
        );
        let scene = file.import().unwrap().scene;
        assert_eq!(primitive_of(&scene, nth_node(&scene, 0)).attributes.get("NORMAL"), None);
    }
    let file = triangle().with("/meshes/0/normals", json!(0));
    assert!(file.warnings()[0].starts_with("/meshes/0/normals"), "view 0 is the positions");
}

#[test]
fn images_at_shifted_offsets_become_warning_textures() {
    let mut file = triangle();
    let image = file.image(&[TEXEL, TEXEL], 2, "sRGB");
    let mut file = file.with("/materials/0/base_color_texture", json!(image));
    let view = &mut file.header["buffer_views"][4];
    view["byte_offset"] = json!(view["byte_offset"].as_u64().unwrap() - 8);
    let warnings = file.warnings();
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].starts_with("/images/0: image \"image 4\" does not decode"), "{warnings:?}");
    let scene = file.import().unwrap().scene;
    let shown = texels(&scene, &nth_material(&scene, 0).base_color_texture);
    assert_eq!(shown[0], [255, 0, 255, 255]);
    // A scalar of it is packed from the warning texture.
    let file = file.with("/materials/0/roughness_texture", json!({ "texture": 0, "channel": 0 }));
    let scene = file.import().unwrap().scene;
    assert!(nth_material(&scene, 0).metallic_roughness_texture.is_some());
}
