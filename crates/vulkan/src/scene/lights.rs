//! Lights: the few rows that the tables of [`orthant_resident::lights`] look at, kept on the host, and the tables on the
//! device, which follow by what was written to those on the host.

use crate::abi::{LightTable, QuadRow};
use crate::device::Device;
use crate::error::Result;
use crate::memory::{Arena, Uploads};
use ash::vk::BufferUsageFlags;
use orthant_resident::batch::{RowRange, RowWrites};
use orthant_resident::lights::{LightChanges, LightRows, LightTables, Quad};
use orthant_resident::rows::{EmitterRow, LightRow, MeshDesc, NONE, RenderNodeRow};
use orthant_resident::sampling::light_tree::LightNode;
use orthant_resident::{Environment, SceneBatch};
use std::collections::HashMap;
use std::sync::Arc;

/// What the host keeps of the rows.
#[derive(Default)]
pub(crate) struct Mirror {
    lights: Vec<LightRow>,
    emitters: Vec<EmitterRow>,
    pub mesh_descs: Vec<MeshDesc>,
    /// The emitter of each render node, or [`NONE`]; it ends after the last that ever had one.
    emitter_of: Vec<u32>,
    /// Render nodes that emit, by row.
    emitting: HashMap<u32, RenderNodeRow>,
    /// First triangles of parallelograms, by RenderPrimitive.
    triangles: HashMap<u32, [[f32; 3]; 3]>,
}

impl LightRows for Mirror {
    fn lights(&self) -> &[LightRow] {
        &self.lights
    }

    fn emitters(&self) -> &[EmitterRow] {
        &self.emitters
    }

    fn emitting_node(&self, row: u32) -> Option<&RenderNodeRow> {
        self.emitting.get(&row)
    }

    fn mesh_desc(&self, primitive: u32) -> Option<&MeshDesc> {
        self.mesh_descs.get(primitive as usize)
    }

    fn first_triangle(&self, primitive: u32) -> Option<[[f32; 3]; 3]> {
        self.triangles.get(&primitive).copied()
    }
}

impl Mirror {
    /// What of the lights a batch may change.
    pub fn light_changes(&self, batch: &SceneBatch) -> LightChanges {
        let emitter_of = |row: u32| self.emitter_of.get(row as usize).copied().unwrap_or(NONE);
        LightChanges::new(self.lights.len(), emitter_of, batch)
    }

    /// Takes over a batch. O(the batch).
    pub fn follow(&mut self, batch: &SceneBatch) {
        batch.lights.clone().apply_to(&mut self.lights);
        batch.emitters.clone().apply_to(&mut self.emitters);
        batch.mesh_descs.clone().apply_to(&mut self.mesh_descs);
        for (row, new) in batch.render_nodes.ranges.iter().flat_map(|range| (range.first..).zip(&range.rows)) {
            self.set_emitting(row, new);
        }
        for row in batch.render_nodes.len..self.emitter_of.len() as u32 {
            self.emitting.remove(&row);
        }
        self.emitter_of.truncate(batch.render_nodes.len as usize);
        self.take_triangles(batch);
    }

    fn set_emitting(&mut self, row: u32, new: &RenderNodeRow) {
        let at = row as usize;
        if new.emitter == NONE {
            if let Some(emitter) = self.emitter_of.get_mut(at) {
                *emitter = NONE;
                self.emitting.remove(&row);
            }
            return;
        }
        if at >= self.emitter_of.len() {
            self.emitter_of.resize(at + 1, NONE);
        }
        self.emitter_of[at] = new.emitter;
        self.emitting.insert(row, *new);
    }

    /// The first triangles of parallelograms whose geometry is in the batch.
    fn take_triangles(&mut self, batch: &SceneBatch) {
        let written = batch.mesh_descs.ranges.iter().flat_map(|r| r.first..r.first + r.rows.len() as u32);
        let touched = written.chain(batch.blas_builds.iter().chain(&batch.blas_updates).copied());
        for primitive in touched {
            let Some(desc) = self.mesh_descs.get(primitive as usize) else { continue };
            if desc.parallelogram().is_none() {
                self.triangles.remove(&primitive);
                continue;
            }
            let index = |k: u32| find(&batch.indices, desc.first_index + k);
            let position = |i: &u32| find(&batch.positions, desc.first_vertex + i);
            let corners = [index(0), index(1), index(2)].map(|i| i.and_then(position).copied());
            if let [Some(a), Some(b), Some(c)] = corners {
                self.triangles.insert(primitive, [a, b, c]);
            }
        }
    }
}

/// An element of a stream, if the batch writes it.
fn find<T>(writes: &RowWrites<T>, at: u32) -> Option<&T> {
    let range = writes.ranges.partition_point(|range| range.first <= at).checked_sub(1)?;
    let range = &writes.ranges[range];
    range.rows.get((at - range.first) as usize)
}

/// The tables, on the host and on the device.
pub(crate) struct Lights {
    pub tables: LightTables,
    emitter_nodes: Arena,
    emitter_leaves: Arena,
    quads: Arena,
    punctual_nodes: Arena,
    directional: Arena,
    local: Arena,
    map: Arena,
    marginal: Arena,
    conditional: Arena,
    cos_edges: Arena,
}

impl Lights {
    pub fn new() -> Self {
        let arena = |what, stride| Arena::new(what, stride, BufferUsageFlags::empty());
        let node = size_of::<LightNode>();
        Self {
            tables: LightTables::default(),
            emitter_nodes: arena("the tree over emitters", node),
            emitter_leaves: arena("leaves of the tree over emitters", 4),
            quads: arena("quads that emit", size_of::<QuadRow>()),
            punctual_nodes: arena("the tree over lights", node),
            directional: arena("directional lights", 4),
            local: arena("local lights", 4),
            map: arena("the environment's map", 12),
            marginal: arena("rows of the environment", 4),
            conditional: arena("texels of the environment", 4),
            cos_edges: arena("edges of the environment", 4),
        }
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        let trees = [&self.emitter_nodes, &self.emitter_leaves, &self.quads, &self.punctual_nodes];
        let lists = [&self.directional, &self.local];
        let maps = [&self.map, &self.marginal, &self.conditional, &self.cos_edges];
        trees.into_iter().chain(lists).chain(maps).map(Arena::bytes).sum()
    }

    /// Follows a batch that the mirror has taken over.
    pub fn follow(
        &mut self,
        device: &Arc<Device>,
        uploads: &mut Uploads<'_>,
        mirror: &Mirror,
        changes: &LightChanges,
    ) -> Result<()> {
        let writes = self.tables.update(mirror, changes);
        let emitters = &writes.emitters;
        self.tables.weigh_kinds();
        uploads.overhead(|uploads| {
            if let Some(writes) = &writes.emitter_tree {
                let tree = &self.tables.emitters;
                let node = |i: u32| tree.nodes[i as usize];
                uploads.rows(device, &mut self.emitter_nodes, &ranges(writes.node_count, &writes.nodes, node))?;
                let leaf = |i: u32| tree.leaves[i as usize];
                uploads.rows(device, &mut self.emitter_leaves, &ranges(writes.leaf_count, &writes.leaves, leaf))?;
                self.write_quads(device, uploads, emitters)?;
            }
            if let Some(writes) = &writes.punctual {
                let punctual = &self.tables.punctual;
                let node = |i: u32| punctual.tree.nodes[i as usize];
                uploads.rows(device, &mut self.punctual_nodes, &ranges(writes.node_count, &writes.nodes, node))?;
                // Lists of row numbers: a light that goes moves another, so that they are sent whole; they are short.
                uploads.rows(device, &mut self.directional, &RowWrites::whole(punctual.directional().to_vec()))?;
                uploads.rows(device, &mut self.local, &RowWrites::whole(punctual.local().to_vec()))?;
            }
            Ok(())
        })
    }

    /// The quads among emitters that were looked at, and those that are new.
    fn write_quads(&mut self, device: &Arc<Device>, uploads: &mut Uploads<'_>, emitters: &[u32]) -> Result<()> {
        let rows = self.tables.quads();
        let len = rows.len() as u32;
        let mut touched: Vec<u32> = emitters.iter().copied().filter(|&i| i < len).collect();
        touched.extend(self.quads.len.min(len)..len);
        touched.sort_unstable();
        touched.dedup();
        let writes = ranges(rows.len(), &touched, |i| quad_row(rows[i as usize].as_ref()));
        uploads.rows(device, &mut self.quads, &writes).map(|_| ())
    }

    /// Takes over what surrounds the scene.
    pub fn set_environment(
        &mut self,
        device: &Arc<Device>,
        uploads: &mut Uploads<'_>,
        environment: &Environment,
    ) -> Result<()> {
        self.tables.set_environment(environment);
        self.tables.weigh_kinds();
        uploads.overhead(|uploads| {
            let texels = self.tables.map.as_ref().map_or(Vec::new(), |map| map.texels.clone());
            uploads.rows(device, &mut self.map, &RowWrites::whole(texels))?;
            if let Some(d) = &self.tables.distribution {
                uploads.rows(device, &mut self.marginal, &RowWrites::whole(d.marginal.clone()))?;
                uploads.rows(device, &mut self.conditional, &RowWrites::whole(d.conditional.clone()))?;
                uploads.rows(device, &mut self.cos_edges, &RowWrites::whole(d.cos_edges.clone()))?;
            }
            Ok(())
        })
    }

    /// What shaders see.
    pub fn table(&self) -> LightTable {
        let t = &self.tables;
        let sun = t.sun.as_ref();
        LightTable {
            emitter_nodes: self.emitter_nodes.address(),
            emitter_leaves: self.emitter_leaves.address(),
            quads: self.quads.address(),
            punctual_nodes: self.punctual_nodes.address(),
            directional: self.directional.address(),
            local: self.local.address(),
            map: self.map.address(),
            marginal: self.marginal.address(),
            conditional: self.conditional.address(),
            cos_edges: self.cos_edges.address(),
            emitter_node_count: t.emitters.nodes.len() as u32,
            emitter_leaf_count: t.emitters.leaves.len() as u32,
            quad_count: t.quads().len() as u32,
            punctual_node_count: t.punctual.tree.nodes.len() as u32,
            directional_count: t.punctual.directional().len() as u32,
            local_count: t.punctual.local().len() as u32,
            map_width: t.map.as_ref().map_or(0, |map| map.width),
            map_height: t.map.as_ref().map_or(0, |map| map.height),
            has_distribution: u32::from(t.distribution.is_some()),
            has_sun: u32::from(sun.is_some()),
            kind_emitters: t.kinds.emitters,
            kind_environment: t.kinds.environment,
            kind_sun: t.kinds.sun,
            intensity: t.intensity,
            rotation_sin: t.rotation[0],
            rotation_cos: t.rotation[1],
            map_integral: t.distribution.as_ref().map_or(0.0, |d| d.integral),
            sun_direction: sun.map_or([0.0, 1.0, 0.0], |sun| sun.direction),
            sun_radiance: sun.map_or([0.0; 3], |sun| sun.radiance),
            sun_cos_radius: sun.map_or(1.0, |sun| sun.cos_radius),
        }
    }
}

/// Writes of named rows, ascending.
fn ranges<T>(len: usize, named: &[u32], row: impl Fn(u32) -> T) -> RowWrites<T> {
    let run = |run: &[u32]| RowRange { first: run[0], rows: run.iter().map(|&i| row(i)).collect() };
    RowWrites { len: len as u32, ranges: named.chunk_by(|a, b| a + 1 == *b).map(run).collect() }
}

fn quad_row(quad: Option<&Quad>) -> QuadRow {
    let Some(quad) = quad else { return QuadRow::default() };
    let [a, b] = quad.opposite().map(|corner| corner as u32);
    let flags = 1 | a << 2 | b << 4;
    let Some(rectangle) = quad.rectangle() else { return QuadRow { flags, ..QuadRow::default() } };
    let (corner, [x, y, z], [width, height]) = rectangle.parts();
    let [corner, x, y, z] = [corner, x, y, z].map(|v| v.to_array());
    QuadRow { corner, width, x, height, y, flags: flags | 2, z, reserved: 0 }
}
