//! What nothing refers to.

use super::{At, Visitor, visit_object, walk};
use crate::Scene;
use crate::model::{AnyId, Id, Kind, NodeId};
use std::collections::HashSet;

struct Reach {
    reached: HashSet<AnyId>,
    ahead: Vec<AnyId>,
}

impl Visitor for Reach {
    fn slot<K: Id>(&mut self, id: K, _: &At<'_>) {
        let id = id.into();
        if self.reached.insert(id) {
            self.ahead.push(id);
        }
    }

    /// A joint that no scene shows is used, and so is what it hangs below: that places it.
    fn parent(&mut self, id: NodeId) {
        self.slot(id, &At::Root);
    }
}

/// The objects that nothing refers to, directly or through others that are used. Used by themselves are the scenes, the
/// animations, the variants and what the document's own extensions refer to; a cycle of unused objects is unused.
pub fn unused(scene: &Scene) -> Vec<AnyId> {
    let mut reach = Reach { reached: HashSet::new(), ahead: Vec::new() };
    walk::visit_root(scene, &mut reach);
    for kind in [Kind::Scene, Kind::Animation, Kind::Variant] {
        let ids = scene.ids_of(kind);
        reach.reached.extend(&ids);
        reach.ahead.extend(&ids);
    }
    while let Some(id) = reach.ahead.pop() {
        visit_object(scene, id, &mut reach);
    }
    let all = Kind::ALL.iter().flat_map(|&kind| scene.ids_of(kind));
    all.filter(|id| !reach.reached.contains(id)).collect()
}
