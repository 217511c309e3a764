//! Small scenes for the tests of the path tracer, built row by row as the derived scene would.
#![allow(dead_code, reason = "every test file uses a part of it")]

use glam::{DAffine3, DVec3, Vec2, Vec3};
use orthant_cpu::CpuBackend;
use orthant_resident::batch::{ImageWrite, RowWrites, TextureRow, TlasAction};
use orthant_resident::camera::Projection;
use orthant_resident::extent::scene_radius;
use orthant_resident::film::Film;
use orthant_resident::frame::{Estimator, Frame, PixelFilter, Tile};
use orthant_resident::image::{ImageData, Sampling};
use orthant_resident::math::luminance;
use orthant_resident::rows::*;
use orthant_resident::{Backend, Camera, Environment, SceneBatch};
use std::f32::consts::PI;
use std::sync::Arc;
use std::time::Duration;

/// Triangles with attributes.
#[derive(Clone, Default)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub colors: Vec<[f32; 4]>,
    pub indices: Vec<u32>,
    pub flat: bool,
}

/// A parallelogram about `center` with half edges `u` and `v`; its front looks along `u x v`. The texture's upper left
/// corner is at `center - u + v`.
pub fn quad(center: Vec3, u: Vec3, v: Vec3) -> Mesh {
    let n = u.cross(v).normalize();
    Mesh {
        positions: vec![center - u - v, center + u - v, center + u + v, center - u + v],
        normals: vec![n; 4],
        uvs: vec![Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    }
}

/// A sphere of `rings` by `2 rings` faces with smooth normals.
pub fn sphere(center: Vec3, radius: f32, rings: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let sectors = 2 * rings;
    for i in 0..=rings {
        for j in 0..=sectors {
            let theta = std::f64::consts::PI * i as f64 / rings as f64;
            let phi = std::f64::consts::TAU * j as f64 / sectors as f64;
            let n = DVec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos()).as_vec3();
            mesh.positions.push(center + n * radius);
            mesh.normals.push(n);
            mesh.uvs.push(Vec2::new(j as f32 / sectors as f32, i as f32 / rings as f32));
        }
    }
    for i in 0..rings {
        for j in 0..sectors {
            let a = i * (sectors + 1) + j;
            let b = a + sectors + 1;
            if i > 0 {
                mesh.indices.extend([a, b, a + 1]);
            }
            if i + 1 < rings {
                mesh.indices.extend([a + 1, b, b + 1]);
            }
        }
    }
    mesh
}

/// A box with outward faces.
pub fn cuboid(center: Vec3, half: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    let (x, y, z) = (Vec3::X * half.x, Vec3::Y * half.y, Vec3::Z * half.z);
    for (n, u, v) in [(x, y, z), (-x, z, y), (y, z, x), (-y, x, z), (z, x, y), (-z, y, x)] {
        mesh.append(&quad(center + n, u, v));
    }
    mesh
}

impl Mesh {
    pub fn append(&mut self, other: &Mesh) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|i| i + first));
    }

    pub fn flat(mut self) -> Self {
        self.flat = true;
        self
    }
}

/// A white dielectric without a reflection of its interface.
pub fn lambert(albedo: f32) -> MaterialRow {
    MaterialRow { base_color: [albedo, albedo, albedo, 1.0], metallic: 0.0, ior: 1.0, ..MaterialRow::DEFAULT }
}

/// A surface that emits and reflects nothing.
pub fn lamp(radiance: f32) -> MaterialRow {
    MaterialRow { emissive: [radiance; 3], ..lambert(0.0) }
}

#[derive(Default)]
pub struct SceneBuilder {
    meshes: Vec<(Mesh, MaterialRow)>,
    nodes: Vec<(usize, DAffine3)>,
    pub lights: Vec<LightRow>,
    pub images: Vec<Arc<ImageData>>,
    pub textures: Vec<TextureRow>,
}

impl SceneBuilder {
    pub fn add(mut self, mesh: Mesh, material: MaterialRow) -> Self {
        self.nodes.push((self.meshes.len(), DAffine3::IDENTITY));
        self.meshes.push((mesh, material));
        self
    }

    pub fn add_at(mut self, mesh: Mesh, material: MaterialRow, world: DAffine3) -> Self {
        self.nodes.push((self.meshes.len(), world));
        self.meshes.push((mesh, material));
        self
    }

    pub fn light(mut self, light: LightRow) -> Self {
        self.lights.push(light);
        self
    }

    pub fn texture(mut self, image: ImageData, sampling: Sampling) -> Self {
        self.textures.push(TextureRow { image: self.images.len() as u32, sampling: sampling.pack() });
        self.images.push(Arc::new(image));
        self
    }

    /// Maps every node and light by a similarity.
    pub fn transformed(mut self, m: DAffine3) -> Self {
        for (_, world) in &mut self.nodes {
            *world = m * *world;
        }
        for light in &mut self.lights {
            light.position = m.transform_point3(Vec3::from(light.position).as_dvec3()).as_vec3().to_array();
            let d = m.transform_vector3(Vec3::from(light.direction).as_dvec3()).as_vec3();
            light.direction = d.normalize_or_zero().to_array();
        }
        self
    }

    pub fn batch(&self) -> SceneBatch {
        let (mut positions, mut vertices, mut indices, mut descs) = (vec![], vec![], vec![], vec![]);
        let (mut emitter_triangles, mut materials) = (Vec::<EmitterTriangle>::new(), vec![]);
        for (mesh, material) in &self.meshes {
            let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for p in &mesh.positions {
                (lo, hi) = (lo.min(*p), hi.max(*p));
            }
            let areas: Vec<f64> = mesh
                .indices
                .chunks(3)
                .map(|t| {
                    let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[t[k] as usize].as_dvec3());
                    0.5 * (b - a).cross(c - a).length()
                })
                .collect();
            let total: f64 = areas.iter().sum();
            let first_emitter_triangle = if material.is_emissive() { emitter_triangles.len() as u32 } else { NONE };
            if material.is_emissive() {
                let mut sum = 0.0;
                let first = emitter_triangles.len();
                emitter_triangles.extend(areas.iter().map(|a| {
                    sum += a;
                    EmitterTriangle { cumulative: (sum / total) as f32 }
                }));
                emitter_triangles[first..].last_mut().unwrap().cumulative = 1.0;
            }
            let corners: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
            let quad = if material.is_emissive() { MeshFlags::of_parallelogram(&corners, &mesh.indices) } else { 0 };
            let flags = MeshFlags::UV0
                | quad
                | if mesh.flat { MeshFlags::FLAT } else { 0 }
                | if mesh.colors.is_empty() { 0 } else { MeshFlags::COLOR };
            descs.push(MeshDesc {
                first_vertex: positions.len() as u32,
                vertex_count: mesh.positions.len() as u32,
                first_index: indices.len() as u32,
                index_count: mesh.indices.len() as u32,
                first_tangent: NONE,
                flags,
                first_emitter_triangle,
                reserved: 0,
                bounds_min: lo.to_array(),
                area: total as f32,
                bounds_max: hi.to_array(),
                reserved2: 0,
            });
            for i in 0..mesh.positions.len() {
                positions.push(mesh.positions[i].to_array());
                let color = mesh.colors.get(i).copied().unwrap_or([1.0; 4]);
                vertices.push(VertexRow {
                    uv0: mesh.uvs[i].to_array(),
                    uv1: [0.0; 2],
                    color: color.map(|c| (c * 65535.0).round() as u16),
                    normal: encode_normal(mesh.normals[i]),
                    reserved: 0,
                });
            }
            indices.extend(&mesh.indices);
            materials.push(*material);
        }
        let (mut render_nodes, mut emitters) = (vec![], Vec::<EmitterRow>::new());
        for (slot, (primitive, world)) in self.nodes.iter().enumerate() {
            let material = &self.meshes[*primitive].1;
            let desc: &MeshDesc = &descs[*primitive];
            let mut flags = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
            if material.alpha_mode() == AlphaMode::Opaque {
                flags |= NodeFlags::OPAQUE;
            }
            let double_sided = material.flags & MaterialFlags::DOUBLE_SIDED != 0;
            if double_sided {
                flags |= NodeFlags::DOUBLE_SIDED;
            }
            if world.matrix3.determinant() < 0.0 {
                flags |= NodeFlags::MIRRORED;
            }
            let mut emitter = NONE;
            if material.is_emissive() {
                emitter = emitters.len() as u32;
                let scale = world.matrix3.determinant().abs().powf(2.0 / 3.0) as f32;
                let faces = if double_sided { 2.0 } else { 1.0 };
                let power = luminance(Vec3::from(material.emissive)) * desc.area * scale * PI * faces;
                emitters.push(EmitterRow {
                    render_node: slot as u32,
                    first_triangle: desc.first_emitter_triangle,
                    triangle_count: desc.triangle_count(),
                    area: desc.area,
                    power,
                    reserved: [0; 3],
                });
            }
            render_nodes.push(RenderNodeRow {
                world: Mat3x4::from_affine(world),
                inverse: Mat3x4::from_affine(&world.inverse()),
                primitive: *primitive as u32,
                material: *primitive as u32,
                node: 100 + slot as u32,
                flags,
                emitter,
                reserved: [0; 3],
            });
        }
        let scene_radius = scene_radius(&render_nodes, &descs);
        SceneBatch {
            expected_revision: 0,
            new_revision: 1,
            positions: RowWrites::whole(positions),
            vertices: RowWrites::whole(vertices),
            indices: RowWrites::whole(indices),
            tangents: RowWrites::none(0),
            blas_builds: (0..descs.len() as u32).collect(),
            mesh_descs: RowWrites::whole(descs),
            blas_updates: vec![],
            blas_frees: vec![],
            images: (0..self.images.len())
                .map(|i| ImageWrite { slot: i as u32, image: Some(self.images[i].clone()) })
                .collect(),
            textures: RowWrites::whole(self.textures.clone()),
            materials: RowWrites::whole(materials),
            lights: RowWrites::whole(self.lights.clone()),
            emitter_triangles: RowWrites::whole(emitter_triangles),
            emitters: RowWrites::whole(emitters),
            scene_radius,
            render_nodes: RowWrites::whole(render_nodes),
            tlas: TlasAction::Rebuild,
        }
    }

    pub fn backend(&self, environment: Environment) -> CpuBackend {
        let mut backend = CpuBackend::new();
        backend.apply(self.batch()).unwrap();
        backend.set_environment(environment).unwrap();
        backend
    }
}

/// A camera at `eye` that looks at `target`.
pub fn camera(eye: Vec3, target: Vec3, vertical_degrees: f32) -> Camera {
    let forward = (target - eye).normalize();
    let up = if forward.y.abs() > 0.999 { Vec3::Z } else { Vec3::Y };
    let right = forward.cross(up).normalize();
    Camera {
        position: eye.to_array(),
        right: right.to_array(),
        up: right.cross(forward).to_array(),
        forward: forward.to_array(),
        projection: Projection::Perspective { tan_half_fov_y: (vertical_degrees.to_radians() * 0.5).tan() },
        lens_radius: 0.0,
        focus_distance: 1.0,
        near: 0.0,
        far: f32::INFINITY,
    }
}

/// The whole image, with a box filter and no clamp.
pub fn frame(camera: Camera, width: u32, height: u32, samples: u32) -> Frame {
    Frame {
        camera,
        width,
        height,
        tile: Tile { x: 0, y: 0, width, height },
        samples: 0..samples,
        keep_blocks: false,
        seed: 1,
        max_depth: 8,
        roulette_depth: 64,
        firefly_clamp: None,
        estimator: Estimator::Mis,
        filter: PixelFilter::Box,
        aovs: vec![],
        threads: 0,
        world: None,
    }
}

pub fn render(backend: &mut CpuBackend, frame: Frame) -> Film {
    let ticket = backend.submit(frame).unwrap();
    while !backend.poll(ticket, Duration::from_secs(60)).unwrap().is_done() {}
    backend.read_film(ticket).unwrap()
}

/// Mean over the film.
pub fn mean(film: &Film) -> Vec3 {
    let pixels = film.resolve();
    let sum = pixels.iter().fold(glam::DVec3::ZERO, |s, p| s + Vec3::from(*p).as_dvec3());
    (sum / pixels.len() as f64).as_vec3()
}

/// Asserts a relative difference.
#[track_caller]
pub fn assert_close(value: f32, expected: f32, tolerance: f32, what: &str) {
    assert!((value / expected - 1.0).abs() <= tolerance, "{what}: {value}, expected {expected}");
}

/// A batch on a scene of which `whole` loaded everything: it goes from a revision to the next and writes nothing.
pub fn unchanged(whole: &SceneBatch, revision: u64) -> SceneBatch {
    SceneBatch {
        expected_revision: revision,
        new_revision: revision + 1,
        positions: RowWrites::none(whole.positions.len),
        vertices: RowWrites::none(whole.vertices.len),
        indices: RowWrites::none(whole.indices.len),
        mesh_descs: RowWrites::none(whole.mesh_descs.len),
        blas_builds: vec![],
        materials: RowWrites::none(whole.materials.len),
        emitter_triangles: RowWrites::none(whole.emitter_triangles.len),
        emitters: RowWrites::none(whole.emitters.len),
        render_nodes: RowWrites::none(whole.render_nodes.len),
        ..whole.clone()
    }
}
