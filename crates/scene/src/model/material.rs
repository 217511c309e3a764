use super::{Extra, TextureId};
use serde::{Deserialize, Serialize};

/// KHR_texture_transform.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureTransform {
    /// Added last.
    pub offset: [f64; 2],
    /// Counter-clockwise, in radians, about the origin of UV space.
    pub rotation: f64,
    /// Applied first.
    pub scale: [f64; 2],
    /// Replaces the texture reference's `texCoord`.
    pub tex_coord: Option<u32>,
    /// The rest.
    pub extra: Extra,
}

/// A material's reference to a texture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TextureInfo {
    /// `index`.
    pub texture: TextureId,
    /// `texCoord`: which UV set.
    pub tex_coord: u32,
    /// KHR_texture_transform.
    pub transform: Option<Box<TextureTransform>>,
    /// `scale` (normal textures) or `strength` (occlusion); 1 where the reference has none.
    pub scale: f64,
    /// The rest.
    pub extra: Extra,
}

/// `alphaMode`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum AlphaMode {
    /// `OPAQUE`.
    #[default]
    Opaque,
    /// `MASK`.
    Mask,
    /// `BLEND`.
    Blend,
}

/// A material: metallic-roughness with every ratified material extension.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// `name`.
    pub name: Option<String>,
    /// `baseColorFactor`, linear RGBA.
    pub base_color: [f64; 4],
    /// `baseColorTexture`.
    pub base_color_texture: Option<TextureInfo>,
    /// `metallicFactor`.
    pub metallic: f64,
    /// `roughnessFactor`.
    pub roughness: f64,
    /// `metallicRoughnessTexture`.
    pub metallic_roughness_texture: Option<TextureInfo>,
    /// The rest of `pbrMetallicRoughness`.
    pub pbr_extra: Extra,
    /// `normalTexture`.
    pub normal_texture: Option<TextureInfo>,
    /// `occlusionTexture`.
    pub occlusion_texture: Option<TextureInfo>,
    /// `emissiveTexture`.
    pub emissive_texture: Option<TextureInfo>,
    /// `emissiveFactor`, linear.
    pub emissive: [f64; 3],
    /// `alphaMode`.
    pub alpha_mode: AlphaMode,
    /// `alphaCutoff`; `None` is 0.5.
    pub alpha_cutoff: Option<f64>,
    /// `doubleSided`.
    pub double_sided: bool,
    /// KHR_materials_unlit.
    pub unlit: bool,
    /// KHR_materials_emissive_strength.
    pub emissive_strength: Option<f64>,
    /// KHR_materials_ior.
    pub ior: Option<f64>,
    /// KHR_materials_dispersion.
    pub dispersion: Option<f64>,
    /// KHR_materials_clearcoat.
    pub clearcoat: Option<Box<Clearcoat>>,
    /// KHR_materials_transmission.
    pub transmission: Option<Box<Transmission>>,
    /// KHR_materials_diffuse_transmission.
    pub diffuse_transmission: Option<Box<DiffuseTransmission>>,
    /// KHR_materials_volume.
    pub volume: Option<Box<Volume>>,
    /// KHR_materials_specular.
    pub specular: Option<Box<Specular>>,
    /// KHR_materials_sheen.
    pub sheen: Option<Box<Sheen>>,
    /// KHR_materials_iridescence.
    pub iridescence: Option<Box<Iridescence>>,
    /// KHR_materials_anisotropy.
    pub anisotropy: Option<Box<Anisotropy>>,
    /// The rest.
    pub extra: Extra,
}

impl Default for Material {
    /// glTF's default material.
    fn default() -> Self {
        Self {
            name: None,
            base_color: [1.0; 4],
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            pbr_extra: Extra::default(),
            normal_texture: None,
            occlusion_texture: None,
            emissive_texture: None,
            emissive: [0.0; 3],
            alpha_mode: AlphaMode::Opaque,
            alpha_cutoff: None,
            double_sided: false,
            unlit: false,
            emissive_strength: None,
            ior: None,
            dispersion: None,
            clearcoat: None,
            transmission: None,
            diffuse_transmission: None,
            volume: None,
            specular: None,
            sheen: None,
            iridescence: None,
            anisotropy: None,
            extra: Extra::default(),
        }
    }
}

/// KHR_materials_clearcoat.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Clearcoat {
    /// `clearcoatFactor`.
    pub factor: f64,
    /// `clearcoatTexture` (red).
    pub texture: Option<TextureInfo>,
    /// `clearcoatRoughnessFactor`.
    pub roughness: f64,
    /// `clearcoatRoughnessTexture` (green).
    pub roughness_texture: Option<TextureInfo>,
    /// `clearcoatNormalTexture`.
    pub normal_texture: Option<TextureInfo>,
    /// The rest.
    pub extra: Extra,
}

/// KHR_materials_transmission.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transmission {
    /// `transmissionFactor`.
    pub factor: f64,
    /// `transmissionTexture` (red).
    pub texture: Option<TextureInfo>,
    /// The rest.
    pub extra: Extra,
}

/// KHR_materials_diffuse_transmission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiffuseTransmission {
    /// `diffuseTransmissionFactor`.
    pub factor: f64,
    /// `diffuseTransmissionTexture` (alpha).
    pub texture: Option<TextureInfo>,
    /// `diffuseTransmissionColorFactor`.
    pub color: [f64; 3],
    /// `diffuseTransmissionColorTexture` (sRGB).
    pub color_texture: Option<TextureInfo>,
    /// The rest.
    pub extra: Extra,
}

/// KHR_materials_volume.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Volume {
    /// `thicknessFactor`, metres in object space.
    pub thickness: f64,
    /// `thicknessTexture` (green).
    pub thickness_texture: Option<TextureInfo>,
    /// `attenuationDistance`, metres; `None` is infinite.
    pub attenuation_distance: Option<f64>,
    /// `attenuationColor`.
    pub attenuation_color: [f64; 3],
    /// The rest.
    pub extra: Extra,
}

/// KHR_materials_specular.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Specular {
    /// `specularFactor`.
    pub factor: f64,
    /// `specularTexture` (alpha).
    pub texture: Option<TextureInfo>,
    /// `specularColorFactor`.
    pub color: [f64; 3],
    /// `specularColorTexture` (sRGB).
    pub color_texture: Option<TextureInfo>,
    /// The rest.
    pub extra: Extra,
}

/// KHR_materials_sheen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sheen {
    /// `sheenColorFactor`.
    pub color: [f64; 3],
    /// `sheenColorTexture` (sRGB).
    pub color_texture: Option<TextureInfo>,
    /// `sheenRoughnessFactor`.
    pub roughness: f64,
    /// `sheenRoughnessTexture` (alpha).
    pub roughness_texture: Option<TextureInfo>,
    /// The rest.
    pub extra: Extra,
}

/// KHR_materials_iridescence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Iridescence {
    /// `iridescenceFactor`.
    pub factor: f64,
    /// `iridescenceTexture` (red).
    pub texture: Option<TextureInfo>,
    /// `iridescenceIor`.
    pub ior: f64,
    /// `iridescenceThicknessMinimum`, nanometres.
    pub thickness_minimum: f64,
    /// `iridescenceThicknessMaximum`, nanometres.
    pub thickness_maximum: f64,
    /// `iridescenceThicknessTexture` (green).
    pub thickness_texture: Option<TextureInfo>,
    /// The rest.
    pub extra: Extra,
}

/// KHR_materials_anisotropy.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Anisotropy {
    /// `anisotropyStrength`.
    pub strength: f64,
    /// `anisotropyRotation`, radians.
    pub rotation: f64,
    /// `anisotropyTexture`.
    pub texture: Option<TextureInfo>,
    /// The rest.
    pub extra: Extra,
}
