//! The members that the specifications give to materials, lights and cameras. A file may have others, which are kept; an
//! edit that sets one more likely means another.

use crate::edit::EditError;
use crate::edit::plan::Result;
use crate::model::Kind;
use crate::place::push_key;
use serde_json::Value;

/// An object: its members, with what is known of those that are objects, and the extensions that are known.
struct Object {
    members: &'static [(&'static str, Option<&'static Object>)],
    extensions: &'static [(&'static str, &'static Object)],
}

const TRANSFORM: Object =
    Object { members: &[("offset", None), ("rotation", None), ("scale", None), ("texCoord", None)], extensions: &[] };
const ON_TEXTURES: &[(&str, &Object)] = &[("KHR_texture_transform", &TRANSFORM)];
const TEXTURE: Object = Object { members: &[("index", None), ("texCoord", None)], extensions: ON_TEXTURES };
const NORMAL: Object =
    Object { members: &[("index", None), ("texCoord", None), ("scale", None)], extensions: ON_TEXTURES };
const OCCLUSION: Object =
    Object { members: &[("index", None), ("texCoord", None), ("strength", None)], extensions: ON_TEXTURES };

const fn plain(members: &'static [(&'static str, Option<&'static Object>)]) -> Object {
    Object { members, extensions: &[] }
}

const PBR: Object = plain(&[
    ("baseColorFactor", None),
    ("baseColorTexture", Some(&TEXTURE)),
    ("metallicFactor", None),
    ("roughnessFactor", None),
    ("metallicRoughnessTexture", Some(&TEXTURE)),
]);

const MATERIAL: Object = Object {
    members: &[
        ("name", None),
        ("pbrMetallicRoughness", Some(&PBR)),
        ("normalTexture", Some(&NORMAL)),
        ("occlusionTexture", Some(&OCCLUSION)),
        ("emissiveTexture", Some(&TEXTURE)),
        ("emissiveFactor", None),
        ("alphaMode", None),
        ("alphaCutoff", None),
        ("doubleSided", None),
    ],
    extensions: &[
        ("KHR_materials_unlit", &plain(&[])),
        ("KHR_materials_emissive_strength", &plain(&[("emissiveStrength", None)])),
        ("KHR_materials_ior", &plain(&[("ior", None)])),
        ("KHR_materials_dispersion", &plain(&[("dispersion", None)])),
        (
            "KHR_materials_clearcoat",
            &plain(&[
                ("clearcoatFactor", None),
                ("clearcoatTexture", Some(&TEXTURE)),
                ("clearcoatRoughnessFactor", None),
                ("clearcoatRoughnessTexture", Some(&TEXTURE)),
                ("clearcoatNormalTexture", Some(&NORMAL)),
            ]),
        ),
        (
            "KHR_materials_transmission",
            &plain(&[("transmissionFactor", None), ("transmissionTexture", Some(&TEXTURE))]),
        ),
        (
            "KHR_materials_diffuse_transmission",
            &plain(&[
                ("diffuseTransmissionFactor", None),
                ("diffuseTransmissionTexture", Some(&TEXTURE)),
                ("diffuseTransmissionColorFactor", None),
                ("diffuseTransmissionColorTexture", Some(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_volume",
            &plain(&[
                ("thicknessFactor", None),
                ("thicknessTexture", Some(&TEXTURE)),
                ("attenuationDistance", None),
                ("attenuationColor", None),
            ]),
        ),
        (
            "KHR_materials_specular",
            &plain(&[
                ("specularFactor", None),
                ("specularTexture", Some(&TEXTURE)),
                ("specularColorFactor", None),
                ("specularColorTexture", Some(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_sheen",
            &plain(&[
                ("sheenColorFactor", None),
                ("sheenColorTexture", Some(&TEXTURE)),
                ("sheenRoughnessFactor", None),
                ("sheenRoughnessTexture", Some(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_iridescence",
            &plain(&[
                ("iridescenceFactor", None),
                ("iridescenceTexture", Some(&TEXTURE)),
                ("iridescenceIor", None),
                ("iridescenceThicknessMinimum", None),
                ("iridescenceThicknessMaximum", None),
                ("iridescenceThicknessTexture", Some(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_anisotropy",
            &plain(&[
                ("anisotropyStrength", None),
                ("anisotropyRotation", None),
                ("anisotropyTexture", Some(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_pbrSpecularGlossiness",
            &plain(&[
                ("diffuseFactor", None),
                ("diffuseTexture", Some(&TEXTURE)),
                ("specularFactor", None),
                ("glossinessFactor", None),
                ("specularGlossinessTexture", Some(&TEXTURE)),
            ]),
        ),
    ],
};

const SPOT: Object = plain(&[("innerConeAngle", None), ("outerConeAngle", None)]);
const LIGHT: Object = plain(&[
    ("name", None),
    ("color", None),
    ("intensity", None),
    ("range", None),
    ("type", None),
    ("spot", Some(&SPOT)),
]);

const PERSPECTIVE: Object = plain(&[("aspectRatio", None), ("yfov", None), ("znear", None), ("zfar", None)]);
const ORTHOGRAPHIC: Object = plain(&[("xmag", None), ("ymag", None), ("znear", None), ("zfar", None)]);
const CAMERA: Object = plain(&[
    ("name", None),
    ("type", None),
    ("perspective", Some(&PERSPECTIVE)),
    ("orthographic", Some(&ORTHOGRAPHIC)),
]);

/// Refuses a patch that sets a member which is not known. Null, which takes one away that a file has, is let pass; so is
/// whatever is in `extras` and in extensions that are not known. `base` is where the patch is in the edit.
pub fn check(kind: Kind, patch: &Value, base: &str) -> Result<()> {
    let object = match kind {
        Kind::Material => &MATERIAL,
        Kind::Light => &LIGHT,
        Kind::Camera => &CAMERA,
        _ => return Ok(()),
    };
    check_object(object, patch, &mut base.to_owned())
}

fn check_object(object: &Object, patch: &Value, pointer: &mut String) -> Result<()> {
    // What is no object, and should be one, is refused for that.
    let Value::Object(patch) = patch else { return Ok(()) };
    for (key, value) in patch.iter().filter(|(key, value)| *key != "extras" && !value.is_null()) {
        let length = pointer.len();
        push_key(pointer, key);
        match object.members.iter().find(|(name, _)| name == key) {
            Some((_, Some(inner))) => check_object(inner, value, pointer)?,
            Some((_, None)) => {}
            None if key == "extensions" => {
                for (name, value) in value.as_object().into_iter().flatten() {
                    if let Some((_, inner)) = object.extensions.iter().find(|(known, _)| known == name) {
                        let length = pointer.len();
                        push_key(pointer, name);
                        check_object(inner, value, pointer)?;
                        pointer.truncate(length);
                    }
                }
            }
            None => {
                let known: Vec<&str> = object.members.iter().map(|(name, _)| *name).collect();
                let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                let what = format!("there is no such member; known are: {known} (and extras, extensions)");
                return Err(EditError::value(pointer.clone(), what));
            }
        }
        pointer.truncate(length);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::gltf;
    use serde_json::{Map, json};

    /// Every member of an object and of all in it: what leads to it, and the object that has it.
    fn each(object: &'static Object, path: &[&'static str], see: &mut impl FnMut(&[&'static str], &str)) {
        for (name, inner) in object.members {
            see(path, name);
            if let Some(inner) = inner {
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
            each(object, &[], &mut |path, name| {
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
            json!({"normalTexture": {"extras": {"a": 1}, "extensions": {"ACME_x": 2}}}),
        ] {
            assert_eq!(check(Kind::Material, &free, "/set"), Ok(()), "{free}");
        }
    }
}
