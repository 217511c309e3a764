//! Decoded images with their mip chains, and how a sampler reads them.
//!
//! Mips are made once, by the derived scene, and are the same bytes on every backend.

/// What one texel is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TexelFormat {
    /// Four bytes, linear.
    Rgba8Linear,
    /// Four bytes, colour channels sRGB-encoded, alpha linear.
    Rgba8Srgb,
    /// Four 16-bit unorms, linear.
    Rgba16Linear,
    /// Four 16-bit unorms, colour channels sRGB-encoded, alpha linear.
    Rgba16Srgb,
    /// Four floats, linear.
    Rgba32Float,
}

impl TexelFormat {
    /// Bytes of a texel.
    pub fn bytes(self) -> usize {
        match self {
            Self::Rgba8Linear | Self::Rgba8Srgb => 4,
            Self::Rgba16Linear | Self::Rgba16Srgb => 8,
            Self::Rgba32Float => 16,
        }
    }
}

/// One level of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MipLevel {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Byte offset of the first texel in [`ImageData::texels`].
    pub offset: usize,
}

/// An image: level 0 is as the file has it, each further level half as large (rounded down, at least 1), to 1x1. Rows
/// run from the top, texels from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageData {
    /// The texel format.
    pub format: TexelFormat,
    /// At least one level.
    pub levels: Vec<MipLevel>,
    /// All levels, tightly packed.
    pub texels: Vec<u8>,
}

/// What happens outside 0..1 (glTF sampler `wrapS`, `wrapT`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every other one mirrored.
    MirroredRepeat,
    /// The edge goes on.
    ClampToEdge,
}

/// How a texture is read: the glTF sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampling {
    /// Along u.
    pub wrap_s: Wrap,
    /// Along v.
    pub wrap_t: Wrap,
    /// Magnification by the nearest texel (else bilinear).
    pub mag_nearest: bool,
    /// Minification by the nearest texel of a level (else bilinear).
    pub min_nearest: bool,
    /// Which mip level.
    pub mip: MipMode,
}

/// How mip levels are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum MipMode {
    /// Level 0 always.
    Base,
    /// The nearest level.
    Nearest,
    /// Between two levels.
    #[default]
    Linear,
}

impl Default for Sampling {
    /// What glTF leaves to the implementation: repeat, trilinear.
    fn default() -> Self {
        Self {
            wrap_s: Wrap::Repeat,
            wrap_t: Wrap::Repeat,
            mag_nearest: false,
            min_nearest: false,
            mip: MipMode::Linear,
        }
    }
}

impl Sampling {
    /// Packs: bits 0-1 wrap s, 2-3 wrap t, 4 magnify nearest, 5 minify nearest, 6-7 mip mode.
    pub fn pack(self) -> u32 {
        self.wrap_s as u32
            | (self.wrap_t as u32) << 2
            | u32::from(self.mag_nearest) << 4
            | u32::from(self.min_nearest) << 5
            | (self.mip as u32) << 6
    }

    /// Unpacks what [`Sampling::pack`] packed.
    #[inline]
    pub fn unpack(bits: u32) -> Self {
        let wrap = |b: u32| match b & 3 {
            0 => Wrap::Repeat,
            1 => Wrap::MirroredRepeat,
            _ => Wrap::ClampToEdge,
        };
        Self {
            wrap_s: wrap(bits),
            wrap_t: wrap(bits >> 2),
            mag_nearest: bits & 16 != 0,
            min_nearest: bits & 32 != 0,
            mip: match (bits >> 6) & 3 {
                0 => MipMode::Base,
                1 => MipMode::Nearest,
                _ => MipMode::Linear,
            },
        }
    }
}
