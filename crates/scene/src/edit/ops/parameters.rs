//! Materials, lights and cameras by JSON: what glTF says of them, with a merge patch over it.

use super::{applicable, bounds, members};
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::Object;
use crate::export;
use crate::import::{Place, Warning, gltf};
use crate::model::*;
use crate::place::At;
use crate::visit::{VisitorMut, visit_mut};
use serde_json::{Map, Value};

/// RFC 7396.
fn merge_patch(target: &mut Value, patch: &Value) {
    let Value::Object(patch) = patch else {
        *target = patch.clone();
        return;
    };
    if !target.is_object() {
        *target = Value::Object(Map::new());
    }
    let Value::Object(members) = target else { return };
    for (key, value) in patch {
        if value.is_null() {
            members.shift_remove(key);
        } else {
            merge_patch(members.entry(key.clone()).or_insert(Value::Null), value);
        }
    }
}

pub fn set(p: &mut Plan<'_>, id: AnyId, patch: &Value) -> Result<()> {
    if !p.scene.contains(id) {
        return Err(EditError::Stale(id));
    }
    if !patch.is_object() {
        return Err(EditError::value("/set", "it must be an object: a JSON merge patch"));
    }
    members::check(id.kind(), patch, "/set")?;
    let text = export::gltf::object_text(p.scene, id).map_err(|fault| EditError::missing(id, fault.to_string()))?;
    let mut value: Value = serde_json::from_slice(&text).map_err(|error| EditError::missing(id, error.to_string()))?;
    merge_patch(&mut value, patch);
    bounds::check(id.kind(), &value, patch, "/set")?;
    members::complete(id.kind(), &value, patch, "/set")?;
    let object = object(p, id.kind(), &value, "/set", Some((&text, patch)))?;
    if let (AnyId::Material(id), Parsed::Material(new)) = (id, &object) {
        applicable::change(p, id, new)?;
    }
    p.replace(match (id, object) {
        (AnyId::Material(id), Parsed::Material(value)) => Object::Material(id, value),
        (AnyId::Light(id), Parsed::Light(value)) => Object::Light(id, value),
        (AnyId::Camera(id), Parsed::Camera(value)) => Object::Camera(id, value),
        (id, _) => return Err(EditError::missing(id, "it has no parameters")),
    });
    Ok(())
}

pub fn add_light(p: &mut Plan<'_>, parent: Option<NodeId>, light: &Value) -> Result<()> {
    if !light.is_object() {
        return Err(EditError::value("/light", "it must be a light of KHR_lights_punctual"));
    }
    members::check(Kind::Light, light, "/light")?;
    bounds::check(Kind::Light, light, light, "/light")?;
    let Parsed::Light(light) = object(p, Kind::Light, light, "/light", None)? else {
        return Err(EditError::value("/light", "it is no light"));
    };
    let name = light.name.clone();
    let light = p.add_light(light);
    let node = p.add_node(Node { name, light: Some(light), ..Node::default() });
    p.made = Some(node.into());
    p.attach_last(node, parent)
}

/// Whether a patch gives a value to the member at a pointer, or to one that it is in.
fn sets(patch: &Value, pointer: &str) -> bool {
    let mut at = patch;
    for key in pointer.split('/').skip(1) {
        let Value::Object(members) = at else { return true };
        let Some(member) = members.get(key) else { return false };
        at = member;
    }
    !at.is_object()
}

enum Parsed {
    Material(Box<Material>),
    Light(Light),
    Camera(Camera),
}

/// An object from its JSON, checked as an import would check it, but that nothing is let pass: a warning there is a
/// refusal here. `base` is where the JSON is in the edit. `change` is the JSON text of what it was before, and the patch: what there was a
/// warning about already, and is not named by the patch, is let pass.
fn object(p: &mut Plan<'_>, kind: Kind, value: &Value, base: &str, change: Option<(&[u8], &Value)>) -> Result<Parsed> {
    let prefix = format!("{}/0", kind.array());
    let pointer = |place: &Place| match place {
        Place::Pointer(pointer) => format!("{base}{}", pointer.strip_prefix(&*prefix).unwrap_or(pointer)),
        _ => base.to_owned(),
    };
    let text = value.to_string();
    let bound = |kind: Kind| p.scene.slot_bound(kind);
    let (mut scene, warnings) = gltf::convert_object(kind, &text, &bound)
        .map_err(|(place, fault)| EditError::value(pointer(&place), fault.to_string()))?;
    let mut before = Vec::new();
    if let Some((old, _)) = change.filter(|_| !warnings.is_empty())
        && let Ok(old) = std::str::from_utf8(old)
        && let Ok((_, warnings)) = gltf::convert_object(kind, old, &bound)
    {
        before = warnings.iter().map(|warning| (pointer(&warning.place), warning.kind.to_string())).collect();
    }
    let is_old = |warning: &&Warning| {
        let found = (pointer(&warning.place), warning.kind.to_string());
        let at = found.0.strip_prefix(base).unwrap_or_default();
        before.contains(&found) && change.is_some_and(|(_, patch)| !sets(patch, at))
    };
    if let Some(warning) = warnings.iter().find(|warning| !is_old(warning)) {
        return Err(EditError::value(pointer(&warning.place), warning.kind.to_string()));
    }
    let mut resolve = Resolve { real: p.scene, stale: None };
    visit_mut(&mut scene, &mut resolve);
    if let Some((place, kind, slot)) = resolve.stale {
        let what = format!("there is no {} {slot}", kind.name());
        return Err(EditError::value(pointer(&Place::Pointer(place)), what));
    }
    let parsed = match kind {
        Kind::Material => scene.materials.values().next().cloned().map(|x| Parsed::Material(Box::new(x))),
        Kind::Light => scene.lights.values().next().cloned().map(Parsed::Light),
        _ => scene.cameras.values().next().cloned().map(Parsed::Camera),
    };
    parsed.ok_or_else(|| EditError::value(base, "it describes nothing"))
}

/// From slots, as the JSON has them, to the objects that are in them.
struct Resolve<'s> {
    real: &'s crate::Scene,
    stale: Option<(String, Kind, usize)>,
}

impl VisitorMut for Resolve<'_> {
    fn slot<K: Id>(&mut self, id: &mut K, at: &At<'_>) {
        let any: AnyId = (*id).into();
        match self.real.id_in_slot(any.kind(), any.slot()).and_then(K::from_any) {
            Some(real) => *id = real,
            None => self.stale = self.stale.take().or_else(|| Some((at.pointer(), any.kind(), any.slot()))),
        }
    }

    fn parent(&mut self, _: &mut NodeId) {}
}
