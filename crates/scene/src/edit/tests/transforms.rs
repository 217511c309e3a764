//! Transforms: what an edit does not name stays to the bit, and what cannot be saved is refused.

use super::*;

const SHEAR: [f64; 16] = [1., 0., 0., 0., 1., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

fn with_nodes(nodes: Value, roots: Value) -> Scene {
    scenes::with_triangle(&json!({"scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes}))
}

fn trs(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> Transform {
    Transform::Trs { translation, rotation, scale }
}

#[test]
fn parts_that_are_not_named_stay_to_the_bit() {
    let half = [0.5; 4];
    let mut scene = with_nodes(
        json!([
            {"rotation": half, "scale": [0, 0, 0]},
            {"rotation": half, "scale": [1, -2, 3]},
            {"scale": [1e300, 1, 1]},
        ]),
        json!([0, 1, 2]),
    );
    let mut session = session();
    for slot in 0..3 {
        let set = json!({"op": "set_transform", "node": slot, "translation": [1, 2, 3]});
        run(&mut session, &mut scene, set).unwrap();
    }
    let at = [1., 2., 3.];
    assert_eq!(node(&scene, 0).transform, trs(at, half, [0.; 3]));
    assert_eq!(node(&scene, 1).transform, trs(at, half, [1., -2., 3.]));
    assert_eq!(node(&scene, 2).transform, trs(at, [0., 0., 0., 1.], [1e300, 1., 1.]));
}

#[test]
fn a_matrix_gives_its_other_parts_unless_it_shears() {
    let matrix = [2., 0., 0., 0., 0., 2., 0., 0., 0., 0., 2., 0., 7., 8., 9., 1.];
    let mut scene = with_nodes(json!([{"matrix": matrix}, {"matrix": SHEAR}]), json!([0, 1]));
    let mut session = session();
    let set = |slot: usize| json!({"op": "set_transform", "node": slot, "translation": [1, 2, 3]});
    run(&mut session, &mut scene, set(0)).unwrap();
    assert_eq!(node(&scene, 0).transform, trs([1., 2., 3.], [0., 0., 0., 1.], [2.; 3]));
    let before = bytes(&scene);
    let error = run(&mut session, &mut scene, set(1)).unwrap_err().to_string();
    assert!(error.contains("shears") && error.contains("give a whole matrix"), "{error}");
    assert!(bytes(&scene) == before);
    // All parts together need nothing of the matrix.
    let all = json!({"op": "set_transform", "node": 1, "translation": [1, 2, 3], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]});
    run(&mut session, &mut scene, all).unwrap();
}

#[test]
fn a_flat_matrix_is_kept_as_its_parts() {
    let flat = [0., 0., -3., 0., 0., 0., 0., 0., 2., 0., 0., 0., 7., 8., 9., 1.];
    let mut scene = with_nodes(json!([{}]), json!([0]));
    let mut session = session();
    run(&mut session, &mut scene, json!({"op": "set_transform", "node": 0, "matrix": flat})).unwrap();
    run(&mut session, &mut scene, json!({"op": "add_node", "matrix": flat})).unwrap();
    for slot in 0..2 {
        let transform = &node(&scene, slot).transform;
        let Transform::Trs { scale, .. } = transform else { panic!("{transform:?}") };
        assert_eq!(*scale, [3., 0., 2.]);
        let map = transform.to_affine();
        let wanted = Transform::Matrix(Box::new(flat)).to_affine();
        assert!(map.abs_diff_eq(wanted, 1e-12), "{map:?}");
    }
}

#[test]
fn numbers_that_renderers_cannot_hold_are_refused_with_their_member() {
    let mut scene = with_nodes(json!([{}]), json!([0]));
    let mut session = session();
    let mut far = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    far[12] = 1e39;
    for (members, pointer) in [
        (json!({"op": "set_transform", "node": 0, "translation": [1e39, 0, 0]}), "/translation:"),
        (json!({"op": "set_transform", "node": 0, "scale": [1e300, 1, 1]}), "/scale:"),
        (json!({"op": "set_transform", "node": 0, "matrix": far}), "/matrix:"),
        (json!({"op": "add_node", "translation": [0, -1e39, 0]}), "/translation:"),
    ] {
        let before = bytes(&scene);
        let error = run(&mut session, &mut scene, members).unwrap_err().to_string();
        assert!(error.starts_with(pointer), "{error}");
        assert!(bytes(&scene) == before);
    }
}

#[test]
fn a_place_in_the_world_that_cannot_be_written_is_not_kept() {
    let nodes = json!([{"scale": [1e300, 1e300, 1e300], "children": [1]}, {"scale": [1e300, 1e300, 1e300], "children": [2]},
        {"translation": [1, 0, 0]}, {"scale": [1e30, 1e30, 1e30], "children": [4]}, {"scale": [1e30, 1e30, 1e30], "children": [5]}, {}]);
    let mut scene = with_nodes(nodes, json!([0, 3]));
    let before = bytes(&scene);
    for slot in [2, 5] {
        let out = json!({"op": "reparent", "node": slot, "parent": null, "keep_world": true});
        let error = run(&mut session(), &mut scene, out).unwrap_err().to_string();
        assert!(error.contains(&format!("node {slot}")) && error.contains("place in the world"), "{error}");
        assert!(bytes(&scene) == before);
    }
}

#[test]
fn where_the_parents_world_stays_the_transform_stays_to_the_bit() {
    let odd = json!({"rotation": [0.5, 0.5, 0.5, 0.5], "scale": [1, -2, 3]});
    let mut scene =
        with_nodes(json!([{"children": [3]}, odd, {"scale": [0, 0, 0]}, {"matrix": SHEAR}]), json!([0, 1, 2]));
    let mut session = session();
    let (odd, sheared) = (node(&scene, 1).transform.clone(), node(&scene, 3).transform.clone());
    let keep = |slot: usize| json!({"op": "reparent", "node": slot, "parent": null, "index": 0, "keep_world": true});
    run(&mut session, &mut scene, keep(1)).unwrap();
    assert_eq!((roots(&scene, 0), &node(&scene, 1).transform), (vec![1, 0, 2], &odd));
    run(&mut session, &mut scene, keep(3)).unwrap();
    assert_eq!((roots(&scene, 0), &node(&scene, 3).transform), (vec![3, 1, 0, 2], &sheared));
}

#[test]
fn a_matrix_stays_one_where_its_place_is_kept() {
    let mut scene = with_nodes(json!([{"translation": [5, 0, 0]}, {"matrix": SHEAR}]), json!([0, 1]));
    run(&mut session(), &mut scene, json!({"op": "reparent", "node": 1, "parent": 0, "keep_world": true})).unwrap();
    let mut moved = SHEAR;
    moved[12] = -5.;
    assert_eq!(node(&scene, 1).transform, Transform::Matrix(Box::new(moved)));
}

#[test]
fn a_small_scale_above_is_no_scale_to_nothing() {
    // The cube of it is no number above 0 any more.
    let nodes = json!([{"scale": [1e-120, 1e-120, 1e-120], "translation": [1, 0, 0]}, {"scale": [2e-120, 2e-120, 2e-120], "translation": [1, 0, 0]}]);
    let mut scene = with_nodes(nodes, json!([0, 1]));
    run(&mut session(), &mut scene, json!({"op": "reparent", "node": 1, "parent": 0, "keep_world": true})).unwrap();
    let Transform::Trs { translation, scale, .. } = node(&scene, 1).transform else { panic!() };
    assert_eq!(translation, [0.; 3]);
    assert!(scale.iter().all(|s| (s - 2.0).abs() < 1e-12), "{scale:?}");
    // That is nothing.
    let mut scene = with_nodes(json!([{"scale": [1, 0, 1]}, {}]), json!([0, 1]));
    let under = json!({"op": "reparent", "node": 1, "parent": 0, "keep_world": true});
    let error = run(&mut session(), &mut scene, under).unwrap_err().to_string();
    assert!(error.contains("scaled to nothing"), "{error}");
}
