use bytemuck::{Pod, Zeroable};

/// How alpha is read (glTF `alphaMode`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque = 0,
    /// Present where alpha is at least the cutoff.
    Mask = 1,
    /// Present with the probability alpha.
    Blend = 2,
}

/// Bits of [`MaterialRow::flags`]. The two lowest bits are the [`AlphaMode`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialFlags;

impl MaterialFlags {
    /// Mask of the [`AlphaMode`].
    pub const ALPHA_MODE: u32 = 3;
    /// Both faces are seen and shaded.
    pub const DOUBLE_SIDED: u32 = 4;
    /// KHR_materials_unlit: the base colour is emitted as it is, nothing is reflected.
    pub const UNLIT: u32 = 8;
}

/// A reference from a material to a texture. 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TextureSlot {
    /// Row of the texture buffer, or [`super::NONE`].
    pub texture: u32,
    /// 0 or 1: which UV set.
    pub uv_set: u32,
    /// KHR_texture_transform as two rows `[a, b, t]`: u' = a u + b v + t.
    pub transform: [[f32; 3]; 2],
}

impl TextureSlot {
    /// No texture.
    pub const NONE: Self = Self { texture: super::NONE, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
}

/// One material in metallic-roughness terms. 224 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MaterialRow {
    /// Linear RGBA factor.
    pub base_color: [f32; 4],
    /// Linear emitted radiance factor, KHR_materials_emissive_strength multiplied in.
    pub emissive: [f32; 3],
    /// For [`AlphaMode::Mask`].
    pub alpha_cutoff: f32,
    /// 0..=1.
    pub metallic: f32,
    /// 0..=1, perceptual (alpha = roughness squared).
    pub roughness: f32,
    /// Scales x and y of the normal map.
    pub normal_scale: f32,
    /// 0..=1; the path tracer computes occlusion and leaves it out, the raster preview uses it.
    pub occlusion_strength: f32,
    /// Index of refraction of the dielectric interface (1.5 unless KHR_materials_ior says else).
    pub ior: f32,
    /// [`MaterialFlags`].
    pub flags: u32,
    /// What the `material` AOV shows: the index of the material in the document, or [`super::NONE`] for the default one.
    pub id: u32,
    /// Zero.
    pub reserved: u32,
    /// sRGB base colour and linear alpha.
    pub base_color_texture: TextureSlot,
    /// Green = roughness, blue = metallic; linear.
    pub metallic_roughness_texture: TextureSlot,
    /// Tangent-space normals; linear.
    pub normal_texture: TextureSlot,
    /// Red; linear.
    pub occlusion_texture: TextureSlot,
    /// sRGB.
    pub emissive_texture: TextureSlot,
}

impl MaterialRow {
    /// glTF's default material.
    pub const DEFAULT: Self = Self {
        base_color: [1.0; 4],
        emissive: [0.0; 3],
        alpha_cutoff: 0.5,
        metallic: 1.0,
        roughness: 1.0,
        normal_scale: 1.0,
        occlusion_strength: 1.0,
        ior: 1.5,
        flags: 0,
        id: super::NONE,
        reserved: 0,
        base_color_texture: TextureSlot::NONE,
        metallic_roughness_texture: TextureSlot::NONE,
        normal_texture: TextureSlot::NONE,
        occlusion_texture: TextureSlot::NONE,
        emissive_texture: TextureSlot::NONE,
    };

    /// The alpha mode in the flags.
    #[inline]
    pub fn alpha_mode(&self) -> AlphaMode {
        match self.flags & MaterialFlags::ALPHA_MODE {
            0 => AlphaMode::Opaque,
            1 => AlphaMode::Mask,
            _ => AlphaMode::Blend,
        }
    }

    /// Whether a surface of it can emit at all.
    #[inline]
    pub fn is_emissive(&self) -> bool {
        self.emissive.iter().any(|&c| c > 0.0)
    }
}
