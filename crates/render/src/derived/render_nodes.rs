//! Render nodes: one row per instance, with `world * instance` in `f64`, rounded relative to the scene's origin.

use super::hierarchy::{DerivedNode, Hierarchy, is_invertible};
use super::primitives::{PrimitiveTable, PrimitiveUse};
use crate::DeriveError;
use crate::budget::Budget;
use glam::{DAffine3, DQuat, DVec3};
use orthant_resident::rows::{AlphaMode, Mat3x4, MaterialFlags, MaterialRow, MeshDesc, NONE, NodeFlags, RenderNodeRow};
use orthant_scene::Scene;
use orthant_scene::accessor;
use orthant_scene::animation::Posed;
use orthant_scene::model::{AccessorId, Instancing, NodeId, Store};
use rayon::prelude::*;

/// The derived rows.
#[derive(Clone, Debug, Default)]
pub struct RenderNodes {
    /// One row per instance.
    pub rows: Vec<RenderNodeRow>,
    /// Index of the derived node that each row shows.
    pub owners: Vec<u32>,
}

/// Rows that one task writes, at least.
const TASK_ROWS: usize = 1 << 13;

/// What all tasks read.
struct Source<'a> {
    scene: &'a Scene,
    table: &'a PrimitiveTable,
    /// [`NodeFlags`] by material row.
    material_flags: Vec<u32>,
    mesh_descs: &'a [MeshDesc],
    origin: DVec3,
}

/// Counts the render nodes of every node, gives them consecutive rows in hierarchy order and fills these.
pub fn derive(
    posed: Posed<'_>,
    hierarchy: &mut Hierarchy,
    table: &PrimitiveTable,
    materials: &[MaterialRow],
    mesh_descs: &[MeshDesc],
    origin: DVec3,
    budget: &Budget,
) -> Result<RenderNodes, DeriveError> {
    let scene = posed.scene;
    let mut total = 0usize;
    for node in &mut hierarchy.nodes {
        if node.mesh == NONE {
            node.first_render_node = total as u32;
            continue;
        }
        let primitives = table.uses_at(node.mesh as usize).len();
        let instances = if node.instanced { instance_count(scene, node) } else { 1 };
        let count = primitives.saturating_mul(instances);
        node.first_render_node = total as u32;
        total = total.saturating_add(count);
        if total >= NONE as usize {
            return Err(DeriveError::new(
                format!("/nodes/{}", Store::<_, ()>::slot(node.node)),
                format!("the scene has {total} or more render nodes; at most {} fit", NONE - 1),
                "split the file into several scenes",
            ));
        }
        node.render_node_count = count as u32;
    }
    let bytes = total as u64 * (size_of::<RenderNodeRow>() + size_of::<u32>()) as u64;
    budget.charge(bytes).map_err(|over| DeriveError::over_budget("/nodes", "the render nodes", over))?;
    let source =
        Source { scene, table, material_flags: materials.iter().map(node_flags).collect(), mesh_descs, origin };
    let mut rows: Vec<RenderNodeRow> = bytemuck::zeroed_vec(total);
    let mut owners = vec![0u32; total];
    let frame = |node: &DerivedNode| if node.deformed { hierarchy.frame(posed, node.node) } else { node.world };
    tasks(&hierarchy.nodes, &mut rows, &mut owners).into_par_iter().try_for_each(|task| {
        let Task { first, nodes, mut rows, mut owners } = task;
        for (i, node) in nodes.iter().enumerate() {
            let count = node.render_node_count as usize;
            if count == 0 {
                continue;
            }
            let (head, tail) = rows.split_at_mut(count);
            rows = tail;
            let (head_owners, tail) = owners.split_at_mut(count);
            owners = tail;
            head_owners.fill((first + i) as u32);
            source.fill(node, &frame(node), head)?;
        }
        Ok(())
    })?;
    Ok(RenderNodes { rows, owners })
}

/// Consecutive nodes with the rows that they fill.
struct Task<'a> {
    first: usize,
    nodes: &'a [DerivedNode],
    rows: &'a mut [RenderNodeRow],
    owners: &'a mut [u32],
}

fn tasks<'a>(nodes: &'a [DerivedNode], rows: &'a mut [RenderNodeRow], owners: &'a mut [u32]) -> Vec<Task<'a>> {
    let mut tasks = Vec::with_capacity(rows.len() / TASK_ROWS + 1);
    let (mut rows, mut owners) = (rows, owners);
    let (mut first, mut count) = (0, 0);
    for (i, node) in nodes.iter().enumerate() {
        count += node.render_node_count as usize;
        if count >= TASK_ROWS || (i + 1 == nodes.len() && count > 0) {
            let (head, tail) = rows.split_at_mut(count);
            let (head_owners, tail_owners) = owners.split_at_mut(count);
            tasks.push(Task { first, nodes: &nodes[first..=i], rows: head, owners: head_owners });
            (rows, owners, first, count) = (tail, tail_owners, i + 1, 0);
        }
    }
    tasks
}

impl Source<'_> {
    /// Fills the rows of one node: instance by instance, primitive by primitive.
    fn fill(&self, node: &DerivedNode, world: &DAffine3, rows: &mut [RenderNodeRow]) -> Result<(), DeriveError> {
        let uses = self.table.uses_at(node.mesh as usize);
        let deformed = if node.deformed { self.table.deformed(node.node) } else { None };
        let instances = match &self.scene.nodes()[node.node].instancing {
            Some(instancing) if node.instanced => Some(Instances::read(self.scene, instancing, node)?),
            _ => None,
        };
        let fill = |(i, rows): (usize, &mut [RenderNodeRow])| {
            let world = match &instances {
                Some(instances) => *world * instances.get(i),
                None => *world,
            };
            self.fill_instance(node, uses, deformed, &world, rows);
        };
        if rows.len() > TASK_ROWS {
            rows.par_chunks_mut(uses.len()).enumerate().for_each(fill);
        } else {
            rows.chunks_mut(uses.len()).enumerate().for_each(fill);
        }
        Ok(())
    }

    fn fill_instance(
        &self,
        node: &DerivedNode,
        uses: &[PrimitiveUse],
        deformed: Option<&[u32]>,
        world: &DAffine3,
        rows: &mut [RenderNodeRow],
    ) {
        let template = InstanceTemplate::new(world, self.origin, node.node, node.visible);
        for (i, (row, use_)) in rows.iter_mut().zip(uses).enumerate() {
            let primitive = deformed.map_or(use_.render_primitive, |d| d[i]);
            let has_triangles = self.mesh_descs[primitive as usize].index_count > 0;
            *row = template.row(primitive, use_.material, self.material_flags[use_.material as usize], has_triangles);
        }
    }
}

/// What the render nodes of an instance have in common.
pub(super) struct InstanceTemplate {
    row: RenderNodeRow,
    /// It is visible, and its matrix can be inverted.
    drawn: bool,
}

impl InstanceTemplate {
    /// `world` is that of the instance in the document's world.
    pub fn new(world: &DAffine3, origin: DVec3, node: NodeId, visible: bool) -> Self {
        let relative = DAffine3 { translation: world.translation - origin, ..*world };
        let invertible = is_invertible(&relative);
        let inverse = if invertible { relative.inverse() } else { DAffine3::IDENTITY };
        let mirrored = relative.matrix3.determinant() < 0.0;
        let row = RenderNodeRow {
            world: Mat3x4::from_affine(&relative),
            inverse: Mat3x4::from_affine(&inverse),
            primitive: NONE,
            material: 0,
            node: Store::<_, ()>::slot(node) as u32,
            flags: NodeFlags::OCCUPIED | if mirrored { NodeFlags::MIRRORED } else { 0 },
            emitter: NONE,
            reserved: [0; 3],
        };
        // A matrix that flattens its object leaves nothing that has an inside, an outside or an inverse.
        Self { row, drawn: visible && invertible }
    }

    /// The row of one primitive. `flags` are those of its material.
    pub fn row(&self, primitive: u32, material: u32, flags: u32, has_triangles: bool) -> RenderNodeRow {
        let visible = if self.drawn && has_triangles { NodeFlags::VISIBLE } else { 0 };
        RenderNodeRow { primitive, material, flags: self.row.flags | flags | visible, ..self.row }
    }
}

/// The flags that a material gives its render nodes.
pub fn node_flags(material: &MaterialRow) -> u32 {
    let opaque = if material.alpha_mode() == AlphaMode::Opaque { NodeFlags::OPAQUE } else { 0 };
    let double_sided = if material.flags & MaterialFlags::DOUBLE_SIDED != 0 { NodeFlags::DOUBLE_SIDED } else { 0 };
    opaque | double_sided
}

pub(super) fn instance_count(scene: &Scene, node: &DerivedNode) -> usize {
    let Some(instancing) = &scene.nodes()[node.node].instancing else { return 1 };
    let custom = instancing.custom.iter().map(|&(_, a)| a);
    [instancing.translation, instancing.rotation, instancing.scale]
        .into_iter()
        .flatten()
        .chain(custom)
        .next()
        .map_or(0, |a| scene.accessors()[a].count)
}

/// Decoded attributes of EXT_mesh_gpu_instancing.
pub(super) struct Instances {
    translation: Vec<[f32; 3]>,
    rotation: Vec<[f32; 4]>,
    scale: Vec<[f32; 3]>,
}

impl Instances {
    pub fn read(scene: &Scene, instancing: &Instancing, node: &DerivedNode) -> Result<Self, DeriveError> {
        let count = instance_count(scene, node);
        Ok(Self {
            translation: Self::attribute(scene, instancing.translation, count, node, "TRANSLATION")?,
            rotation: Self::attribute(scene, instancing.rotation, count, node, "ROTATION")?,
            scale: Self::attribute(scene, instancing.scale, count, node, "SCALE")?,
        })
    }

    fn attribute<const N: usize>(
        scene: &Scene,
        id: Option<AccessorId>,
        count: usize,
        node: &DerivedNode,
        name: &str,
    ) -> Result<Vec<[f32; N]>, DeriveError> {
        let Some(id) = id else { return Ok(Vec::new()) };
        let error = |what: String| {
            let slot = Store::<_, ()>::slot(node.node);
            let place = format!("/nodes/{slot}/extensions/EXT_mesh_gpu_instancing/attributes/{name}");
            DeriveError::new(place, what, "give all instance attributes the same count")
        };
        let values = accessor::read_f32::<N>(scene, id).map_err(|e| error(e.to_string()))?;
        if values.len() != count {
            return Err(error(format!("the attribute has {} elements, others have {count}", values.len())));
        }
        Ok(values)
    }

    /// Node from instance.
    pub fn get(&self, i: usize) -> DAffine3 {
        let vec3 = |a: &[[f32; 3]], default: DVec3| a.get(i).map_or(default, |v| DVec3::from_array(v.map(f64::from)));
        let rotation = self.rotation.get(i).map_or(DQuat::IDENTITY, |q| {
            let q = DQuat::from_array(q.map(f64::from));
            if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
        });
        DAffine3::from_scale_rotation_translation(
            vec3(&self.scale, DVec3::ONE),
            rotation,
            vec3(&self.translation, DVec3::ZERO),
        )
    }
}
