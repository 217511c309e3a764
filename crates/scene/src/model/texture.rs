use super::{Blob, BufferViewId, Extra, ImageId, SamplerId};

/// Where an image's bytes are in the document.
#[derive(Clone, Debug, PartialEq)]
pub enum ImageSource {
    /// `uri` of a file, as the document has it, relative to the document.
    Uri(String),
    /// A data URI (its bytes are in [`Image::data`]); the media type it states.
    DataUri(String),
    /// `bufferView`.
    View(BufferViewId),
}

/// An image, encoded as the file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// `name`.
    pub name: Option<String>,
    /// Where it came from.
    pub source: ImageSource,
    /// `mimeType`, if given.
    pub mime_type: Option<String>,
    /// The encoded bytes (PNG, JPEG, ...). `None` where the file was missing, which is a warning of the import.
    pub data: Option<Blob>,
    /// The rest.
    pub extra: Extra,
}

/// `magFilter`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum MagFilter {
    /// 9728.
    Nearest = 9728,
    /// 9729.
    Linear = 9729,
}

/// `minFilter`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum MinFilter {
    /// 9728.
    Nearest = 9728,
    /// 9729.
    Linear = 9729,
    /// 9984.
    NearestMipmapNearest = 9984,
    /// 9985.
    LinearMipmapNearest = 9985,
    /// 9986.
    NearestMipmapLinear = 9986,
    /// 9987.
    LinearMipmapLinear = 9987,
}

/// `wrapS`, `wrapT`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum WrapMode {
    /// 33071.
    ClampToEdge = 33071,
    /// 33648.
    MirroredRepeat = 33648,
    /// 10497.
    Repeat = 10497,
}

/// A sampler. `None` is what the file leaves open.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sampler {
    /// `name`.
    pub name: Option<String>,
    /// `magFilter`.
    pub mag_filter: Option<MagFilter>,
    /// `minFilter`.
    pub min_filter: Option<MinFilter>,
    /// `wrapS`; absent is Repeat.
    pub wrap_s: Option<WrapMode>,
    /// `wrapT`; absent is Repeat.
    pub wrap_t: Option<WrapMode>,
    /// The rest.
    pub extra: Extra,
}

/// A texture: an image with a sampler.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texture {
    /// `name`.
    pub name: Option<String>,
    /// `source`; `None` where only an unsupported extension gives one.
    pub source: Option<ImageId>,
    /// `sampler`.
    pub sampler: Option<SamplerId>,
    /// The rest.
    pub extra: Extra,
}

/// The media type of an image, by its first bytes.
pub fn media_type(data: &[u8]) -> Option<&'static str> {
    match data {
        [0x89, b'P', b'N', b'G', ..] => Some("image/png"),
        [0xff, 0xd8, 0xff, ..] => Some("image/jpeg"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("image/webp"),
        [0xab, b'K', b'T', b'X', b' ', b'2', b'0', ..] => Some("image/ktx2"),
        [b'D', b'D', b'S', b' ', ..] => Some("image/vnd-ms.dds"),
        [b'G', b'I', b'F', b'8', ..] => Some("image/gif"),
        [b'B', b'M', ..] => Some("image/bmp"),
        _ => None,
    }
}
