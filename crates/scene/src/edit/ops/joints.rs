//! Skins that lose joints.

use crate::accessor;
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::{NodeField, Object};
use crate::model::*;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;

/// Where an influence of a joint goes: to another one, by its new index, or nowhere.
type Targets = Vec<Option<u16>>;

/// The accessors of a set: joints and weights.
type Influences = (AccessorId, AccessorId);

/// Takes the joints that go out of a skin, with their inverse bind matrices, and brings the vertices of the meshes that it
/// deforms along: what followed a joint that goes follows its nearest ancestor that stays, and where there is none, the
/// other influences share its weight. A skin that loses all joints goes, and its meshes stand still. O(joints + vertices).
pub fn without(p: &mut Plan<'_>, id: SkinId, gone: &FxHashSet<AnyId>, parked: &mut Vec<AnyId>) -> Result<()> {
    let mut skin = p.skin(id)?.clone();
    p.visited += skin.joints.len() as u64;
    let is_gone = |node: NodeId| gone.contains(&node.into());
    let users: Vec<NodeId> = p
        .referrers(id)
        .into_iter()
        .filter_map(|owner| match owner {
            AnyId::Node(node) if !is_gone(node) => Some(node),
            _ => None,
        })
        .collect();
    if skin.skeleton.is_some_and(is_gone) {
        skin.skeleton = None;
    }
    let stays: Vec<bool> = skin.joints.iter().map(|&joint| !is_gone(joint)).collect();
    if stays.iter().all(|&stays| !stays) {
        users.into_iter().for_each(|node| p.set(node, NodeField::Skin(None)));
        parked.push(id.into());
        return Ok(());
    }
    if stays.iter().all(|&stays| stays) {
        p.replace(Object::Skin(id, skin));
        return Ok(());
    }
    let targets = targets(p, &skin.joints, &stays)?;
    if let Some(matrices) = skin.inverse_bind_matrices {
        skin.inverse_bind_matrices = Some(kept_matrices(p, matrices, &stays)?);
    }
    let mut next = stays.iter();
    skin.joints.retain(|_| next.next().copied().unwrap_or(true));
    p.replace(Object::Skin(id, skin));

    let mut by_mesh: BTreeMap<MeshId, Vec<NodeId>> = BTreeMap::new();
    for node in users {
        if let Some(mesh) = p.node(node)?.mesh {
            by_mesh.entry(mesh).or_default().push(node);
        }
    }
    for (mesh, nodes) in by_mesh {
        remap_mesh(p, mesh, &nodes, &targets)?;
    }
    Ok(())
}

/// Where the influence of each joint goes.
fn targets(p: &mut Plan<'_>, joints: &[NodeId], stays: &[bool]) -> Result<Targets> {
    let mut new_index: FxHashMap<NodeId, u16> = FxHashMap::default();
    for (&joint, _) in joints.iter().zip(stays).filter(|(_, stays)| **stays) {
        new_index.insert(joint, new_index.len() as u16);
    }
    let mut targets = Vec::with_capacity(joints.len());
    for &joint in joints {
        let mut at = Some(joint);
        let mut target = None;
        while let Some(node) = at {
            target = new_index.get(&node).copied();
            if target.is_some() {
                break;
            }
            at = p.node(node)?.parent;
            p.visited += 1;
        }
        targets.push(target);
    }
    Ok(targets)
}

fn unreadable(id: AccessorId) -> impl FnOnce(accessor::AccessorError) -> EditError {
    move |error| EditError::missing(id, error.to_string())
}

fn kept_matrices(p: &mut Plan<'_>, id: AccessorId, stays: &[bool]) -> Result<AccessorId> {
    let matrices = accessor::read_f32::<16>(p.scene, id).map_err(unreadable(id))?;
    let kept: Vec<u8> = matrices
        .iter()
        .zip(stays)
        .filter(|(_, stays)| **stays)
        .flat_map(|(matrix, _)| matrix.iter().flat_map(|v| v.to_le_bytes()))
        .collect();
    let count = stays.iter().filter(|&&stays| stays).count();
    Ok(add_accessor(p, kept, ComponentType::F32, ElementType::Mat4, count, None))
}

/// A new accessor with a buffer of its own: export puts buffers together.
pub fn add_accessor(
    p: &mut Plan<'_>,
    bytes: Vec<u8>,
    component_type: ComponentType,
    element_type: ElementType,
    count: usize,
    target: Option<u32>,
) -> AccessorId {
    let length = bytes.len();
    let buffer = p.add_buffer(Buffer { name: None, uri: None, data: Blob::new(bytes), extra: Extra::default() });
    let view = p.add_view(BufferView::new(buffer, 0, length, target));
    p.add_accessor(Accessor::packed(view, component_type, element_type, count))
}

/// Gives the nodes of a skin a mesh whose joints are the new ones: the mesh itself if nobody else shows it, else a copy.
fn remap_mesh(p: &mut Plan<'_>, id: MeshId, nodes: &[NodeId], targets: &Targets) -> Result<()> {
    let mut mesh = p.mesh(id)?.clone();
    let mut known: FxHashMap<Vec<Influences>, Vec<Influences>> = FxHashMap::default();
    for primitive in &mut mesh.primitives {
        let mut sets = Vec::new();
        for set in 0.. {
            let [joints, weights] = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
            match (primitive.attributes.get(&joints), primitive.attributes.get(&weights)) {
                (Some(joints), Some(weights)) => sets.push((joints, weights)),
                _ => break,
            }
        }
        if sets.is_empty() {
            continue;
        }
        let new = match known.get(&sets) {
            Some(new) => new.clone(),
            None => remap_vertices(p, &sets, targets)?,
        };
        for (set, &(joints, weights)) in new.iter().enumerate() {
            for (semantic, slot) in &mut primitive.attributes.0 {
                if *semantic == format!("JOINTS_{set}") {
                    *slot = joints;
                } else if *semantic == format!("WEIGHTS_{set}") {
                    *slot = weights;
                }
            }
        }
        known.insert(sets, new);
    }
    let is_own = p.referrers(id).iter().all(|owner| matches!(owner, AnyId::Node(node) if nodes.contains(node)));
    if is_own {
        p.replace(Object::Mesh(id, mesh));
    } else {
        let copy = p.add_mesh(mesh);
        nodes.iter().for_each(|&node| p.set(node, NodeField::Mesh(Some(copy))));
    }
    Ok(())
}

/// New joints and weights of the sets of a primitive. Weights stay normalised over all sets.
fn remap_vertices(
    p: &mut Plan<'_>,
    sets: &[(AccessorId, AccessorId)],
    targets: &Targets,
) -> Result<Vec<(AccessorId, AccessorId)>> {
    let mut joints = Vec::new();
    let mut weights = Vec::new();
    for &(joint, weight) in sets {
        joints.push(accessor::read_joints(p.scene, joint).map_err(unreadable(joint))?);
        weights.push(accessor::read_f32::<4>(p.scene, weight).map_err(unreadable(weight))?);
    }
    let vertices = joints.iter().map(Vec::len).chain(weights.iter().map(Vec::len)).min().unwrap_or(0);
    p.visited += vertices as u64;
    for v in 0..vertices {
        let before: f32 = weights.iter().flat_map(|set| set[v]).sum();
        for (joint, weight) in joints.iter_mut().zip(&mut weights) {
            for (joint, weight) in joint[v].iter_mut().zip(&mut weight[v]) {
                match targets.get(usize::from(*joint)).copied().flatten() {
                    Some(target) => *joint = target,
                    None => (*joint, *weight) = (0, 0.0),
                }
            }
        }
        unite_influences(&mut joints, &mut weights, v);
        let after: f32 = weights.iter().flat_map(|set| set[v]).sum();
        if after > 0.0 && after != before {
            let factor = before / after;
            weights.iter_mut().flat_map(|set| &mut set[v]).for_each(|weight| *weight *= factor);
        } else if after == 0.0 && before > 0.0 {
            (joints[0][v][0], weights[0][v][0]) = (0, before);
        }
    }
    let wide = targets.iter().flatten().any(|&target| target > 255);
    let mut new = Vec::with_capacity(sets.len());
    for (joints, weights) in joints.iter().zip(&weights) {
        let (bytes, component): (Vec<u8>, _) = if wide {
            (joints[..vertices].iter().flatten().flat_map(|joint| joint.to_le_bytes()).collect(), ComponentType::U16)
        } else {
            (joints[..vertices].iter().flatten().map(|&joint| joint as u8).collect(), ComponentType::U8)
        };
        let vertex_data = Some(34962);
        let joints = add_accessor(p, bytes, component, ElementType::Vec4, vertices, vertex_data);
        let bytes = weights[..vertices].iter().flatten().flat_map(|weight| weight.to_le_bytes()).collect();
        let weights = add_accessor(p, bytes, ComponentType::F32, ElementType::Vec4, vertices, vertex_data);
        new.push((joints, weights));
    }
    Ok(new)
}

/// A joint may influence a vertex once (glTF 2.0, section 3.7.3.3): the weights of equal joints go to the first.
fn unite_influences(joints: &mut [Vec<[u16; 4]>], weights: &mut [Vec<[f32; 4]>], v: usize) {
    let count = joints.len() * 4;
    for i in 0..count {
        for k in i + 1..count {
            let ((si, ci), (sk, ck)) = ((i / 4, i % 4), (k / 4, k % 4));
            if weights[sk][v][ck] != 0.0 && joints[si][v][ci] == joints[sk][v][ck] {
                weights[si][v][ci] += weights[sk][v][ck];
                (joints[sk][v][ck], weights[sk][v][ck]) = (0, 0.0);
            }
        }
    }
}
