//! Rows of render nodes, lights and emitters.

use super::Sync;
use super::dirty::same_bytes;
use crate::DeriveError;
use crate::derived::emitters::{emitter_row, shines};
use crate::derived::lights;
use crate::derived::render_nodes::{InstanceTemplate, Instances, instance_count, node_flags};
use orthant_resident::rows::{EmitterRow, LightRow, NONE, NodeFlags, RenderNodeRow};
use orthant_scene::model::{MeshId, NodeId, Store};

impl Sync<'_> {
    pub(super) fn rows(&mut self) -> Result<(), DeriveError> {
        for id in std::mem::take(&mut self.work.refill) {
            if let Some(entry) = self.derived.hierarchy.entry(id) {
                self.fill(id, entry)?;
                self.light(id, entry);
            }
        }
        Ok(())
    }

    /// The rows of a node, instance by instance, primitive by primitive.
    fn fill(&mut self, id: NodeId, entry: u32) -> Result<(), DeriveError> {
        let Some(mesh) = self.scene.nodes()[id].mesh else {
            self.release_render_nodes(entry);
            return Ok(());
        };
        let mut uses = Vec::new();
        self.live.registry.primitive_uses(mesh, &mut uses);
        let deformed = self.live.registry.deformed(id).map(|d| d.render_primitives.clone());
        let node = self.derived.hierarchy.nodes[entry as usize];
        let instancing = self.scene.nodes()[id].instancing.as_deref();
        let count = uses.len().saturating_mul(if instancing.is_some() { instance_count(self.scene, &node) } else { 1 });
        let bytes = (count as u64).saturating_mul(size_of::<RenderNodeRow>() as u64);
        if bytes > self.live.max_bytes {
            let what =
                format!("its {count} render nodes need {bytes} bytes, over the limit of {}", self.live.max_bytes);
            let place = format!("/nodes/{}", Store::<_, ()>::slot(id));
            return Err(DeriveError::new(place, what, "raise --max-memory, or use fewer instances"));
        }
        let instances = match instancing {
            Some(instancing) => Some(Instances::read(self.scene, instancing, &node)?),
            None => None,
        };
        let instance_count = if instancing.is_some() { instance_count(self.scene, &node) } else { 1 };
        let first = u32::try_from(count).ok().and_then(|count| self.claim_render_nodes(entry, count));
        let Some(first) = first else {
            let what = format!("the scene has too many render nodes; at most {} fit", NONE - 1);
            return Err(DeriveError::new(format!("/nodes/{}", Store::<_, ()>::slot(id)), what, "split the file"));
        };
        let world = if node.deformed { self.derived.hierarchy.frame(self.posed, id) } else { node.world };
        let mut row = first;
        for i in 0..instance_count {
            let world = instances.as_ref().map_or(world, |instances| world * instances.get(i));
            let template = InstanceTemplate::new(&world, self.derived.origin, id, node.visible);
            for (k, use_) in uses.iter().enumerate() {
                let primitive = deformed.as_ref().map_or(use_.render_primitive, |d| d[k]);
                let flags = node_flags(&self.derived.materials[use_.material as usize]);
                let has_triangles = self.derived.mesh_descs[primitive as usize].index_count > 0;
                let mut new = template.row(primitive, use_.material, flags, has_triangles);
                new.emitter = self.derived.render_nodes[row as usize].emitter;
                if new.emitter != NONE || shines(&self.derived.materials[use_.material as usize]) {
                    self.work.emission.push(row);
                }
                self.write_row(row, new);
                // The row may be what it was, and its geometry another.
                if self.live.dirty.mesh_descs.is_marked(primitive) {
                    self.live.extent.reshaped(row);
                    self.live.tlas.reshaped(row, &new, &self.derived.mesh_descs);
                }
                row += 1;
            }
        }
        Ok(())
    }

    /// Writes a render-node row, if it is another.
    pub(super) fn write_row(&mut self, index: u32, new: RenderNodeRow) {
        let old = self.put_row(index, new);
        if old.emitter != NONE && new.emitter == NONE {
            self.release_emitter(old.emitter);
        }
    }

    /// Writes a render-node row, if it is another, and nothing else; the row that it was.
    pub(super) fn put_row(&mut self, index: u32, new: RenderNodeRow) -> RenderNodeRow {
        let old = std::mem::replace(&mut self.derived.render_nodes[index as usize], new);
        if !same_bytes(&old, &new) {
            self.live.dirty.render_nodes.mark(index);
            self.live.tlas.change(index, &old, &new, &self.derived.mesh_descs);
        }
        old
    }

    fn release_emitter(&mut self, emitter: u32) {
        self.derived.emitters[emitter as usize] = EmitterRow::HOLE;
        self.live.dirty.emitters.mark(emitter);
        self.live.free_emitters.push(emitter);
    }

    /// The rows of what emits.
    pub(super) fn emission(&mut self) -> Result<(), DeriveError> {
        let mut rows = std::mem::take(&mut self.work.emission);
        rows.sort_unstable();
        rows.dedup();
        for index in rows {
            let row = self.derived.render_nodes[index as usize];
            if row.flags & NodeFlags::OCCUPIED == 0 {
                continue;
            }
            let material = self.derived.materials[row.material as usize];
            let mean = self.live.mean_emission[row.material as usize];
            if row.flags & NodeFlags::VISIBLE != 0
                && shines(&material)
                && let Some((mesh, use_)) = self.use_of(index)
            {
                self.want_areas(row.primitive, mesh, use_)?;
            }
            let desc = &self.derived.mesh_descs[row.primitive as usize];
            let mut new = row;
            match emitter_row(index, &row, desc, &material, mean) {
                Some(emitter) => {
                    let slot = match row.emitter {
                        NONE => self.live.free_emitters.pop().unwrap_or_else(|| {
                            self.derived.emitters.push(EmitterRow::HOLE);
                            self.derived.emitters.len() as u32 - 1
                        }),
                        slot => slot,
                    };
                    let old = std::mem::replace(&mut self.derived.emitters[slot as usize], emitter);
                    if !same_bytes(&old, &emitter) {
                        self.live.dirty.emitters.mark(slot);
                    }
                    new.emitter = slot;
                }
                None => new.emitter = NONE,
            }
            self.write_row(index, new);
        }
        Ok(())
    }

    /// The mesh that a render node shows, and which of its uses.
    fn use_of(&self, index: u32) -> Option<(MeshId, usize)> {
        let entry = *self.derived.owners.get(index as usize)?;
        let node = self.derived.hierarchy.nodes.get(entry as usize)?;
        let mesh = self.scene.nodes().get(node.node)?.mesh?;
        let uses = self.live.registry.uses(mesh).len();
        (uses > 0).then(|| (mesh, (index - node.first_render_node) as usize % uses))
    }

    /// The light of a node.
    fn light(&mut self, id: NodeId, entry: u32) {
        let node = self.derived.hierarchy.nodes[entry as usize];
        let Some(row) = lights::row(self.posed, &node, self.derived.origin) else {
            return self.release_light(entry);
        };
        let slot = match node.light {
            NONE => self.live.free_lights.pop().unwrap_or_else(|| {
                self.derived.lights.push(LightRow::HOLE);
                self.derived.lights.len() as u32 - 1
            }),
            slot => slot,
        };
        debug_assert_eq!(node.node, id);
        self.derived.hierarchy.nodes[entry as usize].light = slot;
        let old = std::mem::replace(&mut self.derived.lights[slot as usize], row);
        if !same_bytes(&old, &row) {
            self.live.dirty.lights.mark(slot);
        }
    }

    pub(super) fn release_light(&mut self, entry: u32) {
        let slot = std::mem::replace(&mut self.derived.hierarchy.nodes[entry as usize].light, NONE);
        if slot != NONE {
            self.derived.lights[slot as usize] = LightRow::HOLE;
            self.live.dirty.lights.mark(slot);
            self.live.free_lights.push(slot);
        }
    }
}
