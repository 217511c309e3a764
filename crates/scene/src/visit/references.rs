//! Who refers to an object.

use super::{At, Visitor, visit_object, walk};
use crate::Scene;
use crate::model::{Animation, AnyId, Children, Extra, Id, Kind, NodeId, SceneId};
use std::collections::BTreeMap;

/// Who refers to something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Owner {
    /// The document as a whole: its default scene, its extensions.
    Document,
    /// An object.
    Object(AnyId),
}

/// The reverse-reference index: for each object, who refers to it and how often. Built in O(n log n); brought up to date
/// in O(log n) for each reference of the objects that an edit changes.
///
/// That a node is the child of another is not in it: the child itself says so ([`Node::parent`](crate::model::Node)). That
/// it is a root of a scene is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReferenceIndex(BTreeMap<(AnyId, Owner), u32>);

struct Targets<F>(F);

impl<F: FnMut(AnyId)> Visitor for Targets<F> {
    fn slot<K: Id>(&mut self, id: K, _: &At<'_>) {
        self.0(id.into());
    }

    /// A node of a million children is changed without a look at them; roots are counted one by one.
    fn children(&mut self, _: &Children, _: &At<'_>) {}
}

/// Everything that an object refers to, but for children.
fn targets(scene: &Scene, owner: AnyId, mut see: impl FnMut(AnyId)) {
    visit_object(scene, owner, &mut Targets(&mut see));
    if let AnyId::Scene(id) = owner
        && let Some(roots) = scene.scenes.get_any(id)
    {
        roots.roots.iter().for_each(|root| see(root.into()));
    }
}

impl ReferenceIndex {
    /// The index of a whole document.
    pub fn of(scene: &Scene) -> Self {
        let mut edges = Vec::new();
        walk::visit_root(scene, &mut Targets(|target| edges.push((target, Owner::Document))));
        for &kind in Kind::ALL {
            for id in scene.ids_of(kind) {
                targets(scene, id, |target| edges.push((target, Owner::Object(id))));
            }
        }
        edges.sort_unstable();
        let counted = edges.chunk_by(|a, b| a == b).map(|same| (same[0], same.len() as u32));
        Self(counted.collect())
    }

    /// Who refers to an object, and how often, in the order of owners.
    pub fn referrers(&self, target: impl Into<AnyId>) -> impl Iterator<Item = (Owner, u32)> + '_ {
        let target = target.into();
        let from = (target, Owner::Document);
        self.0.range(from..).take_while(move |((t, _), _)| *t == target).map(|(&(_, owner), &count)| (owner, count))
    }

    /// Whether anything refers to an object.
    pub fn is_referenced(&self, target: impl Into<AnyId>) -> bool {
        self.referrers(target).next().is_some()
    }

    /// Adds the references of an object: it is new, or has just been changed.
    pub fn add(&mut self, scene: &Scene, owner: AnyId) {
        targets(scene, owner, |target| self.count(target, Owner::Object(owner), true));
    }

    /// Takes the references of an object away: it goes, or is about to be changed.
    pub fn remove(&mut self, scene: &Scene, owner: AnyId) {
        targets(scene, owner, |target| self.count(target, Owner::Object(owner), false));
    }

    /// Counts a root of a scene, or takes it away.
    pub(crate) fn count_root(&mut self, scene: SceneId, root: NodeId, add: bool) {
        self.count(root.into(), Owner::Object(scene.into()), add);
    }

    /// Counts a reference of the document as a whole, or takes it away.
    pub(crate) fn count_document(&mut self, target: impl Into<AnyId>, add: bool) {
        self.count(target.into(), Owner::Document, add);
    }

    /// Counts the references of some channels and samplers, or takes them away.
    pub(crate) fn count_animation(&mut self, owner: Owner, parts: &Animation, add: bool) {
        walk::visit_animation(parts, &mut Targets(|target| self.count(target, owner, add)));
    }

    /// Counts the references in what the document as a whole carries, or takes them away.
    pub(crate) fn count_carried(&mut self, extra: &Extra, add: bool) {
        extra.links().iter().for_each(|link| self.count(link.target, Owner::Document, add));
    }

    fn count(&mut self, target: AnyId, owner: Owner, add: bool) {
        let key = (target, owner);
        if add {
            *self.0.entry(key).or_default() += 1;
        } else if let Some(count) = self.0.get_mut(&key) {
            *count -= 1;
            if *count == 0 {
                self.0.remove(&key);
            }
        }
    }
}
