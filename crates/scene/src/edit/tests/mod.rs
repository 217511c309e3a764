//! Edits, by what they have to mean.

mod bounds;
mod cost;
mod foreign;
mod identity;
mod meaning;
mod scenes;
mod transforms;
mod valid;

use super::script::{Operation, Outcome, Session};
use super::*;
use crate::export::ExportOptions;
use crate::export::gltf::to_glb;
use crate::import::ImportOptions;
use crate::model::*;
use crate::place::At;
use crate::visit::{self, Visitor};
use serde_json::{Value, json};
use std::path::Path;

/// The exported bytes: what an undo has to bring back.
fn bytes(scene: &Scene) -> Vec<u8> {
    to_glb(scene, &ExportOptions::default()).unwrap().document
}

fn session() -> Session {
    Session::new(Path::new("."), ImportOptions::default())
}

/// Runs an operation that is given as JSON.
fn run(session: &mut Session, scene: &mut Scene, operation: Value) -> Result<(), EditError> {
    session.run(scene, &Operation::parse(&operation.to_string())?).map(|_| ())
}

fn slot(id: impl Into<AnyId>) -> usize {
    id.into().slot()
}

fn node(scene: &Scene, slot: usize) -> &Node {
    &scene.nodes[scene.nodes.id_in_slot(slot).unwrap()]
}

fn children(scene: &Scene, parent: usize) -> Vec<usize> {
    node(scene, parent).children.iter().map(slot).collect()
}

fn roots(scene: &Scene, index: usize) -> Vec<usize> {
    scene.scenes.values().nth(index).unwrap().roots.iter().map(slot).collect()
}

struct Dangling<'s>(&'s Scene, Option<String>);

impl Visitor for Dangling<'_> {
    fn slot<K: Id>(&mut self, id: K, at: &At<'_>) {
        if !self.0.contains(id) {
            self.1 = Some(at.pointer());
        }
    }

    fn parent(&mut self, id: NodeId) {
        if !self.0.contains(id) {
            self.1 = Some(format!("a parent, {}", slot(id)));
        }
    }
}

fn top(scene: &Scene, mut node: NodeId) -> NodeId {
    while let Some(parent) = scene.nodes[node].parent {
        node = parent;
    }
    node
}

/// What holds of every document, whatever has been done to it.
fn check(scene: &Scene) {
    let mut dangling = Dangling(scene, None);
    visit::visit(scene, &mut dangling);
    assert_eq!(dangling.1, None, "a reference leads nowhere");
    if let Some(index) = scene.reference_index() {
        assert_eq!(*index, crate::visit::ReferenceIndex::of(scene), "the index of references");
        let (mut kept, fresh) = (scene.editing.twins.clone(), super::twins::Twins::of(scene));
        kept.refresh(scene, index);
        assert!(kept.files_as(&fresh), "the index of equal meshes");
    }
    for (id, node) in scene.nodes.iter() {
        for child in node.children.iter() {
            assert_eq!(scene.nodes[child].parent, Some(id), "the parent of node {}", slot(child));
        }
        if let Some(parent) = node.parent {
            assert!(scene.nodes[parent].children.position(id).is_some(), "node {} below its parent", slot(id));
        }
        let (mut at, mut depth) = (node.parent, 0);
        while let Some(above) = at {
            at = scene.nodes[above].parent;
            depth += 1;
            assert!(depth <= scene.nodes.len(), "a cycle above node {}", slot(id));
        }
    }
    for roots in scene.scenes.values() {
        let mut seen = std::collections::HashSet::new();
        for root in roots.roots.iter() {
            assert!(seen.insert(root), "root {} twice", slot(root));
            assert_eq!(scene.nodes[root].parent, None, "root {} has a parent", slot(root));
        }
    }
    for animation in scene.animations.values() {
        assert!(animation.channels.iter().all(|channel| channel.sampler < animation.samplers.len()));
    }
    for skin in scene.skins.values() {
        let matrices = skin.inverse_bind_matrices.map(|id| scene.accessors[id].count);
        assert!(matrices.is_none_or(|count| count >= skin.joints.len()), "matrices of a skin");
    }
}

/// What holds of documents in which it held before.
fn check_joints(scene: &Scene) {
    for (id, node) in scene.nodes.iter() {
        let Some(&joint) = node.skin.and_then(|skin| scene.skins[skin].joints.first()) else { continue };
        let (shown, with) = (top(scene, id), top(scene, joint));
        for roots in scene.scenes.values().filter(|scene| scene.roots.position(shown).is_some()) {
            assert!(roots.roots.position(with).is_some(), "node {} is shown without its joints", slot(id));
        }
    }
}
