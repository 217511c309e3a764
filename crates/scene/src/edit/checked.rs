//! Steps that come from outside: an inverse that was saved, or made by hand, or for another state of the scene.
//!
//! Each is checked before it is carried out, so that it cannot fail, and what all have touched is checked at the end. What
//! is refused is taken back step by step: the scene is as before then.

use super::EditError;
use super::error::Named;
use super::step::{NodeField, Object, Place, Step};
use crate::Scene;
use crate::edit::{ChangeSet, Facets};
use crate::model::*;
use crate::place::At;
use crate::visit::{Owner, ReferenceIndex, Visitor, visit_object};
use rustc_hash::{FxBuildHasher, FxHashSet};

/// What is wrong with a step or with what the steps led to.
type Check = Result<(), String>;

/// Turns what is wrong into a refusal.
pub(super) fn refused(step: Option<usize>) -> impl FnOnce(String) -> EditError {
    move |what| EditError::Steps { step, what }
}

fn live(scene: &Scene, id: impl Into<AnyId>) -> Check {
    let id = id.into();
    if scene.contains(id) { Ok(()) } else { Err(format!("there is no {}", Named(id))) }
}

fn ascending(what: &str, mut indices: impl Iterator<Item = usize>) -> Check {
    let mut last = None;
    match indices.find(|&index| last.replace(index).is_some_and(|before| before >= index)) {
        Some(index) => Err(format!("{what} {index} comes out of order")),
        None => Ok(()),
    }
}

/// Whether a step can be carried out on the scene as it is now.
pub(super) fn before(scene: &Scene, index: &ReferenceIndex, step: &Step) -> Check {
    match step {
        Step::Park(ids) => {
            distinct(ids)?;
            ids.iter().try_for_each(|&id| live(scene, id))
        }
        Step::Unpark(ids) => {
            distinct(ids)?;
            match ids.iter().find(|&&id| !scene.is_parked(id)) {
                Some(&id) => Err(format!("{} is not among what was taken out", Named(id))),
                None => Ok(()),
            }
        }
        Step::Attach { node, place, .. } => attach(scene, index, *node, *place),
        Step::Detach { node, place } => {
            live(scene, *node)?;
            match siblings(scene, *place)?.position(*node) {
                Some(_) => Ok(()),
                None => Err(format!("{} does not hang there", Named((*node).into()))),
            }
        }
        Step::Node(id, field) => {
            live(scene, *id)?;
            let is_finite = match field {
                NodeField::Transform(Transform::Trs { translation, rotation, scale }) => {
                    translation.iter().chain(rotation).chain(scale).all(|v| v.is_finite())
                }
                NodeField::Transform(Transform::Matrix(matrix)) => matrix.iter().all(|v| v.is_finite()),
                NodeField::Weights(Some(weights)) => weights.iter().all(|v| v.is_finite()),
                _ => true,
            };
            if is_finite { Ok(()) } else { Err(format!("{}: every number must be finite", Named((*id).into()))) }
        }
        Step::Replace(object) => {
            live(scene, object.id())?;
            match object {
                Object::Animation(_, animation) => samplers(animation.channels.iter(), animation.samplers.len()),
                _ => Ok(()),
            }
        }
        Step::TakeChannels { animation, channels, samplers } => {
            let value = scene.animations.get(*animation).ok_or_else(|| live(scene, *animation).unwrap_err())?;
            ascending("channel", channels.iter().copied())?;
            ascending("sampler", samplers.iter().copied())?;
            if channels.last().is_some_and(|&i| i >= value.channels.len())
                || samplers.last().is_some_and(|&i| i >= value.samplers.len())
            {
                return Err(format!("{} has fewer channels or samplers", Named((*animation).into())));
            }
            let stays = |i: &usize| channels.binary_search(i).is_err();
            let mut left = (0..value.channels.len()).filter(stays).map(|i| value.channels[i].sampler);
            match left.find(|sampler| samplers.binary_search(sampler).is_ok()) {
                Some(sampler) => Err(format!("a channel that stays has sampler {sampler}, which goes")),
                None => Ok(()),
            }
        }
        Step::PutChannels { animation, channels, samplers: new } => {
            let value = scene.animations.get(*animation).ok_or_else(|| live(scene, *animation).unwrap_err())?;
            ascending("channel", channels.iter().map(|(i, _)| *i))?;
            ascending("sampler", new.iter().map(|(i, _)| *i))?;
            let end = |there: usize, new: usize| there + new;
            let (all_channels, all_samplers) =
                (end(value.channels.len(), channels.len()), end(value.samplers.len(), new.len()));
            if channels.last().is_some_and(|(i, _)| *i >= all_channels)
                || new.last().is_some_and(|(i, _)| *i >= all_samplers)
            {
                return Err(format!("{} has too few channels or samplers for that place", Named((*animation).into())));
            }
            samplers(channels.iter().map(|(_, channel)| channel), all_samplers)
        }
        Step::DefaultScene(id) => id.map_or(Ok(()), |id| live(scene, id)),
        Step::Variant(id) => id.map_or(Ok(()), |id| live(scene, id)),
        Step::DocumentExtra(_) | Step::AssetExtra(_) | Step::Extensions(_) => Ok(()),
    }
}

fn distinct(ids: &[AnyId]) -> Check {
    let mut seen = FxHashSet::with_capacity_and_hasher(ids.len(), FxBuildHasher);
    match ids.iter().find(|&&id| !seen.insert(id)) {
        Some(&id) => Err(format!("{} comes twice", Named(id))),
        None => Ok(()),
    }
}

fn samplers<'a>(mut channels: impl Iterator<Item = &'a AnimationChannel>, count: usize) -> Check {
    match channels.find(|channel| channel.sampler >= count) {
        Some(channel) => Err(format!("a channel has sampler {}; there are {count}", channel.sampler)),
        None => Ok(()),
    }
}

fn siblings(scene: &Scene, place: Place) -> Result<&Children, String> {
    match place {
        Place::Under(parent) => {
            live(scene, parent)?;
            Ok(&scene.nodes[parent].children)
        }
        Place::RootOf(id) => {
            live(scene, id)?;
            Ok(&scene.scenes[id].roots)
        }
    }
}

fn attach(scene: &Scene, index: &ReferenceIndex, node: NodeId, place: Place) -> Check {
    let named = Named(node.into());
    live(scene, node)?;
    if siblings(scene, place)?.position(node).is_some() {
        return Err(format!("{named} hangs there already"));
    }
    if scene.nodes[node].parent.is_some() {
        return Err(format!("{named} has a parent already"));
    }
    let Place::Under(parent) = place else { return Ok(()) };
    if index.referrers(node).any(|(owner, _)| matches!(owner, Owner::Object(AnyId::Scene(_)))) {
        return Err(format!("{named} is a root, and cannot have a parent"));
    }
    let mut above = Some(parent);
    while let Some(id) = above {
        if id == node {
            return Err(format!("{named} would be its own ancestor"));
        }
        above = scene.nodes.get(id).and_then(|node| node.parent);
    }
    Ok(())
}

/// References to objects that are not in the document.
struct Dangling<'s>(&'s Scene, Option<String>);

impl Visitor for Dangling<'_> {
    fn slot<K: Id>(&mut self, id: K, at: &At<'_>) {
        if self.1.is_none() && !self.0.contains(id) {
            self.1 = Some(format!("{} leads to {}, which is not there", at.pointer(), Named(id.into())));
        }
    }

    /// A node of a million children is changed without a look at them.
    fn children(&mut self, _: &Children, _: &At<'_>) {}
}

/// Whether what was touched is what a document may hold.
pub(super) fn after(scene: &Scene, index: &ReferenceIndex, changes: &ChangeSet) -> Check {
    for &(id, facets) in changes.objects() {
        if !scene.contains(id) {
            gone(scene, index, id)?;
            continue;
        }
        let mut dangling = Dangling(scene, None);
        visit_object(scene, id, &mut dangling);
        if let Some(what) = dangling.1 {
            return Err(what);
        }
        let is_new = facets.has(Facets::ADDED);
        match id {
            AnyId::Node(id) => node(scene, id, is_new)?,
            AnyId::Scene(id) if is_new => {
                for root in scene.scenes[id].roots.iter() {
                    live(scene, root)?;
                }
            }
            AnyId::Skin(id) => skin(scene, id)?,
            _ => {}
        }
    }
    if changes.document {
        let mut dangling = Dangling(scene, None);
        crate::visit::visit_document(scene, &mut dangling);
        if let Some(what) = dangling.1 {
            return Err(what);
        }
    }
    match scene.shown_variant {
        Some(id) if !scene.contains(id) => Err("the variant that is shown is not there".to_owned()),
        _ => Ok(()),
    }
}

/// What has left the document: nobody may refer to it any more.
fn gone(scene: &Scene, index: &ReferenceIndex, id: AnyId) -> Check {
    if let Some((owner, _)) = index.referrers(id).next() {
        let owner = match owner {
            Owner::Document => "the document".to_owned(),
            Owner::Object(owner) => Named(owner).to_string(),
        };
        return Err(format!("{owner} refers to {}, which goes", Named(id)));
    }
    let AnyId::Node(node) = id else { return Ok(()) };
    let Some(value) = scene.nodes.get_any(node) else { return Ok(()) };
    let near = value.parent.into_iter().chain(value.children.iter());
    match near.into_iter().find(|&near| scene.contains(near)) {
        Some(near) => Err(format!("{} goes, and {} beside it in the hierarchy stays", Named(id), Named(near.into()))),
        None => Ok(()),
    }
}

fn node(scene: &Scene, id: NodeId, is_new: bool) -> Check {
    let node = &scene.nodes[id];
    let named = Named(id.into());
    if let Some(parent) = node.parent {
        live(scene, parent)?;
        if scene.nodes[parent].children.position(id).is_none() {
            return Err(format!("{named} is no child of its parent"));
        }
    }
    if !is_new {
        return Ok(());
    }
    match node.children.iter().find(|&child| scene.nodes.get(child).is_none_or(|child| child.parent != Some(id))) {
        Some(child) => Err(format!("{named} has {} as a child, which is not", Named(child.into()))),
        None => Ok(()),
    }
}

fn skin(scene: &Scene, id: SkinId) -> Check {
    let skin = &scene.skins[id];
    let matrices = skin.inverse_bind_matrices.map(|id| scene.accessors[id].count);
    if skin.joints.is_empty() || matrices.is_some_and(|count| count < skin.joints.len()) {
        return Err(format!("{} has no joints, or fewer inverse bind matrices", Named(id.into())));
    }
    Ok(())
}
