//! Which meshes may be equal: over the same geometry, with materials that look the same.

use super::changes::ChangeSet;
use super::fingerprint::fingerprint;
use crate::Scene;
use crate::model::*;
use crate::visit::{Owner, ReferenceIndex};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;

/// The meshes of a document by the fingerprint of what they show. Equal meshes have one; whether those that have one are
/// equal is for the caller to see.
///
/// A mesh is filed anew with each edit that changes it. An edit of a material is only noted, so that its cost does not grow
/// with the meshes that have the material: these are filed anew by the next search ([`Twins::refresh`]).
#[derive(Clone, Debug, Default)]
pub(super) struct Twins {
    meshes: FxHashMap<u64, BTreeSet<MeshId>>,
    filed: FxHashMap<MeshId, u64>,
    /// The fingerprints of materials by which meshes are filed.
    materials: FxHashMap<MaterialId, u64>,
    /// Materials that have been edited since.
    edited: FxHashSet<MaterialId>,
}

impl Twins {
    /// Those of a whole document: O(meshes + materials).
    pub fn of(scene: &Scene) -> Self {
        let mut twins = Self::default();
        scene.meshes.ids().for_each(|id| twins.file(scene, id));
        twins
    }

    /// Follows an edit.
    pub fn follow(&mut self, scene: &Scene, changes: &ChangeSet) {
        for &(id, _) in changes.objects() {
            match id {
                AnyId::Mesh(id) => self.file(scene, id),
                AnyId::Material(id) if !scene.contains(id) => {
                    self.materials.remove(&id);
                    self.edited.remove(&id);
                }
                AnyId::Material(id) if self.materials.contains_key(&id) => drop(self.edited.insert(id)),
                _ => {}
            }
        }
    }

    /// Files the meshes anew whose materials have been edited. Returns how many objects that took.
    pub fn refresh(&mut self, scene: &Scene, index: &ReferenceIndex) -> u64 {
        let mut visited = 0;
        for id in std::mem::take(&mut self.edited) {
            visited += 1;
            let print = scene.materials.get(id).map(fingerprint);
            if print == self.materials.get(&id).copied() {
                continue;
            }
            match print {
                Some(print) => self.materials.insert(id, print),
                None => self.materials.remove(&id),
            };
            for (owner, _) in index.referrers(id) {
                if let Owner::Object(AnyId::Mesh(mesh)) = owner {
                    visited += 1;
                    self.file(scene, mesh);
                }
            }
        }
        visited
    }

    /// The meshes that may be equal to one, itself among them, in the order of ids.
    pub fn like(&self, id: MeshId) -> impl Iterator<Item = MeshId> + '_ {
        self.filed.get(&id).and_then(|print| self.meshes.get(print)).into_iter().flatten().copied()
    }

    /// Whether another one files the same meshes in the same way.
    #[cfg(test)]
    pub fn files_as(&self, other: &Self) -> bool {
        self.meshes == other.meshes && self.filed == other.filed
    }

    fn file(&mut self, scene: &Scene, id: MeshId) {
        if let Some(print) = self.filed.remove(&id)
            && let Some(meshes) = self.meshes.get_mut(&print)
        {
            meshes.remove(&id);
            if meshes.is_empty() {
                self.meshes.remove(&print);
            }
        }
        if let Some(mesh) = scene.meshes.get(id) {
            let print = self.print(scene, mesh);
            self.filed.insert(id, print);
            self.meshes.entry(print).or_default().insert(id);
        }
    }

    fn print(&mut self, scene: &Scene, mesh: &Mesh) -> u64 {
        let mut material = |id: MaterialId| {
            *self.materials.entry(id).or_insert_with(|| scene.materials.get(id).map_or(0, fingerprint))
        };
        let primitives: Vec<_> = mesh
            .primitives
            .iter()
            .map(|p| {
                let variants: Vec<_> =
                    p.variants.iter().map(|m| (material(m.material), &m.variants, &m.extra)).collect();
                (&p.attributes, p.indices, p.mode, &p.targets, p.material.map(&mut material), variants, &p.extra)
            })
            .collect();
        fingerprint(&(primitives, &mesh.weights, &mesh.extra))
    }
}
