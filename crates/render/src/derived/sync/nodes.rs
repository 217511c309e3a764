//! World matrices and visibility, top down, of the nodes that were touched and of what hangs below them.

use super::Sync;
use crate::derived::hierarchy::DerivedNode;
use glam::DAffine3;
use orthant_resident::rows::{NONE, RenderNodeRow};
use orthant_scene::Scene;
use orthant_scene::edit::{ChangeSet, Facets};
use orthant_scene::model::{AnyId, NodeId, SceneId, Store};
use orthant_scene::visit::Owner;
use rustc_hash::FxHashMap;

/// The scene that is shown: the one that is asked for, else the default one, else the first.
pub fn shown_scene(scene: &Scene, asked: Option<SceneId>) -> Option<SceneId> {
    asked.filter(|&id| scene.contains(id)).or(scene.default_scene()).or_else(|| scene.scenes().ids().next())
}

/// What above a node decides.
#[derive(Clone, Copy)]
struct Above {
    world: DAffine3,
    visible: bool,
    entry: u32,
    /// It, or something above it, hangs elsewhere now: the common ancestor of joints may be another, wherever they are.
    placed: bool,
}

impl Above {
    const ROOT: Self = Self { world: DAffine3::IDENTITY, visible: true, entry: NONE, placed: false };
}

impl Sync<'_> {
    pub(super) fn nodes(&mut self, changes: &ChangeSet) {
        let relevant = Facets::ADDED
            | Facets::REMOVED
            | Facets::PLACE
            | Facets::TRANSFORM
            | Facets::VISIBILITY
            | Facets::SHAPE
            | Facets::LIGHT;
        for (id, facets) in changes.nodes().filter(|(_, facets)| facets.has(relevant)) {
            self.work.nodes.insert(id);
            if facets.has(Facets::PLACE) {
                self.work.placed.insert(id);
            }
        }
        self.follow_shown_scene(changes);

        // What is gone goes first: its slots are used again.
        let (mut live, gone): (Vec<NodeId>, Vec<NodeId>) =
            self.work.nodes.iter().partition(|&&id| self.scene.contains(id));
        self.work.visited += gone.len() as u64;
        gone.into_iter().for_each(|id| self.release(id));

        // Each of the others under the nearest one above it that was touched too.
        live.sort_unstable();
        let mut below: FxHashMap<NodeId, Vec<NodeId>> = FxHashMap::default();
        let mut order = Vec::with_capacity(live.len());
        let is_alone = self.work.nodes.len() == 1;
        for &id in &live {
            let mut above = self.scene.nodes()[id].parent.filter(|_| !is_alone);
            while let Some(at) = above {
                self.work.visited += 1;
                if self.work.nodes.contains(&at) {
                    break;
                }
                above = self.scene.nodes()[at].parent;
            }
            match above {
                Some(above) => below.entry(above).or_default().push(id),
                None => order.push(id),
            }
        }
        let mut next = 0;
        while let Some(&id) = order.get(next) {
            next += 1;
            self.bring_up(id);
            order.extend(below.remove(&id).unwrap_or_default());
        }
    }

    /// If another scene is shown now, the roots of both are touched: that is all there is.
    fn follow_shown_scene(&mut self, changes: &ChangeSet) {
        let is_touched = changes.document || changes.objects().iter().any(|(id, _)| matches!(id, AnyId::Scene(_)));
        let shown = if is_touched { shown_scene(self.scene, self.derived.asked_scene) } else { self.live.shown };
        if shown == self.live.shown {
            return;
        }
        self.live.shown = shown;
        let old = self.derived.hierarchy.nodes.iter().filter(|node| node.parent == NONE && node.is_used());
        self.work.nodes.extend(old.map(|node| node.node));
        match shown {
            Some(id) => self.work.nodes.extend(self.scene.scenes()[id].roots.iter()),
            None => {
                let roots = self.scene.nodes().iter().filter(|(_, node)| node.parent.is_none());
                self.work.nodes.extend(roots.map(|(id, _)| id));
            }
        }
    }

    /// What is above a node, or `None` if it is not shown.
    fn above(&self, id: NodeId) -> Option<Above> {
        match self.scene.nodes()[id].parent {
            Some(parent) => {
                let entry = self.derived.hierarchy.entry(parent)?;
                let node = &self.derived.hierarchy.nodes[entry as usize];
                Some(Above { world: node.world, visible: node.visible, entry, placed: false })
            }
            None => {
                let is_root = match self.live.shown {
                    None => true,
                    Some(shown) => self
                        .scene
                        .reference_index()
                        .is_none_or(|index| index.referrers(id).any(|(owner, _)| owner == Owner::Object(shown.into()))),
                };
                is_root.then_some(Above::ROOT)
            }
        }
    }

    /// Brings a node up to date, and what is below it as far as that changes anything.
    fn bring_up(&mut self, top: NodeId) {
        if self.derived.hierarchy.entry(top).is_some_and(|entry| self.live.stamps[entry as usize] == self.live.stamp) {
            return;
        }
        let Some(above) = self.above(top) else { return self.release_below(top) };
        let has_skins = !self.scene.skins().is_empty();
        let mut open = vec![(top, above)];
        while let Some((id, above)) = open.pop() {
            self.work.visited += 1;
            let node = &self.scene.nodes()[id];
            let world = above.world * self.posed.local(id);
            let visible = above.visible && self.posed.visible(id);
            let is_new = self.derived.hierarchy.entry(id).is_none();
            let entry = self.entry(id);
            let derived = &mut self.derived.hierarchy.nodes[entry as usize];
            let moved = is_new || derived.world != world;
            let placed = has_skins && (above.placed || self.work.placed.contains(&id));
            let changed = moved || placed || derived.visible != visible || derived.parent != above.entry;
            (derived.world, derived.visible, derived.parent) = (world, visible, above.entry);
            self.live.stamps[entry as usize] = self.live.stamp;
            self.work.refill(id);
            if moved || placed {
                self.note_joint(id);
            }
            if changed {
                open.extend(node.children.iter().map(|child| (child, Above { world, visible, entry, placed })));
            }
        }
    }

    /// Nodes whose meshes a moved joint deforms.
    fn note_joint(&mut self, id: NodeId) {
        let Some(index) = self.scene.reference_index() else { return };
        for (owner, _) in index.referrers(id) {
            let Owner::Object(AnyId::Skin(skin)) = owner else { continue };
            let users = index.referrers(skin).filter_map(|(owner, _)| match owner {
                Owner::Object(AnyId::Node(user)) => Some(user),
                _ => None,
            });
            self.work.poses.extend(users);
        }
    }

    /// The entry of a node in the hierarchy, a new one if it has none.
    fn entry(&mut self, id: NodeId) -> u32 {
        if let Some(entry) = self.derived.hierarchy.entry(id) {
            return entry;
        }
        let hierarchy = &mut self.derived.hierarchy;
        let entry = match self.live.free_entries.pop() {
            Some(entry) => {
                hierarchy.nodes[entry as usize] = DerivedNode::new(id);
                entry
            }
            None => {
                hierarchy.nodes.push(DerivedNode::new(id));
                self.live.stamps.push(0);
                hierarchy.nodes.len() as u32 - 1
            }
        };
        hierarchy.set_entry(id, entry);
        entry
    }

    /// Takes a node and all below it out of what is shown. A joint need not be shown to deform what is.
    fn release_below(&mut self, top: NodeId) {
        let has_skins = !self.scene.skins().is_empty();
        let mut open = vec![top];
        while let Some(id) = open.pop() {
            self.work.visited += 1;
            let is_shown = self.derived.hierarchy.entry(id).is_some();
            if is_shown {
                self.release(id);
            }
            if has_skins {
                self.note_joint(id);
            }
            if is_shown || has_skins {
                open.extend(self.scene.nodes()[id].children.iter());
            }
        }
    }

    /// Takes a node out of what is shown: its rows become holes.
    fn release(&mut self, id: NodeId) {
        let Some(entry) = self.derived.hierarchy.entry(id) else { return };
        let node = self.derived.hierarchy.nodes[entry as usize];
        self.release_render_nodes(entry);
        self.release_light(entry);
        if node.deformed {
            self.release_deformed(id);
        }
        self.derived.hierarchy.nodes[entry as usize] = DerivedNode::FREE;
        self.derived.hierarchy.clear_entry(id);
        self.live.free_entries.push(entry);
    }

    /// Gives the rows of an entry back.
    pub(super) fn release_render_nodes(&mut self, entry: u32) {
        let node = &mut self.derived.hierarchy.nodes[entry as usize];
        let (first, count) = (node.first_render_node, node.render_node_count);
        (node.first_render_node, node.render_node_count) = (0, 0);
        for row in first..first + count {
            self.write_row(row, RenderNodeRow::HOLE);
            self.derived.owners[row as usize] = NONE;
        }
        self.live.node_spans.free(first, count);
    }

    /// Rows of an entry: its own if there are as many, else others.
    pub(super) fn claim_render_nodes(&mut self, entry: u32, count: u32) -> Option<u32> {
        let node = &self.derived.hierarchy.nodes[entry as usize];
        if node.render_node_count == count {
            return Some(node.first_render_node);
        }
        self.release_render_nodes(entry);
        let first = self.live.node_spans.allocate(count)?;
        let end = (first + count) as usize;
        if end > self.derived.render_nodes.len() {
            self.derived.render_nodes.resize(end, RenderNodeRow::HOLE);
            self.derived.owners.resize(end, NONE);
        }
        self.derived.owners[first as usize..end].fill(entry);
        let node = &mut self.derived.hierarchy.nodes[entry as usize];
        (node.first_render_node, node.render_node_count) = (first, count);
        Some(first)
    }

    /// Slot of the mesh that a node shows, or [`NONE`].
    pub(super) fn mesh_slot(&self, id: NodeId) -> u32 {
        self.scene.nodes()[id].mesh.map_or(NONE, |mesh| Store::<_, ()>::slot(mesh) as u32)
    }
}
