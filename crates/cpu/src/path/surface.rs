//! From a hit, or a sampled point of an emitter, to a point of a surface.

use super::offset::{offset_ray_origin, position_error};
use crate::scene::ResidentScene;
use glam::{Vec2, Vec3, Vec4};
use orthant_resident::math::safe_normalize;
use orthant_resident::rows::{
    MaterialRow, MeshDesc, MeshFlags, NONE, NodeFlags, RenderNodeRow, decode_normal, decode_tangent,
};

/// A point of a triangle of a RenderNode, in world space.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<'a> {
    /// The instance.
    pub node: &'a RenderNodeRow,
    /// Its geometry.
    pub desc: &'a MeshDesc,
    /// Its material.
    pub material: &'a MaterialRow,
    /// Triangle of the primitive.
    pub triangle: u32,
    /// Rows of the three corners in the vertex streams.
    pub corners: [usize; 3],
    /// Barycentric weights of the corners.
    pub weights: [f32; 3],
    /// The point.
    pub position: Vec3,
    /// Bounds of the rounding error of `position`, see [`super::offset`].
    pub error: Vec3,
    /// World-space edges from the first corner.
    pub edges: [Vec3; 2],
    /// Unit geometric normal of the front face.
    pub front: Vec3,
    /// Area of the triangle in square metres.
    pub area: f32,
}

impl<'a> SurfacePoint<'a> {
    /// The point with barycentric weights `(1 - b1 - b2, b1, b2)`.
    #[inline]
    pub fn new(scene: &'a ResidentScene, render_node: u32, triangle: u32, b1: f32, b2: f32) -> Self {
        let node = &scene.render_nodes[render_node as usize];
        let desc = &scene.mesh_descs[node.primitive as usize];
        let material = scene.materials.get(node.material as usize).unwrap_or(&MaterialRow::DEFAULT);
        let corners = corner_rows(scene, desc, triangle);
        let [p0, p1, p2] = corners.map(|c| Vec3::from_array(scene.positions[c]));
        let weights = [1.0 - b1 - b2, b1, b2];
        let (q0, q1, q2) = (p0 * weights[0], p1 * weights[1], p2 * weights[2]);
        let position = node.world.transform_point(q0 + q1 + q2);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let extent = e1.abs().max(e2.abs()).max((e2 - e1).abs()).max_element();
        let error = position_error(node, q0.abs() + q1.abs() + q2.abs(), extent, position);
        let edges = [node.world.transform_vector(e1), node.world.transform_vector(e2)];
        let normal = edges[0].cross(edges[1]);
        let mirrored = node.flags & NodeFlags::MIRRORED != 0;
        let front = safe_normalize(if mirrored { -normal } else { normal }, Vec3::Y);
        let area = 0.5 * normal.length();
        Self { node, desc, material, triangle, corners, weights, position, error, edges, front, area }
    }

    /// Whether both faces exist.
    #[inline]
    pub fn is_double_sided(&self) -> bool {
        self.node.flags & NodeFlags::DOUBLE_SIDED != 0
    }

    /// The origin of a ray that leaves to the side to which `geometric`, the front normal or its opposite, points.
    #[inline]
    pub fn ray_origin(&self, geometric: Vec3) -> Vec3 {
        offset_ray_origin(self.position, self.error, geometric)
    }

    /// Texture coordinates of both UV sets.
    #[inline]
    pub fn uv(&self, scene: &ResidentScene) -> [Vec2; 2] {
        let [w0, w1, w2] = self.weights;
        let [a, b, c] = self.corners.map(|i| &scene.vertices[i]);
        let mix = |a: [f32; 2], b: [f32; 2], c: [f32; 2]| {
            Vec2::from_array(a) * w0 + Vec2::from_array(b) * w1 + Vec2::from_array(c) * w2
        };
        [mix(a.uv0, b.uv0, c.uv0), mix(a.uv1, b.uv1, c.uv1)]
    }

    /// What a footprint of `area` square metres covers of both UV sets.
    #[inline]
    pub fn uv_footprint(&self, scene: &ResidentScene, area: f32) -> [f32; 2] {
        let [a, b, c] = self.corners.map(|i| &scene.vertices[i]);
        let share = if self.area > 0.0 { area / self.area } else { 0.0 };
        let covered = |a: [f32; 2], b: [f32; 2], c: [f32; 2]| {
            let (u, v) = (Vec2::from_array(b) - Vec2::from_array(a), Vec2::from_array(c) - Vec2::from_array(a));
            0.5 * u.perp_dot(v).abs() * share
        };
        [covered(a.uv0, b.uv0, c.uv0), covered(a.uv1, b.uv1, c.uv1)]
    }

    /// Linear vertex colour and alpha; white where the primitive has none.
    #[inline]
    pub fn color(&self, scene: &ResidentScene) -> Vec4 {
        if self.desc.flags & MeshFlags::COLOR == 0 {
            return Vec4::ONE;
        }
        let mut color = Vec4::ZERO;
        for k in 0..3 {
            let [r, g, b, a] = scene.vertices[self.corners[k]].color;
            color += Vec4::new(r as f32, g as f32, b as f32, a as f32) * (self.weights[k] / 65535.0);
        }
        color
    }

    /// Interpolated unit normal in world space, on the side of the front face.
    #[inline]
    pub fn vertex_normal(&self, scene: &ResidentScene) -> Vec3 {
        if self.desc.flags & MeshFlags::FLAT != 0 {
            return self.front;
        }
        let [c0, c1, c2] = self.corners.map(|i| scene.vertices[i].normal);
        let object = if c0 == c1 && c0 == c2 {
            decode_normal(c0)
        } else {
            decode_normal(c0) * self.weights[0]
                + decode_normal(c1) * self.weights[1]
                + decode_normal(c2) * self.weights[2]
        };
        let n = safe_normalize(self.node.inverse.transpose_transform_vector(object), self.front);
        // Normals that contradict the winding are an error of many files; the winding decides.
        if n.dot(self.front) < 0.0 { -n } else { n }
    }

    /// Tangent and bitangent about the unit normal `n`: from the tangent stream, or where there is none from the
    /// derivatives of UV set `set`. Texture space has v downwards, and the bitangent points up. `None` where the texture
    /// coordinates have no area.
    #[inline]
    pub fn tangents(&self, scene: &ResidentScene, n: Vec3, set: u32) -> Option<[Vec3; 2]> {
        let (tangent, sign) = if self.desc.first_tangent != NONE && self.desc.flags & MeshFlags::TANGENT != 0 {
            let first = self.desc.first_tangent as usize + 3 * self.triangle as usize;
            let bits = scene.tangents.get(first..first + 3)?;
            let [(t0, sign), (t1, _), (t2, _)] = [bits[0], bits[1], bits[2]].map(decode_tangent);
            let object = t0 * self.weights[0] + t1 * self.weights[1] + t2 * self.weights[2];
            (self.node.world.transform_vector(object), sign)
        } else {
            let [a, b, c] = self.corners.map(|i| {
                let v = &scene.vertices[i];
                Vec2::from_array(if set == 0 { v.uv0 } else { v.uv1 })
            });
            let (u, v) = (b - a, c - a);
            let determinant = u.perp_dot(v);
            if determinant == 0.0 || !determinant.is_finite() {
                return None;
            }
            let sign = if determinant < 0.0 { 1.0 } else { -1.0 };
            ((self.edges[0] * v.y - self.edges[1] * u.y) * -sign, sign)
        };
        let t = safe_normalize(tangent - n * n.dot(tangent), Vec3::ZERO);
        if t == Vec3::ZERO {
            return None;
        }
        // A mirroring transform turns the cross product round.
        let sign = if self.node.flags & NodeFlags::MIRRORED != 0 { -sign } else { sign };
        Some([t, n.cross(t) * sign])
    }
}

/// Rows of a triangle's corners in the vertex streams.
#[inline]
pub fn corner_rows(scene: &ResidentScene, desc: &MeshDesc, triangle: u32) -> [usize; 3] {
    let first = desc.first_index as usize + 3 * triangle as usize;
    let corner = |k: usize| desc.first_vertex as usize + scene.indices[first + k] as usize;
    [corner(0), corner(1), corner(2)]
}
