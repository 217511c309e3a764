//! Decodes all RenderPrimitives into the global streams, in parallel.

use super::deform::{Deformation, deform};
use super::rows::{Attributes, Bounds};
use super::tangents::{MIKKTSPACE_BYTES, encode_or_any, mikktspace};
use super::topology::{triangle_index_count, write_triangles};
use super::{RenderPrimitive, SkinPose};
use crate::DeriveError;
use crate::budget::Budget;
use glam::{Vec2, Vec3};
use orthant_resident::rows::{EmitterTriangle, MeshDesc, MeshFlags, NONE, VertexRow, decode_normal};
use orthant_scene::Scene;
use orthant_scene::accessor;
use orthant_scene::model::{AccessorId, Primitive, PrimitiveMode, Store};
use rayon::prelude::*;
use std::borrow::Cow;

/// The global streams and one MeshDesc per RenderPrimitive.
#[derive(Clone, Debug, Default)]
pub struct GeometryStreams {
    /// Object-space positions in metres.
    pub positions: Vec<[f32; 3]>,
    /// Attributes, parallel to `positions`.
    pub vertices: Vec<VertexRow>,
    /// Local indices, three a triangle.
    pub indices: Vec<u32>,
    /// Corner tangents.
    pub tangents: Vec<u32>,
    /// Ranges by RenderPrimitive index.
    pub mesh_descs: Vec<MeshDesc>,
    /// Area tables of the primitives that are asked for.
    pub emitter_triangles: Vec<EmitterTriangle>,
}

impl GeometryStreams {
    /// Bytes of all streams.
    pub fn bytes(&self) -> u64 {
        let bytes = size_of_val(self.positions.as_slice())
            + size_of_val(self.vertices.as_slice())
            + size_of_val(self.indices.as_slice())
            + size_of_val(self.tangents.as_slice())
            + size_of_val(self.mesh_descs.as_slice())
            + size_of_val(self.emitter_triangles.as_slice());
        bytes as u64
    }
}

/// Vertices above which the work inside one primitive is split over threads.
const PARALLEL_VERTICES: usize = 1 << 15;

/// What one primitive is decoded from and into.
struct Job<'a> {
    primitive: &'a Primitive,
    render_primitive: &'a RenderPrimitive,
    place: String,
    positions: &'a mut [[f32; 3]],
    vertices: &'a mut [VertexRow],
    indices: &'a mut [u32],
    tangents: &'a mut [u32],
    emitter_triangles: &'a mut [EmitterTriangle],
    desc: &'a mut MeshDesc,
}

/// Where everything will be, before any of it is decoded: what it takes is charged, and nothing is taken yet.
pub struct GeometryPlan<'a> {
    scene: &'a Scene,
    primitives: &'a [RenderPrimitive],
    spans: Vec<Spans>,
    total: Spans,
    mesh_descs: Vec<MeshDesc>,
    budget: &'a Budget,
    /// Bytes that are charged until all is decoded.
    working: u64,
}

impl<'a> GeometryPlan<'a> {
    /// Lays out the spans of every primitive. `emissive[i]` asks for the area table of primitive `i`. The streams are
    /// charged to `budget`, and so is what the threads have in hand until they are filled.
    pub fn new(
        scene: &'a Scene,
        primitives: &'a [RenderPrimitive],
        emissive: &[bool],
        budget: &'a Budget,
    ) -> Result<Self, DeriveError> {
        let mut spans = Vec::with_capacity(primitives.len());
        let mut mesh_descs = Vec::with_capacity(primitives.len());
        let mut total = Spans::default();
        let mut working = Vec::with_capacity(primitives.len());
        for (p, &emissive) in primitives.iter().zip(emissive) {
            let primitive = &scene.meshes()[p.mesh].primitives[p.primitive];
            let span = Spans::of(scene, p, primitive, emissive);
            mesh_descs.push(total.desc(&span)?);
            total.add(&span);
            working.push(working_bytes(scene, p, primitive, &span));
            spans.push(span);
        }
        total.check_fits_u32()?;
        // Whichever primitives the threads have in hand at once, it is no more than the largest ones take.
        working.sort_unstable();
        let at_once = working.iter().rev().take(rayon::current_num_threads());
        let working = at_once.fold(0, |sum: u64, &bytes| sum.saturating_add(bytes));
        budget
            .charge(total.bytes().saturating_add(working))
            .map_err(|over| DeriveError::over_budget("/meshes", "the decoded meshes", over))?;
        Ok(Self { scene, primitives, spans, total, mesh_descs, budget, working })
    }

    /// Decodes every primitive, in parallel. `pose(i)` is how primitive `i` is deformed, for those whose `deformed_by` is
    /// set.
    pub fn decode(self, pose: &(dyn Fn(usize) -> Option<SkinPose> + Sync)) -> Result<GeometryStreams, DeriveError> {
        let Self { scene, primitives, spans, total, mesh_descs, budget, working } = self;
        let mut streams = GeometryStreams {
            positions: vec![[0.0; 3]; total.vertices],
            vertices: bytemuck::zeroed_vec(total.vertices),
            indices: vec![0; total.indices],
            tangents: vec![0; total.tangents],
            mesh_descs,
            emitter_triangles: bytemuck::zeroed_vec(total.emitter_triangles),
        };
        let mut jobs = Vec::with_capacity(primitives.len());
        let mut positions = streams.positions.as_mut_slice();
        let mut vertices = streams.vertices.as_mut_slice();
        let mut indices = streams.indices.as_mut_slice();
        let mut tangents = streams.tangents.as_mut_slice();
        let mut emitter_triangles = streams.emitter_triangles.as_mut_slice();
        for ((p, span), desc) in primitives.iter().zip(&spans).zip(&mut streams.mesh_descs) {
            jobs.push(Job {
                primitive: &scene.meshes()[p.mesh].primitives[p.primitive],
                render_primitive: p,
                place: format!("/meshes/{}/primitives/{}", Store::<_, ()>::slot(p.mesh), p.primitive),
                positions: take(&mut positions, span.vertices),
                vertices: take(&mut vertices, span.vertices),
                indices: take(&mut indices, span.indices),
                tangents: take(&mut tangents, span.tangents),
                emitter_triangles: take(&mut emitter_triangles, span.emitter_triangles),
                desc,
            });
        }
        jobs.into_par_iter().enumerate().try_for_each(|(i, job)| job.run(scene, pose(i)))?;
        budget.release(working);
        Ok(streams)
    }
}

/// An upper bound of what one primitive takes while it is decoded: copies of attributes that are not stored as they are
/// read, a pose, tangents.
fn working_bytes(scene: &Scene, render_primitive: &RenderPrimitive, primitive: &Primitive, span: &Spans) -> u64 {
    fn copy<const N: usize>(scene: &Scene, id: Option<AccessorId>) -> usize {
        let in_place = id.is_none_or(|id| accessor::borrow_f32::<N>(scene, id).is_ok_and(|floats| floats.is_some()));
        if in_place { 0 } else { N * size_of::<f32>() }
    }
    let get = |semantic: &str| primitive.attributes.get(semantic);
    let mut vertex = copy::<3>(scene, get("POSITION"))
        + copy::<3>(scene, get("NORMAL"))
        + copy::<2>(scene, get("TEXCOORD_0"))
        + copy::<2>(scene, get("TEXCOORD_1"))
        // Three components become four in a second copy.
        + if get("COLOR_0").is_some() { 28 } else { 0 };
    if render_primitive.deformed_by.is_some() {
        // Positions and normals, the deltas of all targets, and joints with their weights.
        let sets = primitive.attributes.0.iter().filter(|(semantic, _)| semantic.starts_with("JOINTS_")).count();
        vertex += 24 + 24 * primitive.targets.len() + 24 * sets;
    }
    if render_primitive.tangents_from_uv.is_some() {
        vertex += copy::<4>(scene, get("TANGENT"));
    }
    let has_tangents = get("TANGENT").is_some() && get("NORMAL").is_some() && render_primitive.deformed_by.is_none();
    let corner = if span.tangents > 0 && !has_tangents { MIKKTSPACE_BYTES } else { 0 };
    let index = if primitive.indices.is_none_or(|id| accessor::is_packed(scene, id)) { 0 } else { size_of::<u32>() };
    let bytes = |count: usize, each: usize| (count as u64).saturating_mul(each as u64);
    bytes(span.vertices, vertex)
        .saturating_add(bytes(span.indices, corner + index))
        .saturating_add(bytes(span.emitter_triangles, size_of::<f64>()))
}

/// Cuts the first `n` elements off a slice.
fn take<'a, T>(slice: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    let (head, tail) = std::mem::take(slice).split_at_mut(n);
    *slice = tail;
    head
}

/// Elements in each stream.
#[derive(Clone, Copy, Default)]
struct Spans {
    vertices: usize,
    indices: usize,
    tangents: usize,
    emitter_triangles: usize,
}

impl Spans {
    fn of(scene: &Scene, render_primitive: &RenderPrimitive, primitive: &Primitive, emissive: bool) -> Self {
        let count = |id: AccessorId| scene.accessors()[id].count;
        let vertices = primitive.attributes.get("POSITION").map_or(0, count);
        let elements = primitive.indices.map_or(vertices, count);
        let indices = triangle_index_count(primitive.mode, elements);
        Self {
            vertices,
            indices,
            tangents: if render_primitive.tangents_from_uv.is_some() { indices } else { 0 },
            emitter_triangles: if emissive { indices / 3 } else { 0 },
        }
    }

    fn add(&mut self, other: &Self) {
        // A sum that saturates is refused by `check_fits_u32`.
        self.vertices = self.vertices.saturating_add(other.vertices);
        self.indices = self.indices.saturating_add(other.indices);
        self.tangents = self.tangents.saturating_add(other.tangents);
        self.emitter_triangles = self.emitter_triangles.saturating_add(other.emitter_triangles);
    }

    fn bytes(&self) -> u64 {
        let vertex = size_of::<[f32; 3]>() + size_of::<VertexRow>();
        (self.vertices as u64).saturating_mul(vertex as u64)
            + 4 * (self.indices as u64 + self.tangents as u64 + self.emitter_triangles as u64)
    }

    fn check_fits_u32(&self) -> Result<(), DeriveError> {
        let largest =
            [self.vertices, self.indices, self.tangents, self.emitter_triangles].into_iter().max().unwrap_or(0);
        if largest >= NONE as usize {
            return Err(DeriveError::new(
                "/meshes",
                format!("the meshes hold {largest} vertices or indices together; at most {} fit", NONE - 1),
                "split the file into several scenes",
            ));
        }
        Ok(())
    }

    /// The ranges of `span`, which begins where `self` ends.
    fn desc(&self, span: &Self) -> Result<MeshDesc, DeriveError> {
        self.check_fits_u32()?;
        let first = |at: usize, n: usize| if n == 0 { NONE } else { at as u32 };
        Ok(MeshDesc {
            first_vertex: self.vertices as u32,
            vertex_count: span.vertices as u32,
            first_index: self.indices as u32,
            index_count: span.indices as u32,
            first_tangent: first(self.tangents, span.tangents),
            first_emitter_triangle: first(self.emitter_triangles, span.emitter_triangles),
            ..bytemuck::Zeroable::zeroed()
        })
    }
}

impl Job<'_> {
    fn run(mut self, scene: &Scene, pose: Option<SkinPose>) -> Result<(), DeriveError> {
        let place = self.place.clone();
        let error = |what: String| DeriveError::new(&place, what, "export the mesh again, or repair the file");
        self.indices(scene).map_err(error)?;
        self.attributes(scene, pose).map_err(error)?;
        self.tangents(scene).map_err(error)?;
        self.areas();
        Ok(())
    }

    fn indices(&mut self, scene: &Scene) -> Result<(), String> {
        let mode = self.primitive.mode;
        let Some(id) = self.primitive.indices else {
            write_triangles(mode, self.positions.len(), |i| i as u32, self.indices);
            return Ok(());
        };
        let source = accessor::indices(scene, id).map_err(|e| e.to_string())?;
        let largest = if mode == PrimitiveMode::Triangles {
            let copy = |(i, out): (usize, &mut [u32])| source.copy_to(i * PARALLEL_VERTICES, out);
            match self.indices.len() {
                0..=PARALLEL_VERTICES => copy((0, &mut *self.indices)),
                _ => self.indices.par_chunks_mut(PARALLEL_VERTICES).enumerate().filter_map(copy).max(),
            }
        } else {
            write_triangles(mode, source.len(), |i| source.get(i), self.indices);
            self.indices.iter().copied().max()
        };
        match largest {
            Some(index) if index as usize >= self.positions.len() => Err(format!(
                "vertex index {index} is out of range: the primitive has {} vertices",
                self.positions.len()
            )),
            _ => Ok(()),
        }
    }

    fn attributes(&mut self, scene: &Scene, pose: Option<SkinPose>) -> Result<(), String> {
        let attributes = &self.primitive.attributes;
        let get = |semantic: &str| attributes.get(semantic);
        let n = self.positions.len();
        let positions = optional::<3>(scene, get("POSITION"), n)?.unwrap_or_default();
        let normals = optional::<3>(scene, get("NORMAL"), n)?;
        let uv0 = optional::<2>(scene, get("TEXCOORD_0"), n)?;
        let uv1 = optional::<2>(scene, get("TEXCOORD_1"), n)?;
        let colors = match get("COLOR_0") {
            Some(id) => Some(checked_len(accessor::read_colors(scene, id).map_err(|e| e.to_string())?, n, "COLOR_0")?),
            None => None,
        };
        let (positions, normals) = match &pose {
            Some(pose) => {
                let deformation = Deformation::read(scene, self.primitive, pose)?;
                let (p, n) = deform(&positions, normals.as_deref(), &deformation);
                (Cow::Owned(p), n.map(Cow::Owned))
            }
            None => (positions, normals),
        };

        let flag = |given: bool, bit: u32| if given { bit } else { 0 };
        self.desc.flags = flag(normals.is_none(), MeshFlags::FLAT)
            | flag(uv0.is_some(), MeshFlags::UV0)
            | flag(uv1.is_some(), MeshFlags::UV1)
            | flag(colors.is_some(), MeshFlags::COLOR)
            | flag(!self.tangents.is_empty(), MeshFlags::TANGENT)
            | flag(pose.is_some(), MeshFlags::DEFORMED);

        let fill = |first: usize, out_positions: &mut [[f32; 3]], out: &mut [VertexRow]| {
            let range = first..first + out.len();
            let source = Attributes {
                normals: normals.as_deref().map(|a| &a[range.clone()]),
                uv0: uv0.as_deref().map(|a| &a[range.clone()]),
                uv1: uv1.as_deref().map(|a| &a[range.clone()]),
                colors: colors.as_deref().map(|a| &a[range.clone()]),
            };
            source.write_rows(out);
            out_positions.copy_from_slice(&positions[range]);
            Bounds::of(out_positions)
        };
        let bounds = if n > PARALLEL_VERTICES {
            self.positions
                .par_chunks_mut(PARALLEL_VERTICES)
                .zip(self.vertices.par_chunks_mut(PARALLEL_VERTICES))
                .enumerate()
                .map(|(c, (p, v))| fill(c * PARALLEL_VERTICES, p, v))
                .reduce(|| Bounds::EMPTY, Bounds::union)
        } else {
            fill(0, self.positions, self.vertices)
        };
        if bounds.min.cmple(bounds.max).all() {
            self.desc.bounds_min = bounds.min.to_array();
            self.desc.bounds_max = bounds.max.to_array();
        }
        Ok(())
    }

    fn tangents(&mut self, scene: &Scene) -> Result<(), String> {
        let Some(uv_set) = self.render_primitive.tangents_from_uv else { return Ok(()) };
        let (positions, vertices, indices) = (&*self.positions, &*self.vertices, &*self.indices);
        let flat = self.desc.flags & MeshFlags::FLAT != 0;
        let normal = |corner: usize| {
            if flat {
                face_normal(positions, &indices[corner / 3 * 3..corner / 3 * 3 + 3])
            } else {
                decode_normal(vertices[indices[corner] as usize].normal)
            }
        };
        // A deformed primitive's tangents follow its deformed positions; given ones are for the undeformed ones.
        let given =
            self.primitive.attributes.get("TANGENT").filter(|_| self.desc.flags & MeshFlags::DEFORMED == 0 && !flat);
        if let Some(id) = given {
            let source = optional::<4>(scene, Some(id), positions.len())?.unwrap_or_default();
            for (corner, out) in self.tangents.iter_mut().enumerate() {
                let [x, y, z, w] = source[indices[corner] as usize];
                *out = encode_or_any(normal(corner), Vec3::new(x, y, z), w);
            }
        } else {
            let uv = |v: u32| {
                let row = &vertices[v as usize];
                Vec2::from_array(if uv_set == 1 { row.uv1 } else { row.uv0 })
            };
            mikktspace(positions, &normal, &uv, indices, self.tangents);
        }
        Ok(())
    }

    /// The area table: cumulative object-space areas in index order, divided by their total. And whether it is a quad.
    fn areas(&mut self) {
        if self.emitter_triangles.is_empty() {
            return;
        }
        let mut sum = 0.0f64;
        let areas: Vec<f64> = self
            .indices
            .chunks_exact(3)
            .map(|t| {
                let area = f64::from(face_cross(self.positions, t).length()) * 0.5;
                sum += if area.is_finite() { area } else { 0.0 };
                sum
            })
            .collect();
        for (out, cumulative) in self.emitter_triangles.iter_mut().zip(areas) {
            out.cumulative = if sum > 0.0 { (cumulative / sum) as f32 } else { 0.0 };
        }
        self.desc.area = sum as f32;
        self.desc.flags |= MeshFlags::of_parallelogram(self.positions, self.indices);
    }
}

fn face_cross(positions: &[[f32; 3]], triangle: &[u32]) -> Vec3 {
    let p = |i: usize| Vec3::from_array(positions[triangle[i] as usize]);
    (p(1) - p(0)).cross(p(2) - p(0))
}

fn face_normal(positions: &[[f32; 3]], triangle: &[u32]) -> Vec3 {
    face_cross(positions, triangle).normalize_or(Vec3::Z)
}

/// An attribute as floats: borrowed where it is stored as tightly packed, aligned floats.
fn optional<const N: usize>(
    scene: &Scene,
    id: Option<AccessorId>,
    count: usize,
) -> Result<Option<Cow<'_, [[f32; N]]>>, String> {
    let Some(id) = id else { return Ok(None) };
    let values = match accessor::borrow_f32::<N>(scene, id).map_err(|e| e.to_string())? {
        Some(slice) => Cow::Borrowed(slice),
        None => Cow::Owned(accessor::read_f32::<N>(scene, id).map_err(|e| e.to_string())?),
    };
    if values.len() != count {
        return Err(format!("an attribute has {} elements where POSITION has {count}", values.len()));
    }
    Ok(Some(values))
}

fn checked_len<T>(values: Vec<T>, count: usize, name: &str) -> Result<Vec<T>, String> {
    if values.len() == count {
        Ok(values)
    } else {
        Err(format!("{name} has {} elements where POSITION has {count}", values.len()))
    }
}
