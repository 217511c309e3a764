//! Cameras against the sentences that define them.

use super::*;
use std::f64::consts::PI;

fn at_origin(turns: Turns) -> WorldCamera {
    WorldCamera::new(Point4::default(), &turns)
}

fn close(a: DVec4, b: DVec4) -> bool {
    (a - b).length() < 1e-12
}

fn axes(camera: &WorldCamera) -> [DVec4; 4] {
    [camera.right(), camera.up(), camera.forward(), camera.hidden()]
}

fn in_world(layer: &Layer, v: [f32; 3]) -> DVec4 {
    DVec4::from_array(layer.to_world(v).map(f64::from))
}

fn some_views() -> Vec<WorldCamera> {
    let angles = [0.0, 17.0, -63.0, 90.0, 141.0, 180.0];
    let mut views = Vec::new();
    for yaw in angles {
        for xw in angles {
            for zw in angles {
                views.push(at_origin(Turns { yaw, xw, zw, pitch: yaw / 3.0 - 20.0 }));
            }
        }
    }
    views
}

#[test]
fn without_turns_right_is_x_up_is_y_forward_is_minus_z_and_hidden_is_w() {
    assert_eq!(axes(&at_origin(Turns::default())), [DVec4::X, DVec4::Y, DVec4::NEG_Z, DVec4::W]);
}

#[test]
fn yaw_turns_forward_to_the_left() {
    let camera = at_origin(Turns { yaw: 90.0, ..Turns::default() });
    assert_eq!(axes(&camera), [DVec4::NEG_Z, DVec4::Y, DVec4::NEG_X, DVec4::W]);
}

#[test]
fn xw_turns_right_towards_hidden() {
    let camera = at_origin(Turns { xw: 30.0, ..Turns::default() });
    let (sin, cos) = (PI / 6.0).sin_cos();
    assert!(close(camera.right(), DVec4::new(cos, 0.0, 0.0, sin)));
    assert!(close(camera.hidden(), DVec4::new(-sin, 0.0, 0.0, cos)));
    assert_eq!((camera.up(), camera.forward()), (DVec4::Y, DVec4::NEG_Z));
}

#[test]
fn zw_turns_forward_towards_hidden() {
    let camera = at_origin(Turns { zw: 30.0, ..Turns::default() });
    let (sin, cos) = (PI / 6.0).sin_cos();
    assert!(close(camera.forward(), DVec4::new(0.0, 0.0, -cos, sin)));
    assert!(close(camera.hidden(), DVec4::new(0.0, 0.0, sin, cos)));
    assert_eq!((camera.right(), camera.up()), (DVec4::X, DVec4::Y));
}

#[test]
fn pitch_turns_forward_towards_up() {
    let camera = at_origin(Turns { pitch: 30.0, ..Turns::default() });
    let (sin, cos) = (PI / 6.0).sin_cos();
    assert!(close(camera.forward(), DVec4::new(0.0, sin, -cos, 0.0)));
    assert!(close(camera.up(), DVec4::new(0.0, cos, sin, 0.0)));
}

/// The four rotations one after another, each of two axes as they are then.
#[test]
fn the_order_is_yaw_xw_zw_pitch() {
    let turns = Turns { yaw: 20.0, xw: -35.0, zw: 50.0, pitch: 15.0 };
    let [mut r, mut u, mut f, mut h] = [DVec4::X, DVec4::Y, DVec4::NEG_Z, DVec4::W];
    let (sin, cos) = 20_f64.to_radians().sin_cos();
    (f, r) = (f * cos + -r * sin, r * cos + f * sin);
    let (sin, cos) = (-35_f64).to_radians().sin_cos();
    (r, h) = (r * cos + h * sin, h * cos - r * sin);
    let (sin, cos) = 50_f64.to_radians().sin_cos();
    (f, h) = (f * cos + h * sin, h * cos - f * sin);
    let (sin, cos) = 15_f64.to_radians().sin_cos();
    (f, u) = (f * cos + u * sin, u * cos - f * sin);
    for (is, should) in axes(&at_origin(turns)).into_iter().zip([r, u, f, h]) {
        assert!(close(is, should), "{is} {should}");
    }
}

#[test]
fn axes_stay_orthonormal_over_a_million_turns_and_the_horizon_level() {
    let mut camera = at_origin(Turns::default());
    for i in 0..1_000_000 {
        let by = 0.1 + f64::from(i % 7);
        camera.steer(&Turns { yaw: by, xw: -by * 0.3, zw: by * 0.7, pitch: if i % 2 == 0 { by } else { -by } });
    }
    let axes = axes(&camera);
    for i in 0..4 {
        for j in 0..4 {
            let expected = if i == j { 1.0 } else { 0.0 };
            assert!((axes[i].dot(axes[j]) - expected).abs() < 1e-12);
        }
    }
    assert_eq!((camera.right().y, camera.hidden().y), (0.0, 0.0));
    camera.steer(&Turns { pitch: 1e4, ..Turns::default() });
    assert!(close(camera.forward(), DVec4::Y), "{}", camera.forward());
}

#[test]
fn a_camera_moves_along_its_axes() {
    let mut camera = WorldCamera::new(Point4::from_ints([10, 20, 30, 40]), &Turns { yaw: 90.0, ..Turns::default() });
    camera.advance(&Steps { right: 1.0, up: 2.0, forward: 3.0, hidden: 4.0 });
    assert_eq!(camera.position, Point4::from_ints([7, 22, 29, 44]));
    camera.advance(&Steps { hidden: 1e300, ..Steps::default() });
    camera.advance(&Steps { hidden: f64::INFINITY, ..Steps::default() });
    assert_eq!(camera.position.raw()[3], (1 << 61) - 1, "at the end of space it stands still");
    camera.advance(&Steps { forward: f64::NAN, ..Steps::default() });
    assert_eq!(camera.position.raw()[0], 7 << 16);
}

#[test]
fn pulled_to_3d_the_hidden_axis_is_the_nearest_axis_of_the_world() {
    for before in some_views() {
        let mut camera = before;
        camera.pull_to_3d();
        let hidden = camera.hidden();
        assert_eq!(hidden.abs().element_sum(), 1.0, "{hidden}");
        let nearest = before.hidden().abs().max_element();
        assert!((before.hidden().dot(hidden) - nearest).abs() < 1e-6);
        assert!(camera.right().dot(hidden).abs() < 1e-12 && camera.forward().dot(hidden).abs() < 1e-12);
        assert!((camera.right().length() - 1.0).abs() < 1e-12);
    }
    let mut camera = at_origin(Turns { xw: 40.0, ..Turns::default() });
    camera.pull_to_3d();
    for (is, should) in axes(&camera).into_iter().zip([DVec4::X, DVec4::Y, DVec4::NEG_Z, DVec4::W]) {
        assert!(close(is, should));
    }
}

/// `dir = normalize(R sx + U sy + F cos(theta) + H sin(theta))`, from the layer alone.
#[test]
fn the_integral_sweeps_its_layers_by_the_formula() {
    let camera = at_origin(Turns { yaw: 33.0, xw: 12.0, zw: -70.0, pitch: 8.0 });
    for (count, zoom) in [(1, 1.0), (4, 1.0), (128, 2.5)] {
        let layers = camera.layers(&Mode::Integral { layers: count, hidden_zoom: zoom, mix: 8.0 });
        assert_eq!(layers.len(), count as usize);
        for (l, layer) in layers.iter().enumerate() {
            let angle = (PI / 2.0) / zoom;
            let theta = (2.0 * (l as f64 + 0.5) / f64::from(count) - 1.0) * angle / 2.0;
            for (sx, sy) in [(0.0, 0.0), (0.7, -0.3), (-1.5, 0.9)] {
                let expected = camera.right() * sx
                    + camera.up() * sy
                    + camera.forward() * theta.cos()
                    + camera.hidden() * theta.sin();
                let d =
                    std::array::from_fn(|a| layer.right[a] * sx as f32 + layer.up[a] * sy as f32 + layer.forward[a]);
                let is = in_world(layer, d);
                assert!((is - expected).length() < 1e-6, "{is} {expected}");
            }
        }
    }
    assert_eq!(camera.layers(&Mode::Integral { layers: 1, hidden_zoom: 1.0, mix: 8.0 }), camera.layers(&Mode::Slice));
}

#[test]
fn a_thick_slice_has_layers_on_both_sides() {
    let camera = at_origin(Turns { yaw: 10.0, ..Turns::default() });
    let layers = camera.layers(&Mode::Thick { each_side: 2, spacing: 0.5 });
    assert_eq!(layers.len(), 5);
    assert_eq!(layers[2], camera.layers(&Mode::Slice)[0]);
    for (i, layer) in layers.iter().enumerate() {
        let forward = in_world(layer, layer.forward);
        let angle = forward.dot(camera.hidden()).asin().to_degrees();
        assert!((angle - (i as f64 - 2.0) * 0.5).abs() < 1e-5, "{angle}");
    }
}

#[test]
fn the_axes_of_an_unrotated_layer_are_those_of_the_world() {
    for yaw in [0.0, 77.0] {
        let camera = at_origin(Turns { yaw, pitch: -30.0, ..Turns::default() });
        let layer = camera.layers(&Mode::Slice)[0];
        assert_eq!(layer.axes, [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]);
        assert_eq!(layer.up, camera.up().truncate().as_vec3().to_array());
    }
}

/// Every view, hidden axes at and near -W included.
#[test]
fn the_axes_of_a_layer_are_those_of_the_world_turned_by_the_smallest_rotation() {
    let near_minus_w =
        [1e-3, 1e-7, 1e-12, 1e-15].map(|e| at_origin(Turns { xw: 180.0 - e, zw: e, ..Turns::default() }));
    for camera in some_views().into_iter().chain(near_minus_w) {
        for layer in camera.layers(&Mode::Integral { layers: 5, hidden_zoom: 1.0, mix: 8.0 }) {
            let axes = layer.axes.map(|axis| DVec4::from_array(axis.map(f64::from)));
            for i in 0..3 {
                for j in 0..3 {
                    let expected = if i == j { 1.0 } else { 0.0 };
                    assert!((axes[i].dot(axes[j]) - expected).abs() < 1e-6);
                }
            }
            // The camera's vectors lie in the layer, and are those of the camera in the world.
            let vectors = [layer.right, layer.up, layer.forward];
            let back = vectors.map(|v| in_world(&layer, v));
            assert!((back[0] - camera.right()).length() < 1e-6 && (back[1] - camera.up()).length() < 1e-6);
            let [r, u, f] = vectors.map(|v| glam::DVec3::from_array(v.map(f64::from)));
            assert!((r.cross(u) + f).length() < 1e-6, "right, up and backward are right-handed");
            // What is at right angles to both W and the hidden axis does not move; that makes it the smallest rotation.
            let forward = in_world(&layer, layer.forward);
            let hidden =
                camera.hidden() * forward.dot(camera.forward()) - camera.forward() * forward.dot(camera.hidden());
            let Some(d) = DVec4::new(hidden.x, hidden.y, hidden.z, 0.0).try_normalize() else { continue };
            if d.dot(hidden).abs() < 1e-6 {
                continue;
            }
            let still = [DVec4::X, DVec4::Y, DVec4::Z].map(|e| e - d * d.dot(e));
            for v in still {
                let turned = axes[0] * v.x + axes[1] * v.y + axes[2] * v.z;
                assert!((turned - v).length() < 1e-5, "{v} {turned}");
            }
        }
    }
}

#[test]
fn a_framed_world_is_seen_whole_from_w_one_half() {
    let boxes = [
        Aabb4::from_ints([-100, 0, 50, 0], [300, 40, 90, 1]).unwrap(),
        Aabb4::from_ints([1_000_000, 0, 0, -900], [1_000_001, 1, 1, 900]).unwrap(),
    ];
    let turned = Turns { yaw: 200.0, pitch: -50.0, ..Turns::default() };
    let rotated = Turns { yaw: 30.0, xw: 25.0, zw: -20.0, pitch: -10.0 };
    for bounds in boxes {
        for (turns, is_tight) in [(WorldCamera::DEFAULT_TURNS, true), (turned, true), (rotated, false)] {
            let (tan, aspect) = (0.3, 1.7);
            let camera = WorldCamera::framing(&bounds, &turns, tan, aspect);
            assert_eq!(camera.position.raw()[3], 1 << 15);
            let (min, max, at) = (bounds.min_raw(), bounds.max_raw(), camera.position.raw());
            let mut largest = 0.0_f64;
            for corner in 0..8 {
                let pick = |a: usize| if corner >> a & 1 == 0 { min[a] } else { max[a] };
                let offset = |a: usize| (pick(a) - at[a]) as f64;
                let p = DVec4::new(offset(0), offset(1), offset(2), 0.0);
                let depth = camera.forward().dot(p);
                assert!(depth > 0.0);
                largest = largest.max(camera.right().dot(p).abs() / depth / tan / aspect);
                largest = largest.max(camera.up().dot(p).abs() / depth / tan);
            }
            assert!(largest < 0.953 && (!is_tight || largest > 0.951), "{largest}");
        }
    }
    let along_w = WorldCamera::framing(&boxes[0], &Turns { zw: 90.0, ..Turns::default() }, 0.3, 1.0);
    assert_eq!(along_w.position.0.map(Fixed::to_f64), [100.0, 20.0, 70.0, 0.5]);
    let all = WorldCamera::framing(&Aabb4::SPACE, &WorldCamera::DEFAULT_TURNS, 0.3, 1.0);
    assert!(Aabb4::SPACE.contains_point(all.position));
}

#[test]
fn a_world_is_framed_from_where_a_scene_is() {
    let camera = at_origin(WorldCamera::DEFAULT_TURNS);
    let backward = DVec4::new(0.45, 0.35, 1.0, 0.0).normalize();
    assert!((camera.forward() + backward).length() < 1e-9, "{}", camera.forward());
}

#[test]
fn a_camera_reaches_the_farthest_corner() {
    let bounds = Aabb4::from_ints([0; 4], [10, 1, 1, 1]).unwrap();
    let camera = WorldCamera::new(Point4::from_ints([-2, 0, 0, 0]), &Turns::default());
    assert_eq!(camera.reach(&bounds), 147_f64.sqrt().ceil());
}

#[test]
fn positions_are_rounded_and_what_is_none_is_refused() {
    let p = position([0.1, -0.1, 3.0, 1e12]).expect("a position");
    assert_eq!(p.raw(), [6554, -6554, 3 << 16, 1_000_000_000_000 << 16]);
    for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, 35_184_372_088_832.0] {
        assert_eq!(position([0.0, 0.0, bad, 0.0]), None, "{bad}");
    }
}

#[test]
fn a_view_has_the_camera_of_its_first_layer_at_its_anchor() {
    let camera = WorldCamera::new(Point4::from_ints([5, 6, 7, 8]), &Turns { xw: 45.0, ..Turns::default() });
    let look = Look { shade: Shade::Path, distance: 100.0, edges: 0.0 };
    let view = camera.view(&Mode::Integral { layers: 8, hidden_zoom: 1.0, mix: 3.0 }, &look);
    assert_eq!((view.anchor, view.layers.len()), ([5 << 16, 6 << 16, 7 << 16, 8 << 16], 8));
    assert_eq!(view.combine, Combine::Integral { mix: 3.0 });
    let frame = WorldCamera::camera(&view, 0.5);
    assert_eq!((frame.position, frame.forward), ([0.0; 3], view.layers[0].forward));
    assert_eq!(camera.view(&Mode::Slice, &look).combine, Combine::Mean);
}
