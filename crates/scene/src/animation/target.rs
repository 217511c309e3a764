//! Where a channel leads: an object of the document, and what of it.

use super::property::{CameraProperty, LightProperty, MaterialProperty};
use crate::edit::Facets;
use crate::model::{AnimationChannel, AnimationPath, AnyId};
use crate::visit::pointer_index;
use serde_json::Value as Json;
use std::sync::Arc;

/// What of an object is animated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Property {
    /// A node's translation, in metres.
    Translation,
    /// A node's rotation, a quaternion x y z w.
    Rotation,
    /// A node's scale.
    Scale,
    /// KHR_node_visibility of a node.
    Visible,
    /// All morph weights of a node, or the default ones of a mesh.
    Weights,
    /// One morph weight of a node or mesh.
    Weight(u32),
    /// A number or colour of a material, or of the transform of one of its textures.
    Material(MaterialProperty),
    /// A number or colour of a light.
    Light(LightProperty),
    /// A number of a camera.
    Camera(CameraProperty),
}

/// An animated property of an object of the document.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Target {
    /// The object.
    pub object: AnyId,
    /// What of it.
    pub property: Property,
}

/// The value of a target at a time.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Visible or not.
    Flag(bool),
    /// As many numbers as the property has; the others are 0.
    Numbers([f64; 4]),
    /// Morph weights by target.
    Weights(Arc<[f64]>),
}

impl Value {
    /// The numbers of a vector, a colour, a factor.
    pub(super) fn numbers(&self) -> [f64; 4] {
        match self {
            Self::Numbers(numbers) => *numbers,
            _ => [0.0; 4],
        }
    }
}

impl Target {
    /// What of the object a change of the value touches.
    pub(super) fn facets(&self) -> Facets {
        match (self.object, self.property) {
            (AnyId::Node(_), Property::Translation | Property::Rotation | Property::Scale) => Facets::TRANSFORM,
            (AnyId::Node(_), Property::Visible) => Facets::VISIBILITY,
            (AnyId::Node(_), Property::Weights | Property::Weight(_)) => Facets::SHAPE,
            _ => Facets::CONTENT,
        }
    }

    /// Where a channel leads. The error says why it leads nowhere that can be played.
    pub(super) fn of(channel: &AnimationChannel) -> Result<Self, String> {
        let property = match channel.path {
            AnimationPath::Translation => Property::Translation,
            AnimationPath::Rotation => Property::Rotation,
            AnimationPath::Scale => Property::Scale,
            AnimationPath::Weights => Property::Weights,
            AnimationPath::Pointer => return Self::of_pointer(channel),
        };
        let node = channel.node.ok_or("it names no node, and is not played")?;
        Ok(Self { object: node.into(), property })
    }

    /// KHR_animation_pointer.
    fn of_pointer(channel: &AnimationChannel) -> Result<Self, String> {
        let extra = &channel.target_extra;
        let extension = extra.extensions.as_ref().and_then(|extensions| extensions.get("KHR_animation_pointer"));
        let pointer = extension.and_then(|extension| extension.get("pointer")).and_then(Json::as_str);
        let pointer = pointer.ok_or("its target has no KHR_animation_pointer, and is not played")?;
        let link = extra.links().iter().find(|link| &*link.path == "/KHR_animation_pointer/pointer");
        let (Some(link), Some((_, _, path))) = (link, pointer_index(pointer)) else {
            return Err(format!("{pointer:?} leads to no object that can be animated; it is not played"));
        };
        let property = match link.target {
            AnyId::Node(_) => node_property(path),
            AnyId::Mesh(_) => weights(path),
            AnyId::Material(_) => MaterialProperty::at(path).map(Property::Material),
            AnyId::Light(_) => LightProperty::at(path).map(Property::Light),
            AnyId::Camera(_) => CameraProperty::at(path).map(Property::Camera),
            _ => None,
        };
        let property = property.ok_or_else(|| format!("{pointer:?} leads to nothing that Orthant plays"))?;
        Ok(Self { object: link.target, property })
    }
}

fn node_property(path: &str) -> Option<Property> {
    match path {
        "/translation" => Some(Property::Translation),
        "/rotation" => Some(Property::Rotation),
        "/scale" => Some(Property::Scale),
        "/extensions/KHR_node_visibility/visible" => Some(Property::Visible),
        _ => weights(path),
    }
}

fn weights(path: &str) -> Option<Property> {
    let rest = path.strip_prefix("/weights")?;
    if rest.is_empty() {
        return Some(Property::Weights);
    }
    let digits = rest.strip_prefix('/').filter(|digits| digits.bytes().all(|b| b.is_ascii_digit()))?;
    digits.parse().ok().map(Property::Weight)
}
