use super::*;
use crate::Scene;
use crate::model::Kind;
use crate::testing::{Reference, every_slot, every_slot_scene};
use std::collections::BTreeSet;

#[derive(Default)]
struct Record(Vec<Reference>);

impl Visitor for Record {
    fn slot<K: Id>(&mut self, id: K, at: &At<'_>) {
        let id: AnyId = id.into();
        self.0.push(Reference { pointer: at.pointer(), kind: id.kind(), index: id.slot() });
    }
}

#[derive(Default)]
struct RecordMut(Vec<Reference>);

impl VisitorMut for RecordMut {
    fn slot<K: Id>(&mut self, id: &mut K, at: &At<'_>) {
        let mut shared = Record(std::mem::take(&mut self.0));
        shared.slot(*id, at);
        self.0 = shared.0;
    }

    fn parent(&mut self, _: &mut NodeId) {}
}

fn visited(scene: &Scene) -> Vec<Reference> {
    let mut record = Record::default();
    visit(scene, &mut record);
    record.0.sort();
    record.0
}

#[test]
fn every_slot_is_visited_once_at_its_place() {
    let (_, expected) = every_slot(|_, index| index);
    let found = visited(&every_slot_scene());
    let pointers = |list: &[Reference]| list.iter().map(|r| r.pointer.clone()).collect::<BTreeSet<_>>();
    let (wanted, seen) = (pointers(&expected), pointers(&found));
    assert_eq!(wanted.difference(&seen).collect::<Vec<_>>(), Vec::<&String>::new(), "not visited");
    assert_eq!(seen.difference(&wanted).collect::<Vec<_>>(), Vec::<&String>::new(), "no slots");
    assert_eq!(found, expected);
}

#[test]
fn the_document_fills_slots_of_every_kind() {
    let (_, references) = every_slot(|_, index| index);
    for &kind in Kind::ALL {
        // Nothing refers to an animation.
        let filled = references.iter().any(|r| r.kind == kind);
        assert_eq!(filled, kind != Kind::Animation, "{kind:?}");
    }
}

#[test]
fn both_walks_and_the_walk_of_single_objects_see_the_same() {
    let mut scene = every_slot_scene();
    let all = visited(&scene);
    let mut record = RecordMut::default();
    visit_mut(&mut scene, &mut record);
    record.0.sort();
    assert_eq!(record.0, all);

    let mut single = Record::default();
    walk::visit_root(&scene, &mut single);
    let mut single_mut = RecordMut::default();
    for &kind in Kind::ALL {
        for id in scene.ids_of(kind) {
            visit_object(&scene, id, &mut single);
            walk::visit_object_mut(&mut scene, id, &mut single_mut);
        }
    }
    let of_objects = single_mut.0.len();
    assert!(of_objects < single.0.len(), "the document itself refers to something");
    single.0.sort();
    assert_eq!(single.0, all);
}

#[test]
fn the_reverse_index_knows_every_referrer() {
    let scene = every_slot_scene();
    let index = ReferenceIndex::of(&scene);
    let (_, references) = every_slot(|_, index| index);
    for &kind in Kind::ALL {
        for id in scene.ids_of(kind) {
            // Children say themselves whose they are.
            let is_child = |r: &&Reference| r.pointer.starts_with("/nodes/") && r.pointer.contains("/children/");
            let of_object = references.iter().filter(|r| r.kind == kind && r.index == id.slot());
            let wanted = of_object.filter(|r| !is_child(r)).count();
            let found: u32 = index.referrers(id).map(|(_, count)| count).sum();
            assert_eq!(found as usize, wanted, "{kind:?} {}", id.slot());
            assert_eq!(index.is_referenced(id), wanted > 0);
        }
    }
    let scenes = scene.ids_of(Kind::Scene);
    assert_eq!(index.referrers(node(&scene, 4)).collect::<Vec<_>>(), [(Owner::Object(scenes[1]), 1)]);
    assert_eq!(
        index
            .referrers(match scenes[1] {
                AnyId::Scene(id) => id,
                _ => unreachable!(),
            })
            .collect::<Vec<_>>(),
        [(Owner::Document, 1)]
    );
}

#[test]
fn taking_an_object_out_of_the_index_and_back_changes_nothing() {
    let scene = every_slot_scene();
    let full = ReferenceIndex::of(&scene);
    let mut index = full.clone();
    let objects: Vec<AnyId> = Kind::ALL.iter().flat_map(|&kind| scene.ids_of(kind)).collect();
    for &id in &objects {
        index.remove(&scene, id);
    }
    let left: BTreeSet<Owner> = objects.iter().flat_map(|&id| index.referrers(id)).map(|(owner, _)| owner).collect();
    assert_eq!(left.into_iter().collect::<Vec<_>>(), [Owner::Document]);
    for &id in &objects {
        index.add(&scene, id);
    }
    assert_eq!(index, full);
}

#[test]
fn what_only_unused_objects_refer_to_is_unused() {
    let scene = every_slot_scene();
    let found: Vec<(Kind, usize)> = unused(&scene).into_iter().map(|id| (id.kind(), id.slot())).collect();
    // Mesh 2, skin 1 and light 0 are at no node. What they refer to, others refer to as well. Light 1 is the target of an
    // animation, and node 3 is a root only of a scene that is not shown: both are uses.
    assert_eq!(found, [(Kind::Mesh, 2), (Kind::Skin, 1), (Kind::Light, 0)]);
}

#[test]
fn used_extensions_are_those_that_some_object_has() {
    let scene = every_slot_scene();
    let used = extensions_in_use(&scene);
    let declared: BTreeSet<String> = scene.extensions_used().iter().cloned().collect();
    assert_eq!(declared.difference(&used).collect::<Vec<_>>(), ["X_declared_only"]);
    assert_eq!(used.difference(&declared).collect::<Vec<_>>(), Vec::<&String>::new());
    assert_eq!(scene.extensions_declared_only, ["X_declared_only"]);
}

fn node(scene: &Scene, slot: usize) -> AnyId {
    scene.ids_of(Kind::Node)[slot]
}
