//! Who refers to an object.

use super::{At, Visitor, visit_object, walk};
use crate::Scene;
use crate::model::{AnyId, Id, Kind};
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
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReferenceIndex(BTreeMap<(AnyId, Owner), u32>);

struct Targets<F>(F);

impl<F: FnMut(AnyId)> Visitor for Targets<F> {
    fn slot<K: Id>(&mut self, id: K, _: &At<'_>) {
        self.0(id.into());
    }
}

impl ReferenceIndex {
    /// The index of a whole document.
    pub fn of(scene: &Scene) -> Self {
        let mut edges = Vec::new();
        let mut add = |owner, target| edges.push((target, owner));
        walk::visit_root(scene, &mut Targets(|target| add(Owner::Document, target)));
        for &kind in Kind::ALL {
            for id in scene.ids_of(kind) {
                visit_object(scene, id, &mut Targets(|target| add(Owner::Object(id), target)));
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
        visit_object(
            scene,
            owner,
            &mut Targets(|target| *self.0.entry((target, Owner::Object(owner))).or_default() += 1),
        );
    }

    /// Takes the references of an object away: it goes, or is about to be changed.
    pub fn remove(&mut self, scene: &Scene, owner: AnyId) {
        visit_object(
            scene,
            owner,
            &mut Targets(|target| {
                let key = (target, Owner::Object(owner));
                if let Some(count) = self.0.get_mut(&key) {
                    *count -= 1;
                    if *count == 0 {
                        self.0.remove(&key);
                    }
                }
            }),
        );
    }
}
