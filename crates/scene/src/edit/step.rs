//! Steps: the least changes that a document can undergo. Every edit is a sequence of them, and so is its inverse.
//!
//! A step is checked before it is made (by whoever plans an edit), so that carrying it out cannot fail half-way. Carrying
//! it out gives the step that takes it back.

use super::changes::{ChangeSet, Facets};
use crate::Scene;
use crate::model::*;
use crate::visit::ReferenceIndex;
use serde::{Deserialize, Serialize};

/// Where a node hangs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// Below a node.
    Under(NodeId),
    /// As a root of a scene.
    RootOf(SceneId),
}

/// A member of a node, with its value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NodeField {
    /// `name`.
    Name(Option<String>),
    /// The local transform.
    Transform(Transform),
    /// `mesh`.
    Mesh(Option<MeshId>),
    /// `skin`.
    Skin(Option<SkinId>),
    /// `camera`.
    Camera(Option<CameraId>),
    /// KHR_lights_punctual.
    Light(Option<LightId>),
    /// `weights`.
    Weights(Option<Vec<f64>>),
    /// KHR_node_visibility.
    Visible(Option<bool>),
    /// What the node carries besides.
    Extra(Extra),
}

/// An object with a new value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Object {
    /// A mesh.
    Mesh(MeshId, Mesh),
    /// A material.
    Material(MaterialId, Box<Material>),
    /// A light.
    Light(LightId, Light),
    /// A camera.
    Camera(CameraId, Camera),
    /// A skin.
    Skin(SkinId, Skin),
    /// An animation.
    Animation(AnimationId, Animation),
}

/// One step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Step {
    /// Objects leave the document. They stay parked under their ids.
    Park(Vec<AnyId>),
    /// Parked objects come into the document: new ones for the first time, others back.
    Unpark(Vec<AnyId>),
    /// A node that hangs nowhere, or is to be a root of one more scene, is hung up before the child at an index.
    Attach {
        /// The node.
        node: NodeId,
        /// Where.
        place: Place,
        /// Before which child; at the end, if there are fewer.
        index: usize,
    },
    /// A node is taken off.
    Detach {
        /// The node.
        node: NodeId,
        /// From where.
        place: Place,
    },
    /// A member of a node gets a value.
    Node(NodeId, NodeField),
    /// An object gets a value.
    Replace(Object),
    /// Channels leave an animation, and samplers that only they had.
    TakeChannels {
        /// The animation.
        animation: AnimationId,
        /// Which channels, ascending.
        channels: Vec<usize>,
        /// Which samplers, ascending.
        samplers: Vec<usize>,
    },
    /// Channels and samplers come into an animation.
    PutChannels {
        /// The animation.
        animation: AnimationId,
        /// Channels and where they will be, ascending. Samplers in them are numbered as they will be.
        channels: Vec<(usize, AnimationChannel)>,
        /// Samplers and where they will be, ascending.
        samplers: Vec<(usize, AnimationSampler)>,
    },
    /// What the document as a whole carries besides.
    DocumentExtra(Extra),
    /// What `asset` carries besides.
    AssetExtra(Extra),
    /// The scene to show.
    DefaultScene(Option<SceneId>),
    /// The material variant to show.
    Variant(Option<VariantId>),
    /// The extensions that the document declares: `extensionsUsed`, `extensionsRequired`, and those of the former that
    /// nothing in the document shows.
    Extensions([Vec<String>; 3]),
}

/// What carrying out steps needs and gives.
pub(super) struct Execution<'e> {
    pub scene: &'e mut Scene,
    pub index: &'e mut ReferenceIndex,
    pub changes: ChangeSet,
    /// Objects that were looked at or changed.
    pub visited: u64,
}

impl Execution<'_> {
    /// Carries a step out and gives the one that takes it back.
    pub fn run(&mut self, step: Step) -> Step {
        match step {
            Step::Park(ids) => {
                self.park(&ids);
                Step::Unpark(ids)
            }
            Step::Unpark(ids) => {
                self.unpark(&ids);
                Step::Park(ids)
            }
            Step::Attach { node, place, index } => {
                self.attach(node, place, index);
                Step::Detach { node, place }
            }
            Step::Detach { node, place } => {
                let index = self.detach(node, place);
                Step::Attach { node, place, index }
            }
            Step::Node(node, field) => Step::Node(node, self.set(node, field)),
            Step::Replace(object) => Step::Replace(self.replace(object)),
            Step::TakeChannels { animation, channels, samplers } => self.take_channels(animation, &channels, &samplers),
            Step::PutChannels { animation, channels, samplers } => self.put_channels(animation, channels, samplers),
            Step::DocumentExtra(extra) => {
                self.note_carried(&extra, false);
                Step::DocumentExtra(std::mem::replace(&mut self.scene.extra, extra))
            }
            Step::AssetExtra(extra) => {
                self.note_carried(&extra, true);
                Step::AssetExtra(std::mem::replace(&mut self.scene.asset.extra, extra))
            }
            Step::DefaultScene(id) => {
                self.visited += 1;
                self.changes.document = true;
                for (id, add) in [(self.scene.default_scene, false), (id, true)] {
                    if let Some(id) = id {
                        self.index.count_document(id, add);
                    }
                }
                Step::DefaultScene(std::mem::replace(&mut self.scene.default_scene, id))
            }
            Step::Variant(id) => {
                self.visited += 1;
                self.changes.document = true;
                Step::Variant(std::mem::replace(&mut self.scene.shown_variant, id))
            }
            Step::Extensions([used, required, declared_only]) => {
                let scene = &mut *self.scene;
                Step::Extensions([
                    std::mem::replace(&mut scene.extensions_used, used),
                    std::mem::replace(&mut scene.extensions_required, required),
                    std::mem::replace(&mut scene.extensions_declared_only, declared_only),
                ])
            }
        }
    }

    /// The references of what the document carries, before it is replaced.
    fn note_carried(&mut self, new: &Extra, of_asset: bool) {
        self.visited += 1;
        self.changes.document = true;
        let old = if of_asset { &self.scene.asset.extra } else { &self.scene.extra };
        self.index.count_carried(old, false);
        self.index.count_carried(new, true);
    }

    fn park(&mut self, ids: &[AnyId]) {
        self.visited += ids.len() as u64;
        for &id in ids {
            self.index.remove(self.scene, id);
            self.scene.set_parked(id, true);
            self.changes.touch(id, Facets::REMOVED);
        }
    }

    fn unpark(&mut self, ids: &[AnyId]) {
        self.visited += ids.len() as u64;
        for &id in ids {
            self.scene.set_parked(id, false);
            self.index.add(self.scene, id);
            self.changes.touch(id, Facets::ADDED);
        }
    }

    fn siblings(&mut self, place: Place) -> Option<&mut Children> {
        match place {
            Place::Under(parent) => self.scene.nodes.get_mut(parent).map(|node| &mut node.children),
            Place::RootOf(scene) => self.scene.scenes.get_mut(scene).map(|scene| &mut scene.roots),
        }
    }

    fn attach(&mut self, node: NodeId, place: Place, index: usize) {
        self.visited += 2;
        if let Some(siblings) = self.siblings(place) {
            siblings.insert(index, node);
        }
        match place {
            Place::Under(parent) => {
                if let Some(node) = self.scene.nodes.get_mut(node) {
                    node.parent = Some(parent);
                }
            }
            Place::RootOf(scene) => self.index.count_root(scene, node, true),
        }
        self.changes.touch(node, Facets::PLACE);
    }

    fn detach(&mut self, node: NodeId, place: Place) -> usize {
        self.visited += 2;
        let index = self.siblings(place).and_then(|siblings| siblings.remove(node)).unwrap_or(0);
        match place {
            Place::Under(_) => {
                if let Some(node) = self.scene.nodes.get_mut(node) {
                    node.parent = None;
                }
            }
            Place::RootOf(scene) => self.index.count_root(scene, node, false),
        }
        self.changes.touch(node, Facets::PLACE);
        index
    }

    fn set(&mut self, id: NodeId, field: NodeField) -> NodeField {
        use std::mem::replace;
        self.visited += 1;
        let refers = !matches!(field, NodeField::Name(_) | NodeField::Transform(_) | NodeField::Visible(_));
        if refers {
            self.index.remove(self.scene, id.into());
        }
        let Some(node) = self.scene.nodes.get_mut(id) else { return field };
        let (before, facets) = match field {
            NodeField::Name(value) => (NodeField::Name(replace(&mut node.name, value)), Facets::NAME),
            NodeField::Transform(value) => {
                (NodeField::Transform(replace(&mut node.transform, value)), Facets::TRANSFORM)
            }
            NodeField::Mesh(value) => (NodeField::Mesh(replace(&mut node.mesh, value)), Facets::SHAPE),
            NodeField::Skin(value) => (NodeField::Skin(replace(&mut node.skin, value)), Facets::SHAPE),
            NodeField::Camera(value) => (NodeField::Camera(replace(&mut node.camera, value)), Facets::CAMERA),
            NodeField::Light(value) => (NodeField::Light(replace(&mut node.light, value)), Facets::LIGHT),
            NodeField::Weights(value) => (NodeField::Weights(replace(&mut node.weights, value)), Facets::SHAPE),
            NodeField::Visible(value) => (NodeField::Visible(replace(&mut node.visible, value)), Facets::VISIBILITY),
            NodeField::Extra(value) => (NodeField::Extra(replace(&mut node.extra, value)), Facets::CONTENT),
        };
        if refers {
            self.index.add(self.scene, id.into());
        }
        self.changes.touch(id, facets);
        before
    }

    fn replace(&mut self, object: Object) -> Object {
        use std::mem::replace;
        self.visited += 1;
        let id = object.id();
        self.index.remove(self.scene, id);
        let scene = &mut *self.scene;
        macro_rules! swap {
            ($store:ident, $id:expr, $value:expr) => {
                match scene.$store.get_mut($id) {
                    Some(slot) => replace(slot, $value),
                    None => $value,
                }
            };
        }
        let before = match object {
            Object::Mesh(id, value) => Object::Mesh(id, swap!(meshes, id, value)),
            Object::Material(id, value) => Object::Material(id, Box::new(swap!(materials, id, *value))),
            Object::Light(id, value) => Object::Light(id, swap!(lights, id, value)),
            Object::Camera(id, value) => Object::Camera(id, swap!(cameras, id, value)),
            Object::Skin(id, value) => Object::Skin(id, swap!(skins, id, value)),
            Object::Animation(id, value) => Object::Animation(id, swap!(animations, id, value)),
        };
        self.index.add(self.scene, id);
        self.changes.touch(id, Facets::CONTENT);
        before
    }
}

impl Object {
    /// Which object.
    pub fn id(&self) -> AnyId {
        match self {
            Self::Mesh(id, _) => (*id).into(),
            Self::Material(id, _) => (*id).into(),
            Self::Light(id, _) => (*id).into(),
            Self::Camera(id, _) => (*id).into(),
            Self::Skin(id, _) => (*id).into(),
            Self::Animation(id, _) => (*id).into(),
        }
    }
}
