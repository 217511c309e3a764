//! Which extensions are understood.

/// Extensions that a file may require. Those that only say how a surface scatters are listed even where the renderers do
/// not show them yet: the material keeps them, see [`crate::Scene::unrendered_lobes`].
pub const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "MSFT_texture_dds",
    // These say nothing about the picture.
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_xmp_json_ld",
];

/// Extensions of a buffer view that hold its data compressed.
pub const COMPRESSED_VIEWS: &[&str] = &["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// Extensions of a texture that give an image in a form that cannot be decoded.
pub const UNDECODABLE_SOURCES: &[&str] = &["EXT_texture_avif"];

/// The extension of a primitive that holds its accessors compressed.
pub const DRACO: &str = "KHR_draco_mesh_compression";
