//! The extensions that the document models.

use super::core::object;
use super::{Attributes, Extensions, Int, Rest, TextureInfo};
use serde::Deserialize;
use serde_json::value::RawValue;

// KHR_texture_transform
object!(TextureTransform {
    offset: Option<[f64; 2]>,
    rotation: Option<f64>,
    scale: Option<[f64; 2]>,
    tex_coord: Option<Int>,
});

// KHR_materials_unlit: nothing but the members of every object.
object!(Unlit {});

// KHR_materials_emissive_strength
object!(EmissiveStrength {
    emissive_strength: Option<f64>,
});

// KHR_materials_ior
object!(Ior { ior: Option<f64>, });

// KHR_materials_dispersion
object!(Dispersion {
    dispersion: Option<f64>,
});

// KHR_materials_clearcoat
object!(Clearcoat {
    clearcoat_factor: Option<f64>,
    #[serde(borrow)]
    clearcoat_texture: Option<TextureInfo<'a>>,
    clearcoat_roughness_factor: Option<f64>,
    #[serde(borrow)]
    clearcoat_roughness_texture: Option<TextureInfo<'a>>,
    #[serde(borrow)]
    clearcoat_normal_texture: Option<TextureInfo<'a>>,
});

// KHR_materials_transmission
object!(Transmission {
    transmission_factor: Option<f64>,
    #[serde(borrow)]
    transmission_texture: Option<TextureInfo<'a>>,
});

// KHR_materials_diffuse_transmission
object!(DiffuseTransmission {
    diffuse_transmission_factor: Option<f64>,
    #[serde(borrow)]
    diffuse_transmission_texture: Option<TextureInfo<'a>>,
    diffuse_transmission_color_factor: Option<[f64; 3]>,
    #[serde(borrow)]
    diffuse_transmission_color_texture: Option<TextureInfo<'a>>,
});

// KHR_materials_volume
object!(Volume {
    thickness_factor: Option<f64>,
    #[serde(borrow)]
    thickness_texture: Option<TextureInfo<'a>>,
    attenuation_distance: Option<f64>,
    attenuation_color: Option<[f64; 3]>,
});

// KHR_materials_specular
object!(Specular {
    specular_factor: Option<f64>,
    #[serde(borrow)]
    specular_texture: Option<TextureInfo<'a>>,
    specular_color_factor: Option<[f64; 3]>,
    #[serde(borrow)]
    specular_color_texture: Option<TextureInfo<'a>>,
});

// KHR_materials_sheen
object!(Sheen {
    sheen_color_factor: Option<[f64; 3]>,
    #[serde(borrow)]
    sheen_color_texture: Option<TextureInfo<'a>>,
    sheen_roughness_factor: Option<f64>,
    #[serde(borrow)]
    sheen_roughness_texture: Option<TextureInfo<'a>>,
});

// KHR_materials_iridescence
object!(Iridescence {
    iridescence_factor: Option<f64>,
    #[serde(borrow)]
    iridescence_texture: Option<TextureInfo<'a>>,
    iridescence_ior: Option<f64>,
    iridescence_thickness_minimum: Option<f64>,
    iridescence_thickness_maximum: Option<f64>,
    #[serde(borrow)]
    iridescence_thickness_texture: Option<TextureInfo<'a>>,
});

// KHR_materials_anisotropy
object!(Anisotropy {
    anisotropy_strength: Option<f64>,
    anisotropy_rotation: Option<f64>,
    #[serde(borrow)]
    anisotropy_texture: Option<TextureInfo<'a>>,
});

// KHR_lights_punctual at the root
object!(Lights {
    #[serde(borrow, default)]
    lights: Vec<Light<'a>>,
});

object!(Light {
    name: Option<String>,
    color: Option<[f64; 3]>,
    intensity: Option<f64>,
    range: Option<f64>,
    #[serde(rename = "type")]
    kind: LightType,
    #[serde(borrow)]
    spot: Option<Spot<'a>>,
});

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LightType {
    Directional,
    Point,
    Spot,
}

object!(Spot {
    inner_cone_angle: Option<f64>,
    outer_cone_angle: Option<f64>,
});

// KHR_lights_punctual at a node
object!(NodeLight { light: Int });

// KHR_node_visibility
object!(NodeVisibility {
    visible: Option<bool>,
});

// EXT_mesh_gpu_instancing
object!(Instancing {
    #[serde(default)]
    attributes: Attributes,
});

// EXT_texture_webp, KHR_texture_basisu and MSFT_texture_dds
object!(TextureSource { source: Option<Int> });

// EXT_meshopt_compression and KHR_meshopt_compression at a buffer view
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct MeshoptView {
    pub buffer: Int,
    #[serde(default)]
    pub byte_offset: Int,
    pub byte_length: Int,
    pub byte_stride: Int,
    pub count: Int,
    pub mode: String,
    pub filter: Option<String>,
}

// KHR_draco_mesh_compression at a primitive: a view, and ids of attributes by semantic
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Draco {
    pub buffer_view: Int,
    #[serde(default)]
    pub attributes: Attributes,
}

// The meshopt extensions at a buffer
#[derive(Debug, Deserialize)]
pub struct MeshoptBuffer {
    #[serde(default)]
    pub fallback: bool,
}

// KHR_materials_variants at the root
object!(Variants {
    #[serde(borrow)]
    variants: Vec<Variant<'a>>,
});

object!(Variant { name: String });

// KHR_materials_variants at a primitive
object!(VariantMappings {
    #[serde(borrow)]
    mappings: Vec<VariantMapping<'a>>,
});

object!(VariantMapping {
    name: Option<String>,
    material: Int,
    variants: Vec<Int>,
});

// KHR_xmp_json_ld at the root
object!(Packets {
    #[serde(default)]
    packets: Vec<serde_json::Value>,
});
