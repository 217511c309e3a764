//! What varies over the face of a block.

use super::ray::WorldScene;
use glam::Vec3;
use orthant_resident::math::{SRGB8, unit_float};
use orthant_resident::sampling::hash::hash_combine;
use orthant_resident::world::BlockRow;
use orthant_resident::world::rows::{UNKNOWN_COLOR, pattern};

/// For each axis of the material the axis of the world that it points along, and whether it points backwards, by the code of an
/// orientation (see [`orthant_resident::world::rows::block::orientation`]). Codes from 192 on count as 0.
#[inline]
pub fn orientation_axes(code: u32) -> [(usize, bool); 4] {
    let code = if code < 192 { code } else { 0 };
    let (mut number, signs) = (code / 8, code % 8);
    // The axes that are left, ascending, four bits each.
    let mut left = 0x3210_u32;
    let mut axes = [(0, false); 4];
    let mut odd = signs.count_ones() & 1 == 1;
    for (m, choices) in [6, 2, 1, 1].into_iter().enumerate() {
        let chosen = number / choices;
        number %= choices;
        // As many axes that come later are smaller as were passed over: inversions.
        odd ^= chosen & 1 == 1;
        let low = (1 << (4 * chosen)) - 1;
        axes[m] = ((left >> (4 * chosen) & 15) as usize, signs >> m & 1 == 1);
        left = (left & low) | (left >> 4 & !low);
    }
    axes[3].1 = odd;
    axes
}

/// A point of a face in the coordinates of the material, 0 to 1 along its edges: the three axes that remain, in the material's
/// order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacePoint {
    /// Coordinates.
    pub place: [f32; 3],
    /// Whether the layer runs along that axis at all. Where it does not the coordinate is the same all over, and no line is drawn.
    pub runs: [bool; 3],
    /// The material's axis that is missing.
    pub normal: u32,
}

impl FacePoint {
    /// From coordinates in the block along the world's axes, the axis of the face, and the axes that the layer runs along.
    #[inline]
    pub fn new(local: [f32; 4], face: usize, orientation: u32, runs: [bool; 4]) -> Self {
        let mut point = Self { place: [0.0; 3], runs: [false; 3], normal: 3 };
        let mut k = 0;
        for (m, (axis, backwards)) in orientation_axes(orientation).into_iter().enumerate() {
            if axis == face {
                point.normal = m as u32;
                continue;
            }
            point.place[k] = if backwards { 1.0 - local[axis] } else { local[axis] };
            point.runs[k] = runs[axis];
            k += 1;
        }
        point
    }

    /// Whether the point lies within `width` of an edge.
    #[inline]
    pub fn is_edge(&self, width: f32) -> bool {
        (0..3).any(|k| self.runs[k] && (self.place[k] < width || self.place[k] > 1.0 - width))
    }
}

/// Number of the cell of `count` that a coordinate falls in.
#[inline]
fn cell(place: f32, count: u32) -> u32 {
    ((place * count as f32) as u32).min(count - 1)
}

/// What the material's colour is multiplied by.
#[inline]
pub fn pattern_factor(scene: &WorldScene, row: &BlockRow, id: u32, point: &FacePoint) -> Vec3 {
    match row.pattern {
        pattern::CHECKER => {
            let count = row.cells.max(1);
            let sum: u32 = point.place.iter().map(|&p| cell(p, count) & 1).sum();
            Vec3::splat(if sum & 1 == 1 { row.contrast } else { 1.0 })
        }
        pattern::NOISE => {
            let value = value_noise(point.place, row.cells.max(1), hash_combine(id, point.normal));
            Vec3::splat(row.contrast + (1.0 - row.contrast) * value)
        }
        pattern::EDGES => Vec3::splat(if point.is_edge(row.width) { row.contrast } else { 1.0 }),
        pattern::TEXTURE => {
            let size: [u32; 3] = std::array::from_fn(|k| (row.texture_size >> (8 * k) & 0xff) + 1);
            let [x, y, z]: [u32; 3] = std::array::from_fn(|k| cell(point.place[k], size[k]));
            let word = row.cells as usize + (x + size[0] * (y + size[1] * z)) as usize;
            let Some(texel) = scene.arenas.payload.get(word) else { return Vec3::from_array(UNKNOWN_COLOR) };
            let component = |k: u32| SRGB8[(texel >> (8 * k) & 0xff) as usize];
            Vec3::new(component(0), component(1), component(2))
        }
        _ => Vec3::ONE,
    }
}

/// Noise in 0..1: hashed values at the corners of `count` cells along each edge, interpolated smoothly. It goes on over the edge of a
/// block into the next one.
#[inline]
fn value_noise(place: [f32; 3], count: u32, seed: u32) -> f32 {
    let mut low = [0; 3];
    let mut weight = [0.0; 3];
    for k in 0..3 {
        low[k] = cell(place[k], count);
        let f = place[k] * count as f32 - low[k] as f32;
        weight[k] = f * f * (3.0 - 2.0 * f);
    }
    let mut sum = 0.0;
    for corner in 0..8_u32 {
        let mut hash = seed;
        let mut share = 1.0;
        for k in 0..3 {
            let upper = corner >> k & 1;
            let at = low[k] + upper;
            hash = hash_combine(hash, if at == count { 0 } else { at });
            share *= if upper == 1 { weight[k] } else { 1.0 - weight[k] };
        }
        sum += share * unit_float(hash);
    }
    sum
}
