//! RenderPrimitives that come and go: who uses which geometry, and which slots are free.

use crate::derived::primitives::{self, PrimitiveTable, PrimitiveUse};
use crate::geometry::RenderPrimitive;
use orthant_resident::rows::NONE;
use orthant_scene::Scene;
use orthant_scene::model::{AccessorId, Attributes, MeshId, NodeId, Primitive, PrimitiveMode, Store};
use rustc_hash::FxHashMap;
use std::collections::HashMap;

/// What makes two primitives the same geometry.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct GeometryKey {
    attributes: Attributes,
    indices: Option<AccessorId>,
    mode: PrimitiveMode,
    targets: Vec<Attributes>,
}

impl GeometryKey {
    pub fn of(primitive: &Primitive) -> Self {
        Self {
            attributes: primitive.attributes.clone(),
            indices: primitive.indices,
            mode: primitive.mode,
            targets: primitive.targets.clone(),
        }
    }
}

impl GeometryKey {
    /// An accessor that every mesh with this geometry refers to.
    pub fn accessor(&self) -> Option<AccessorId> {
        self.attributes.get("POSITION")
    }
}

/// A primitive of a mesh that makes triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshUse {
    /// Its position in the mesh.
    pub primitive: usize,
    /// Its geometry.
    pub key: GeometryKey,
    /// Its RenderPrimitive, or [`NONE`] as long as no node shows it undeformed.
    pub render_primitive: u32,
    /// Its material row, the variant applied.
    pub material: u32,
}

/// The RenderPrimitives of a node that deforms its mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformed {
    /// The mesh when they were made.
    pub mesh: MeshId,
    /// The geometry when they were made.
    pub keys: Vec<GeometryKey>,
    /// Parallel to the uses of the mesh.
    pub render_primitives: Vec<u32>,
}

/// Who uses which geometry.
#[derive(Clone, Debug, Default)]
pub struct Registry {
    static_slots: HashMap<GeometryKey, u32>,
    /// By RenderPrimitive: primitives of meshes that use it (1 for a deformed one, 0 for a free slot).
    users: Vec<u32>,
    free: Vec<u32>,
    /// By mesh slot: the mesh that is in it, and its uses.
    meshes: Vec<(MeshId, Vec<MeshUse>)>,
    deformed: FxHashMap<NodeId, Deformed>,
}

impl Registry {
    /// What a full derivation has registered.
    pub fn new(scene: &Scene, table: &PrimitiveTable) -> Self {
        let mut registry = Self { users: vec![0; table.primitives.len()], ..Self::default() };
        registry.meshes.resize(scene.meshes().slot_bound(), (MeshId::NULL, Vec::new()));
        for (id, mesh) in scene.meshes().iter() {
            let drawn = mesh.primitives.iter().enumerate().filter(|(_, p)| primitives::has_triangles(scene, p));
            let uses = drawn.zip(table.uses_of(id)).map(|((i, primitive), use_)| {
                let key = GeometryKey::of(primitive);
                if use_.render_primitive != NONE {
                    registry.users[use_.render_primitive as usize] += 1;
                    registry.static_slots.insert(key.clone(), use_.render_primitive);
                }
                MeshUse { primitive: i, key, render_primitive: use_.render_primitive, material: use_.material }
            });
            let uses: Vec<MeshUse> = uses.collect();
            registry.meshes[Store::<_, ()>::slot(id)] = (id, uses);
        }
        for (node, render_primitives) in table.deformed_nodes() {
            let Some(mesh) = scene.nodes()[node].mesh else { continue };
            let keys = registry.uses(mesh).iter().map(|use_| use_.key.clone()).collect();
            render_primitives.iter().for_each(|&slot| registry.users[slot as usize] = 1);
            registry.deformed.insert(node, Deformed { mesh, keys, render_primitives: render_primitives.to_vec() });
        }
        registry
    }

    /// The drawn primitives of a mesh.
    pub fn uses(&self, mesh: MeshId) -> &[MeshUse] {
        let found = self.meshes.get(Store::<_, ()>::slot(mesh)).filter(|(id, _)| *id == mesh);
        found.map_or(&[], |(_, uses)| uses.as_slice())
    }

    /// The same as render nodes refer to them.
    pub fn primitive_uses(&self, mesh: MeshId, out: &mut Vec<PrimitiveUse>) {
        let of = |use_: &MeshUse| PrimitiveUse { render_primitive: use_.render_primitive, material: use_.material };
        out.clear();
        out.extend(self.uses(mesh).iter().map(of));
    }

    /// Replaces the uses of a mesh. RenderPrimitives that nobody uses any more come back.
    pub fn set_uses(&mut self, mesh: MeshId, uses: Vec<MeshUse>) -> Vec<u32> {
        let slot = Store::<_, ()>::slot(mesh);
        if slot >= self.meshes.len() {
            self.meshes.resize(slot + 1, (MeshId::NULL, Vec::new()));
        }
        if uses.is_empty() && self.meshes[slot].0 != mesh {
            // It is gone, and another has taken its slot already.
            return Vec::new();
        }
        for use_ in uses.iter().filter(|use_| use_.render_primitive != NONE) {
            self.users[use_.render_primitive as usize] += 1;
        }
        let (_, old) = std::mem::replace(&mut self.meshes[slot], (mesh, uses));
        let mut unused = Vec::new();
        for use_ in old.into_iter().filter(|use_| use_.render_primitive != NONE) {
            let users = &mut self.users[use_.render_primitive as usize];
            *users -= 1;
            if *users == 0 {
                self.static_slots.remove(&use_.key);
                unused.push(use_.render_primitive);
            }
        }
        unused
    }

    /// The RenderPrimitive of undeformed geometry, if there is one.
    pub fn static_slot(&self, key: &GeometryKey) -> Option<u32> {
        self.static_slots.get(key).copied()
    }

    /// Gives a use of a mesh its RenderPrimitive.
    pub fn bind(&mut self, mesh: MeshId, use_: usize, slot: u32) {
        let use_ = &mut self.meshes[Store::<_, ()>::slot(mesh)].1[use_];
        use_.render_primitive = slot;
        self.users[slot as usize] += 1;
        self.static_slots.insert(use_.key.clone(), slot);
    }

    /// A slot for a new RenderPrimitive: a free one, or the next.
    pub fn take_slot(&mut self, primitives: &mut Vec<RenderPrimitive>, new: RenderPrimitive) -> u32 {
        match self.free.pop() {
            Some(slot) => {
                primitives[slot as usize] = new;
                slot
            }
            None => {
                primitives.push(new);
                self.users.push(0);
                primitives.len() as u32 - 1
            }
        }
    }

    /// Gives a slot back.
    pub fn free_slot(&mut self, slot: u32) {
        self.users[slot as usize] = 0;
        self.free.push(slot);
    }

    /// The free slots.
    pub fn free(&self) -> &[u32] {
        &self.free
    }

    /// The slots that some mesh or node uses; those that several use come several times.
    pub fn in_use(&self) -> impl Iterator<Item = u32> + '_ {
        let shared = self.meshes.iter().flat_map(|(_, uses)| uses).map(|use_| use_.render_primitive);
        let own = self.deformed.values().flat_map(|deformed| &deformed.render_primitives).copied();
        shared.filter(|&slot| slot != NONE).chain(own)
    }

    pub fn deformed(&self, node: NodeId) -> Option<&Deformed> {
        self.deformed.get(&node)
    }

    pub fn set_deformed(&mut self, node: NodeId, deformed: Deformed) {
        deformed.render_primitives.iter().for_each(|&slot| self.users[slot as usize] = 1);
        self.deformed.insert(node, deformed);
    }

    pub fn take_deformed(&mut self, node: NodeId) -> Option<Deformed> {
        self.deformed.remove(&node)
    }
}
