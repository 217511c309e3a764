//! RenderPrimitives in deterministic order: by mesh, then by primitive; then those that a node deforms, by node.
//!
//! Primitives with the same accessors share one. A mesh whose every user is skinned or morphed has no undeformed
//! RenderPrimitive.

use super::material_row;
use crate::DeriveWarning;
use crate::geometry::{RenderPrimitive, triangle_index_count};
use orthant_resident::rows::NONE;
use orthant_scene::Scene;
use orthant_scene::model::{
    AccessorId, Attributes, MaterialId, MeshId, Node, NodeId, Primitive, PrimitiveMode, Store, VariantId,
};
use std::collections::{HashMap, HashSet};

/// One primitive of a mesh, as render nodes refer to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimitiveUse {
    /// RenderPrimitive index, or [`NONE`] where the mesh has no undeformed geometry (or no triangles).
    pub render_primitive: u32,
    /// Material row, the variant applied.
    pub material: u32,
}

/// All RenderPrimitives, and how meshes and nodes refer to them.
#[derive(Clone, Debug, Default)]
pub struct PrimitiveTable {
    /// RenderPrimitives by index.
    pub primitives: Vec<RenderPrimitive>,
    /// First element in `uses` by mesh slot, with one more at the end.
    first_use: Vec<u32>,
    uses: Vec<PrimitiveUse>,
    /// The RenderPrimitive of a node's first drawn primitive, for nodes that deform their mesh.
    deformed: HashMap<NodeId, Vec<u32>>,
}

impl PrimitiveTable {
    /// The primitives of a mesh that have triangles, in order.
    pub fn uses_of(&self, mesh: MeshId) -> &[PrimitiveUse] {
        self.uses_at(Store::<_, ()>::slot(mesh))
    }

    /// As [`PrimitiveTable::uses_of`], by slot.
    #[inline]
    pub fn uses_at(&self, slot: usize) -> &[PrimitiveUse] {
        &self.uses[self.first_use[slot] as usize..self.first_use[slot + 1] as usize]
    }

    /// The RenderPrimitives of a node that deforms its mesh, parallel to [`PrimitiveTable::uses_of`] its mesh.
    pub fn deformed(&self, node: NodeId) -> Option<&[u32]> {
        self.deformed.get(&node).map(Vec::as_slice)
    }

    /// The nodes that deform their meshes, with their RenderPrimitives.
    pub(super) fn deformed_nodes(&self) -> impl Iterator<Item = (NodeId, &[u32])> {
        self.deformed.iter().map(|(&node, slots)| (node, slots.as_slice()))
    }

    /// Whether any node deforms its mesh.
    pub fn has_deformed(&self) -> bool {
        !self.deformed.is_empty()
    }
}

/// What makes two primitives the same geometry.
#[derive(PartialEq, Eq, Hash)]
struct GeometryKey<'a> {
    attributes: &'a Attributes,
    indices: Option<AccessorId>,
    mode: PrimitiveMode,
    targets: &'a [Attributes],
}

/// Whether a node's mesh is deformed by its pose.
pub fn is_deformed(node: &Node, scene: &Scene) -> bool {
    let Some(mesh) = node.mesh else { return false };
    node.skin.is_some() || scene.meshes()[mesh].primitives.iter().any(|p| !p.targets.is_empty())
}

/// Whether a primitive makes triangles.
pub fn has_triangles(scene: &Scene, primitive: &Primitive) -> bool {
    let Some(position) = primitive.attributes.get("POSITION") else { return false };
    let count = scene.accessors()[primitive.indices.unwrap_or(position)].count;
    triangle_index_count(primitive.mode, count) > 0
}

impl<'a> GeometryKey<'a> {
    fn of(primitive: &'a Primitive) -> Self {
        Self {
            attributes: &primitive.attributes,
            indices: primitive.indices,
            mode: primitive.mode,
            targets: &primitive.targets,
        }
    }
}

/// Every distinct primitive that makes triangles, by mesh and then by primitive; none is deformed, and none has tangents.
pub fn distinct(scene: &Scene) -> Vec<RenderPrimitive> {
    let mut known: HashSet<GeometryKey> = HashSet::new();
    let mut primitives = Vec::new();
    for (mesh, object) in scene.meshes().iter() {
        for (index, primitive) in object.primitives.iter().enumerate() {
            if has_triangles(scene, primitive) && known.insert(GeometryKey::of(primitive)) {
                primitives.push(RenderPrimitive { mesh, primitive: index, deformed_by: None, tangents_from_uv: None });
            }
        }
    }
    primitives
}

/// What is said of primitives without triangles, if there are any.
pub fn skipped_primitives(count: usize) -> Option<DeriveWarning> {
    let what = "primitives have no triangles (points, lines or no positions): they are kept, but not rendered";
    (count > 0).then(|| DeriveWarning { place: "/meshes".into(), what: format!("{count} {what}") })
}

/// Registers all RenderPrimitives.
pub fn register(scene: &Scene, variant: Option<VariantId>, warnings: &mut Vec<DeriveWarning>) -> PrimitiveTable {
    let mut table = PrimitiveTable::default();
    let users = mesh_users(scene);
    let mut known: HashMap<GeometryKey, u32> = HashMap::new();
    let mut skipped = 0usize;
    let mut first_use = vec![0u32; scene.meshes().slot_bound() + 1];
    // Slots in use ascend in iteration order, so the ranges of unused slots are empty.
    let mut next_slot = 0;
    for (mesh_id, mesh) in scene.meshes().iter() {
        let slot = Store::<_, ()>::slot(mesh_id);
        first_use[next_slot..=slot].fill(table.uses.len() as u32);
        next_slot = slot + 1;
        for (index, primitive) in mesh.primitives.iter().enumerate() {
            if !has_triangles(scene, primitive) {
                skipped += 1;
                continue;
            }
            let render_primitive = if users[slot] == MeshUsers::DEFORMED {
                NONE
            } else {
                *known.entry(GeometryKey::of(primitive)).or_insert_with(|| {
                    table.primitives.push(RenderPrimitive {
                        mesh: mesh_id,
                        primitive: index,
                        deformed_by: None,
                        tangents_from_uv: None,
                    });
                    table.primitives.len() as u32 - 1
                })
            };
            let material = material_of(primitive, variant);
            if render_primitive != NONE {
                want_tangents(&mut table.primitives[render_primitive as usize], scene, primitive);
            }
            table.uses.push(PrimitiveUse { render_primitive, material: material_row(material) });
        }
    }
    first_use[next_slot..].fill(table.uses.len() as u32);
    table.first_use = first_use;
    warnings.extend(skipped_primitives(skipped));
    register_deformed(scene, &mut table);
    table
}

fn register_deformed(scene: &Scene, table: &mut PrimitiveTable) {
    for (node_id, node) in scene.nodes().iter() {
        let Some(mesh) = node.mesh.filter(|_| is_deformed(node, scene)) else { continue };
        let mut own = Vec::new();
        for (index, primitive) in scene.meshes()[mesh].primitives.iter().enumerate() {
            if has_triangles(scene, primitive) {
                let mut render_primitive =
                    RenderPrimitive { mesh, primitive: index, deformed_by: Some(node_id), tangents_from_uv: None };
                want_tangents(&mut render_primitive, scene, primitive);
                own.push(table.primitives.len() as u32);
                table.primitives.push(render_primitive);
            }
        }
        table.deformed.insert(node_id, own);
    }
}

/// The material of a primitive under a variant.
pub fn material_of(primitive: &Primitive, variant: Option<VariantId>) -> Option<MaterialId> {
    let mapped = variant.and_then(|v| primitive.variants.iter().find(|m| m.variants.contains(&v)));
    mapped.map(|m| m.material).or(primitive.material)
}

fn want_tangents(render_primitive: &mut RenderPrimitive, scene: &Scene, primitive: &Primitive) {
    render_primitive.tangents_from_uv = render_primitive.tangents_from_uv.or_else(|| tangents_wanted(scene, primitive));
}

/// The UV set that tangents are for, if a material has a normal map: of every material that the primitive can have, so that
/// choosing a variant changes no geometry.
pub fn tangents_wanted(scene: &Scene, primitive: &Primitive) -> Option<u32> {
    let mut materials = primitive.material.into_iter().chain(primitive.variants.iter().map(|m| m.material));
    materials.find_map(|material| {
        let info = scene.materials()[material].normal_texture.as_ref()?;
        Some(info.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord))
    })
}

#[derive(Clone, Copy, PartialEq, Eq)]
struct MeshUsers(u8);

impl MeshUsers {
    const NONE: Self = Self(0);
    /// Every user deforms the mesh.
    const DEFORMED: Self = Self(1);
    /// Some user shows it as it is.
    const STATIC: Self = Self(2);
}

fn mesh_users(scene: &Scene) -> Vec<MeshUsers> {
    let mut users = vec![MeshUsers::NONE; scene.meshes().slot_bound()];
    let deformable: Vec<bool> = {
        let mut by_slot = vec![false; users.len()];
        for (id, mesh) in scene.meshes().iter() {
            by_slot[Store::<_, ()>::slot(id)] = mesh.primitives.iter().any(|p| !p.targets.is_empty());
        }
        by_slot
    };
    for (_, node) in scene.nodes().iter() {
        if let Some(mesh) = node.mesh {
            let slot = Store::<_, ()>::slot(mesh);
            let deformed = node.skin.is_some() || deformable[slot];
            users[slot] =
                if deformed && users[slot] != MeshUsers::STATIC { MeshUsers::DEFORMED } else { MeshUsers::STATIC };
        }
    }
    users
}
