//! Shapes that the generated scenes are made of. Right-handed, Y up, counter-clockwise faces seen from outside, texture
//! coordinates from the upper left.

use glam::{Affine3A, Vec3};
use std::f32::consts::{PI, TAU};

/// A triangle mesh. Optional streams are empty, or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// First texture coordinates.
    pub uvs: Vec<[f32; 2]>,
    /// Second texture coordinates.
    pub uvs1: Vec<[f32; 2]>,
    /// Linear colours.
    pub colours: Vec<[f32; 3]>,
    /// Joints that move a vertex.
    pub joints: Vec<[u8; 4]>,
    /// Their weights, which sum to 1.
    pub weights: Vec<[f32; 4]>,
    /// Three a triangle.
    pub indices: Vec<u32>,
}

impl Geometry {
    fn vertex(&mut self, position: Vec3, normal: Vec3, uv: [f32; 2]) -> u32 {
        self.positions.push(position.to_array());
        self.normals.push(normal.to_array());
        self.uvs.push(uv);
        (self.positions.len() - 1) as u32
    }

    /// Adds a quadrilateral from its corners in counter-clockwise order, beginning at the lower left.
    pub fn quad(&mut self, corners: [Vec3; 4]) {
        let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize_or(Vec3::Y);
        self.quad_with_normals(corners, [normal; 4]);
    }

    /// Adds a quadrilateral with the given shading normals.
    pub fn quad_with_normals(&mut self, corners: [Vec3; 4], normals: [Vec3; 4]) {
        const UV: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| self.vertex(corners[i], normals[i], UV[i]));
        self.indices.extend([a, b, c, a, c, d]);
    }

    /// Adds another geometry under a rigid or scaling map. Streams that only one of them has are not allowed.
    pub fn append(&mut self, other: &Self, map: Affine3A) {
        let first = self.positions.len() as u32;
        let normal_map = map.matrix3.inverse().transpose();
        self.positions.extend(other.positions.iter().map(|&p| map.transform_point3(Vec3::from(p)).to_array()));
        self.normals.extend(other.normals.iter().map(|&n| (normal_map * Vec3::from(n)).normalize().to_array()));
        self.uvs.extend(&other.uvs);
        self.uvs1.extend(&other.uvs1);
        self.colours.extend(&other.colours);
        self.joints.extend(&other.joints);
        self.weights.extend(&other.weights);
        self.indices.extend(other.indices.iter().map(|i| i + first));
    }

    /// Scales the first texture coordinates.
    #[must_use]
    pub fn tiled(mut self, u: f32, v: f32) -> Self {
        for uv in &mut self.uvs {
            *uv = [uv[0] * u, uv[1] * v];
        }
        self
    }

    /// Sets one vertex colour per vertex.
    #[must_use]
    pub fn coloured(mut self, colour: impl Fn(Vec3) -> [f32; 3]) -> Self {
        self.colours = self.positions.iter().map(|&p| colour(Vec3::from(p))).collect();
        self
    }
}

/// A box of the given size, centred on the origin.
pub fn cuboid(size: [f32; 3]) -> Geometry {
    let h = Vec3::from(size) * 0.5;
    let mut g = Geometry::default();
    for (right, up) in [
        (Vec3::X, Vec3::Y),
        (Vec3::NEG_X, Vec3::Y),
        (Vec3::NEG_Z, Vec3::Y),
        (Vec3::Z, Vec3::Y),
        (Vec3::X, Vec3::NEG_Z),
        (Vec3::X, Vec3::Z),
    ] {
        let front = right.cross(up);
        g.quad([-right - up, right - up, right + up, -right + up].map(|c| (c + front) * h));
    }
    g
}

/// A box that stands on the plane y = 0.
pub fn standing_cuboid(size: [f32; 3]) -> Geometry {
    let mut g = Geometry::default();
    g.append(&cuboid(size), Affine3A::from_translation(Vec3::Y * size[1] * 0.5));
    g
}

/// A rectangle in the plane y = 0, facing +Y, centred on the origin; texture coordinates run over it once.
pub fn ground(width: f32, depth: f32) -> Geometry {
    let (x, z) = (width * 0.5, depth * 0.5);
    let mut g = Geometry::default();
    g.quad([Vec3::new(-x, 0.0, z), Vec3::new(x, 0.0, z), Vec3::new(x, 0.0, -z), Vec3::new(-x, 0.0, -z)]);
    g
}

/// A surface of revolution about Y from profile points (radius, y), bottom to top, with smooth normals around and
/// normals of the given slopes (radial, vertical) along it.
pub fn lathe(profile: &[([f32; 2], [f32; 2])], segments: u32) -> Geometry {
    let mut g = Geometry::default();
    let length = (profile.len() - 1).max(1) as f32;
    for (i, &([radius, y], [radial, vertical])) in profile.iter().enumerate() {
        for s in 0..=segments {
            let (sin, cos) = (s as f32 / segments as f32 * TAU).sin_cos();
            let normal = Vec3::new(radial * sin, vertical, radial * cos).normalize_or(Vec3::Y);
            let uv = [s as f32 / segments as f32, 1.0 - i as f32 / length];
            g.vertex(Vec3::new(radius * sin, y, radius * cos), normal, uv);
        }
    }
    let row = segments + 1;
    for i in 0..profile.len() as u32 - 1 {
        for s in 0..segments {
            let (a, b) = (i * row + s, i * row + s + 1);
            // A ring of radius 0 is a pole: the triangle that would have an edge there is left out.
            if profile[i as usize].0[0] > 0.0 {
                g.indices.extend([a, b, b + row]);
            }
            if profile[i as usize + 1].0[0] > 0.0 {
                g.indices.extend([a, b + row, a + row]);
            }
        }
    }
    g
}

/// A sphere about the origin.
pub fn sphere(radius: f32, segments: u32, rings: u32) -> Geometry {
    let profile: Vec<_> = (0..=rings)
        .map(|i| {
            let (sin, cos) = if i == 0 || i == rings {
                (0.0, if i == 0 { 1.0 } else { -1.0 })
            } else {
                (i as f32 / rings as f32 * PI).sin_cos()
            };
            ([radius * sin, -radius * cos], [sin, -cos])
        })
        .collect();
    lathe(&profile, segments)
}

/// A cone frustum from y = 0 to y = height, without its ends.
pub fn frustum(bottom: f32, top: f32, height: f32, segments: u32) -> Geometry {
    let slope = [height, bottom - top];
    lathe(&[([bottom, 0.0], slope), ([top, height], slope)], segments)
}

/// A capsule from y = 0 to y = height between the centres of its caps.
pub fn capsule(bottom: f32, top: f32, height: f32, segments: u32, rings: u32) -> Geometry {
    let mut profile = Vec::new();
    for (centre, radius, from) in [(0.0, bottom, -0.5), (height, top, 0.0)] {
        for i in 0..=rings {
            let angle = (from + 0.5 * i as f32 / rings as f32) * PI;
            let pole = (from < 0.0 && i == 0) || (from == 0.0 && i == rings);
            let (sin, cos) = if pole { (angle.signum(), 0.0) } else { angle.sin_cos() };
            profile.push(([radius * cos, centre + radius * sin], [cos, sin]));
        }
    }
    lathe(&profile, segments)
}

/// A disc in the plane z = 0 that faces -Z.
pub fn disc(radius: f32, segments: u32) -> Geometry {
    let mut g = Geometry::default();
    let centre = g.vertex(Vec3::ZERO, Vec3::NEG_Z, [0.5, 0.5]);
    for i in 0..segments {
        let (sin, cos) = (i as f32 / segments as f32 * TAU).sin_cos();
        g.vertex(Vec3::new(cos, sin, 0.0) * radius, Vec3::NEG_Z, [0.5 + 0.5 * cos, 0.5 - 0.5 * sin]);
    }
    for i in 0..segments {
        g.indices.extend([centre, 1 + (i + 1) % segments, 1 + i]);
    }
    g
}

/// A square grid in the plane x, z of `cells * cells` cells, `size` wide, at the heights that `height` gives; normals
/// from central differences. Texture coordinates are x and z in metres.
pub fn terrain(size: f32, cells: u32, height: impl Fn(f32, f32) -> f32) -> Geometry {
    let mut g = Geometry::default();
    let step = size / cells as f32;
    for j in 0..=cells {
        for i in 0..=cells {
            let (x, z) = (i as f32 * step - size * 0.5, j as f32 * step - size * 0.5);
            let slope_x = height(x + step, z) - height(x - step, z);
            let slope_z = height(x, z + step) - height(x, z - step);
            let normal = Vec3::new(-slope_x, 2.0 * step, -slope_z).normalize();
            g.vertex(Vec3::new(x, height(x, z), z), normal, [x, z]);
        }
    }
    let row = cells + 1;
    for j in 0..cells {
        for i in 0..cells {
            let a = j * row + i;
            g.indices.extend([a, a + row, a + row + 1, a, a + row + 1, a + 1]);
        }
    }
    g
}

/// Turns a closed shape inside out: it is seen from within.
#[must_use]
pub fn inverted(mut g: Geometry) -> Geometry {
    for n in &mut g.normals {
        *n = n.map(|c| -c);
    }
    for triangle in g.indices.as_chunks_mut::<3>().0 {
        triangle.swap(1, 2);
    }
    g
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the signed volume: positive where the faces of a closed shape are seen from outside.
    fn volume(g: &Geometry) -> f32 {
        let p = |i: u32| Vec3::from(g.positions[i as usize]);
        g.indices.as_chunks::<3>().0.iter().map(|t| p(t[0]).dot(p(t[1]).cross(p(t[2]))) / 6.0).sum()
    }

    #[test]
    fn closed_shapes_face_outwards_and_have_their_volume() {
        assert!((volume(&cuboid([1.0, 2.0, 3.0])) - 6.0).abs() < 1e-4);
        assert!((volume(&sphere(1.0, 64, 32)) - 4.0 / 3.0 * PI).abs() < 0.03);
        assert!((volume(&capsule(0.5, 0.5, 2.0, 64, 16)) - (PI * 0.25 * 2.0 + PI / 6.0)).abs() < 0.03);
        assert!(volume(&inverted(cuboid([1.0; 3]))) < 0.0);
    }

    #[test]
    fn no_triangle_is_degenerate_and_shading_normals_agree_with_faces() {
        let shapes = [
            cuboid([1.0; 3]),
            sphere(2.0, 12, 8),
            frustum(1.0, 0.5, 3.0, 8),
            frustum(1.0, 0.0, 3.0, 8),
            capsule(0.5, 0.2, 1.0, 8, 4),
            disc(1.0, 8),
            ground(3.0, 2.0),
            terrain(10.0, 8, |x, z| (x + z).sin() * 0.2),
        ];
        for (i, g) in shapes.iter().enumerate() {
            assert_eq!((g.positions.len(), g.positions.len()), (g.normals.len(), g.uvs.len()));
            for t in g.indices.as_chunks::<3>().0 {
                let [a, b, c] = t.map(|i| Vec3::from(g.positions[i as usize]));
                let face = (b - a).cross(c - a);
                assert!(face.length() > 1e-5, "shape {i}: {t:?}");
                let shading: Vec3 = t.iter().map(|&i| Vec3::from(g.normals[i as usize])).sum();
                assert!(face.dot(shading) > 0.0, "shape {i}: {t:?}");
                for &v in t {
                    assert!((Vec3::from(g.normals[v as usize]).length() - 1.0).abs() < 1e-5);
                }
            }
        }
    }
}
