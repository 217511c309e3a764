//! The slots inside extensions that the model keeps as JSON. Import turns the indices there into [`Link`]s.

use crate::import::crts::disney::EXTENSION as DISNEY;
use crate::model::{AnyId, Extra, Kind, Link, Other};
use crate::place::{At, push_key};
use serde_json::Value;
use std::fmt::Write;

/// What a slot refers to.
enum Target {
    /// An object of one kind.
    To(Kind),
    /// An object of the kind of the owner.
    ToOwnKind,
    /// Whatever a JSON pointer says.
    ByPointer,
}

use Target::{ByPointer, To, ToOwnKind};

/// Extension, path in it (`*` is each element of an array or each member of an object), target.
///
/// Compressed views (EXT_meshopt_compression) have no line: import decompresses them, and the extension is gone.
/// Extensions that index only their own arrays (EXT_mesh_features' property tables, KHR_interactivity's graphs) have no
/// line for that: the order of those arrays is theirs.
const SLOTS: &[(&str, &str, Target)] = &[
    ("KHR_draco_mesh_compression", "bufferView", To(Kind::BufferView)),
    ("EXT_texture_avif", "source", To(Kind::Image)),
    ("KHR_materials_pbrSpecularGlossiness", "diffuseTexture/index", To(Kind::Texture)),
    ("KHR_materials_pbrSpecularGlossiness", "specularGlossinessTexture/index", To(Kind::Texture)),
    ("KHR_xmp_json_ld", "packet", To(Kind::Packet)),
    ("KHR_animation_pointer", "pointer", ByPointer),
    ("MSFT_lod", "ids/*", ToOwnKind),
    ("MSFT_packing_normalRoughnessMetallic", "normalRoughnessMetallicTexture/index", To(Kind::Texture)),
    ("MSFT_packing_occlusionRoughnessMetallic", "occlusionRoughnessMetallicTexture/index", To(Kind::Texture)),
    ("MSFT_packing_occlusionRoughnessMetallic", "roughnessMetallicOcclusionTexture/index", To(Kind::Texture)),
    ("MSFT_packing_occlusionRoughnessMetallic", "normalTexture/index", To(Kind::Texture)),
    ("EXT_lights_image_based", "lights/*/specularImages/*/*", To(Kind::Image)),
    ("CESIUM_primitive_outline", "indices", To(Kind::Accessor)),
    ("EXT_mesh_features", "featureIds/*/texture/index", To(Kind::Texture)),
    (DISNEY, "base_color_texture/index", To(Kind::Texture)),
    (DISNEY, "textures/*/index", To(Kind::Texture)),
    ("EXT_structural_metadata", "propertyTables/*/properties/*/values", To(Kind::BufferView)),
    ("EXT_structural_metadata", "propertyTables/*/properties/*/arrayOffsets", To(Kind::BufferView)),
    ("EXT_structural_metadata", "propertyTables/*/properties/*/stringOffsets", To(Kind::BufferView)),
    ("EXT_structural_metadata", "propertyTextures/*/properties/*/index", To(Kind::Texture)),
];

/// Whether the references inside an extension are known.
pub(crate) fn has_links(extension: &str) -> bool {
    SLOTS.iter().any(|slot| slot.0 == extension)
}

/// Turns the indices inside the extensions of an object into links. `count` says how many objects of a kind there are;
/// what it contradicts is given to `dangling` and stays as it is.
pub(crate) fn connect(
    extra: &mut Extra,
    at: &At<'_>,
    count: impl Fn(Kind) -> usize,
    mut dangling: impl FnMut(&At<'_>),
) {
    let Some(extensions) = &extra.extensions else { return };
    let mut links = Vec::new();
    for (name, value) in extensions.iter() {
        for (_, path, target) in SLOTS.iter().filter(|slot| slot.0 == name) {
            let mut pointer = String::new();
            push_key(&mut pointer, name);
            each(value, path, &mut pointer, &mut |slot, pointer| {
                let found = match target {
                    To(kind) => Some((*kind, index(slot))),
                    ToOwnKind => owner_kind(at).map(|kind| (kind, index(slot))),
                    ByPointer => slot.as_str().and_then(pointer_index).map(|(kind, index, _)| (kind, Some(index))),
                };
                let Some((kind, index)) = found else { return };
                match index.filter(|&index| index < count(kind)) {
                    Some(index) => links.push(Link { path: pointer.into(), target: AnyId::nth(kind, index) }),
                    None => dangling(&at.key("extensions").path(pointer)),
                }
            });
        }
    }
    if !links.is_empty() {
        let other = extra.other.get_or_insert_with(|| Box::new(Other::default()));
        other.links = links;
    }
}

/// An index as JSON may write it: 3, 3.0.
fn index(value: &Value) -> Option<usize> {
    let index = match value.as_u64() {
        Some(index) => index,
        None => value.as_f64().filter(|v| v.fract() == 0.0 && (0.0..9e15).contains(v))? as u64,
    };
    usize::try_from(index).ok()
}

/// `/nodes` of `/nodes/3`.
fn owner_kind(at: &At<'_>) -> Option<Kind> {
    let pointer = at.pointer();
    let is_owner = |kind: &Kind| pointer.strip_prefix(kind.array()).is_some_and(|rest| rest.starts_with('/'));
    Kind::ALL.iter().copied().find(is_owner)
}

/// The kind, the index and the rest of a JSON pointer such as `/nodes/3/translation`; `None` if it leads to no object.
pub(crate) fn pointer_index(pointer: &str) -> Option<(Kind, usize, &str)> {
    for &kind in Kind::ALL {
        let Some(rest) = pointer.strip_prefix(kind.array()).and_then(|rest| rest.strip_prefix('/')) else { continue };
        let end = rest.find('/').unwrap_or(rest.len());
        // RFC 6901, section 4: digits without leading zeros.
        let (digits, rest) = rest.split_at(end);
        let plain = digits == "0" || !digits.starts_with('0') && digits.bytes().all(|b| b.is_ascii_digit());
        return plain.then(|| digits.parse().ok()).flatten().map(|index| (kind, index, rest));
    }
    None
}

/// Writes the index of an object where the JSON of an extension refers to it: a number, or the first index of a JSON pointer.
pub(crate) fn write_index(slot: &mut Value, kind: Kind, index: u64) {
    *slot = match slot.as_str() {
        None => index.into(),
        Some(pointer) => {
            let rest = pointer_index(pointer).map_or("", |(_, _, rest)| rest);
            format!("{}/{index}{rest}", kind.array()).into()
        }
    };
}

/// Calls `found` for each value at a path.
fn each(value: &Value, path: &str, pointer: &mut String, found: &mut impl FnMut(&Value, &str)) {
    let (step, rest) = match path.split_once('/') {
        Some((step, rest)) => (step, Some(rest)),
        None => (path, None),
    };
    let mut enter = |value: &Value, pointer: &mut String| match rest {
        Some(rest) => each(value, rest, pointer, found),
        None => found(value, pointer),
    };
    let length = pointer.len();
    match value {
        Value::Array(values) if step == "*" => {
            for (i, value) in values.iter().enumerate() {
                // Writing to a string cannot fail.
                let _ = write!(pointer, "/{i}");
                enter(value, pointer);
                pointer.truncate(length);
            }
        }
        Value::Object(members) => {
            for (key, value) in members.iter().filter(|(key, _)| step == "*" || *key == step) {
                push_key(pointer, key);
                enter(value, pointer);
                pointer.truncate(length);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_index_of_a_pointer_is_meant() {
        assert_eq!(pointer_index("/nodes/3/translation"), Some((Kind::Node, 3, "/translation")));
        assert_eq!(pointer_index("/nodes/0"), Some((Kind::Node, 0, "")));
        assert_eq!(pointer_index("/extensions/KHR_lights_punctual/lights/12/color"), Some((Kind::Light, 12, "/color")));
        assert_eq!(pointer_index("/materials/1/pbrMetallicRoughness/x").unwrap().0, Kind::Material);
        for none in ["", "/nodes", "/nodes/", "/nodes/03/x", "/nodes/+3", "/nodes/-1", "/nodesx/1", "/extensions/X/1"] {
            assert_eq!(pointer_index(none), None, "{none}");
        }
    }

    #[test]
    fn every_path_of_the_table_leads_somewhere() {
        for (name, path, target) in SLOTS {
            let leaf = if matches!(target, ByPointer) { Value::from("/nodes/1/scale") } else { Value::from(1) };
            let value = path.rsplit('/').fold(leaf, |value, step| match step {
                "*" => Value::from(vec![value]),
                key => Value::Object([(key.to_owned(), value)].into_iter().collect()),
            });
            let extensions = [((*name).to_owned(), value)].into_iter().collect();
            let mut extra = Extra { extensions: Some(Box::new(extensions)), ..Extra::default() };
            let nodes = At::Root.key("nodes");
            connect(&mut extra, &nodes.index(0), |_| 2, |at| panic!("{}", at.pointer()));
            let pointer = format!("/{name}/{}", path.replace('*', "0"));
            assert_eq!(extra.links().iter().map(|link| &*link.path).collect::<Vec<_>>(), [pointer]);
            let mut none = Extra { extensions: extra.extensions.clone(), ..Extra::default() };
            let mut dangling = 0;
            connect(&mut none, &nodes.index(0), |_| 1, |_| dangling += 1);
            assert_eq!((none.links().len(), dangling), (0, 1), "{name}");
        }
    }
}
