//! Planning: what an edit means, as steps, checked before anything is changed.

use super::EditError;
use super::step::{NodeField, Object, Place, Step};
use super::twins::Twins;
use crate::Scene;
use crate::model::*;
use crate::visit::{Owner, ReferenceIndex};

pub(super) type Result<T> = std::result::Result<T, EditError>;

/// An edit on its way to steps. New objects are in their stores already, parked, so that others can refer to them.
pub(super) struct Plan<'p> {
    pub scene: &'p mut Scene,
    pub index: &'p ReferenceIndex,
    twins: &'p mut Twins,
    new: Vec<AnyId>,
    steps: Vec<Step>,
    /// What the edit made, for whoever wants to name it.
    pub made: Option<AnyId>,
    /// Objects that were looked at.
    pub visited: u64,
    /// What could not be done as the edit asks for it, in words.
    pub notes: Vec<String>,
}

macro_rules! kinds {
    ($($insert:ident $get:ident $store:ident $id:ident $value:ident;)*) => {
        impl Plan<'_> {
            $(
                /// A new object.
                #[allow(dead_code, reason = "one for each kind")]
                pub fn $insert(&mut self, value: $value) -> $id {
                    let id = self.scene.$store.insert_parked(value);
                    self.new.push(id.into());
                    id
                }

                /// An object of the document.
                #[allow(dead_code, reason = "one for each kind")]
                pub fn $get(&self, id: $id) -> Result<&$value> {
                    self.scene.$store.get(id).ok_or(EditError::Stale(id.into()))
                }
            )*
        }
    };
}

kinds! {
    add_scene scene_roots scenes SceneId SceneRoots;
    add_node node nodes NodeId Node;
    add_mesh mesh meshes MeshId Mesh;
    add_material material materials MaterialId Material;
    add_skin skin skins SkinId Skin;
    add_animation animation animations AnimationId Animation;
    add_camera camera cameras CameraId Camera;
    add_light light lights LightId Light;
    add_accessor accessor accessors AccessorId Accessor;
    add_view view buffer_views BufferViewId BufferView;
    add_buffer buffer buffers BufferId Buffer;
}

impl<'p> Plan<'p> {
    pub fn new(scene: &'p mut Scene, index: &'p ReferenceIndex, twins: &'p mut Twins) -> Self {
        Self { scene, index, twins, new: Vec::new(), steps: Vec::new(), made: None, visited: 0, notes: Vec::new() }
    }

    /// The steps in order: new objects come first.
    pub fn finish(self) -> Vec<Step> {
        let mut steps = Vec::with_capacity(self.steps.len() + 1);
        if !self.new.is_empty() {
            steps.push(Step::Unpark(self.new));
        }
        steps.extend(self.steps);
        steps
    }

    /// Ends the new objects of an edit that is refused.
    pub fn abandon(self) {
        // The last one first: slots that are free are taken in the reverse order in which they became so.
        for id in self.new.into_iter().rev() {
            self.scene.purge(id);
        }
    }

    pub fn step(&mut self, step: Step) {
        self.steps.push(step);
    }

    pub fn set(&mut self, node: NodeId, field: NodeField) {
        self.step(Step::Node(node, field));
    }

    pub fn replace(&mut self, object: Object) {
        self.step(Step::Replace(object));
    }

    /// Objects that were inserted parked by other means.
    pub fn adopt(&mut self, ids: impl IntoIterator<Item = AnyId>) {
        self.new.extend(ids);
    }

    /// Takes back a new object: it was not needed.
    pub fn disown(&mut self, id: AnyId) {
        self.new.retain(|&other| other != id);
        self.scene.purge(id);
    }

    /// Which objects refer to an object. The document as a whole may as well: [`Plan::is_carried`].
    pub fn referrers(&mut self, id: impl Into<AnyId>) -> Vec<AnyId> {
        let owners: Vec<AnyId> = self
            .index
            .referrers(id)
            .filter_map(|(owner, _)| match owner {
                Owner::Object(owner) => Some(owner),
                Owner::Document => None,
            })
            .collect();
        self.visited += owners.len() as u64;
        owners
    }

    /// Whether anything but one object refers to an object. O(1).
    pub fn has_other_referrer(&mut self, id: impl Into<AnyId>, owner: impl Into<AnyId>) -> bool {
        let owner = Owner::Object(owner.into());
        self.visited += 1;
        self.index.unordered(id).any(|(other, _)| other != owner)
    }

    /// Whether the document as a whole refers to an object, in an extension of its own.
    pub fn is_carried(&self, id: impl Into<AnyId>) -> bool {
        self.index.is_referenced_by(id, Owner::Document)
    }

    /// The first other mesh for which `is_equal` holds, of those that may be equal. O(log n), and the meshes of materials
    /// that have been edited since the last search.
    pub fn twin(&mut self, mesh: MeshId, is_equal: impl Fn(&Self, MeshId) -> Result<bool>) -> Result<Option<MeshId>> {
        self.visited += self.twins.refresh(self.scene, self.index);
        let (mut looked_at, mut found) = (0, None);
        for other in self.twins.like(mesh).filter(|&other| other != mesh) {
            looked_at += 1;
            if is_equal(self, other)? {
                found = Some(other);
                break;
            }
        }
        self.visited += looked_at;
        Ok(found)
    }

    /// Where a node hangs: below its parent, or as a root of each of these scenes, or nowhere.
    pub fn places(&mut self, id: NodeId) -> Result<Vec<Place>> {
        if let Some(parent) = self.node(id)?.parent {
            return Ok(vec![Place::Under(parent)]);
        }
        let owners = self.referrers(id);
        let scenes = owners.into_iter().filter_map(|owner| match owner {
            AnyId::Scene(scene) => Some(Place::RootOf(scene)),
            _ => None,
        });
        Ok(scenes.collect())
    }

    /// Where a node without a parent goes: the scene that is shown. A document without scenes shows all its nodes: it gets one
    /// that has all roots, but for the node that is to go there. O(nodes) then, once.
    pub fn root_place(&mut self, node: NodeId) -> Place {
        let shown = self.scene.default_scene.or_else(|| self.scene.scenes.ids().next());
        Place::RootOf(shown.unwrap_or_else(|| {
            let nodes = self.scene.nodes.iter();
            let roots = nodes.filter(|&(id, other)| other.parent.is_none() && id != node).map(|(id, _)| id);
            let roots = Children::from(roots.collect::<Vec<_>>());
            self.visited += self.scene.nodes.len() as u64;
            let scene = self.add_scene(SceneRoots { roots, ..SceneRoots::default() });
            self.step(Step::DefaultScene(Some(scene)));
            scene
        }))
    }

    /// Hangs a node up behind all others.
    pub fn attach_last(&mut self, node: NodeId, parent: Option<NodeId>) -> Result<()> {
        let place = match parent {
            Some(parent) => {
                self.node(parent)?;
                Place::Under(parent)
            }
            None => self.root_place(node),
        };
        self.step(Step::Attach { node, place, index: usize::MAX });
        Ok(())
    }

    /// A node and all below it, parents before children.
    pub fn subtree(&mut self, root: NodeId) -> Result<Vec<NodeId>> {
        self.node(root)?;
        let mut nodes = vec![root];
        let mut next = 0;
        while let Some(&node) = nodes.get(next) {
            nodes.extend(self.node(node)?.children.iter());
            next += 1;
        }
        self.visited += nodes.len() as u64;
        Ok(nodes)
    }

    /// The transform from a node to the world: O(depth).
    pub fn world(&mut self, id: NodeId) -> Result<glam::DAffine3> {
        let mut world = glam::DAffine3::IDENTITY;
        let mut at = Some(id);
        while let Some(id) = at {
            let node = self.node(id)?;
            world = node.transform.to_affine() * world;
            at = node.parent;
            self.visited += 1;
        }
        Ok(world)
    }
}
