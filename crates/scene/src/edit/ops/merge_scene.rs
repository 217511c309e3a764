//! Whole documents below a node.

use super::duplicate::Rename;
use super::{root, skins};
use crate::Scene;
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::Step;
use crate::model::*;
use crate::visit::visit_object_mut;
use rustc_hash::{FxHashMap, FxHashSet};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// A document that is merged: by its content, which is shared, not copied into histories.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MergedFile {
    /// Where it came from. The wrapper node is named after it.
    pub path: String,
    /// BLAKE3 of what was read, in hexadecimal ([`Folder::read`](crate::edit::files::Folder::read)).
    pub blake3: String,
    /// The document. Not part of the JSON form: who reads that loads the file and compares the hash.
    #[serde(skip)]
    pub scene: Option<Arc<Scene>>,
}

impl PartialEq for MergedFile {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path && self.blake3 == other.blake3
    }
}

pub fn merge(p: &mut Plan<'_>, file: MergedFile, parent: Option<NodeId>) -> Result<()> {
    let Some(other) = &file.scene else {
        let what = "the file has not been read; who applies a saved edit has to read it again";
        return Err(EditError::File(format!("{}: {what}", file.path)));
    };
    let other: &Scene = other;
    let objects: usize = Kind::ALL.iter().map(|&kind| other.count(kind)).sum();
    p.visited += objects as u64;
    let mut renamed: FxHashMap<AnyId, AnyId> = p.scene.insert_parked_copies(other).into_iter().collect();
    let mut new: Vec<AnyId> = renamed.values().copied().collect();
    new.sort_unstable();
    p.adopt(new.iter().copied());
    unite_variants(p, other, &mut renamed, &mut new);

    for &id in &new {
        visit_object_mut(p.scene, id, &mut Rename(&renamed));
    }
    let shown = other.default_scene.or_else(|| other.scenes.ids().next());
    let (roots, left_out) = roots(other, shown, &renamed);
    let name = Path::new(&file.path).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let extra = Extra { extras: root::extras(p, &file.path, other, shown), ..Extra::default() };
    root::unite(p, &file.path, other, &renamed)?;
    let wrapper = p.add_node(Node { name, extra, ..Node::default() });
    for &root in &roots {
        if let Some(node) = p.scene.nodes.get_any_mut(root) {
            node.parent = Some(wrapper);
        }
    }
    let mut taken: FxHashSet<NodeId> = roots.iter().copied().collect();
    if let Some(shown) = shown {
        let apart = skins::apart(other, shown);
        let new = |&root: &NodeId| renamed.get(&root.into()).copied().and_then(NodeId::from_any);
        let apart: Vec<NodeId> = apart.iter().filter_map(new).collect();
        if !apart.is_empty() {
            let slots: Vec<String> = apart.iter().map(|&id| Store::<NodeId, ()>::slot(id).to_string()).collect();
            p.notes.push(format!(
                "{}: in no scene any more, as joints that they need are below the new node now: what is below node {}",
                file.path,
                slots.join(", ")
            ));
        }
        taken.extend(apart);
    }
    if let Some(node) = p.scene.nodes.get_any_mut(wrapper) {
        node.children = Children::from(roots);
        node.children.prepare();
    }
    // Other scenes of the file keep the roots that are not shown already, and do without these; the one that is shown is what is
    // below the wrapper.
    for id in left_out {
        if let Some(scene) = p.scene.scenes.get_any_mut(id) {
            let left: Vec<NodeId> = scene.roots.iter().filter(|root| !taken.contains(root)).collect();
            scene.roots = Children::from(left);
        }
    }
    if let Some(shown) = shown.and_then(|shown| renamed.get(&shown.into()).copied()) {
        p.disown(shown);
    }
    let declarations = merge_declarations(p, other);
    p.step(declarations);
    p.made = Some(wrapper.into());
    p.attach_last(wrapper, parent)
}

/// Variants are known by their names: one that is there already is not made again.
fn unite_variants(p: &mut Plan<'_>, other: &Scene, renamed: &mut FxHashMap<AnyId, AnyId>, new: &mut Vec<AnyId>) {
    let known: FxHashMap<String, VariantId> = p.scene.variants.iter().map(|(id, v)| (v.name.clone(), id)).collect();
    for (id, variant) in other.variants.iter() {
        if let Some(&there) = known.get(&variant.name)
            && let Some(copy) = renamed.insert(id.into(), there.into())
        {
            new.retain(|&id| id != copy);
            p.disown(copy);
        }
    }
}

/// The roots that are shown, and the other scenes, under their new ids.
fn roots(other: &Scene, shown: Option<SceneId>, renamed: &FxHashMap<AnyId, AnyId>) -> (Vec<NodeId>, Vec<SceneId>) {
    let new = |id: AnyId| renamed.get(&id).copied();
    let old: Vec<NodeId> = match shown {
        Some(shown) => other.scenes[shown].roots.iter().collect(),
        None => other.nodes.iter().filter(|(_, node)| node.parent.is_none()).map(|(id, _)| id).collect(),
    };
    let roots = old.into_iter().filter_map(|id| NodeId::from_any(new(id.into())?)).collect();
    let left_out = other.scenes.ids().filter(|&id| Some(id) != shown);
    let left_out = left_out.filter_map(|id| SceneId::from_any(new(id.into())?)).collect();
    (roots, left_out)
}

/// The extensions of both documents.
fn merge_declarations(p: &Plan<'_>, other: &Scene) -> Step {
    let union = |a: &[String], b: &[String]| {
        let mut all = a.to_vec();
        all.extend(b.iter().filter(|name| !a.contains(name)).cloned());
        all
    };
    let scene = &*p.scene;
    Step::Extensions([
        union(&scene.extensions_used, &other.extensions_used),
        union(&scene.extensions_required, &other.extensions_required),
        union(&scene.extensions_declared_only, &other.extensions_declared_only),
    ])
}
