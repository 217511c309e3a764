//! Projection, planes and offsets of a pass.

use super::abi::RasterPush;
use glam::{DVec3, Vec2, Vec3};
use orthant_resident::Frame;
use orthant_resident::camera::{Camera, Projection};
use orthant_resident::frame::{PixelFilter, Tile};
use orthant_resident::sampling::warp::sample_disc;
use orthant_resident::sampling::{DimensionSet, Sampler};

/// The nearest distance of the rasterizer, in metres: it cannot begin at the eye.
const NEAREST: f32 = 1e-6;
/// The farthest distance of parallel rays without one, in metres. Depths are floats that begin at 0: their precision is
/// relative.
const FARTHEST: f32 = 1e9;
/// Half the width over which the samples of a pass, which lie on a grid, are moved for a box filter.
const WITHIN_GRID: f32 = 0.125;
/// Pixels of the targets at most: more are drawn part by part.
const PART: u32 = 1 << 21;
/// Columns of the targets at most.
const PART_WIDTH: u32 = 2048;

/// A pass over the image: where its samples lie.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Offsets {
    /// From the pixel's centre, in pixels.
    pub pixel: [f32; 2],
    /// On the lens, in metres.
    pub lens: [f32; 2],
}

/// Where the samples of one of some passes lie: centred, on a pinhole, if it is the only one. The four samples of a pass fill
/// the pixel evenly; moved about evenly they make a tent of the same variance as the filter.
pub(super) fn offsets(frame: &Frame, pass: u32, passes: u32) -> Offsets {
    if passes <= 1 {
        return Offsets::default();
    }
    let reach = match frame.filter {
        PixelFilter::Box => WITHIN_GRID,
        PixelFilter::Tent { radius } => half_width(radius * radius / 6.0),
        // The variance of the window over -1..1 is 0.07674.
        PixelFilter::BlackmanHarris { radius } => half_width(0.07674 * radius * radius),
    };
    let [x, y, u, v] = Sampler::new(frame.seed, 0, 0, pass).set(0, DimensionSet::Camera);
    let lens = sample_disc(Vec2::new(u, v)) * frame.camera.lens_radius;
    Offsets { pixel: [(2.0 * x - 1.0) * reach, (2.0 * y - 1.0) * reach], lens: lens.to_array() }
}

/// Half the width of the even distribution that adds what a pixel's own width lacks of a variance.
fn half_width(variance: f32) -> f32 {
    (3.0 * (variance - 1.0 / 12.0)).max(0.0).sqrt().max(WITHIN_GRID)
}

/// 1 over the distance in focus; 0 for a pinhole.
pub(super) fn inverse_focus(camera: &Camera) -> f32 {
    if camera.lens_radius > 0.0 { 1.0 / camera.focus_distance } else { 0.0 }
}

/// Depth in clip space as the first plus the second times the distance. Perspective depths are reversed, so that they are
/// precise far away; parallel ones are not.
pub(super) fn depth(camera: &Camera) -> [f32; 2] {
    let near = camera.near.max(NEAREST);
    match camera.projection {
        Projection::Perspective { .. } if camera.far.is_finite() => {
            let scale = near / (camera.far - near).max(f32::MIN_POSITIVE);
            [scale * camera.far, -scale]
        }
        Projection::Perspective { .. } => [near, 0.0],
        Projection::Orthographic { .. } => {
            let scale = 1.0 / (camera.far.min(FARTHEST) - camera.near);
            [-camera.near * scale, scale]
        }
    }
}

/// The planes about what is seen in a part of the image, relative to the camera's position. They follow from `project` of
/// the shaders.
pub(super) fn planes(frame: &Frame, part: Tile, offsets: Offsets) -> [f32; 24] {
    let camera = &frame.camera;
    let [right, up, forward] = [camera.right, camera.up, camera.forward].map(|v| Vec3::from(v).as_dvec3());
    let (is_perspective, size) = match camera.projection {
        Projection::Perspective { tan_half_fov_y } => (true, f64::from(tan_half_fov_y)),
        Projection::Orthographic { half_height } => (false, f64::from(half_height)),
    };
    let inverse_focus = f64::from(inverse_focus(camera));
    let lens = offsets.lens.map(f64::from);
    // Linear functions of a point relative to the camera, as (gradient, constant).
    let z = (forward, 0.0);
    let x = (right + forward * (lens[0] * inverse_focus), -lens[0]);
    let y = (up + forward * (lens[1] * inverse_focus), -lens[1]);
    let w = if is_perspective { z } else { (DVec3::ZERO, 1.0) };
    let scale = 0.5 * f64::from(frame.height) / size;
    let middle = |size: u32, offset: f32, first: u32| 0.5 * f64::from(size) - f64::from(offset) - f64::from(first);
    let across = middle(frame.width, offsets.pixel[0], part.x);
    let down = middle(frame.height, offsets.pixel[1], part.y);
    let sum = |a: (DVec3, f64), s: f64, b: (DVec3, f64), t: f64| (a.0 * s + b.0 * t, a.1 * s + b.1 * t);
    let film_x = sum(w, across, x, scale);
    let film_y = sum(w, down, y, -scale);
    let far = if camera.far.is_finite() { (-forward, f64::from(camera.far)) } else { (DVec3::ZERO, 1.0) };
    let planes = [
        film_x,
        sum(w, f64::from(part.width), film_x, -1.0),
        film_y,
        sum(w, f64::from(part.height), film_y, -1.0),
        (forward, -f64::from(camera.near)),
        far,
    ];
    let mut numbers = [0.0; 24];
    for (plane, (normal, constant)) in numbers.chunks_exact_mut(4).zip(planes) {
        let scale = 1.0 / normal.length().max(f64::MIN_POSITIVE);
        let scale = if normal == DVec3::ZERO { 1.0 } else { scale };
        let [a, b, c] = (normal * scale).as_vec3().to_array();
        plane.copy_from_slice(&[a, b, c, (constant * scale) as f32]);
    }
    numbers
}

/// The parts in which a tile is drawn, row by row.
pub(super) fn parts(tile: Tile) -> Vec<Tile> {
    let width = tile.width.min(PART_WIDTH);
    let height = (PART / width).min(tile.height);
    let starts = |first: u32, size: u32, step: u32| (0..size).step_by(step as usize).map(move |at| (first + at, at));
    let mut parts = Vec::new();
    for (y, down) in starts(tile.y, tile.height, height) {
        for (x, across) in starts(tile.x, tile.width, width) {
            parts.push(Tile { x, y, width: width.min(tile.width - across), height: height.min(tile.height - down) });
        }
    }
    parts
}

/// Push constants of a part of a pass.
pub(super) fn push(frame: &Frame, table: u64, part: Tile, offsets: Offsets, view: u32, pass: u32) -> RasterPush {
    RasterPush {
        table,
        offset: offsets.pixel,
        lens: offsets.lens,
        depth: depth(&frame.camera),
        tile_x: part.x,
        tile_y: part.y,
        tile_width: part.width,
        tile_height: part.height,
        view,
        sample: pass,
    }
}

/// What distances are multiplied by in the weights of blending, which were made for scenes that begin a few units away: the
/// distance in focus is made 40, and then 200 one, as the paper has it.
pub(super) fn blend_scale(camera: &Camera) -> f32 {
    let focus = camera.focus_distance;
    if focus > 0.0 && focus.is_finite() { 40.0 / 200.0 / focus } else { 1.0 / 200.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_resident::frame::Estimator;

    fn frame(projection: Projection, far: f32) -> Frame {
        Frame {
            camera: Camera {
                position: [1.0, 2.0, 3.0],
                right: [1.0, 0.0, 0.0],
                up: [0.0, 1.0, 0.0],
                forward: [0.0, 0.0, -1.0],
                projection,
                lens_radius: 0.0,
                focus_distance: 4.0,
                near: 0.5,
                far,
            },
            width: 40,
            height: 20,
            tile: Tile { x: 0, y: 0, width: 40, height: 20 },
            samples: 0..16,
            keep_blocks: false,
            seed: 0,
            max_depth: 1,
            roulette_depth: 1,
            firefly_clamp: None,
            estimator: Estimator::Mis,
            filter: PixelFilter::Box,
            aovs: Vec::new(),
            threads: 0,
            world: None,
        }
    }

    /// Whether a point relative to the camera is on the inner side of all planes.
    fn is_inside(planes: &[f32; 24], p: [f32; 3]) -> bool {
        planes.chunks_exact(4).all(|q| q[0] * p[0] + q[1] * p[1] + q[2] * p[2] + q[3] >= 0.0)
    }

    #[test]
    fn planes_are_about_the_part_that_is_drawn() {
        for (projection, scale) in [
            (Projection::Perspective { tan_half_fov_y: 0.5 }, 0.5 * 4.0),
            (Projection::Orthographic { half_height: 2.0 }, 2.0),
        ] {
            let frame = frame(projection, 10.0);
            // The right half: at distance 4, x is 0 to 2 half heights, y -1 to 1.
            let part = Tile { x: 20, y: 0, width: 20, height: 20 };
            let planes = planes(&frame, part, Offsets::default());
            let at = |x: f32, y: f32| is_inside(&planes, [x * scale, y * scale, -4.0]);
            assert!(at(0.01, 0.99) && at(1.99, -0.99), "{projection:?}");
            assert!(!at(-0.01, 0.0) && !at(2.01, 0.0) && !at(1.0, 1.01) && !at(1.0, -1.01), "{projection:?}");
            assert!(!is_inside(&planes, [0.1, 0.0, -0.49]) && !is_inside(&planes, [0.1, 0.0, -10.1]));
            assert!(is_inside(&planes, [0.1, 0.0, -0.51]) && is_inside(&planes, [0.1, 0.0, -9.9]));
        }
    }

    #[test]
    fn depths_run_from_the_near_plane_to_the_far_one() {
        let at = |frame: &Frame, z: f32| {
            let [a, b] = depth(&frame.camera);
            let w = if matches!(frame.camera.projection, Projection::Perspective { .. }) { z } else { 1.0 };
            (a + b * z) / w
        };
        let perspective = Projection::Perspective { tan_half_fov_y: 0.5 };
        let near = |a: f32, b: f32| (a - b).abs() < 1e-6;
        let finite = frame(perspective, 10.0);
        assert!(near(at(&finite, 0.5), 1.0) && near(at(&finite, 10.0), 0.0));
        let endless = frame(perspective, f32::INFINITY);
        assert!(near(at(&endless, 0.5), 1.0) && near(at(&endless, 1e9), 0.0));
        let parallel = frame(Projection::Orthographic { half_height: 1.0 }, 10.0);
        assert!(near(at(&parallel, 0.5), 0.0) && near(at(&parallel, 10.0), 1.0));
    }

    #[test]
    fn parts_cover_a_tile_once() {
        let tile = Tile { x: 3, y: 5, width: 5000, height: 3000 };
        let parts = parts(tile);
        let area: u64 = parts.iter().map(|p| u64::from(p.width) * u64::from(p.height)).sum();
        assert_eq!(area, 5000 * 3000);
        assert!(parts.iter().all(|p| p.width * p.height <= PART && p.width <= PART_WIDTH));
        assert!(parts.iter().all(|p| p.x >= 3 && p.y >= 5 && p.x + p.width <= 5003 && p.y + p.height <= 3005));
        let small = Tile { x: 0, y: 0, width: 1920, height: 1080 };
        assert_eq!(super::parts(small), [small]);
    }
}
