//! Who refers to an object.

use super::{At, Visitor, visit_object, walk};
use crate::Scene;
use crate::model::{Animation, AnyId, Children, Extra, Id, Kind, NodeId, SceneId};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::collections::hash_map::Entry;

/// Who refers to something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Owner {
    /// The document as a whole: its default scene, its extensions.
    Document,
    /// An object.
    Object(AnyId),
}

/// The reverse-reference index: for each object, who refers to it and how often. Built in O(n log n); brought up to date
/// in O(1) for each reference of the objects that an edit changes.
///
/// That a node is the child of another is not in it: the child itself says so ([`Node::parent`](crate::model::Node)). That
/// it is a root of a scene is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReferenceIndex(FxHashMap<AnyId, Referrers>);

/// Who refers to one object, and how often. Most of what is referred to has one referrer; a material may have a million.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Referrers {
    One(Owner, u32),
    /// Two or more.
    Many(FxHashMap<Owner, u32>),
}

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
        let mut targets = FxHashMap::default();
        for of_target in edges.chunk_by(|a, b| a.0 == b.0) {
            let owners = || of_target.chunk_by(|a, b| a == b).map(|same| (same[0].1, same.len() as u32));
            let referrers = match (owners().next(), owners().nth(1)) {
                (Some((owner, count)), None) => Referrers::One(owner, count),
                _ => Referrers::Many(owners().collect()),
            };
            targets.insert(of_target[0].0, referrers);
        }
        Self(targets)
    }

    /// Who refers to an object, and how often, in the order of owners. O(n log n) in the referrers.
    pub fn referrers(&self, target: impl Into<AnyId>) -> impl Iterator<Item = (Owner, u32)> + '_ {
        let mut all: SmallVec<[(Owner, u32); 2]> = self.unordered(target).collect();
        all.sort_unstable();
        all.into_iter()
    }

    /// Who refers to an object, and how often, in no order that means anything. Each costs O(1).
    pub fn unordered(&self, target: impl Into<AnyId>) -> impl Iterator<Item = (Owner, u32)> + '_ {
        let (one, many) = match self.0.get(&target.into()) {
            None => (None, None),
            Some(&Referrers::One(owner, count)) => (Some((owner, count)), None),
            Some(Referrers::Many(owners)) => (None, Some(owners)),
        };
        one.into_iter().chain(many.into_iter().flatten().map(|(&owner, &count)| (owner, count)))
    }

    /// Whether anything refers to an object. O(1).
    pub fn is_referenced(&self, target: impl Into<AnyId>) -> bool {
        self.0.contains_key(&target.into())
    }

    /// Whether one owner refers to an object. O(1).
    pub fn is_referenced_by(&self, target: impl Into<AnyId>, owner: Owner) -> bool {
        match self.0.get(&target.into()) {
            None => false,
            Some(&Referrers::One(other, _)) => other == owner,
            Some(Referrers::Many(owners)) => owners.contains_key(&owner),
        }
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
        match self.0.entry(target) {
            Entry::Vacant(entry) => {
                if add {
                    entry.insert(Referrers::One(owner, 1));
                }
            }
            Entry::Occupied(mut entry) => {
                let goes = if add { entry.get_mut().add(owner) } else { entry.get_mut().take(owner) };
                if goes {
                    entry.remove();
                }
            }
        }
    }
}

impl Referrers {
    /// Counts a reference. There is one more, so that it does not go.
    fn add(&mut self, owner: Owner) -> bool {
        match self {
            Self::One(only, count) if *only == owner => *count += 1,
            &mut Self::One(only, count) => *self = Self::Many([(only, count), (owner, 1)].into_iter().collect()),
            Self::Many(owners) => *owners.entry(owner).or_default() += 1,
        }
        false
    }

    /// Takes a reference away. Returns whether it was the last one.
    fn take(&mut self, owner: Owner) -> bool {
        match self {
            Self::One(only, count) if *only == owner => {
                *count -= 1;
                return *count == 0;
            }
            Self::One(..) => {}
            Self::Many(owners) => {
                if let Entry::Occupied(mut entry) = owners.entry(owner) {
                    *entry.get_mut() -= 1;
                    if *entry.get() == 0 {
                        entry.remove();
                    }
                }
                if owners.len() == 1
                    && let Some((&owner, &count)) = owners.iter().next()
                {
                    *self = Self::One(owner, count);
                }
            }
        }
        false
    }
}
