//! The nodes that a scene shows, parents before children, with their world matrices in `f64`.
//!
//! The walk goes level by level, so that a chain of any depth needs no stack and a wide level is done in parallel.

use super::primitives::PrimitiveTable;
use crate::DeriveError;
use crate::geometry::SkinPose;
use glam::{DAffine3, DMat4, DVec3, Vec3};
use orthant_resident::rows::{MeshDesc, NONE};
use orthant_scene::Scene;
use orthant_scene::accessor;
use orthant_scene::animation::Posed;
use orthant_scene::model::{NodeId, SceneId, Store};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// A node that the scene shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerivedNode {
    /// World from node, in the document's world.
    pub world: DAffine3,
    /// The node.
    pub node: NodeId,
    /// Its index among the nodes of [`Hierarchy::nodes`]' previous levels, or [`NONE`] for a root.
    pub parent: u32,
    /// Slot of its mesh, or [`NONE`].
    pub mesh: u32,
    /// Its first render node.
    pub first_render_node: u32,
    /// Its render nodes: instances times primitives.
    pub render_node_count: u32,
    /// The row of its light, or [`NONE`].
    pub light: u32,
    /// It and all its ancestors are visible.
    pub visible: bool,
    /// Its mesh is deformed by its pose.
    pub deformed: bool,
    /// EXT_mesh_gpu_instancing.
    pub instanced: bool,
}

impl DerivedNode {
    /// An entry without a node.
    pub(super) const FREE: Self = Self {
        world: DAffine3::IDENTITY,
        node: NodeId::NULL,
        parent: NONE,
        mesh: NONE,
        first_render_node: 0,
        render_node_count: 0,
        light: NONE,
        visible: false,
        deformed: false,
        instanced: false,
    };

    /// A node about which nothing is known yet.
    pub(super) fn new(node: NodeId) -> Self {
        Self { node, ..Self::FREE }
    }

    /// Whether the entry holds a node.
    pub fn is_used(&self) -> bool {
        self.node != NodeId::NULL
    }
}

/// The nodes that a scene shows.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    /// After a derivation parents come before children, level by level, siblings in order. Edits take free entries.
    pub nodes: Vec<DerivedNode>,
    /// Index in `nodes` by node slot; [`NONE`] for nodes that the scene does not show.
    index: Vec<u32>,
}

/// Nodes of a level above which it is walked in parallel.
const PARALLEL_NODES: usize = 1 << 12;

impl Hierarchy {
    /// Walks the nodes below a scene's roots.
    ///
    /// # Errors
    /// A node that is reached twice: a cycle or two parents. The importers refuse such documents, so this guards
    /// against documents that were made otherwise.
    pub fn build(posed: Posed<'_>, shown: Option<SceneId>, table: &PrimitiveTable) -> Result<Self, DeriveError> {
        let scene = posed.scene;
        let roots = roots(scene, shown);
        let mut hierarchy =
            Self { nodes: Vec::with_capacity(scene.nodes().len()), index: vec![NONE; scene.nodes().slot_bound()] };
        let mut frontier: Vec<(NodeId, u32)> = roots.into_iter().map(|id| (id, NONE)).collect();
        while !frontier.is_empty() {
            let first = hierarchy.nodes.len();
            for (i, &(id, _)) in frontier.iter().enumerate() {
                let index = &mut hierarchy.index[Store::<_, ()>::slot(id)];
                if *index != NONE {
                    return Err(reached_twice(scene, id));
                }
                *index = (first + i) as u32;
            }
            let nodes = &hierarchy.nodes;
            let make = |&(id, parent): &(NodeId, u32)| {
                let node = &scene.nodes()[id];
                let local = posed.local(id);
                let (above, visible) = match nodes.get(parent as usize) {
                    Some(parent) => (parent.world * local, parent.visible),
                    None => (local, true),
                };
                DerivedNode {
                    world: above,
                    node: id,
                    parent,
                    mesh: node.mesh.map_or(NONE, |m| Store::<_, ()>::slot(m) as u32),
                    first_render_node: 0,
                    render_node_count: 0,
                    light: NONE,
                    visible: visible && posed.visible(id),
                    deformed: table.has_deformed() && table.deformed(id).is_some(),
                    instanced: node.instancing.is_some(),
                }
            };
            let children = |(i, &(id, _)): (usize, &(NodeId, u32))| {
                scene.nodes()[id].children.iter().map(move |c| (c, (first + i) as u32))
            };
            if frontier.len() < PARALLEL_NODES {
                let level: Vec<DerivedNode> = frontier.iter().map(make).collect();
                frontier = frontier.iter().enumerate().flat_map(children).collect();
                hierarchy.nodes.extend(level);
            } else {
                let mut level = Vec::new();
                frontier.par_iter().map(make).collect_into_vec(&mut level);
                frontier = frontier.par_iter().enumerate().flat_map_iter(children).collect();
                if hierarchy.nodes.is_empty() {
                    hierarchy.nodes = level;
                } else {
                    hierarchy.nodes.extend_from_slice(&level);
                }
            }
        }
        Ok(hierarchy)
    }

    /// Makes room for nodes to come.
    pub(super) fn reserve(&mut self, nodes: usize) {
        self.nodes.reserve(nodes);
        self.index.reserve(nodes);
    }

    /// A node that the scene shows.
    pub fn get(&self, id: NodeId) -> Option<&DerivedNode> {
        Some(&self.nodes[self.entry(id)? as usize])
    }

    /// The index in [`Hierarchy::nodes`] of a node that the scene shows.
    pub fn entry(&self, id: NodeId) -> Option<u32> {
        let index = *self.index.get(Store::<_, ()>::slot(id))?;
        self.nodes.get(index as usize).is_some_and(|n| n.node == id).then_some(index)
    }

    pub(super) fn set_entry(&mut self, id: NodeId, entry: u32) {
        let slot = Store::<_, ()>::slot(id);
        if slot >= self.index.len() {
            self.index.resize(slot + 1, NONE);
        }
        self.index[slot] = entry;
    }

    pub(super) fn clear_entry(&mut self, id: NodeId) {
        if let Some(index) = self.index.get_mut(Store::<_, ()>::slot(id)) {
            *index = NONE;
        }
    }

    /// Bytes of the nodes and their index.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.index.as_slice())
    }

    /// World from node, also for a node that the scene does not show (a skin may refer to one).
    fn world(&self, posed: Posed<'_>, id: NodeId) -> DAffine3 {
        let mut local = DAffine3::IDENTITY;
        let mut at = Some(id);
        while let Some(id) = at {
            if let Some(node) = self.get(id) {
                return node.world * local;
            }
            local = posed.local(id) * local;
            at = posed.scene.nodes()[id].parent;
        }
        local
    }

    /// The frame in which the vertices of a deformed node are stored: the node's own without a skin; with one, that of
    /// the nearest common ancestor of its joints, so that moving the whole figure deforms nothing. The node's own
    /// transform does not place a skinned mesh (glTF 2.0, section 3.7.3.3).
    pub fn frame(&self, posed: Posed<'_>, id: NodeId) -> DAffine3 {
        let scene = posed.scene;
        let own = self.world(posed, id);
        let Some(skin) = scene.nodes()[id].skin else { return own };
        let Some(ancestor) = common_ancestor(scene, &scene.skins()[skin].joints) else { return DAffine3::IDENTITY };
        let frame = self.world(posed, ancestor);
        if is_invertible(&frame) { frame } else { DAffine3::from_translation(frame.translation) }
    }

    /// What deforms the mesh of a node: its weights and joints.
    pub fn skin_pose(&self, posed: Posed<'_>, id: NodeId) -> SkinPose {
        let scene = posed.scene;
        let node = &scene.nodes()[id];
        let weights = posed.weights(id);
        let Some(skin) = node.skin.map(|s| &scene.skins()[s]) else { return SkinPose { weights, joints: Vec::new() } };
        let inverse_bind: Vec<DAffine3> = skin
            .inverse_bind_matrices
            .and_then(|a| accessor::read_f32::<16>(scene, a).ok())
            .unwrap_or_default()
            .iter()
            .map(|m| DAffine3::from_mat4(DMat4::from_cols_array(&m.map(f64::from))))
            .collect();
        let from_world = self.frame(posed, id).inverse();
        let joint = |(i, &joint): (usize, &NodeId)| {
            let bind = inverse_bind.get(i).copied().unwrap_or(DAffine3::IDENTITY);
            from_world * self.world(posed, joint) * bind
        };
        SkinPose { weights, joints: skin.joints.iter().enumerate().map(joint).collect() }
    }

    /// The origin of everything resident: zero for a scene that is about there, else the middle of the scene, rounded
    /// to metres so that moving between it and the document's world is exact.
    pub fn origin(&self, table: &PrimitiveTable, mesh_descs: &[MeshDesc]) -> DVec3 {
        let radius = |use_: &super::primitives::PrimitiveUse| {
            let Some(desc) = mesh_descs.get(use_.render_primitive as usize) else { return (Vec3::ZERO, 0.0) };
            let (lo, hi) = (Vec3::from_array(desc.bounds_min), Vec3::from_array(desc.bounds_max));
            ((lo + hi) * 0.5, f64::from((hi - lo).length()) * 0.5)
        };
        // The bounding sphere of each mesh's first primitive is enough: only the order of magnitude matters.
        let of = |node: &DerivedNode| {
            let spheres = if node.mesh == NONE { &[][..] } else { table.uses_at(node.mesh as usize) };
            let (centre, radius) = spheres.first().map_or((Vec3::ZERO, 0.0), radius);
            let m = node.world.matrix3;
            let scale = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
            (node.world.transform_point3(centre.as_dvec3()), radius * scale)
        };
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0.0f64);
        let grow = |(lo, hi, r): (DVec3, DVec3, f64), node: &DerivedNode| {
            let (p, radius) = of(node);
            if p.is_finite() { (lo.min(p), hi.max(p), r.max(radius)) } else { (lo, hi, r) }
        };
        let merge = |a: (DVec3, DVec3, f64), b: (DVec3, DVec3, f64)| (a.0.min(b.0), a.1.max(b.1), a.2.max(b.2));
        let shown = self.nodes.par_iter().with_min_len(PARALLEL_NODES).filter(|n| n.mesh != NONE);
        let (lo, hi, radius) = shown.fold(|| empty, grow).reduce(|| empty, merge);
        if !lo.cmple(hi).all() {
            return DVec3::ZERO;
        }
        let (centre, extent) = ((lo + hi) * 0.5, (hi - lo).length() * 0.5 + radius);
        if centre.length() > ORIGIN_EXTENTS * extent && centre.length() < 1e15 { centre.round() } else { DVec3::ZERO }
    }
}

/// A scene whose centre is nearer to zero than this many times its radius keeps its origin: `f32` loses at most two
/// bits there.
const ORIGIN_EXTENTS: f64 = 4.0;

/// The roots of a scene; of the default scene, else the first, else every node without a parent.
fn roots(scene: &Scene, shown: Option<SceneId>) -> Vec<NodeId> {
    match shown.or(scene.default_scene()).or_else(|| scene.scenes().ids().next()) {
        Some(id) => scene.scenes()[id].roots.iter().collect(),
        None => scene.nodes().iter().filter(|(_, n)| n.parent.is_none()).map(|(id, _)| id).collect(),
    }
}

fn reached_twice(scene: &Scene, id: NodeId) -> DeriveError {
    let name = scene.nodes()[id].name.as_deref().unwrap_or("");
    DeriveError::new(
        format!("/nodes/{}", Store::<_, ()>::slot(id)),
        format!("node \"{name}\" is reached twice: it is in a cycle, has two parents, or is a root twice"),
        "give every node one parent",
    )
}

/// The nearest node that is an ancestor of all (or one of them). Every node is walked over once.
fn common_ancestor(scene: &Scene, nodes: &[NodeId]) -> Option<NodeId> {
    let parent = |id: NodeId| scene.nodes()[id].parent;
    let first: Vec<NodeId> = std::iter::successors(Some(*nodes.first()?), |&id| parent(id)).collect();
    let height: HashMap<NodeId, usize> = first.iter().enumerate().map(|(i, &id)| (id, i)).collect();
    let mut common = 0;
    let mut walked = HashSet::new();
    for &node in &nodes[1..] {
        let mut at = Some(node);
        loop {
            let id = at?;
            if let Some(&h) = height.get(&id) {
                common = common.max(h);
                break;
            }
            if !walked.insert(id) {
                break;
            }
            at = parent(id);
        }
    }
    Some(first[common])
}

/// Whether a matrix can be inverted without infinities.
pub(super) fn is_invertible(m: &DAffine3) -> bool {
    let d = m.matrix3.determinant();
    d != 0.0 && d.is_finite() && (1.0 / d).is_finite() && m.translation.is_finite()
}
