//! Resident geometry, vertex by vertex, against that of a full derivation.

use crate::rays::Side;

/// How far vertices may be apart, relative to the size of their mesh: poses are followed up to rounding.
const TOLERANCE: f32 = 1e-4;

/// Compares the vertices and triangles of every render node.
pub fn compare(synced: Side<'_>, fresh: Side<'_>) -> Result<(), String> {
    for node in &fresh.0.hierarchy.nodes {
        let rows = |side: Side<'_>| side.0.render_nodes_of(node.node);
        for (a, b) in rows(synced).zip(rows(fresh)) {
            let (positions, indices) = streams(synced, a);
            let (wanted_positions, wanted_indices) = streams(fresh, b);
            let at = |what: String| format!("{:?}: render node {}: {what}", node.node, b - rows(fresh).start);
            if indices != wanted_indices || positions.len() != wanted_positions.len() {
                return Err(at("its resident triangles are others".to_owned()));
            }
            let size = wanted_positions.iter().flatten().fold(1e-30f32, |size, v| size.max(v.abs()));
            let near = |(a, b): (&f32, &f32)| a == b || (a - b).abs() <= TOLERANCE * size;
            let mut vertices = positions.iter().zip(wanted_positions);
            if let Some(i) = vertices.position(|(a, b)| !a.iter().zip(b).all(near)) {
                let (is, should) = (positions[i], wanted_positions[i]);
                return Err(at(format!("vertex {i} is resident at {is:?}, and should be at {should:?}")));
            }
        }
    }
    Ok(())
}

fn streams<'s>(side: Side<'s>, row: u32) -> (&'s [[f32; 3]], &'s [u32]) {
    let scene = side.1;
    let desc = &scene.mesh_descs[scene.render_nodes[row as usize].primitive as usize];
    let part = |first: u32, count: u32| first as usize..(first + count) as usize;
    let indices = if desc.index_count > 0 { &scene.indices[part(desc.first_index, desc.index_count)] } else { &[] };
    let positions =
        if desc.vertex_count > 0 { &scene.positions[part(desc.first_vertex, desc.vertex_count)] } else { &[] };
    (positions, indices)
}
