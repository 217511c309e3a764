//! The members of materials, lights and cameras and their types, as the JSON schemas of glTF 2.0 and of the extensions have them.

/// What a member is.
#[derive(Clone, Copy)]
pub enum Type {
    Number,
    /// So many numbers.
    Numbers(usize),
    /// 0, 1, 2, ...
    Index,
    Text,
    Flag,
    Object(&'static Members),
}

/// The members of an object, and the extensions that it may have.
pub struct Members {
    pub members: &'static [(&'static str, Type)],
    pub extensions: &'static [(&'static str, &'static Members)],
}

const fn plain(members: &'static [(&'static str, Type)]) -> Members {
    Members { members, extensions: &[] }
}

use Type::{Flag, Index, Number, Numbers, Object, Text};

const TRANSFORM: Members = Members {
    members: &[("offset", Numbers(2)), ("rotation", Number), ("scale", Numbers(2)), ("texCoord", Index)],
    extensions: &[],
};
const ON_TEXTURES: &[(&str, &Members)] = &[("KHR_texture_transform", &TRANSFORM)];
const TEXTURE: Members = Members { members: &[("index", Index), ("texCoord", Index)], extensions: ON_TEXTURES };
const NORMAL: Members =
    Members { members: &[("index", Index), ("texCoord", Index), ("scale", Number)], extensions: ON_TEXTURES };
const OCCLUSION: Members =
    Members { members: &[("index", Index), ("texCoord", Index), ("strength", Number)], extensions: ON_TEXTURES };

const PBR: Members = plain(&[
    ("baseColorFactor", Numbers(4)),
    ("baseColorTexture", Object(&TEXTURE)),
    ("metallicFactor", Number),
    ("roughnessFactor", Number),
    ("metallicRoughnessTexture", Object(&TEXTURE)),
]);

pub const MATERIAL: Members = Members {
    members: &[
        ("name", Text),
        ("pbrMetallicRoughness", Object(&PBR)),
        ("normalTexture", Object(&NORMAL)),
        ("occlusionTexture", Object(&OCCLUSION)),
        ("emissiveTexture", Object(&TEXTURE)),
        ("emissiveFactor", Numbers(3)),
        ("alphaMode", Text),
        ("alphaCutoff", Number),
        ("doubleSided", Flag),
    ],
    extensions: &[
        ("KHR_materials_unlit", &plain(&[])),
        ("KHR_materials_emissive_strength", &plain(&[("emissiveStrength", Number)])),
        ("KHR_materials_ior", &plain(&[("ior", Number)])),
        ("KHR_materials_dispersion", &plain(&[("dispersion", Number)])),
        (
            "KHR_materials_clearcoat",
            &plain(&[
                ("clearcoatFactor", Number),
                ("clearcoatTexture", Object(&TEXTURE)),
                ("clearcoatRoughnessFactor", Number),
                ("clearcoatRoughnessTexture", Object(&TEXTURE)),
                ("clearcoatNormalTexture", Object(&NORMAL)),
            ]),
        ),
        (
            "KHR_materials_transmission",
            &plain(&[("transmissionFactor", Number), ("transmissionTexture", Object(&TEXTURE))]),
        ),
        (
            "KHR_materials_diffuse_transmission",
            &plain(&[
                ("diffuseTransmissionFactor", Number),
                ("diffuseTransmissionTexture", Object(&TEXTURE)),
                ("diffuseTransmissionColorFactor", Numbers(3)),
                ("diffuseTransmissionColorTexture", Object(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_volume",
            &plain(&[
                ("thicknessFactor", Number),
                ("thicknessTexture", Object(&TEXTURE)),
                ("attenuationDistance", Number),
                ("attenuationColor", Numbers(3)),
            ]),
        ),
        (
            "KHR_materials_specular",
            &plain(&[
                ("specularFactor", Number),
                ("specularTexture", Object(&TEXTURE)),
                ("specularColorFactor", Numbers(3)),
                ("specularColorTexture", Object(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_sheen",
            &plain(&[
                ("sheenColorFactor", Numbers(3)),
                ("sheenColorTexture", Object(&TEXTURE)),
                ("sheenRoughnessFactor", Number),
                ("sheenRoughnessTexture", Object(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_iridescence",
            &plain(&[
                ("iridescenceFactor", Number),
                ("iridescenceTexture", Object(&TEXTURE)),
                ("iridescenceIor", Number),
                ("iridescenceThicknessMinimum", Number),
                ("iridescenceThicknessMaximum", Number),
                ("iridescenceThicknessTexture", Object(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_anisotropy",
            &plain(&[
                ("anisotropyStrength", Number),
                ("anisotropyRotation", Number),
                ("anisotropyTexture", Object(&TEXTURE)),
            ]),
        ),
        (
            "KHR_materials_pbrSpecularGlossiness",
            &plain(&[
                ("diffuseFactor", Numbers(4)),
                ("diffuseTexture", Object(&TEXTURE)),
                ("specularFactor", Numbers(3)),
                ("glossinessFactor", Number),
                ("specularGlossinessTexture", Object(&TEXTURE)),
            ]),
        ),
    ],
};

const SPOT: Members = plain(&[("innerConeAngle", Number), ("outerConeAngle", Number)]);
pub const LIGHT: Members = plain(&[
    ("name", Text),
    ("color", Numbers(3)),
    ("intensity", Number),
    ("range", Number),
    ("type", Text),
    ("spot", Object(&SPOT)),
]);

const PERSPECTIVE: Members = plain(&[("aspectRatio", Number), ("yfov", Number), ("znear", Number), ("zfar", Number)]);
const ORTHOGRAPHIC: Members = plain(&[("xmag", Number), ("ymag", Number), ("znear", Number), ("zfar", Number)]);
pub const CAMERA: Members = plain(&[
    ("name", Text),
    ("type", Text),
    ("perspective", Object(&PERSPECTIVE)),
    ("orthographic", Object(&ORTHOGRAPHIC)),
]);
