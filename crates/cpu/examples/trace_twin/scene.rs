//! A meadow of instances: spheres, tori, boulders and alpha-tested bushes on a ground of tiles.

use super::rays::Random;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use orthant_resident::batch::{RowWrites, SceneBatch, TlasAction};
use orthant_resident::rows::{Mat3x4, MeshDesc, NONE, NodeFlags, RenderNodeRow, VertexRow};

/// The batch that loads `count` instances of five meshes.
pub fn batch(count: usize) -> SceneBatch {
    let mut random = Random(7);
    let boulder = |p: Vec3| p * (1.0 + 0.15 * (7.0 * p.x).sin() * (9.0 * p.y).sin() + 0.1 * (23.0 * p.z).sin());
    let meshes = [sphere(24, |p| p), sphere(56, boulder), torus(48, 24), bush(&mut random), ground()];
    let mut positions = Vec::new();
    let mut indices = Vec::new();
    let mut descs = Vec::new();
    for (points, triangles) in &meshes {
        descs.push(MeshDesc {
            first_vertex: positions.len() as u32,
            vertex_count: points.len() as u32,
            first_index: indices.len() as u32,
            index_count: triangles.len() as u32,
            first_tangent: NONE,
            first_emitter_triangle: NONE,
            ..bytemuck::Zeroable::zeroed()
        });
        positions.extend(points.iter().map(|p| p.to_array()));
        indices.extend_from_slice(triangles);
    }
    let side = (count as f64).sqrt().ceil();
    let mut rows = Vec::with_capacity(count);
    for i in 0..count {
        let (x, z) = ((i as f64 % side) * 2.0, (i as f64 / side).floor() * 2.0);
        let mut r = || f64::from(random.next());
        let primitive = if i % 8 == 0 { 4 } else { i % 4 };
        let world = if primitive == 4 {
            // Every eighth instance is a tile of ground, wide enough to overlap its neighbours.
            DAffine3::from_scale_rotation_translation(
                DVec3::new(8.0, 1.0, 2.0),
                DQuat::IDENTITY,
                DVec3::new(x + 7.0, -0.5, z),
            )
        } else {
            let axis = DVec3::new(r() - 0.5, r() - 0.5, r() - 0.5).normalize_or(DVec3::X);
            DAffine3::from_scale_rotation_translation(
                DVec3::new(0.6 + r(), 0.6 + r(), 0.6 + r()),
                DQuat::from_axis_angle(axis, r() * 6.0),
                DVec3::new(x + r(), r(), z + r()),
            )
        };
        let opaque = if primitive == 3 { 0 } else { NodeFlags::OPAQUE };
        rows.push(RenderNodeRow {
            world: Mat3x4::from_affine(&world),
            inverse: Mat3x4::from_affine(&world.inverse()),
            primitive: primitive as u32,
            flags: NodeFlags::OCCUPIED | NodeFlags::VISIBLE | NodeFlags::DOUBLE_SIDED | opaque,
            ..RenderNodeRow::HOLE
        });
    }
    let vertices: Vec<VertexRow> = vec![bytemuck::Zeroable::zeroed(); positions.len()];
    SceneBatch {
        expected_revision: 0,
        new_revision: 1,
        positions: RowWrites::whole(positions),
        vertices: RowWrites::whole(vertices),
        indices: RowWrites::whole(indices),
        tangents: RowWrites::none(0),
        mesh_descs: RowWrites::whole(descs),
        blas_builds: (0..meshes.len() as u32).collect(),
        blas_frees: Vec::new(),
        images: Vec::new(),
        textures: RowWrites::none(0),
        materials: RowWrites::none(0),
        lights: RowWrites::none(0),
        emitter_triangles: RowWrites::none(0),
        emitters: RowWrites::none(0),
        render_nodes: RowWrites::whole(rows),
        tlas: TlasAction::Rebuild,
    }
}

type Mesh = (Vec<Vec3>, Vec<u32>);

/// A grid of quads, wrapped by `place` from (column, row) shares.
fn grid(columns: u32, rows: u32, place: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for j in 0..=rows {
        for i in 0..=columns {
            points.push(place(i as f32 / columns as f32, j as f32 / rows as f32));
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let (b, c, d) = (a + 1, a + columns + 1, a + columns + 2);
            triangles.extend([a, c, b, b, c, d]);
        }
    }
    (points, triangles)
}

fn sphere(rings: u32, shape: impl Fn(Vec3) -> Vec3) -> Mesh {
    grid(2 * rings, rings, |u, v| {
        let ((sp, cp), (st, ct)) = ((u * std::f32::consts::TAU).sin_cos(), (v * std::f32::consts::PI).sin_cos());
        shape(Vec3::new(st * cp, ct, st * sp))
    })
}

fn torus(columns: u32, rows: u32) -> Mesh {
    grid(columns, rows, |u, v| {
        let ((su, cu), (sv, cv)) = ((u * std::f32::consts::TAU).sin_cos(), (v * std::f32::consts::TAU).sin_cos());
        Vec3::new((0.7 + 0.3 * cv) * cu, 0.3 * sv, (0.7 + 0.3 * cv) * su)
    })
}

/// Crossing quads, like leaves.
fn bush(random: &mut Random) -> Mesh {
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for _ in 0..400 {
        let center = random.unit() * random.next().cbrt();
        let (u, v) = (random.unit() * 0.12, random.unit() * 0.12);
        let a = points.len() as u32;
        points.extend([center - u - v, center + u - v, center + u + v, center - u + v]);
        triangles.extend([a, a + 1, a + 2, a, a + 2, a + 3]);
    }
    (points, triangles)
}

fn ground() -> Mesh {
    grid(16, 4, |u, v| Vec3::new(2.0 * u - 1.0, 0.1 * (9.0 * u).sin() * (5.0 * v).sin(), 2.0 * v - 1.0))
}
