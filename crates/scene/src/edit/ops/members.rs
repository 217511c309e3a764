//! The members that the specifications give to materials, lights and cameras. A file may have others, which are kept; an
//! edit that sets one more, or gives one a value of another type, likely means something else.

mod schema;

use crate::edit::EditError;
use crate::edit::plan::Result;
use crate::import::gltf::extensions::SUPPORTED;
use crate::model::Kind;
use crate::place::push_key;
use schema::{CAMERA, LIGHT, MATERIAL, Members, Type};
use serde_json::Value;

/// Supported, and for any object of glTF.
const ANYWHERE: &str = "KHR_xmp_json_ld";

/// Refuses a patch that sets a member which is not known, or one to what it cannot be. Null, which takes one away that a file
/// has, is let pass; so is whatever is in `extras` and in extensions that are not known. `base` is where the patch is in the
/// edit.
pub fn check(kind: Kind, patch: &Value, base: &str) -> Result<()> {
    let object = match kind {
        Kind::Material => &MATERIAL,
        Kind::Light => &LIGHT,
        Kind::Camera => &CAMERA,
        _ => return Ok(()),
    };
    Patch { pointer: base.to_owned() }.object(object, patch)
}

/// Refuses what import would not notice to be without effect: a texture of specular and glossiness, which is kept as JSON,
/// without its index, and the parameters of another type of camera than the camera has. `value` is the whole object with the
/// patch in it.
pub fn complete(kind: Kind, value: &Value, patch: &Value, base: &str) -> Result<()> {
    match kind {
        Kind::Material => {
            for texture in ["diffuseTexture", "specularGlossinessTexture"] {
                let pointer = format!("/extensions/KHR_materials_pbrSpecularGlossiness/{texture}");
                if patch.pointer(&pointer).is_some_and(Value::is_object)
                    && value.pointer(&pointer).is_some_and(|info| info.get("index").is_none())
                {
                    return Err(EditError::value(format!("{base}{pointer}"), "the member \"index\" is missing"));
                }
            }
        }
        Kind::Camera => {
            let is = value.get("type").and_then(Value::as_str).unwrap_or_default();
            for other in ["perspective", "orthographic"].into_iter().filter(|&other| other != is) {
                if patch.get(other).is_some_and(|set| !set.is_null()) {
                    let what = format!("the camera's type is {is:?}; set \"type\" to {other:?} as well");
                    return Err(EditError::value(format!("{base}/{other}"), what));
                }
            }
        }
        _ => {}
    }
    Ok(())
}

/// A walk through a patch.
struct Patch {
    /// Where it is.
    pointer: String,
}

impl Patch {
    fn refuse<T>(&self, what: impl Into<String>) -> Result<T> {
        Err(EditError::value(self.pointer.clone(), what))
    }

    /// Does something at a member.
    fn at(&mut self, key: &str, visit: impl FnOnce(&mut Self) -> Result<()>) -> Result<()> {
        let length = self.pointer.len();
        push_key(&mut self.pointer, key);
        visit(self)?;
        self.pointer.truncate(length);
        Ok(())
    }

    fn object(&mut self, known: &Members, patch: &Value) -> Result<()> {
        let Value::Object(patch) = patch else { return self.refuse(is_no("an object", patch)) };
        for (key, value) in patch.iter().filter(|(key, value)| *key != "extras" && !value.is_null()) {
            self.at(key, |here| match known.members.iter().find(|(name, _)| name == key) {
                Some((_, of)) => here.member(*of, value),
                None if key == "extensions" => here.extensions(known, value),
                None => {
                    let names: Vec<&str> = known.members.iter().map(|(name, _)| *name).collect();
                    let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                    here.refuse(format!("there is no such member; known are: {names} (and extras, extensions)"))
                }
            })?;
        }
        Ok(())
    }

    fn extensions(&mut self, known: &Members, extensions: &Value) -> Result<()> {
        let Value::Object(extensions) = extensions else { return self.refuse(is_no("an object", extensions)) };
        for (name, value) in extensions.iter().filter(|(_, value)| !value.is_null()) {
            self.at(name, |here| match known.extensions.iter().find(|(known, _)| known == name) {
                Some((_, members)) => here.object(members, value),
                None if name.is_empty() => here.refuse("an extension has a name"),
                None if SUPPORTED.contains(&name.as_str()) && name != ANYWHERE => {
                    let names: Vec<&str> = known.extensions.iter().map(|(name, _)| *name).collect();
                    let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                    here.refuse(format!("the extension is for other objects; for this one are known: {names}"))
                }
                None if !value.is_object() => here.refuse(is_no("an object", value)),
                None => Ok(()),
            })?;
        }
        Ok(())
    }

    fn member(&mut self, of: Type, value: &Value) -> Result<()> {
        let (is_one, what) = match of {
            Type::Object(members) => return self.object(members, value),
            Type::Number => (value.is_number(), "a number"),
            Type::Index => (value.is_u64(), "a whole number, 0 or more"),
            Type::Text => (value.is_string(), "a string"),
            Type::Flag => (value.is_boolean(), "true or false"),
            Type::Numbers(count) => {
                if let Some(list) = value.as_array().filter(|list| list.len() == count) {
                    let element =
                        |(i, value): (usize, &Value)| self.at(&i.to_string(), |here| here.member(Type::Number, value));
                    return list.iter().enumerate().try_for_each(element);
                }
                return self.refuse(is_no(&format!("a list of {count} numbers"), value));
            }
        };
        if is_one { Ok(()) } else { self.refuse(is_no(what, value)) }
    }
}

/// What a value should be and is not.
fn is_no(what: &str, value: &Value) -> String {
    let is = match value {
        Value::Null => "null".to_owned(),
        Value::Bool(flag) => flag.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(_) => "a string".to_owned(),
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(_) => "an object".to_owned(),
    };
    format!("it has to be {what}, and is {is}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::gltf;
    use serde_json::{Map, json};

    /// Every member of an object and of all in it: what leads to it, and the object that has it.
    fn each(object: &'static Members, path: &[&'static str], see: &mut impl FnMut(&[&'static str], &str, Type)) {
        for (name, of) in object.members {
            see(path, name, *of);
            if let Type::Object(inner) = of {
                each(inner, &[path, &[name]].concat(), see);
            }
        }
        for (name, inner) in object.extensions {
            each(inner, &[path, &["extensions", name]].concat(), see);
        }
    }

    #[test]
    fn every_known_member_is_one_that_import_reads() {
        for (kind, object) in [(Kind::Material, &MATERIAL), (Kind::Light, &LIGHT), (Kind::Camera, &CAMERA)] {
            let mut count = 0;
            each(object, &[], &mut |path, name, _| {
                // Kept as JSON, and read by those who show it.
                if path.contains(&"KHR_materials_pbrSpecularGlossiness") {
                    return;
                }
                count += 1;
                // No member of glTF is a list of lists of lists: one that is read is refused for it.
                let mut value = json!({ name: [[[]]] });
                for key in path.iter().rev() {
                    value = Value::Object(Map::from_iter([((*key).to_owned(), value)]));
                }
                let read = gltf::convert_object(kind, &value.to_string(), &|_| 1);
                assert!(read.is_err(), "{kind:?}: {path:?} {name} is not read");
            });
            assert!(count > 5, "{kind:?}");
        }
    }

    /// `{"a": {"b": value}}`, its pointer being `/a/b`.
    fn nested(path: &[&str], name: &str, value: Value) -> (Value, String) {
        let value = path.iter().rev().fold(json!({ name: value }), |inner, key| json!({ *key: inner }));
        (value, format!("/set/{}", [path, &[name]].concat().join("/")))
    }

    #[test]
    fn a_value_of_another_type_is_refused_at_the_member_itself() {
        let values = [
            json!(1),
            json!(-0.5),
            json!("x"),
            json!(true),
            json!([1, 2]),
            json!([1, 2, 3]),
            json!([1, 2, 3, 4]),
            json!([1, "x", 3]),
            json!({}),
            json!([]),
        ];
        for (kind, object) in [(Kind::Material, &MATERIAL), (Kind::Light, &LIGHT), (Kind::Camera, &CAMERA)] {
            each(object, &[], &mut |path, name, of| {
                let mut taken = 0;
                for value in &values {
                    let (patch, pointer) = nested(path, name, value.clone());
                    match check(kind, &patch, "/set") {
                        Ok(()) => taken += 1,
                        Err(EditError::Value { pointer: at, what }) => {
                            assert!(at.starts_with(&pointer), "{at}: {what}");
                            assert!(what.starts_with("it has to be "), "{what}");
                        }
                        Err(other) => panic!("{other}"),
                    }
                }
                let expected = match of {
                    Type::Number => 2,
                    Type::Numbers(_) | Type::Index | Type::Text | Type::Flag | Type::Object(_) => 1,
                };
                assert_eq!(taken, expected, "{path:?} {name}");
            });
        }
    }

    #[test]
    fn the_types_are_those_that_import_reads() {
        // What passes here, import must not refuse for its type; what is of another type, import must refuse.
        for (kind, object) in [(Kind::Material, &MATERIAL), (Kind::Light, &LIGHT), (Kind::Camera, &CAMERA)] {
            each(object, &[], &mut |path, name, of| {
                if path.contains(&"KHR_materials_pbrSpecularGlossiness") {
                    return;
                }
                let value = match of {
                    Type::Number => json!(0.5),
                    Type::Numbers(count) => json!(vec![0.5; count]),
                    Type::Index => json!(0),
                    Type::Text => json!("text"),
                    Type::Flag => json!(true),
                    Type::Object(_) => return,
                };
                let (patch, _) = nested(path, name, value);
                if let Err((_, fault)) = gltf::convert_object(kind, &patch.to_string(), &|_| 1) {
                    // Another member is missing beside it, or the text means nothing; the type is no fault.
                    let fault = fault.to_string();
                    assert!(
                        !fault.contains("invalid type") && !fault.contains("invalid length"),
                        "{path:?} {name}: {fault}"
                    );
                }
            });
        }
    }

    #[test]
    fn an_extension_is_an_object_and_for_the_object_that_has_it() {
        for (kind, patch, pointer) in [
            (
                Kind::Material,
                json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}),
                "/set/extensions/KHR_lights_punctual",
            ),
            (
                Kind::Material,
                json!({"extensions": {"KHR_texture_transform": {}}}),
                "/set/extensions/KHR_texture_transform",
            ),
            (Kind::Material, json!({"extensions": {"ACME_paint": 3}}), "/set/extensions/ACME_paint"),
            (
                Kind::Material,
                json!({"extensions": {"KHR_materials_unlit": true}}),
                "/set/extensions/KHR_materials_unlit",
            ),
            (Kind::Material, json!({"extensions": {"": {}}}), "/set/extensions/"),
            (Kind::Material, json!({"extensions": []}), "/set/extensions"),
            (
                Kind::Material,
                json!({"normalTexture": {"extensions": {"KHR_materials_ior": {}}}}),
                "/set/normalTexture/extensions/KHR_materials_ior",
            ),
            (Kind::Light, json!({"extensions": {"KHR_materials_unlit": {}}}), "/set/extensions/KHR_materials_unlit"),
        ] {
            match check(kind, &patch, "/set") {
                Err(EditError::Value { pointer: at, .. }) => assert_eq!(at, pointer),
                other => panic!("{patch}: {other:?}"),
            }
        }
        for free in
            [json!({"extensions": {"KHR_xmp_json_ld": {"packet": 0}}}), json!({"extensions": {"ACME_paint": null}})]
        {
            assert_eq!(check(Kind::Material, &free, "/set"), Ok(()), "{free}");
        }
    }

    #[test]
    fn a_typo_is_named_with_what_is_known() {
        let refused = |kind: Kind, patch: Value| match check(kind, &patch, "/set") {
            Err(EditError::Value { pointer, what }) => (pointer, what),
            other => panic!("{patch}: {other:?}"),
        };
        let (pointer, what) =
            refused(Kind::Material, json!({"pbrMetallicRoughness": {"baseColourFactor": [1, 1, 1, 1]}}));
        assert_eq!(pointer, "/set/pbrMetallicRoughness/baseColourFactor");
        assert!(what.contains("baseColorFactor, baseColorTexture"), "{what}");
        let coat = json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatNormalTexture": {"strength": 1}}}});
        let pointer = "/set/extensions/KHR_materials_clearcoat/clearcoatNormalTexture/strength";
        assert_eq!(refused(Kind::Material, coat).0, pointer);
        assert_eq!(refused(Kind::Light, json!({"spot": {"angle": 1}})).0, "/set/spot/angle");
        assert_eq!(refused(Kind::Camera, json!({"fov": 1})).0, "/set/fov");
        for free in [
            json!({"extras": {"anything": 1}}),
            json!({"extensions": {"ACME_paint": {"gloss": 1}}}),
            json!({"junk": null}),
            json!({"normalTexture": {"extras": {"a": 1}, "extensions": {"ACME_x": {"b": 2}}}}),
        ] {
            assert_eq!(check(Kind::Material, &free, "/set"), Ok(()), "{free}");
        }
    }
}
