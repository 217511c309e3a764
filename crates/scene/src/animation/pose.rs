//! The overlay of an animation over the document.

use super::target::{Property, Target, Value};
use crate::Scene;
use crate::edit::ChangeSet;
use crate::edit::ops::decompose;
use crate::model::{AnyId, Camera, CameraId, Light, LightId, Material, MaterialId, NodeId, Transform};
use glam::DAffine3;
use std::borrow::Cow;
use std::cmp::Ordering;

/// What an animation says of the scene at a time: values for some properties of some objects. Everything else is as the
/// document has it. The default is the rest pose, which says nothing.
///
/// A pose outlives edits: what it says of an object that is gone counts for nothing, and counts again when the object is
/// back.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Ascending, each target once.
    values: Vec<(Target, Value)>,
}

impl Pose {
    /// The values in any order; of those for one target the last counts.
    pub fn new(mut values: Vec<(Target, Value)>) -> Self {
        values.sort_by_key(|(target, _)| *target);
        let mut kept: Vec<(Target, Value)> = Vec::with_capacity(values.len());
        for (target, value) in values {
            match kept.last_mut() {
                Some(last) if last.0 == target => last.1 = value,
                _ => kept.push((target, value)),
            }
        }
        Self { values: kept }
    }

    /// Of values that ascend already, each target once.
    pub(super) fn from_sorted(values: Vec<(Target, Value)>) -> Self {
        debug_assert!(values.is_sorted_by(|a, b| a.0 < b.0));
        Self { values }
    }

    /// Whether it says nothing.
    pub fn is_rest(&self) -> bool {
        self.values.is_empty()
    }

    /// All values, in the order of their targets.
    pub fn values(&self) -> &[(Target, Value)] {
        &self.values
    }

    /// What it says of an object.
    fn of(&self, object: AnyId) -> &[(Target, Value)] {
        if self.values.is_empty() {
            return &[];
        }
        let first = self.values.partition_point(|(target, _)| target.object < object);
        let count = self.values[first..].iter().take_while(|(target, _)| target.object == object).count();
        &self.values[first..first + count]
    }

    /// Where two poses differ: where to look when one takes the place of the other, of the objects that the document has.
    pub fn difference(&self, other: &Self, scene: &Scene) -> ChangeSet {
        let mut changes = ChangeSet::default();
        let mut touch = |target: &Target| {
            if scene.contains(target.object) {
                changes.touch(target.object, target.facets());
            }
        };
        let (mut a, mut b) = (self.values.iter().peekable(), other.values.iter().peekable());
        loop {
            let order = match (a.peek(), b.peek()) {
                (None, None) => break,
                (Some(_), None) => Ordering::Less,
                (None, Some(_)) => Ordering::Greater,
                (Some((a, _)), Some((b, _))) => a.cmp(b),
            };
            let first = if order.is_le() { a.next() } else { None };
            let second = if order.is_ge() { b.next() } else { None };
            match (first, second) {
                (Some((target, x)), Some((_, y))) if x != y => touch(target),
                (Some((target, _)), None) | (None, Some((target, _))) => touch(target),
                _ => {}
            }
        }
        changes
    }
}

/// A document under a pose: what is shown.
#[derive(Clone, Copy, Debug)]
pub struct Posed<'s> {
    /// The document.
    pub scene: &'s Scene,
    /// The pose.
    pub pose: &'s Pose,
}

impl<'s> Posed<'s> {
    /// A document under a pose.
    pub fn new(scene: &'s Scene, pose: &'s Pose) -> Self {
        Self { scene, pose }
    }

    /// Parent from node. What the pose does not say of translation, rotation and scale is the document's; a matrix is taken
    /// apart for that (one that shears cannot be, and is not posed: [`super::Evaluator`] refuses it).
    ///
    /// # Panics
    /// Like all of these, if the id is stale.
    pub fn local(&self, id: NodeId) -> DAffine3 {
        let rest = &self.scene.nodes()[id].transform;
        let values = self.pose.of(id.into());
        let is_moved = |(target, _): &(Target, Value)| {
            matches!(target.property, Property::Translation | Property::Rotation | Property::Scale)
        };
        if !values.iter().any(is_moved) {
            return rest.to_affine();
        }
        let parts = match rest {
            Transform::Trs { .. } => Some(rest.clone()),
            Transform::Matrix(_) => decompose(&rest.to_affine()),
        };
        let Some(Transform::Trs { mut translation, mut rotation, mut scale }) = parts else { return rest.to_affine() };
        for (target, value) in values {
            let [x, y, z, w] = value.numbers();
            match target.property {
                Property::Translation => translation = [x, y, z],
                Property::Rotation => rotation = [x, y, z, w],
                Property::Scale => scale = [x, y, z],
                _ => {}
            }
        }
        Transform::Trs { translation, rotation, scale }.to_affine()
    }

    /// Whether a node itself is visible; its ancestors have a say too.
    pub fn visible(&self, id: NodeId) -> bool {
        let rest = self.scene.nodes()[id].visible.unwrap_or(true);
        let posed = self.pose.of(id.into()).iter().find_map(|(target, value)| match (target.property, value) {
            (Property::Visible, Value::Flag(visible)) => Some(*visible),
            _ => None,
        });
        posed.unwrap_or(rest)
    }

    /// The morph weights of a node: its own, or else the default ones of its mesh. Missing ones are 0.
    pub fn weights(&self, id: NodeId) -> Vec<f64> {
        let node = &self.scene.nodes()[id];
        let mut weights = match (&node.weights, node.mesh) {
            (Some(own), _) => own.clone(),
            (None, Some(mesh)) => {
                let mut weights = self.scene.meshes()[mesh].weights.clone();
                overlay_weights(&mut weights, self.pose.of(mesh.into()));
                weights
            }
            (None, None) => Vec::new(),
        };
        overlay_weights(&mut weights, self.pose.of(id.into()));
        weights
    }

    /// A material.
    pub fn material(&self, id: MaterialId) -> Cow<'s, Material> {
        overlay(self.pose.of(id.into()), &self.scene.materials()[id], |material, property, values| match property {
            Property::Material(property) => property.write(material, values),
            _ => None,
        })
    }

    /// A light.
    pub fn light(&self, id: LightId) -> Cow<'s, Light> {
        overlay(self.pose.of(id.into()), &self.scene.lights()[id], |light, property, values| match property {
            Property::Light(property) => property.write(light, values),
            _ => None,
        })
    }

    /// A camera.
    pub fn camera(&self, id: CameraId) -> Cow<'s, Camera> {
        overlay(self.pose.of(id.into()), &self.scene.cameras()[id], |camera, property, values| match property {
            Property::Camera(property) => property.write(camera, values),
            _ => None,
        })
    }
}

/// An object with the values that a pose has for it.
fn overlay<'s, T: Clone>(
    values: &[(Target, Value)],
    rest: &'s T,
    write: impl Fn(&mut T, Property, &[f64]) -> Option<usize>,
) -> Cow<'s, T> {
    let mut object = Cow::Borrowed(rest);
    for (target, value) in values {
        // A property that an edit has taken away is not there to be written.
        let _width = write(object.to_mut(), target.property, &value.numbers());
    }
    object
}

/// How many weights there may be: no mesh has as many targets.
const MOST_WEIGHTS: u32 = 1 << 16;

fn overlay_weights(weights: &mut Vec<f64>, values: &[(Target, Value)]) {
    for (target, value) in values {
        match (target.property, value) {
            (Property::Weights, Value::Weights(all)) => *weights = all.to_vec(),
            (Property::Weight(index), value) if index < MOST_WEIGHTS => {
                let index = index as usize;
                if index >= weights.len() {
                    weights.resize(index + 1, 0.0);
                }
                weights[index] = value.numbers()[0];
            }
            _ => {}
        }
    }
}
