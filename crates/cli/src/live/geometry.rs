//! Resident geometry, stream by stream, against that of a full derivation.

use glam::Vec3;
use orthant_cpu::ResidentScene;
use orthant_render::DerivedScene;
use orthant_resident::rows::{
    EmitterTriangle, MeshDesc, MeshFlags, NONE, RenderNodeRow, VertexRow, decode_normal, decode_tangent,
};
use orthant_vulkan::ResidentRows;
use std::collections::HashSet;

/// The geometry that a backend has: in memory, or read back from a device.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "the names are those of SceneBatch")]
pub struct Geometry<'s> {
    pub render_nodes: &'s [RenderNodeRow],
    pub mesh_descs: &'s [MeshDesc],
    pub positions: &'s [[f32; 3]],
    pub vertices: &'s [VertexRow],
    pub indices: &'s [u32],
    pub tangents: &'s [u32],
    pub emitter_triangles: &'s [EmitterTriangle],
}

/// What was derived, and what geometry is resident of it.
pub type Side<'s> = (&'s DerivedScene, Geometry<'s>);

macro_rules! geometry_of {
    ($resident:ty) => {
        impl<'s> From<&'s $resident> for Geometry<'s> {
            fn from(scene: &'s $resident) -> Self {
                Self {
                    render_nodes: &scene.render_nodes,
                    mesh_descs: &scene.mesh_descs,
                    positions: &scene.positions,
                    vertices: &scene.vertices,
                    indices: &scene.indices,
                    tangents: &scene.tangents,
                    emitter_triangles: &scene.emitter_triangles,
                }
            }
        }
    };
}

geometry_of!(ResidentScene);
geometry_of!(ResidentRows);

/// How far vertices of what is deformed may be apart, relative to the size of their mesh: poses are followed up to rounding.
const TOLERANCE: f32 = 1e-4;
/// How far their unit normals and tangents may be apart.
const DIRECTION_TOLERANCE: f32 = 1e-2;

/// Compares positions, attributes, triangles, tangents and area tables of every render node. What no pose deforms is the same to
/// the bit. O(geometry).
///
/// # Errors
/// The first difference: the node, the render node of it, and the element.
pub fn compare(synced: Side<'_>, fresh: Side<'_>) -> Result<(), String> {
    let mut seen = HashSet::new();
    for node in &fresh.0.hierarchy.nodes {
        let rows = |side: Side<'_>| side.0.render_nodes_of(node.node);
        for (a, b) in rows(synced).zip(rows(fresh)) {
            let primitive = |side: Side<'_>, row: u32| side.1.render_nodes[row as usize].primitive;
            if seen.insert((primitive(synced, a), primitive(fresh, b))) {
                compare_one(&Streams::of(&synced.1, a), &Streams::of(&fresh.1, b))
                    .map_err(|what| format!("{:?}: render node {}: {what}", node.node, b - rows(fresh).start))?;
            }
        }
    }
    Ok(())
}

/// What is resident of the geometry of one render node.
struct Streams<'s> {
    desc: &'s MeshDesc,
    positions: &'s [[f32; 3]],
    vertices: &'s [VertexRow],
    indices: &'s [u32],
    /// Empty if there are none.
    tangents: &'s [u32],
    /// Empty if there is none.
    areas: &'s [EmitterTriangle],
}

impl<'s> Streams<'s> {
    fn of(scene: &Geometry<'s>, row: u32) -> Self {
        let desc = &scene.mesh_descs[scene.render_nodes[row as usize].primitive as usize];
        fn part<T>(rows: &[T], first: u32, count: u32) -> &[T] {
            if first == NONE || count == 0 { &[] } else { &rows[first as usize..(first + count) as usize] }
        }
        Self {
            desc,
            positions: part(scene.positions, desc.first_vertex, desc.vertex_count),
            vertices: part(scene.vertices, desc.first_vertex, desc.vertex_count),
            indices: part(scene.indices, desc.first_index, desc.index_count),
            tangents: part(scene.tangents, desc.first_tangent, desc.index_count),
            areas: part(scene.emitter_triangles, desc.first_emitter_triangle, desc.triangle_count()),
        }
    }
}

fn compare_one(is: &Streams<'_>, should: &Streams<'_>) -> Result<(), String> {
    if is.indices != should.indices || is.positions.len() != should.positions.len() {
        return Err("its resident triangles are others".to_owned());
    }
    let deformed = should.desc.flags & MeshFlags::DEFORMED != 0;
    let size = should.positions.iter().flatten().fold(1e-30f32, |size, v| size.max(v.abs()));
    let near = |a: &f32, b: &f32| {
        same(a, b) || deformed && (a == b || a.is_nan() && b.is_nan() || (a - b).abs() <= TOLERANCE * size)
    };
    first_difference("position", is.positions, should.positions, |a, b| a.iter().zip(b).all(|(a, b)| near(a, b)))?;
    first_difference("vertex", is.vertices, should.vertices, |a, b| {
        let normal = |row: &VertexRow| decode_normal(row.normal);
        same(&VertexRow { normal: 0, ..*a }, &VertexRow { normal: 0, ..*b })
            && (a.normal == b.normal || deformed && agree(normal(a), normal(b)))
    })?;
    // Tangents and area tables stay when no material wants them any more. A load makes area tables also for what cannot emit.
    if !should.tangents.is_empty() {
        first_difference("tangent", is.tangents, should.tangents, |a, b| {
            a == b || deformed && agree(decode_tangent(*a).0, decode_tangent(*b).0)
        })?;
    }
    if !should.areas.is_empty() && !is.areas.is_empty() {
        first_difference("row of the area table", is.areas, should.areas, |a, b| {
            same(a, b) || deformed && (a.cumulative - b.cumulative).abs() <= DIRECTION_TOLERANCE
        })?;
    }
    Ok(())
}

fn agree(a: Vec3, b: Vec3) -> bool {
    (a - b).length() <= DIRECTION_TOLERANCE
}

fn same<T: bytemuck::Pod>(a: &T, b: &T) -> bool {
    bytemuck::bytes_of(a) == bytemuck::bytes_of(b)
}

fn first_difference<T: std::fmt::Debug>(
    what: &str,
    is: &[T],
    should: &[T],
    near: impl Fn(&T, &T) -> bool,
) -> Result<(), String> {
    if is.len() != should.len() {
        return Err(format!("of {what} {} are resident, and should be {}", is.len(), should.len()));
    }
    match is.iter().zip(should).position(|(a, b)| !near(a, b)) {
        Some(i) => Err(format!("{what} {i} is {:?} where it is resident, and should be {:?}", is[i], should[i])),
        None => Ok(()),
    }
}
