//! Copies of subtrees.

use super::copy_name;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::{Place, Step};
use crate::model::*;
use crate::place::At;
use crate::visit::{VisitorMut, visit_object_mut};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::collections::BTreeSet;

/// Old ids to new ones; what is not in it stays.
pub struct Rename<'m>(pub &'m FxHashMap<AnyId, AnyId>);

impl VisitorMut for Rename<'_> {
    fn slot<K: Id>(&mut self, id: &mut K, _: &At<'_>) {
        if let Some(&new) = self.0.get(&(*id).into())
            && let Some(new) = K::from_any(new)
        {
            *id = new;
        }
    }

    fn parent(&mut self, id: &mut NodeId) {
        self.slot(id, &At::Root);
    }
}

pub fn duplicate(p: &mut Plan<'_>, top: NodeId) -> Result<()> {
    let nodes = p.subtree(top)?;
    let mut renamed: FxHashMap<AnyId, AnyId> = FxHashMap::with_capacity_and_hasher(nodes.len(), FxBuildHasher);
    let mut copies = Vec::with_capacity(nodes.len());
    for &node in &nodes {
        let mut copy = p.node(node)?.clone();
        if node == top {
            copy.name = Some(copy_name(copy.name.as_deref()));
            copy.parent = None;
        }
        let copy = p.add_node(copy);
        renamed.insert(node.into(), copy.into());
        copies.push(copy);
    }
    let mut skins = BTreeSet::new();
    for &node in &nodes {
        let skin = p.node(node)?.skin;
        skins.extend(skin);
    }
    for skin in skins {
        let original = p.skin(skin)?;
        if original.joints.iter().any(|&joint| renamed.contains_key(&joint.into())) {
            let mut copy = original.clone();
            copy.name = copy.name.map(|name| copy_name(Some(&name)));
            let copy = p.add_skin(copy);
            visit_object_mut(p.scene, copy.into(), &mut Rename(&renamed));
            renamed.insert(skin.into(), copy.into());
        }
    }
    for &copy in &copies {
        visit_object_mut(p.scene, copy.into(), &mut Rename(&renamed));
    }
    extend_animations(p, &nodes, &renamed)?;

    let copy = copies[0];
    for place in p.places(top)? {
        let siblings = match place {
            Place::Under(parent) => &p.node(parent)?.children,
            Place::RootOf(scene) => &p.scene_roots(scene)?.roots,
        };
        let index = siblings.position(top).map_or(usize::MAX, |index| index + 1);
        p.step(Step::Attach { node: copy, place, index });
    }
    p.made = Some(copy.into());
    Ok(())
}

/// Animations that move originals move the copies as well, by the same samplers.
fn extend_animations(p: &mut Plan<'_>, nodes: &[NodeId], renamed: &FxHashMap<AnyId, AnyId>) -> Result<()> {
    let mut animations = BTreeSet::new();
    for &node in nodes {
        animations.extend(p.referrers(node).into_iter().filter_map(|owner| match owner {
            AnyId::Animation(id) => Some(id),
            _ => None,
        }));
    }
    for id in animations {
        let animation = p.animation(id)?;
        let looked_at = animation.channels.len();
        let mut new = Vec::new();
        for channel in &animation.channels {
            if let Some(copy) = renamed_channel(channel, renamed) {
                new.push((looked_at + new.len(), copy));
            }
        }
        p.visited += looked_at as u64;
        if !new.is_empty() {
            p.step(Step::PutChannels { animation: id, channels: new, samplers: Vec::new() });
        }
    }
    Ok(())
}

/// The channel of the copies, if the channel moves an original.
fn renamed_channel(channel: &AnimationChannel, renamed: &FxHashMap<AnyId, AnyId>) -> Option<AnimationChannel> {
    let is_original = |id: AnyId| renamed.contains_key(&id);
    let moves = channel.node.is_some_and(|node| is_original(node.into()))
        || channel.target_extra.links().iter().any(|link| is_original(link.target));
    if !moves {
        return None;
    }
    let mut copy = channel.clone();
    if let Some(node) = &mut copy.node
        && let Some(&AnyId::Node(target)) = renamed.get(&(*node).into())
    {
        *node = target;
    }
    for link in copy.target_extra.links_mut() {
        if let Some(&target) = renamed.get(&link.target) {
            link.target = target;
        }
    }
    Some(copy)
}
