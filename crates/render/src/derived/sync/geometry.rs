//! Geometry that comes, goes, or is deformed anew.

use super::Sync;
use super::registry::{Deformed, GeometryKey};
use crate::DeriveError;
use crate::budget::Budget;
use crate::derived::primitives::tangents_wanted;
use crate::geometry::{GeometryPlan, GeometryStreams, Piece, RenderPrimitive, SkinPose};
use orthant_resident::rows::{MeshDesc, NONE};
use orthant_scene::model::{MeshId, NodeId};
use std::collections::BTreeSet;

/// How far a joint may be from where it was, relative to the size of the matrix, before the mesh is deformed anew: moving a
/// whole figure moves its joints against their common ancestor by rounding alone.
const POSE_TOLERANCE: f64 = 1e-9;

impl Sync<'_> {
    /// Makes sure that everything that is shown has its geometry.
    pub(super) fn geometry(&mut self) -> Result<(), DeriveError> {
        let mut next = 0;
        let mut posed = BTreeSet::new();
        while let Some(&id) = self.work.refill.get(next) {
            next += 1;
            let Some(entry) = self.derived.hierarchy.entry(id) else { continue };
            let deformed = self.is_deformed(id);
            let mesh = self.mesh_slot(id);
            let instanced = self.scene.nodes()[id].instancing.is_some();
            let node = &mut self.derived.hierarchy.nodes[entry as usize];
            let was_deformed = std::mem::replace(&mut node.deformed, deformed);
            (node.mesh, node.instanced) = (mesh, instanced);
            if was_deformed && !deformed {
                self.release_deformed(id);
            }
            let Some(mesh) = self.scene.nodes()[id].mesh else { continue };
            if deformed {
                self.deform(id, mesh)?;
                posed.insert(id);
            } else {
                self.show(mesh)?;
            }
        }
        for id in std::mem::take(&mut self.work.poses) {
            let is_shown = self.derived.hierarchy.get(id).is_some_and(|node| node.deformed);
            if is_shown && self.scene.contains(id) && !posed.contains(&id) {
                if let Some(mesh) = self.scene.nodes()[id].mesh {
                    self.deform(id, mesh)?;
                }
                // Its frame follows the joints.
                self.work.refill(id);
            }
        }
        Ok(())
    }

    /// Decodes, and drops, geometry that is new and that nothing shows: a full derivation decodes it too, and what that
    /// refuses must not come into the document unnoticed.
    pub(super) fn prove_unshown(&self) -> Result<(), DeriveError> {
        for &mesh in &self.work.new_meshes {
            let is_deformed = self.users(mesh).iter().any(|node| self.live.poses.contains_key(node));
            for use_ in self.live.registry.uses(mesh).iter().filter(|_| !is_deformed) {
                if use_.render_primitive == NONE && self.live.registry.static_slot(&use_.key).is_none() {
                    let primitive = use_.primitive;
                    let unshown = RenderPrimitive { mesh, primitive, deformed_by: None, tangents_from_uv: None };
                    self.decode(std::slice::from_ref(&unshown), false, None)?;
                }
            }
        }
        Ok(())
    }

    fn decode(
        &self,
        primitives: &[RenderPrimitive],
        emissive: bool,
        pose: Option<&SkinPose>,
    ) -> Result<GeometryStreams, DeriveError> {
        let emissive = vec![emissive; primitives.len()];
        GeometryPlan::new(self.scene, primitives, &emissive, &Budget::new(self.live.bytes_left()))?
            .decode(&|_| pose.cloned())
    }

    /// Gives new geometry its place and its BLAS.
    fn place(&mut self, slot: u32, streams: &GeometryStreams, desc: &MeshDesc) -> Result<(), DeriveError> {
        let placed = self
            .live
            .store
            .insert(&Piece::of(streams, desc))
            .map_err(|full| DeriveError::new("/meshes", full.to_string(), "remove meshes that nothing shows"))?;
        let descs = &mut self.derived.mesh_descs;
        if slot as usize >= descs.len() {
            descs.resize(slot as usize + 1, bytemuck::Zeroable::zeroed());
        }
        descs[slot as usize] = placed;
        self.live.dirty.mesh_descs.mark(slot);
        self.live.dirty.blas_frees.remove(&slot);
        if placed.index_count > 0 {
            self.live.dirty.blas_builds.insert(slot);
        }
        Ok(())
    }

    /// Registers the geometry of a mesh that some node shows undeformed.
    fn show(&mut self, mesh: MeshId) -> Result<(), DeriveError> {
        for i in 0..self.live.registry.uses(mesh).len() {
            let use_ = &self.live.registry.uses(mesh)[i];
            if use_.render_primitive != NONE {
                continue;
            }
            let (primitive, key) = (use_.primitive, use_.key.clone());
            let slot = match self.live.registry.static_slot(&key) {
                Some(slot) => {
                    // Another new mesh has it, whose materials may want no tangents.
                    self.want_tangents(slot, mesh, primitive)?;
                    slot
                }
                None => {
                    // As at load, tangents are made if any mesh of the document wants them of this geometry.
                    let source = &self.scene.meshes()[mesh].primitives[primitive];
                    let tangents_from_uv = tangents_wanted(self.scene, source).or_else(|| {
                        let mut others = self.sharing(&key);
                        others
                            .find_map(|(mesh, i)| tangents_wanted(self.scene, &self.scene.meshes()[mesh].primitives[i]))
                    });
                    let new = RenderPrimitive { mesh, primitive, deformed_by: None, tangents_from_uv };
                    let streams = self.decode(std::slice::from_ref(&new), false, None)?;
                    let slot = self.live.registry.take_slot(&mut self.derived.primitives, new);
                    self.place(slot, &streams, &streams.mesh_descs[0])?;
                    slot
                }
            };
            self.live.registry.bind(mesh, i, slot);
        }
        Ok(())
    }

    /// Makes or renews what a node deforms.
    fn deform(&mut self, id: NodeId, mesh: MeshId) -> Result<(), DeriveError> {
        let keys: Vec<GeometryKey> = self.live.registry.uses(mesh).iter().map(|use_| use_.key.clone()).collect();
        let pose = self.derived.hierarchy.skin_pose(self.posed, id);
        let known = self.live.registry.deformed(id).filter(|d| d.mesh == mesh && d.keys == keys);
        let Some(slots) = known.map(|d| d.render_primitives.clone()) else {
            self.release_deformed(id);
            return self.deform_new(id, mesh, keys, pose);
        };
        if self.live.poses.get(&id).is_some_and(|before| same_pose(before, &pose)) {
            return Ok(());
        }
        let primitives: Vec<RenderPrimitive> =
            slots.iter().map(|&slot| self.derived.primitives[slot as usize].clone()).collect();
        for (&slot, primitive) in slots.iter().zip(&primitives) {
            let old = self.derived.mesh_descs[slot as usize];
            let emits = old.first_emitter_triangle != NONE;
            let streams = self.decode(std::slice::from_ref(primitive), emits, Some(&pose))?;
            let piece = Piece::of(&streams, &streams.mesh_descs[0]);
            self.live.store.rewrite(&old, piece.positions, piece.vertices, piece.tangents);
            let desc = &mut self.derived.mesh_descs[slot as usize];
            if emits {
                self.live.store.set_emitter_triangles(desc, piece.emitter_triangles).map_err(|full| {
                    DeriveError::new("/meshes", full.to_string(), "remove meshes that nothing shows")
                })?;
            }
            (desc.flags, desc.area) = (piece.desc.flags, piece.desc.area);
            (desc.bounds_min, desc.bounds_max) = (piece.desc.bounds_min, piece.desc.bounds_max);
            self.live.dirty.mesh_descs.mark(slot);
            self.live.dirty.blas_updates.insert(slot);
        }
        self.live.tlas.deformed();
        self.live.poses.insert(id, pose);
        Ok(())
    }

    fn deform_new(
        &mut self,
        id: NodeId,
        mesh: MeshId,
        keys: Vec<GeometryKey>,
        pose: SkinPose,
    ) -> Result<(), DeriveError> {
        let mut slots = Vec::with_capacity(keys.len());
        for i in 0..keys.len() {
            let primitive = self.live.registry.uses(mesh)[i].primitive;
            let source = &self.scene.meshes()[mesh].primitives[primitive];
            let tangents_from_uv = tangents_wanted(self.scene, source);
            let new = RenderPrimitive { mesh, primitive, deformed_by: Some(id), tangents_from_uv };
            let streams = self.decode(std::slice::from_ref(&new), false, Some(&pose))?;
            let slot = self.live.registry.take_slot(&mut self.derived.primitives, new);
            self.place(slot, &streams, &streams.mesh_descs[0])?;
            slots.push(slot);
        }
        self.live.registry.set_deformed(id, Deformed { mesh, keys, render_primitives: slots });
        self.live.poses.insert(id, pose);
        Ok(())
    }

    /// Takes away what a node deforms.
    pub(super) fn release_deformed(&mut self, id: NodeId) {
        self.live.poses.remove(&id);
        if let Some(deformed) = self.live.registry.take_deformed(id) {
            deformed.render_primitives.into_iter().for_each(|slot| self.free_primitive(slot));
        }
    }

    /// Gives shared geometry tangents, if a material of a use of it wants others than it has. Its BLAS is the same, but its
    /// place is another.
    pub(super) fn want_tangents(&mut self, slot: u32, mesh: MeshId, primitive: usize) -> Result<(), DeriveError> {
        let has = self.derived.primitives[slot as usize].tangents_from_uv;
        let wanted = tangents_wanted(self.scene, &self.scene.meshes()[mesh].primitives[primitive]);
        // The mesh that it was found at first may be gone.
        let found = RenderPrimitive { mesh, primitive, deformed_by: None, tangents_from_uv: wanted.or(has) };
        self.derived.primitives[slot as usize] = found;
        if wanted.is_none() || has == wanted {
            return Ok(());
        }
        let old = self.derived.mesh_descs[slot as usize];
        let emits = old.first_emitter_triangle != NONE;
        let primitive = self.derived.primitives[slot as usize].clone();
        let streams = self.decode(std::slice::from_ref(&primitive), emits, None)?;
        self.live.store.remove(&old);
        self.place(slot, &streams, &streams.mesh_descs[0])
    }

    /// Gives geometry its area table: a material that emits shows it now.
    pub(super) fn want_areas(&mut self, slot: u32, mesh: MeshId, use_: usize) -> Result<(), DeriveError> {
        if self.derived.mesh_descs[slot as usize].first_emitter_triangle != NONE {
            return Ok(());
        }
        let mut primitive = self.derived.primitives[slot as usize].clone();
        (primitive.mesh, primitive.primitive) = (mesh, self.live.registry.uses(mesh)[use_].primitive);
        let pose = primitive.deformed_by.map(|id| self.derived.hierarchy.skin_pose(self.posed, id));
        let streams = self.decode(std::slice::from_ref(&primitive), true, pose.as_ref())?;
        let new = streams.mesh_descs[0];
        let table = Piece::of(&streams, &new).emitter_triangles;
        let desc = &mut self.derived.mesh_descs[slot as usize];
        self.live
            .store
            .set_emitter_triangles(desc, table)
            .map_err(|full| DeriveError::new("/meshes", full.to_string(), "remove meshes that nothing shows"))?;
        (desc.flags, desc.area) = (new.flags, new.area);
        self.live.dirty.mesh_descs.mark(slot);
        Ok(())
    }
}

fn same_pose(a: &SkinPose, b: &SkinPose) -> bool {
    let same = |a: &glam::DAffine3, b: &glam::DAffine3| {
        let size = b.to_cols_array().iter().fold(1.0f64, |size, v| size.max(v.abs()));
        a.abs_diff_eq(*b, POSE_TOLERANCE * size)
    };
    a.weights == b.weights
        && a.joints.len() == b.joints.len()
        && a.joints.iter().zip(&b.joints).all(|(a, b)| same(a, b))
}
