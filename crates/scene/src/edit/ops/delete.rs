//! Taking objects out of the document, and mending what referred to them.

use super::joints;
use super::links::drop_links;
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::{NodeField, Place, Step};
use crate::model::*;
use crate::visit;
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;

/// Who has to be mended when nodes go.
#[derive(Default)]
struct Mend {
    roots: Vec<(SceneId, NodeId)>,
    skins: BTreeSet<SkinId>,
    animations: BTreeSet<AnimationId>,
    /// Nodes whose extensions refer to one that goes.
    nodes: BTreeSet<NodeId>,
}

pub fn delete(p: &mut Plan<'_>, top: NodeId) -> Result<()> {
    let nodes = p.subtree(top)?;
    let gone: FxHashSet<AnyId> = nodes.iter().map(|&node| node.into()).collect();
    let mut mend = Mend::default();
    for &node in &nodes {
        for owner in p.referrers(node) {
            match owner {
                AnyId::Scene(scene) => mend.roots.push((scene, node)),
                AnyId::Skin(skin) => drop(mend.skins.insert(skin)),
                AnyId::Animation(animation) => drop(mend.animations.insert(animation)),
                AnyId::Node(owner) if gone.contains(&owner.into()) => {}
                AnyId::Node(owner) => drop(mend.nodes.insert(owner)),
                owner => return Err(EditError::Unmendable { owner, target: node.into() }),
            }
        }
    }
    let mut parked: Vec<AnyId> = nodes.iter().map(|&node| node.into()).collect();
    let refers = |extra: &Extra| extra.links().iter().any(|link| gone.contains(&link.target));
    let goes = |channel: &AnimationChannel| {
        let moves = channel.node.is_some_and(|node| gone.contains(&node.into()));
        moves || refers(&channel.target_extra) || refers(&channel.extra)
    };
    for &animation in &mend.animations {
        without_channels(p, animation, &goes, &mut parked)?;
    }
    for &skin in &mend.skins {
        joints::without(p, skin, &gone, &mut parked)?;
    }
    for &node in &mend.nodes {
        let mut extra = p.node(node)?.extra.clone();
        drop_links(&mut extra, &gone);
        p.set(node, NodeField::Extra(extra));
    }
    if let Some(parent) = p.node(top)?.parent {
        p.step(Step::Detach { node: top, place: Place::Under(parent) });
    }
    for (scene, node) in mend.roots {
        p.step(Step::Detach { node, place: Place::RootOf(scene) });
    }
    drop_carried(p, &parked);
    p.step(Step::Park(parked));
    Ok(())
}

/// Mends what the document as a whole carries.
fn drop_carried(p: &mut Plan<'_>, parked: &[AnyId]) {
    if !parked.iter().any(|&id| p.is_carried(id)) {
        return;
    }
    let gone: FxHashSet<AnyId> = parked.iter().copied().collect();
    let mend = |extra: &Extra| {
        let mut mended = extra.clone();
        drop_links(&mut mended, &gone);
        (mended != *extra).then_some(mended)
    };
    let (document, asset) = (mend(&p.scene.extra), mend(&p.scene.asset.extra));
    document.map(Step::DocumentExtra).into_iter().chain(asset.map(Step::AssetExtra)).for_each(|step| p.step(step));
}

/// Takes channels out of an animation, and the samplers that only they had. An animation without channels goes (glTF 2.0
/// asks for one at least). O(channels), to find them; what is kept for the undo is what goes.
pub fn without_channels(
    p: &mut Plan<'_>,
    id: AnimationId,
    goes: &dyn Fn(&AnimationChannel) -> bool,
    parked: &mut Vec<AnyId>,
) -> Result<()> {
    let animation = p.animation(id)?;
    let mut used = vec![false; animation.samplers.len()];
    let mut orphaned = Vec::new();
    let mut channels = Vec::new();
    for (i, channel) in animation.channels.iter().enumerate() {
        if goes(channel) {
            channels.push(i);
            orphaned.push(channel.sampler);
        } else if let Some(used) = used.get_mut(channel.sampler) {
            *used = true;
        }
    }
    let is_empty = channels.len() == animation.channels.len();
    let looked_at = animation.channels.len() as u64;
    p.visited += looked_at;
    if channels.is_empty() {
        return Ok(());
    }
    if is_empty {
        if let Some(&owner) = p.referrers(id).first() {
            return Err(EditError::Unmendable { owner, target: id.into() });
        }
        parked.push(id.into());
        return Ok(());
    }
    orphaned.retain(|&sampler| used.get(sampler) == Some(&false));
    orphaned.sort_unstable();
    orphaned.dedup();
    p.step(Step::TakeChannels { animation: id, channels, samplers: orphaned });
    Ok(())
}

/// The one edit that looks at the whole document, once.
pub fn remove_unused(p: &mut Plan<'_>) -> Result<()> {
    let all: usize = Kind::ALL.iter().map(|&kind| p.scene.count(kind)).sum();
    p.visited += all as u64;
    let unused = visit::unused(p.scene);
    let nodes: FxHashSet<NodeId> = unused
        .iter()
        .filter_map(|id| match id {
            AnyId::Node(id) => Some(*id),
            _ => None,
        })
        .collect();
    // What is unused is not below what is used. Below each other they stay as they are, for the undo.
    if !unused.is_empty() {
        p.step(Step::Park(unused));
    }
    debug_assert!(nodes.iter().all(|&id| p.scene.nodes[id].parent.is_none_or(|parent| nodes.contains(&parent))));
    Ok(())
}
