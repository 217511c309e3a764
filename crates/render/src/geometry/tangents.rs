//! Tangents by MikkTSpace (Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited", section 2), per triangle corner.
//!
//! They are stored per corner so that a seam in UV space never splits a vertex: a material edit that brings in a normal
//! map changes the tangent stream alone.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3};
use orthant_resident::rows::encode_tangent;

/// Bytes that [`mikktspace`] takes for each corner, at most: where no two corners are welded. A test counts them.
pub(super) const MIKKTSPACE_BYTES: usize = 256;

struct Corners<'a> {
    positions: &'a [[f32; 3]],
    normal: &'a (dyn Fn(usize) -> Vec3 + Sync),
    uv: &'a (dyn Fn(u32) -> Vec2 + Sync),
    indices: &'a [u32],
    out: &'a mut [u32],
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.indices.len() / 3
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.positions[self.indices[3 * face + vert] as usize]
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        (self.normal)(3 * face + vert).to_array()
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        (self.uv)(self.indices[3 * face + vert]).to_array()
    }

    fn set_tangent(&mut self, tangent_space: Option<TangentSpace>, face: usize, vert: usize) {
        let corner = 3 * face + vert;
        let t = tangent_space.unwrap_or_default().tangent_encoded();
        self.out[corner] = encode_or_any((self.normal)(corner), Vec3::new(t[0], t[1], t[2]), t[3]);
    }
}

/// Fills `out` (one element per index) from positions, normals per corner, UVs per vertex. Degenerate triangles get
/// any tangent that is perpendicular to the normal.
pub(super) fn mikktspace(
    positions: &[[f32; 3]],
    normal: &(dyn Fn(usize) -> Vec3 + Sync),
    uv: &(dyn Fn(u32) -> Vec2 + Sync),
    indices: &[u32],
    out: &mut [u32],
) {
    let mut corners = Corners { positions, normal, uv, indices, out };
    if generate_tangents(&mut corners).is_err() {
        for (corner, o) in out.iter_mut().enumerate() {
            *o = encode_or_any(normal(corner), Vec3::ZERO, 1.0);
        }
    }
}

/// Encodes a tangent, or any unit vector perpendicular to the normal where the tangent is degenerate.
pub(super) fn encode_or_any(normal: Vec3, tangent: Vec3, sign: f32) -> u32 {
    let unit = tangent
        .try_normalize()
        .unwrap_or_else(|| normal.try_normalize().map_or(Vec3::X, |n| n.any_orthonormal_vector()));
    encode_tangent(unit, sign)
}
