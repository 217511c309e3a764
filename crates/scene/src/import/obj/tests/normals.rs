use super::*;

/// A roof: two faces that share the edge 1-2, one along z, one along y.
const ROOF: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 -1\n";

#[test]
fn without_smoothing_there_are_no_normals_which_is_flat() {
    for s in ["", "s off\n", "s 0\n"] {
        let scene = import(format!("{ROOF}{s}f 1 2 3\nf 1 2 4"));
        let [p] = primitives(&scene) else { panic!() };
        assert_eq!(p.attributes.get("NORMAL"), None);
        assert_eq!(positions(&scene, p).len(), 4, "no vertex is split");
    }
}

#[test]
fn faces_of_one_smoothing_group_share_normals_and_others_do_not() {
    let scene = import(format!("{ROOF}s 1\nf 1 2 3\nf 1 2 4"));
    let [p] = primitives(&scene) else { panic!() };
    let normals = attribute::<3>(&scene, p, "NORMAL").unwrap();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert_eq!(normals.len(), 4);
    assert!(glam::Vec3::from(normals[0]).abs_diff_eq(glam::vec3(0., half, half), 1e-6), "{normals:?}");
    assert_eq!(normals[2], [0., 0., 1.]);

    let scene = import(format!("{ROOF}s 1\nf 1 2 3\ns 2\nf 1 2 4"));
    let [p] = primitives(&scene) else { panic!() };
    let normals = attribute::<3>(&scene, p, "NORMAL").unwrap();
    assert_eq!(normals, [[0., 0., 1.], [0., 0., 1.], [0., 0., 1.], [0., 1., 0.], [0., 1., 0.], [0., 1., 0.]]);
}

#[test]
fn smoothing_goes_across_materials() {
    let scene = import(format!("{ROOF}s 1\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 4"));
    let [a, b] = primitives(&scene) else { panic!() };
    let first = |p| attribute::<3>(&scene, p, "NORMAL").unwrap()[0];
    assert_eq!(first(a), first(b));
    assert!(first(a)[1] > 0.7);
}

#[test]
fn a_normal_is_weighted_by_area_and_angle() {
    // Along y there is one quad; along z two triangles share the same right angle and have the same area together.
    let whole = import(format!("{ROOF}v 1 1 0\nv 1 0 -1\ns 1\nf 1 2 5 3\nf 1 2 6 4"));
    let cut = import(format!("{ROOF}v 1 1 0\nv 1 0 -1\ns 1\nf 1 2 5 3\nf 1 2 6\nf 1 6 4"));
    let first = |scene: &Scene| glam::Vec3::from(attribute::<3>(scene, &primitives(scene)[0], "NORMAL").unwrap()[0]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert!(first(&whole).abs_diff_eq(glam::vec3(0., half, half), 1e-6));
    // Two triangles of half the area and half the angle each.
    let tilted = glam::vec3(0., 0.5, 1.).normalize();
    assert!(first(&cut).abs_diff_eq(tilted, 1e-6), "{}", first(&cut));
}

#[test]
fn given_normals_stay_and_missing_ones_are_added_corner_by_corner() {
    let scene = import(format!("{ROOF}vn 0 0.6 0.8\nf 1//1 2 3\nf 1 2 4"));
    let [p] = primitives(&scene) else { panic!() };
    let normals = attribute::<3>(&scene, p, "NORMAL").unwrap();
    assert_eq!(normals, [[0., 0.6, 0.8], [0., 0., 1.], [0., 0., 1.], [0., 1., 0.], [0., 1., 0.], [0., 1., 0.]]);
}

#[test]
fn a_normal_without_direction_counts_as_missing() {
    let text = format!("{ROOF}vn 0 0 0\nvn 0 0 -3\nf 1//1 2//2 3//2");
    let scene = import(&text);
    let normals = attribute::<3>(&scene, &primitives(&scene)[0], "NORMAL").unwrap();
    assert_eq!(normals, [[0., 0., 1.], [0., 0., -1.], [0., 0., -1.]]);
    assert!(warnings(&text)[0].contains("vn has no direction"));
}
