//! Emissive geometry: an area table per RenderPrimitive and a row per emissive render node.

use super::material_row;
use super::materials::Materials;
use super::primitives::PrimitiveTable;
use glam::Vec3;
use orthant_resident::rows::{EmitterRow, MaterialFlags, MaterialRow, MeshDesc, NONE, NodeFlags, RenderNodeRow};
use orthant_scene::animation::Posed;

/// Which RenderPrimitives need an area table: those that some primitive shows with an emissive material, under any
/// variant (so that choosing a variant changes no geometry).
pub fn emissive_primitives(posed: Posed<'_>, table: &PrimitiveTable) -> Vec<bool> {
    let scene = posed.scene;
    let mut emissive_row = vec![false; scene.materials().slot_bound() + 1];
    for id in scene.materials().ids() {
        let material = posed.material(id);
        let strength = material.emissive_strength.unwrap_or(1.0);
        emissive_row[material_row(Some(id)) as usize] = material.emissive.iter().any(|&c| c * strength > 0.0);
    }
    let mut emissive = vec![false; table.primitives.len()];
    if !emissive_row.contains(&true) {
        return emissive;
    }
    for (mesh_id, mesh) in scene.meshes().iter() {
        // `uses_of` leaves out primitives without triangles, so the materials of all are taken together: a table too
        // many costs 4 bytes a triangle.
        let any = mesh.primitives.iter().any(|p| {
            let variants = p.variants.iter().map(|m| m.material);
            p.material.into_iter().chain(variants).any(|m| emissive_row[material_row(Some(m)) as usize])
        });
        if any {
            for use_ in table.uses_of(mesh_id).iter().filter(|u| u.render_primitive != NONE) {
                emissive[use_.render_primitive as usize] = true;
            }
        }
    }
    for (i, primitive) in table.primitives.iter().enumerate().filter(|(_, p)| p.deformed_by.is_some()) {
        let source = &scene.meshes()[primitive.mesh].primitives[primitive.primitive];
        let variants = source.variants.iter().map(|m| m.material);
        emissive[i] = source.material.into_iter().chain(variants).any(|m| emissive_row[material_row(Some(m)) as usize]);
    }
    emissive
}

/// Makes the emitter rows and writes their indices into the render nodes.
pub fn derive(render_nodes: &mut [RenderNodeRow], mesh_descs: &[MeshDesc], materials: &Materials) -> Vec<EmitterRow> {
    let emits: Vec<bool> = materials.rows.iter().map(shines).collect();
    let mut rows: Vec<EmitterRow> = Vec::new();
    if !emits.contains(&true) {
        return rows;
    }
    for (index, node) in render_nodes.iter_mut().enumerate() {
        if !emits[node.material as usize] {
            continue;
        }
        let (material, mean) = (node.material as usize, materials.mean_emission[node.material as usize]);
        let desc = &mesh_descs[node.primitive as usize];
        if let Some(row) = emitter_row(index as u32, node, desc, &materials.rows[material], mean) {
            node.emitter = rows.len() as u32;
            rows.push(row);
        }
    }
    rows
}

/// Whether what has the material emits light that others receive.
pub(super) fn shines(material: &MaterialRow) -> bool {
    material.is_emissive() && material.flags & MaterialFlags::UNLIT == 0
}

/// The emitter row of a render node; `None` if it emits nothing. `mean` is the mean colour of its emissive texture.
pub(super) fn emitter_row(
    index: u32,
    node: &RenderNodeRow,
    desc: &MeshDesc,
    material: &MaterialRow,
    mean: Vec3,
) -> Option<EmitterRow> {
    let is_lit = node.flags & NodeFlags::VISIBLE != 0 && shines(material);
    if !is_lit || desc.first_emitter_triangle == NONE || desc.area <= 0.0 {
        return None;
    }
    let luminance = (Vec3::from_array(material.emissive) * mean).dot(Vec3::new(0.2126, 0.7152, 0.0722));
    // The world area of a mesh under a linear map: exact for a similarity, and a fair weight for the rest.
    let scale = node.world.determinant().abs().powf(2.0 / 3.0);
    let faces = if node.flags & NodeFlags::DOUBLE_SIDED != 0 { 2.0 } else { 1.0 };
    let power = luminance * desc.area * scale * faces * std::f32::consts::PI;
    (power > 0.0 && power.is_finite()).then(|| EmitterRow {
        render_node: index,
        first_triangle: desc.first_emitter_triangle,
        triangle_count: desc.triangle_count(),
        area: desc.area,
        power,
        reserved: [0; 3],
    })
}
