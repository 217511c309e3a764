//! From a hit to a point of a block's face.

use super::pattern::{FacePoint, pattern_factor};
use super::ray::{WorldRay, WorldScene};
use super::trace::{WorldHit, block_row};
use crate::path::bsdf::BsdfParameters;
use glam::Vec3;
use orthant_resident::math::safe_normalize;
use orthant_resident::world::Layer;
use orthant_resident::world::rows::{UNKNOWN_COLOR, block};

/// The factor of the lines that a view draws along the edges of blocks.
const EDGE_FACTOR: f32 = 0.5;

/// A point of a block's face. It is a function of the ray, the parameter, the face and the block alone: how the region is split shows
/// nowhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockSurface {
    /// The face: `2 axis`, plus 1 if its outward normal points to the axis' positive end.
    pub face: u32,
    /// Number of the block's material.
    pub id: u32,
    /// The block's place in the lattice of its own scale, less the anchor's.
    pub cell: [i64; 4],
    /// Linear albedo, the pattern and the lines of the view multiplied in.
    pub albedo: Vec3,
    /// Emitted radiance.
    pub emission: Vec3,
    /// Weight of a hit in the `integral` mode.
    pub weight: f32,
    /// As in glTF.
    pub roughness: f32,
    /// As in glTF.
    pub metallic: f32,
}

impl BlockSurface {
    /// The surface at a hit. `runs` says which axes the layer runs along ([`layer_runs`]), `edges` is the width of the view's lines.
    #[inline]
    pub fn new(scene: &WorldScene, ray: &WorldRay, hit: &WorldHit, runs: [bool; 4], edges: f32) -> Self {
        let id = block::id(hit.block);
        let (local, cell) = block_place(scene, ray, hit);
        let face = 2 * hit.axis as u32 + u32::from(hit.positive);
        let point = FacePoint::new(local, hit.axis, block::orientation(hit.block), runs);
        let lines = if edges > 0.0 && point.is_edge(edges) { EDGE_FACTOR } else { 1.0 };
        let Some(row) = block_row(scene, hit.block) else {
            return Self {
                face,
                id,
                cell,
                albedo: Vec3::from_array(UNKNOWN_COLOR) * lines,
                emission: Vec3::ZERO,
                weight: 1.0,
                roughness: 1.0,
                metallic: 0.0,
            };
        };
        let factor = pattern_factor(scene, row, id, &point);
        Self {
            face,
            id,
            cell,
            albedo: Vec3::from_array(row.color) * factor * lines,
            emission: Vec3::from_array(row.emission),
            weight: row.weight,
            roughness: row.roughness,
            metallic: row.metallic,
        }
    }
}

impl BlockSurface {
    /// Parameters of the BSDF: glTF's, with its index of refraction where none is given.
    #[inline]
    pub fn bsdf_parameters(&self) -> BsdfParameters {
        BsdfParameters {
            base_color: self.albedo.clamp(Vec3::ZERO, Vec3::ONE),
            metallic: self.metallic.clamp(0.0, 1.0),
            roughness: self.roughness.clamp(0.0, 1.0),
            ior: 1.5,
        }
    }
}

/// Where a hit is in its block, 0 to 1 along the world's axes over the block at its own scale (on the face's axis exactly 0 or 1), and
/// where the block is in the lattice of that scale, less the anchor's place.
#[inline]
fn block_place(scene: &WorldScene, ray: &WorldRay, hit: &WorldHit) -> ([f32; 4], [i64; 4]) {
    let log2 = block::edge_log2(hit.block).min(31);
    let edge = (1_i64 << log2) as f32;
    let mask = (1_i64 << log2) - 1;
    let position = ray.at(hit.t);
    let (mut local, mut cell) = ([0.0; 4], [0; 4]);
    for a in 0..4 {
        if a == hit.axis {
            let inside = if hit.positive { hit.plane - 1 } else { hit.plane };
            (local[a], cell[a]) = (f32::from(hit.positive), (inside >> log2) - (scene.anchor[a] >> log2));
        } else {
            let place = (scene.anchor[a] & mask) as f32 / edge + position[a] * 65_536.0 / edge;
            let floor = place.floor();
            (local[a], cell[a]) = (place - floor, floor as i64);
        }
    }
    (local, cell)
}

/// Which axes of the world a layer runs along: those that are not perpendicular to it.
pub fn layer_runs(layer: &Layer) -> [bool; 4] {
    std::array::from_fn(|a| {
        let mut axis = [0.0; 4];
        axis[a] = 1.0;
        Vec3::from_array(layer.from_world(axis)).length_squared() > 1e-6
    })
}

/// The unit normal of a face in a layer: its outward normal, projected and normalised again. `toward` is for a face to which the
/// layer is perpendicular.
#[inline]
pub fn layer_normal(layer: &Layer, axis: usize, positive: bool, toward: Vec3) -> Vec3 {
    let sign = if positive { 1.0 } else { -1.0 };
    let projected = Vec3::new(layer.axes[0][axis], layer.axes[1][axis], layer.axes[2][axis]) * sign;
    safe_normalize(projected, toward)
}
