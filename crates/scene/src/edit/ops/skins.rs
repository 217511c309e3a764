//! Skins, when nodes move: their joints keep a common root (glTF 2.0, section 3.7.3.1), and are in every scene that shows what
//! they deform (section 3.7.3.3, by which a skinned mesh stands where its joints are).

use crate::Scene;
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::{Object, Place};
use crate::model::*;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;

/// A subtree on its way to another place.
struct Move {
    node: NodeId,
    /// All of it.
    moved: FxHashSet<NodeId>,
    /// The topmost node above it, before and afterwards.
    top: [NodeId; 2],
    /// The scenes that show it, before and afterwards.
    scenes: [BTreeSet<SceneId>; 2],
    parent: Option<NodeId>,
}

/// Keeps the skins valid whose joints, or whose nodes, move to a place. Refused is a move after which joints have no common
/// root and had one before, and one after which a scene shows a skinned node without its joints and none did before. A
/// `skeleton` that is not above all joints any more, and was, goes: it may be left out, and says nothing that the joints do not
/// say. O(what is moved), if the document has skins; where it comes to other scenes, O(nodes of its skins) as well.
pub fn keep(p: &mut Plan<'_>, node: NodeId, place: &Place) -> Result<()> {
    if p.scene.skins.is_empty() {
        return Ok(());
    }
    let subtree = p.subtree(node)?;
    let mut skins = BTreeSet::new();
    for &node in &subtree {
        skins.extend(p.node(node)?.skin);
        skins.extend(p.referrers(node).into_iter().filter_map(|owner| match owner {
            AnyId::Skin(skin) => Some(skin),
            _ => None,
        }));
    }
    if skins.is_empty() {
        return Ok(());
    }
    let old_top = top(p, node)?;
    let old_scenes = scenes(p, old_top)?;
    let (parent, new_top, new_scenes) = match *place {
        Place::Under(parent) => {
            let new_top = top(p, parent)?;
            (Some(parent), new_top, scenes(p, new_top)?)
        }
        Place::RootOf(scene) => (None, node, BTreeSet::from([scene])),
    };
    let moved = subtree.into_iter().collect();
    let it = Move { node, moved, top: [old_top, new_top], scenes: [old_scenes, new_scenes], parent };
    for id in skins {
        it.keep_root(p, id)?;
        it.keep_scenes(p, id)?;
        it.keep_skeleton(p, id)?;
    }
    Ok(())
}

impl Move {
    /// The topmost node above one, before and afterwards.
    fn tops(&self, p: &mut Plan<'_>, node: NodeId) -> Result<[NodeId; 2]> {
        if self.moved.contains(&node) { Ok(self.top) } else { top(p, node).map(|top| [top; 2]) }
    }

    /// The scenes that show a node, before and afterwards.
    fn scenes(&self, p: &mut Plan<'_>, node: NodeId) -> Result<[BTreeSet<SceneId>; 2]> {
        if self.moved.contains(&node) {
            return Ok(self.scenes.clone());
        }
        let top = top(p, node)?;
        let scenes = scenes(p, top)?;
        Ok([scenes.clone(), scenes])
    }

    fn keep_root(&self, p: &mut Plan<'_>, id: SkinId) -> Result<()> {
        if self.top[0] == self.top[1] {
            return Ok(());
        }
        let [mut before, mut after] = [FxHashSet::default(), FxHashSet::default()];
        for joint in p.skin(id)?.joints.clone() {
            let [old, new] = self.tops(p, joint)?;
            before.insert(old);
            after.insert(new);
        }
        if before.len() == 1 && after.len() > 1 {
            let what = "its joints would have no common root any more, which glTF asks for; move the node that all of \
                        them are below, or delete what it deforms first";
            return Err(EditError::missing(id, what));
        }
        Ok(())
    }

    fn keep_scenes(&self, p: &mut Plan<'_>, id: SkinId) -> Result<()> {
        let Some(&joint) = p.skin(id)?.joints.first() else { return Ok(()) };
        if self.scenes[0] == self.scenes[1] {
            return Ok(());
        }
        let joints = self.scenes(p, joint)?;
        for user in p.referrers(id) {
            let AnyId::Node(user) = user else { continue };
            let users = self.scenes(p, user)?;
            if users[0].is_subset(&joints[0]) && !users[1].is_subset(&joints[1]) {
                return Err(without_joints(id, user));
            }
        }
        Ok(())
    }

    fn keep_skeleton(&self, p: &mut Plan<'_>, id: SkinId) -> Result<()> {
        let skin = p.skin(id)?;
        // Below a skeleton that moves along nothing changes; nor does it for joints that do not move.
        let Some(skeleton) = skin.skeleton.filter(|skeleton| !self.moved.contains(skeleton)) else { return Ok(()) };
        if skin.joints.iter().any(|joint| self.moved.contains(joint))
            && is_below(p, Some(self.node), skeleton)?
            && !is_below(p, self.parent, skeleton)?
        {
            let skin = Skin { skeleton: None, ..p.skin(id)?.clone() };
            p.replace(Object::Skin(id, skin));
        }
        Ok(())
    }
}

/// Refuses a skin for a node that a scene shows without the joints.
pub fn shown_with(p: &mut Plan<'_>, node: NodeId, id: SkinId) -> Result<()> {
    let Some(&joint) = p.skin(id)?.joints.first() else { return Ok(()) };
    let [node_top, joint_top] = [top(p, node)?, top(p, joint)?];
    if node_top == joint_top || scenes(p, node_top)?.is_subset(&scenes(p, joint_top)?) {
        return Ok(());
    }
    Err(without_joints(id, node))
}

fn without_joints(skin: SkinId, node: NodeId) -> EditError {
    let node = Store::<NodeId, ()>::slot(node);
    let what = format!(
        "a scene would show node {node}, which it deforms, without its joints, which glTF does not allow; move the node that \
         all of them are below, or take the skin from node {node} first"
    );
    EditError::missing(skin, what)
}

/// The roots that other scenes of a document cannot keep when the roots of the one that is `shown` leave them: joints of what
/// they show go, below these or below one another. O(nodes), if the document has skins.
pub fn apart(document: &Scene, shown: SceneId) -> Vec<NodeId> {
    if document.skins.is_empty() || document.scenes.len() < 2 {
        return Vec::new();
    }
    let top = |mut node: NodeId| {
        while let Some(parent) = document.nodes.get(node).and_then(|node| node.parent) {
            node = parent;
        }
        node
    };
    let mut needed: FxHashMap<NodeId, FxHashSet<NodeId>> = FxHashMap::default();
    for (id, node) in document.nodes.iter() {
        if let Some(&joint) = node.skin.and_then(|skin| document.skins.get(skin)?.joints.first()) {
            needed.entry(top(id)).or_default().insert(top(joint));
        }
    }
    let roots_of = |id: SceneId| document.scenes.get(id).into_iter().flat_map(|scene| scene.roots.iter());
    let mut gone: FxHashSet<NodeId> = roots_of(shown).collect();
    let others: BTreeSet<NodeId> = document.scenes.ids().filter(|&id| id != shown).flat_map(roots_of).collect();
    let mut apart = Vec::new();
    loop {
        let misses = |root: &NodeId| needed.get(root).is_some_and(|needed| !needed.is_disjoint(&gone));
        let next: Vec<NodeId> = others.iter().copied().filter(|root| !gone.contains(root) && misses(root)).collect();
        if next.is_empty() {
            return apart;
        }
        gone.extend(&next);
        apart.extend(next);
    }
}

fn top(p: &mut Plan<'_>, node: NodeId) -> Result<NodeId> {
    let mut at = node;
    while let Some(parent) = p.node(at)?.parent {
        at = parent;
        p.visited += 1;
    }
    Ok(at)
}

/// The scenes that have a topmost node as a root.
fn scenes(p: &mut Plan<'_>, top: NodeId) -> Result<BTreeSet<SceneId>> {
    let places = p.places(top)?.into_iter();
    Ok(places.filter_map(|place| if let Place::RootOf(scene) = place { Some(scene) } else { None }).collect())
}

/// Whether a node is another one or below it.
fn is_below(p: &mut Plan<'_>, node: Option<NodeId>, above: NodeId) -> Result<bool> {
    let mut at = node;
    while let Some(id) = at {
        if id == above {
            return Ok(true);
        }
        at = p.node(id)?.parent;
        p.visited += 1;
    }
    Ok(false)
}
