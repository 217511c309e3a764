//! Nodes in world space, for formats without a hierarchy.

use crate::Scene;
use crate::accessor::{self, AccessorError};
use crate::model::*;
use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};

/// A node that is shown, and where it is: world from node.
pub struct Placed {
    pub node: NodeId,
    pub world: DAffine3,
}

/// The nodes of the default scene (the first, if none is named; without scenes, all roots) that are visible, parents first.
pub fn flatten(scene: &Scene) -> Vec<Placed> {
    let shown = scene.default_scene().or_else(|| scene.scenes().ids().next());
    let roots: Vec<NodeId> = match shown {
        Some(shown) => scene.scenes()[shown].roots.iter().collect(),
        None => all_roots(scene),
    };
    walk(scene, roots, |node| node.visible != Some(false))
}

fn all_roots(scene: &Scene) -> Vec<NodeId> {
    scene.nodes().iter().filter(|(_, n)| n.parent.is_none()).map(|(id, _)| id).collect()
}

fn walk(scene: &Scene, roots: Vec<NodeId>, is_wanted: impl Fn(&Node) -> bool) -> Vec<Placed> {
    let mut placed = Vec::new();
    let mut open: Vec<(NodeId, DAffine3)> = roots.into_iter().rev().map(|id| (id, DAffine3::IDENTITY)).collect();
    while let Some((id, parent)) = open.pop() {
        let node = &scene.nodes()[id];
        if !is_wanted(node) {
            continue;
        }
        let local = node.transform.to_affine();
        // A root's matrix stays what it is, to the bit.
        let world = if node.parent.is_none() { local } else { parent * local };
        placed.push(Placed { node: id, world });
        let first = open.len();
        open.extend(node.children.iter().map(|child| (child, world)));
        open[first..].reverse();
    }
    placed
}

/// Where a node's mesh appears (EXT_mesh_gpu_instancing).
pub fn instances(scene: &Scene, node: &Node, world: DAffine3) -> Result<Vec<DAffine3>, AccessorError> {
    let Some(instancing) = node.instancing.as_deref() else { return Ok(vec![world]) };
    let (t, r, s) = (instancing.translation, instancing.rotation, instancing.scale);
    let Some(any) = t.or(r).or(s) else { return Ok(vec![world]) };
    let count = scene.accessors()[any].count;
    let three = |id: Option<AccessorId>| id.map(|id| accessor::read_f32::<3>(scene, id)).transpose();
    let (t, s) = (three(t)?, three(s)?);
    let r = r.map(|id| accessor::read_f32::<4>(scene, id)).transpose()?;
    let vector = |list: &Option<Vec<[f32; 3]>>, i: usize, or: f64| {
        list.as_ref().and_then(|l| l.get(i)).map_or(DVec3::splat(or), |&v| glam::Vec3::from(v).as_dvec3())
    };
    let rotation = |i: usize| {
        let r = r.as_ref().and_then(|l| l.get(i)).map_or(DVec4::W, |&v| glam::Vec4::from(v).as_dvec4());
        r.try_normalize().map_or(DQuat::IDENTITY, DQuat::from_vec4)
    };
    let local = |i| DAffine3::from_scale_rotation_translation(vector(&s, i, 1.0), rotation(i), vector(&t, i, 0.0));
    Ok((0..count).map(|i| world * local(i)).collect())
}

/// What deforms the mesh of a node: its morph weights and, for a skinned one, for each joint the world from the space in
/// which vertices are stored (glTF 2.0, section 3.7.3.3). The pose is the one that the nodes' own transforms make.
#[derive(Default)]
pub struct Pose {
    pub weights: Vec<f64>,
    pub joints: Vec<DAffine3>,
}

/// The poses of nodes. The joints of a skin may lie in what is hidden, or in no scene.
pub struct Poses<'s> {
    scene: &'s Scene,
    /// World from node by slot; made for the first skin.
    worlds: Option<Vec<DAffine3>>,
}

impl<'s> Poses<'s> {
    pub fn new(scene: &'s Scene) -> Self {
        Self { scene, worlds: None }
    }

    /// `None` if the node shows its mesh as it is stored.
    pub fn of(&mut self, node: &Node) -> Result<Option<Pose>, AccessorError> {
        let scene = self.scene;
        let Some(mesh) = node.mesh.map(|id| &scene.meshes()[id]) else { return Ok(None) };
        let has_targets = mesh.primitives.iter().any(|p| !p.targets.is_empty());
        let weights = node.weights.as_ref().unwrap_or(&mesh.weights);
        let is_morphed = has_targets && weights.iter().any(|&w| w != 0.0);
        let mut pose = Pose { weights: if is_morphed { weights.clone() } else { Vec::new() }, joints: Vec::new() };
        if let Some(skin) = node.skin.map(|id| &scene.skins()[id]) {
            let worlds = self.worlds.get_or_insert_with(|| {
                let mut worlds = vec![DAffine3::IDENTITY; scene.nodes().slot_bound()];
                for p in walk(scene, all_roots(scene), |_| true) {
                    worlds[Store::<NodeId, Node>::slot(p.node)] = p.world;
                }
                worlds
            });
            let inverse_bind = match skin.inverse_bind_matrices {
                Some(id) => accessor::read_f32::<16>(scene, id)?,
                None => Vec::new(),
            };
            let joint = |(i, &joint): (usize, &NodeId)| {
                let bind = inverse_bind
                    .get(i)
                    .map_or(DAffine3::IDENTITY, |m| DAffine3::from_mat4(DMat4::from_cols_array(&m.map(f64::from))));
                worlds[Store::<NodeId, Node>::slot(joint)] * bind
            };
            pose.joints = skin.joints.iter().enumerate().map(joint).collect();
        }
        Ok((is_morphed || !pose.joints.is_empty()).then_some(pose))
    }
}
