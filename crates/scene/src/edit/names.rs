//! Objects by name, kept while a scene is edited.

use super::{Cursor, Facets};
use crate::Scene;
use crate::model::{AnyId, Kind};
use std::collections::{BTreeSet, HashMap};

/// The objects of those kinds that have been looked up, by name. The first look-up of a kind costs O(objects of the kind);
/// afterwards one costs O(log n), and what edits have changed since the last one.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    kinds: HashMap<Kind, ByName>,
    cursor: Cursor,
}

#[derive(Clone, Debug, Default)]
struct ByName {
    /// By slot, which is the order of the document.
    objects: HashMap<String, BTreeSet<(usize, AnyId)>>,
    names: HashMap<AnyId, String>,
}

impl Names {
    /// The first object of a kind that has a name.
    pub fn first(&mut self, scene: &Scene, kind: Kind, name: &str) -> Option<AnyId> {
        self.follow(scene);
        let named = self.kinds.entry(kind).or_insert_with(|| ByName::of(scene, kind));
        named.objects.get(name)?.first().map(|&(_, id)| id)
    }

    fn follow(&mut self, scene: &Scene) {
        let Some(changes) = scene.change_log().take(&mut self.cursor) else {
            // More has happened than the log remembers.
            self.kinds.clear();
            return;
        };
        let renaming = Facets::ADDED | Facets::REMOVED | Facets::NAME | Facets::CONTENT;
        for &(id, _) in changes.objects().iter().filter(|(_, facets)| facets.has(renaming)) {
            if let Some(named) = self.kinds.get_mut(&id.kind()) {
                named.forget(id);
                named.note(scene, id);
            }
        }
    }
}

impl ByName {
    fn of(scene: &Scene, kind: Kind) -> Self {
        let mut named = Self::default();
        scene.ids_of(kind).into_iter().for_each(|id| named.note(scene, id));
        named
    }

    fn note(&mut self, scene: &Scene, id: AnyId) {
        if let Some(name) = scene.name_of(id) {
            self.objects.entry(name.to_owned()).or_default().insert((id.slot(), id));
            self.names.insert(id, name.to_owned());
        }
    }

    fn forget(&mut self, id: AnyId) {
        if let Some(name) = self.names.remove(&id)
            && let Some(objects) = self.objects.get_mut(&name)
        {
            objects.remove(&(id.slot(), id));
            if objects.is_empty() {
                self.objects.remove(&name);
            }
        }
    }
}
