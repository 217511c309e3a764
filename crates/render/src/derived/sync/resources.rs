//! Meshes, materials, lights and skins that were touched, and the nodes that show them.

use super::Sync;
use super::dirty::same_bytes;
use super::registry::{GeometryKey, MeshUse};
use crate::DeriveError;
use crate::derived::material_row;
use crate::derived::primitives::{has_triangles, material_of, skipped_primitives};
use crate::derived::render_nodes::node_flags;
use crate::geometry::RenderPrimitive;
use glam::Vec3;
use orthant_resident::rows::{MaterialRow, MeshDesc, NONE};
use orthant_scene::Scene;
use orthant_scene::edit::{ChangeSet, Facets};
use orthant_scene::model::{AnyId, Material, MaterialId, MeshId, NodeId, Store};
use orthant_scene::visit::Owner;
use std::collections::BTreeSet;

/// The UV set of a material's normal map.
fn tangent_set(material: &Material) -> Option<u32> {
    let info = material.normal_texture.as_ref()?;
    Some(info.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord))
}

/// [`tangent_set`] of all materials, by row.
pub(super) fn tangent_sets(scene: &Scene) -> Vec<Option<u32>> {
    let mut sets = vec![None; scene.materials().slot_bound() + 1];
    for (id, material) in scene.materials().iter() {
        sets[material_row(Some(id)) as usize] = tangent_set(material);
    }
    sets
}

impl Sync<'_> {
    pub(super) fn resources(&mut self, changes: &ChangeSet) -> Result<(), DeriveError> {
        let mut meshes = BTreeSet::new();
        let mut new = BTreeSet::new();
        let mut materials = BTreeSet::new();
        for &(id, facets) in changes.objects() {
            match id {
                AnyId::Mesh(id) => {
                    meshes.insert(id);
                    if facets.has(Facets::ADDED) {
                        new.insert(id);
                    }
                }
                AnyId::Material(id) => drop(materials.insert(id)),
                AnyId::Light(id) => self.touch_users(id),
                AnyId::Skin(id) => {
                    let users = self.users(id);
                    self.work.poses.extend(&users);
                    self.work.nodes.extend(users);
                }
                _ => {}
            }
        }
        let variant = self.live.asked_variant.or(self.scene.shown_variant());
        if variant != self.live.variant {
            self.live.variant = variant;
            let has_variants =
                |mesh: &orthant_scene::model::Mesh| mesh.primitives.iter().any(|p| !p.variants.is_empty());
            meshes.extend(self.scene.meshes().iter().filter(|(_, mesh)| has_variants(mesh)).map(|(id, _)| id));
        }
        for id in materials {
            self.material(id, &mut meshes)?;
        }
        // Those that are gone come last: what they shared stays.
        let (live, gone): (Vec<MeshId>, Vec<MeshId>) = meshes.into_iter().partition(|&id| self.scene.contains(id));
        let mut skipped = 0;
        for id in live {
            let without_triangles = self.mesh(id)?;
            if new.contains(&id) {
                skipped += without_triangles;
                self.work.new_meshes.push(id);
            }
        }
        self.derived.warnings.extend(skipped_primitives(skipped));
        gone.into_iter().for_each(|id| self.set_uses(id, Vec::new()));
        Ok(())
    }

    /// The nodes that refer to an object.
    pub(super) fn users(&self, id: impl Into<AnyId>) -> Vec<NodeId> {
        let Some(index) = self.scene.reference_index() else { return Vec::new() };
        let users = index.referrers(id).filter_map(|(owner, _)| match owner {
            Owner::Object(AnyId::Node(node)) => Some(node),
            _ => None,
        });
        users.collect()
    }

    fn touch_users(&mut self, id: impl Into<AnyId>) {
        let users = self.users(id);
        self.work.nodes.extend(users);
    }

    /// Follows a mesh. Returns how many of its primitives have no triangles.
    fn mesh(&mut self, id: MeshId) -> Result<usize, DeriveError> {
        let mesh = &self.scene.meshes()[id];
        let mut uses = Vec::with_capacity(mesh.primitives.len());
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            if !has_triangles(self.scene, primitive) {
                continue;
            }
            let key = GeometryKey::of(primitive);
            let render_primitive = self.live.registry.static_slot(&key).unwrap_or(NONE);
            if render_primitive != NONE {
                self.want_tangents(render_primitive, id, i)?;
            }
            let material = material_row(material_of(primitive, self.live.variant));
            uses.push(MeshUse { primitive: i, key, render_primitive, material });
        }
        let skipped = mesh.primitives.len() - uses.len();
        self.set_uses(id, uses);
        self.touch_users(id);
        Ok(skipped)
    }

    fn set_uses(&mut self, mesh: MeshId, uses: Vec<MeshUse>) {
        let shared: Vec<(u32, GeometryKey)> = self
            .live
            .registry
            .uses(mesh)
            .iter()
            .filter(|use_| use_.render_primitive != NONE)
            .map(|use_| (use_.render_primitive, use_.key.clone()))
            .collect();
        for slot in self.live.registry.set_uses(mesh, uses) {
            self.free_primitive(slot);
        }
        for (slot, key) in shared {
            if self.derived.primitives[slot as usize].mesh == mesh {
                self.find_again(slot, &key);
            }
        }
    }

    /// Shared geometry is decoded from a mesh that has it; if that one has changed or gone, there is another.
    fn find_again(&mut self, slot: u32, key: &GeometryKey) {
        let another = self.sharing(key).next();
        if let Some((mesh, primitive)) = another {
            let found = &mut self.derived.primitives[slot as usize];
            (found.mesh, found.primitive) = (mesh, primitive);
        }
    }

    /// The primitives of the document that are this geometry, shown or not: mesh, and place in it.
    pub(super) fn sharing<'k>(&'k self, key: &'k GeometryKey) -> impl Iterator<Item = (MeshId, usize)> + 'k {
        let index = self.scene.reference_index();
        let referrers = index.zip(key.accessor()).into_iter().flat_map(|(index, id)| index.referrers(id));
        let meshes = referrers.filter_map(|(owner, _)| match owner {
            Owner::Object(AnyId::Mesh(mesh)) => Some(mesh),
            _ => None,
        });
        meshes.flat_map(move |mesh| {
            let primitives = self.scene.meshes()[mesh].primitives.iter().enumerate();
            primitives.filter(|(_, primitive)| GeometryKey::of(primitive) == *key).map(move |(i, _)| (mesh, i))
        })
    }

    /// Takes geometry away for good.
    pub(super) fn free_primitive(&mut self, slot: u32) {
        let desc = &mut self.derived.mesh_descs[slot as usize];
        self.live.store.remove(desc);
        *desc = MeshDesc { first_tangent: NONE, first_emitter_triangle: NONE, ..bytemuck::Zeroable::zeroed() };
        self.derived.primitives[slot as usize] = RenderPrimitive::FREE;
        self.live.dirty.mesh_descs.mark(slot);
        self.live.dirty.blas_builds.remove(&slot);
        self.live.dirty.blas_updates.remove(&slot);
        self.live.dirty.blas_frees.insert(slot);
        self.live.registry.free_slot(slot);
    }

    fn material(&mut self, id: MaterialId, meshes: &mut BTreeSet<MeshId>) -> Result<(), DeriveError> {
        let row = Store::<_, ()>::slot(id) + 1;
        if row >= self.derived.materials.len() {
            self.derived.materials.resize(row + 1, MaterialRow::DEFAULT);
            self.live.mean_emission.resize(row + 1, Vec3::ONE);
        }
        let is_there = self.scene.contains(id);
        let (new, mean) = if is_there {
            self.material_row(id)?
        } else {
            self.live.textures.forget(row as u32);
            (MaterialRow::DEFAULT, Vec3::ONE)
        };
        let old = std::mem::replace(&mut self.derived.materials[row], new);
        let old_mean = std::mem::replace(&mut self.live.mean_emission[row], mean);
        if !same_bytes(&old, &new) {
            self.live.dirty.materials.mark(row as u32);
        }
        let shines = |row: &MaterialRow| (row.emissive, row.flags);
        let flags_changed = node_flags(&old) != node_flags(&new);
        let emission_changed = shines(&old) != shines(&new) || old_mean != mean;
        // What the document says counts, also where the image of the normal map is missing.
        let wanted = self.scene.materials().get(id).and_then(tangent_set);
        if row >= self.live.tangent_sets.len() {
            self.live.tangent_sets.resize(row + 1, None);
        }
        let tangents_changed = std::mem::replace(&mut self.live.tangent_sets[row], wanted) != wanted;
        if !flags_changed && !emission_changed && !tangents_changed {
            return Ok(());
        }
        let Some(index) = self.scene.reference_index() else { return Ok(()) };
        let users: Vec<MeshId> = index
            .referrers(id)
            .filter_map(|(owner, _)| match owner {
                Owner::Object(AnyId::Mesh(mesh)) => Some(mesh),
                _ => None,
            })
            .collect();
        for mesh in users {
            if tangents_changed {
                meshes.insert(mesh);
                for node in self.users(mesh) {
                    if self.derived.hierarchy.get(node).is_some_and(|node| node.deformed) {
                        self.release_deformed(node);
                    }
                }
            }
            self.touch_users(mesh);
        }
        Ok(())
    }
}
