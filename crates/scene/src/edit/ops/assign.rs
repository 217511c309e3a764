//! What a node shows, what a primitive is made of, and names.

use super::delete::without_channels;
use super::{applicable, copy_name, skins};
use crate::accessor;
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::{NodeField, Object, Step};
use crate::model::*;
use crate::visit::pointer_index;
use std::collections::BTreeSet;

/// Whether every primitive has joints and weights.
fn is_skinnable(mesh: &Mesh) -> bool {
    let has = |p: &Primitive, semantic: &str| p.attributes.get(semantic).is_some();
    !mesh.primitives.is_empty() && mesh.primitives.iter().all(|p| has(p, "JOINTS_0") && has(p, "WEIGHTS_0"))
}

/// Whether a skin has all the joints that the vertices of a mesh name. O(vertices).
fn has_joints(p: &mut Plan<'_>, skin: SkinId, mesh: MeshId) -> Result<bool> {
    let count = p.skin(skin)?.joints.len();
    for primitive in &p.mesh(mesh)?.primitives {
        for set in 0.. {
            let Some(id) = primitive.attributes.get(&format!("JOINTS_{set}")) else { break };
            let joints = accessor::read_joints(p.scene, id).map_err(|e| EditError::missing(id, e.to_string()))?;
            if joints.iter().flatten().any(|&joint| usize::from(joint) >= count) {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

pub fn set_mesh(p: &mut Plan<'_>, node: NodeId, mesh: Option<MeshId>) -> Result<()> {
    let (skin, weights) = p.node(node).map(|n| (n.skin, n.weights.as_ref().map(Vec::len)))?;
    let shape = mesh.map(|mesh| p.mesh(mesh)).transpose()?;
    let count = |mesh: &Mesh| mesh.primitives.first().map_or(0, |primitive| primitive.targets.len());
    let shown = p.node(node)?.mesh.map(|mesh| p.mesh(mesh)).transpose()?.map_or(0, count);
    let is_skinnable = shape.is_some_and(is_skinnable);
    let targets = shape.map_or(0, count);
    if let Some(skin) = skin {
        let fits = is_skinnable && mesh.map_or(Ok(false), |mesh| has_joints(p, skin, mesh))?;
        if !fits {
            p.set(node, NodeField::Skin(None));
        }
    }
    if weights.is_some_and(|count| count != targets) {
        p.set(node, NodeField::Weights(None));
    }
    p.set(node, NodeField::Mesh(mesh));
    if targets != shown {
        without_weights(p, node, targets)?;
    }
    Ok(())
}

/// Whether a channel leads to the weights of a node by a pointer (KHR_animation_pointer): to all, which are of another
/// number now, or to one that a mesh of so many targets has not.
fn points_to_weights(channel: &AnimationChannel, node: NodeId, targets: usize) -> bool {
    let extensions = channel.target_extra.extensions.as_deref();
    let pointer = extensions.and_then(|all| all.get("KHR_animation_pointer")?.get("pointer")?.as_str());
    // Which node it is is said by the link: the number in the pointer is that of the file.
    let is_it = channel.target_extra.links().iter().any(|link| link.target == node.into());
    let Some((Kind::Node, _, rest)) = pointer.filter(|_| is_it).and_then(pointer_index) else { return false };
    match rest.strip_prefix("/weights") {
        Some("") => true,
        Some(element) => element.strip_prefix('/').and_then(|i| i.parse().ok()).is_some_and(|i: usize| i >= targets),
        None => false,
    }
}

/// Takes the channels that animate a node's weights out of all animations: they have values for other morph targets. What
/// animates the weights of a mesh stays: the mesh is what it was.
fn without_weights(p: &mut Plan<'_>, node: NodeId, targets: usize) -> Result<()> {
    let animations: BTreeSet<AnimationId> = p
        .referrers(node)
        .into_iter()
        .filter_map(|owner| match owner {
            AnyId::Animation(animation) => Some(animation),
            _ => None,
        })
        .collect();
    let goes = |channel: &AnimationChannel| match channel.path {
        AnimationPath::Weights => channel.node == Some(node),
        AnimationPath::Pointer => points_to_weights(channel, node, targets),
        _ => false,
    };
    let mut parked = Vec::new();
    for animation in animations {
        without_channels(p, animation, &goes, &mut parked)?;
    }
    if !parked.is_empty() {
        p.step(Step::Park(parked));
    }
    Ok(())
}

pub fn set_camera(p: &mut Plan<'_>, node: NodeId, camera: Option<CameraId>) -> Result<()> {
    p.node(node)?;
    camera.map(|camera| p.camera(camera).map(|_| ())).transpose()?;
    p.set(node, NodeField::Camera(camera));
    Ok(())
}

pub fn set_skin(p: &mut Plan<'_>, node: NodeId, skin: Option<SkinId>) -> Result<()> {
    let (mesh, now) = p.node(node).map(|node| (node.mesh, node.skin))?;
    if let Some(skin) = skin {
        p.skin(skin)?;
        let Some(mesh) = mesh else {
            return Err(EditError::missing(node, "it shows no mesh that a skin could deform; give it one first"));
        };
        if !is_skinnable(p.mesh(mesh)?) {
            return Err(EditError::missing(mesh, "it has a primitive without JOINTS_0 and WEIGHTS_0; no skin fits it"));
        }
        if !has_joints(p, skin, mesh)? {
            return Err(EditError::missing(skin, "it has fewer joints than the vertices of the mesh name"));
        }
        if now != Some(skin) {
            skins::shown_with(p, node, skin)?;
        }
    }
    p.set(node, NodeField::Skin(skin));
    Ok(())
}

pub fn material(p: &mut Plan<'_>, mesh: MeshId, primitive: usize, material: Option<MaterialId>) -> Result<()> {
    let mut value = p.mesh(mesh)?.clone();
    material.map(|material| p.material(material).map(|_| ())).transpose()?;
    let count = value.primitives.len();
    let Some(slot) = value.primitives.get_mut(primitive) else {
        return Err(EditError::missing(mesh, format!("there is no primitive {primitive}; it has {count}")));
    };
    slot.material = material;
    if let Some(material) = material {
        applicable::to_primitive(p, material, mesh, primitive)?;
    }
    p.replace(Object::Mesh(mesh, value));
    Ok(())
}

pub fn duplicate_material(p: &mut Plan<'_>, material: MaterialId) -> Result<()> {
    let mut value = p.material(material)?.clone();
    value.name = Some(copy_name(value.name.as_deref()));
    p.made = Some(p.add_material(value).into());
    Ok(())
}

pub fn select_variant(p: &mut Plan<'_>, variant: Option<VariantId>) -> Result<()> {
    if let Some(id) = variant.filter(|&id| p.scene.variants.get(id).is_none()) {
        return Err(EditError::Stale(id.into()));
    }
    p.step(Step::Variant(variant));
    Ok(())
}

pub fn rename(p: &mut Plan<'_>, object: AnyId, name: Option<String>) -> Result<()> {
    macro_rules! renamed {
        ($get:ident $id:ident $kind:ident) => {{
            let mut value = p.$get($id)?.clone();
            value.name = name;
            p.replace(Object::$kind($id, value.into()));
        }};
    }
    match object {
        AnyId::Node(id) => {
            p.node(id)?;
            p.set(id, NodeField::Name(name));
        }
        AnyId::Mesh(id) => renamed!(mesh id Mesh),
        AnyId::Material(id) => renamed!(material id Material),
        AnyId::Light(id) => renamed!(light id Light),
        AnyId::Camera(id) => renamed!(camera id Camera),
        AnyId::Skin(id) => renamed!(skin id Skin),
        AnyId::Animation(id) => renamed!(animation id Animation),
        other => {
            let what = "it cannot be renamed; nodes, meshes, materials, lights, cameras, skins and animations can";
            return Err(EditError::missing(other, what));
        }
    }
    Ok(())
}
