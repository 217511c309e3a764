//! The properties of materials, lights and cameras that KHR_animation_pointer may name: where each is, below its object, and
//! which values it takes.

use crate::model::{Camera, CameraProjection, Light, LightKind, Material, TextureInfo, TextureTransform};
use std::slice::from_mut;

/// The values that glTF allows; what lies between keys is clamped to them, since a spline may overshoot.
#[derive(Clone, Copy, Debug)]
struct Bounds(f64, f64);

const UNIT: Bounds = Bounds(0.0, 1.0);
const NOT_NEGATIVE: Bounds = Bounds(0.0, f64::MAX);
const POSITIVE: Bounds = Bounds(f64::MIN_POSITIVE, f64::MAX);
const ANY: Bounds = Bounds(f64::MIN, f64::MAX);
const IOR: Bounds = Bounds(1.0, f64::MAX);
const CONE: Bounds = Bounds(0.0, std::f64::consts::FRAC_PI_2);
/// A field of view is between nothing and half of everything.
const FIELD_OF_VIEW: Bounds = Bounds(1e-6, std::f64::consts::PI - 1e-6);

/// A property of a kind of object: JSON pointer below the object, bounds, and its numbers. `None` where the object has
/// nothing of that name, such as an extension that it does not use.
struct Numbers<T> {
    path: &'static str,
    bounds: Bounds,
    of: fn(&mut T) -> Option<&mut [f64]>,
}

const fn numbers<T>(path: &'static str, bounds: Bounds, of: fn(&mut T) -> Option<&mut [f64]>) -> Numbers<T> {
    Numbers { path, bounds, of }
}

fn one(number: &mut f64) -> Option<&mut [f64]> {
    Some(from_mut(number))
}

const MATERIAL: &[Numbers<Material>] = &[
    numbers("/pbrMetallicRoughness/baseColorFactor", UNIT, |m| Some(&mut m.base_color)),
    numbers("/pbrMetallicRoughness/metallicFactor", UNIT, |m| one(&mut m.metallic)),
    numbers("/pbrMetallicRoughness/roughnessFactor", UNIT, |m| one(&mut m.roughness)),
    numbers("/emissiveFactor", UNIT, |m| Some(&mut m.emissive)),
    numbers("/alphaCutoff", NOT_NEGATIVE, |m| one(m.alpha_cutoff.get_or_insert(0.5))),
    numbers("/normalTexture/scale", ANY, |m| one(&mut m.normal_texture.as_mut()?.scale)),
    numbers("/occlusionTexture/strength", UNIT, |m| one(&mut m.occlusion_texture.as_mut()?.scale)),
    numbers("/extensions/KHR_materials_emissive_strength/emissiveStrength", NOT_NEGATIVE, |m| {
        one(m.emissive_strength.as_mut()?)
    }),
    numbers("/extensions/KHR_materials_ior/ior", NOT_NEGATIVE, |m| one(m.ior.as_mut()?)),
    numbers("/extensions/KHR_materials_dispersion/dispersion", NOT_NEGATIVE, |m| one(m.dispersion.as_mut()?)),
    numbers("/extensions/KHR_materials_clearcoat/clearcoatFactor", UNIT, |m| one(&mut m.clearcoat.as_mut()?.factor)),
    numbers("/extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", UNIT, |m| {
        one(&mut m.clearcoat.as_mut()?.roughness)
    }),
    numbers("/extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale", ANY, |m| {
        one(&mut m.clearcoat.as_mut()?.normal_texture.as_mut()?.scale)
    }),
    numbers("/extensions/KHR_materials_transmission/transmissionFactor", UNIT, |m| {
        one(&mut m.transmission.as_mut()?.factor)
    }),
    numbers("/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", UNIT, |m| {
        one(&mut m.diffuse_transmission.as_mut()?.factor)
    }),
    numbers("/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", UNIT, |m| {
        Some(&mut m.diffuse_transmission.as_mut()?.color)
    }),
    numbers("/extensions/KHR_materials_volume/thicknessFactor", NOT_NEGATIVE, |m| {
        one(&mut m.volume.as_mut()?.thickness)
    }),
    numbers("/extensions/KHR_materials_volume/attenuationDistance", POSITIVE, |m| {
        one(m.volume.as_mut()?.attenuation_distance.get_or_insert(f64::MAX))
    }),
    numbers("/extensions/KHR_materials_volume/attenuationColor", UNIT, |m| {
        Some(&mut m.volume.as_mut()?.attenuation_color)
    }),
    numbers("/extensions/KHR_materials_specular/specularFactor", UNIT, |m| one(&mut m.specular.as_mut()?.factor)),
    numbers("/extensions/KHR_materials_specular/specularColorFactor", NOT_NEGATIVE, |m| {
        Some(&mut m.specular.as_mut()?.color)
    }),
    numbers("/extensions/KHR_materials_sheen/sheenColorFactor", UNIT, |m| Some(&mut m.sheen.as_mut()?.color)),
    numbers("/extensions/KHR_materials_sheen/sheenRoughnessFactor", UNIT, |m| one(&mut m.sheen.as_mut()?.roughness)),
    numbers("/extensions/KHR_materials_iridescence/iridescenceFactor", UNIT, |m| {
        one(&mut m.iridescence.as_mut()?.factor)
    }),
    numbers("/extensions/KHR_materials_iridescence/iridescenceIor", IOR, |m| one(&mut m.iridescence.as_mut()?.ior)),
    numbers("/extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", NOT_NEGATIVE, |m| {
        one(&mut m.iridescence.as_mut()?.thickness_minimum)
    }),
    numbers("/extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", NOT_NEGATIVE, |m| {
        one(&mut m.iridescence.as_mut()?.thickness_maximum)
    }),
    numbers("/extensions/KHR_materials_anisotropy/anisotropyStrength", UNIT, |m| {
        one(&mut m.anisotropy.as_mut()?.strength)
    }),
    numbers("/extensions/KHR_materials_anisotropy/anisotropyRotation", ANY, |m| {
        one(&mut m.anisotropy.as_mut()?.rotation)
    }),
];

/// A material's reference to a texture: its path, and how to reach it.
type Texture = (&'static str, fn(&mut Material) -> Option<&mut TextureInfo>);

/// The references to textures, each of which may have a KHR_texture_transform.
const TEXTURES: &[Texture] = &[
    ("/pbrMetallicRoughness/baseColorTexture", |m| m.base_color_texture.as_mut()),
    ("/pbrMetallicRoughness/metallicRoughnessTexture", |m| m.metallic_roughness_texture.as_mut()),
    ("/normalTexture", |m| m.normal_texture.as_mut()),
    ("/occlusionTexture", |m| m.occlusion_texture.as_mut()),
    ("/emissiveTexture", |m| m.emissive_texture.as_mut()),
    ("/extensions/KHR_materials_clearcoat/clearcoatTexture", |m| m.clearcoat.as_mut()?.texture.as_mut()),
    ("/extensions/KHR_materials_clearcoat/clearcoatRoughnessTexture", |m| {
        m.clearcoat.as_mut()?.roughness_texture.as_mut()
    }),
    ("/extensions/KHR_materials_clearcoat/clearcoatNormalTexture", |m| m.clearcoat.as_mut()?.normal_texture.as_mut()),
    ("/extensions/KHR_materials_transmission/transmissionTexture", |m| m.transmission.as_mut()?.texture.as_mut()),
    ("/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionTexture", |m| {
        m.diffuse_transmission.as_mut()?.texture.as_mut()
    }),
    ("/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorTexture", |m| {
        m.diffuse_transmission.as_mut()?.color_texture.as_mut()
    }),
    ("/extensions/KHR_materials_volume/thicknessTexture", |m| m.volume.as_mut()?.thickness_texture.as_mut()),
    ("/extensions/KHR_materials_specular/specularTexture", |m| m.specular.as_mut()?.texture.as_mut()),
    ("/extensions/KHR_materials_specular/specularColorTexture", |m| m.specular.as_mut()?.color_texture.as_mut()),
    ("/extensions/KHR_materials_sheen/sheenColorTexture", |m| m.sheen.as_mut()?.color_texture.as_mut()),
    ("/extensions/KHR_materials_sheen/sheenRoughnessTexture", |m| m.sheen.as_mut()?.roughness_texture.as_mut()),
    ("/extensions/KHR_materials_iridescence/iridescenceTexture", |m| m.iridescence.as_mut()?.texture.as_mut()),
    ("/extensions/KHR_materials_iridescence/iridescenceThicknessTexture", |m| {
        m.iridescence.as_mut()?.thickness_texture.as_mut()
    }),
    ("/extensions/KHR_materials_anisotropy/anisotropyTexture", |m| m.anisotropy.as_mut()?.texture.as_mut()),
];

const TRANSFORM: &[Numbers<TextureTransform>] = &[
    numbers("/extensions/KHR_texture_transform/offset", ANY, |t| Some(&mut t.offset)),
    numbers("/extensions/KHR_texture_transform/rotation", ANY, |t| one(&mut t.rotation)),
    numbers("/extensions/KHR_texture_transform/scale", ANY, |t| Some(&mut t.scale)),
];

const LIGHT: &[Numbers<Light>] = &[
    numbers("/color", UNIT, |l| Some(&mut l.color)),
    numbers("/intensity", NOT_NEGATIVE, |l| one(&mut l.intensity)),
    numbers("/range", POSITIVE, |l| one(l.range.get_or_insert(f64::MAX))),
    numbers("/spot/innerConeAngle", CONE, |l| match &mut l.kind {
        LightKind::Spot { inner_cone_angle, .. } => one(inner_cone_angle),
        _ => None,
    }),
    numbers("/spot/outerConeAngle", CONE, |l| match &mut l.kind {
        LightKind::Spot { outer_cone_angle, .. } => one(outer_cone_angle),
        _ => None,
    }),
];

const CAMERA: &[Numbers<Camera>] = &[
    numbers("/perspective/yfov", FIELD_OF_VIEW, |c| match &mut c.projection {
        CameraProjection::Perspective { yfov, .. } => one(yfov),
        CameraProjection::Orthographic { .. } => None,
    }),
    numbers("/perspective/aspectRatio", POSITIVE, |c| match &mut c.projection {
        CameraProjection::Perspective { aspect_ratio, .. } => one(aspect_ratio.get_or_insert(1.0)),
        CameraProjection::Orthographic { .. } => None,
    }),
    numbers("/perspective/znear", POSITIVE, |c| match &mut c.projection {
        CameraProjection::Perspective { znear, .. } => one(znear),
        CameraProjection::Orthographic { .. } => None,
    }),
    numbers("/perspective/zfar", POSITIVE, |c| match &mut c.projection {
        CameraProjection::Perspective { zfar, .. } => one(zfar.get_or_insert(f64::MAX)),
        CameraProjection::Orthographic { .. } => None,
    }),
    numbers("/orthographic/xmag", ANY, |c| match &mut c.projection {
        CameraProjection::Orthographic { xmag, .. } => one(xmag),
        CameraProjection::Perspective { .. } => None,
    }),
    numbers("/orthographic/ymag", ANY, |c| match &mut c.projection {
        CameraProjection::Orthographic { ymag, .. } => one(ymag),
        CameraProjection::Perspective { .. } => None,
    }),
    numbers("/orthographic/znear", NOT_NEGATIVE, |c| match &mut c.projection {
        CameraProjection::Orthographic { znear, .. } => one(znear),
        CameraProjection::Perspective { .. } => None,
    }),
    numbers("/orthographic/zfar", POSITIVE, |c| match &mut c.projection {
        CameraProjection::Orthographic { zfar, .. } => one(zfar),
        CameraProjection::Perspective { .. } => None,
    }),
];

fn find<T>(table: &[Numbers<T>], path: &str) -> Option<u8> {
    table.iter().position(|row| row.path == path).map(|row| row as u8)
}

/// Writes numbers to a property, within its bounds. How many it has; `None` where the object does not have it.
fn write<T>(row: &Numbers<T>, object: &mut T, values: &[f64]) -> Option<usize> {
    let numbers = (row.of)(object)?;
    for (number, value) in numbers.iter_mut().zip(values) {
        *number = value.clamp(row.bounds.0, row.bounds.1);
    }
    Some(numbers.len())
}

/// A property of a material, by its row in the tables of this file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MaterialProperty {
    /// Of the material itself.
    Factor(u8),
    /// Of the KHR_texture_transform of one of its references to textures.
    Transform {
        /// The reference.
        texture: u8,
        /// The property.
        property: u8,
    },
}

impl MaterialProperty {
    /// The property at a JSON pointer below a material.
    pub fn at(path: &str) -> Option<Self> {
        if let Some(row) = find(MATERIAL, path) {
            return Some(Self::Factor(row));
        }
        TEXTURES.iter().enumerate().find_map(|(texture, (prefix, _))| {
            let property = find(TRANSFORM, path.strip_prefix(prefix)?)?;
            Some(Self::Transform { texture: texture as u8, property })
        })
    }

    /// Writes the numbers that there are. How many the property has; `None` where the material does not have it.
    pub fn write(self, material: &mut Material, values: &[f64]) -> Option<usize> {
        match self {
            Self::Factor(row) => write(&MATERIAL[usize::from(row)], material, values),
            Self::Transform { texture, property } => {
                let transform = TEXTURES[usize::from(texture)].1(material)?.transform.as_mut()?;
                write(&TRANSFORM[usize::from(property)], transform, values)
            }
        }
    }
}

/// A property of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LightProperty(u8);

impl LightProperty {
    /// The property at a JSON pointer below a light.
    pub fn at(path: &str) -> Option<Self> {
        find(LIGHT, path).map(Self)
    }

    /// As [`MaterialProperty::write`].
    pub fn write(self, light: &mut Light, values: &[f64]) -> Option<usize> {
        write(&LIGHT[usize::from(self.0)], light, values)
    }
}

/// A property of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CameraProperty(u8);

impl CameraProperty {
    /// The property at a JSON pointer below a camera.
    pub fn at(path: &str) -> Option<Self> {
        find(CAMERA, path).map(Self)
    }

    /// As [`MaterialProperty::write`].
    pub fn write(self, camera: &mut Camera, values: &[f64]) -> Option<usize> {
        write(&CAMERA[usize::from(self.0)], camera, values)
    }
}
