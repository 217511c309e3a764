use super::{Blob, BufferViewId, Extra, ImageId, SamplerId, Store};

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
    /// The encoded bytes (PNG, JPEG, WebP, KTX2, DDS). `None` where the file was missing, which is a warning of the import.
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
    /// `source`: the core form, for who does not know the extensions. What is shown is [`Texture::best_source`].
    pub source: Option<ImageId>,
    /// The same picture in the forms of extensions.
    pub alternatives: TextureAlternatives,
    /// `sampler`.
    pub sampler: Option<SamplerId>,
    /// The rest.
    pub extra: Extra,
}

/// The images that extensions offer for a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureAlternatives {
    /// EXT_texture_webp.
    pub webp: Option<ImageId>,
    /// KHR_texture_basisu (KTX2).
    pub basisu: Option<ImageId>,
    /// MSFT_texture_dds.
    pub dds: Option<ImageId>,
}

impl Texture {
    /// The image to show: the first form that can be decoded, or else the first that there is. An extension goes before
    /// the core form, which is there for who does not know it; of the extensions, the one that loses least goes first.
    pub fn best_source(&self, images: &Store<ImageId, Image>) -> Option<ImageId> {
        let TextureAlternatives { webp, basisu, dds } = self.alternatives;
        let forms = || [webp, basisu, dds, self.source].into_iter().flatten();
        forms().find(|&id| images.get(id).is_some_and(Image::is_decodable)).or_else(|| forms().next())
    }
}

impl Image {
    /// What the bytes are, whatever the document says. `None` if they are missing or of no kind that is known.
    pub fn media_type(&self) -> Option<&'static str> {
        media_type(self.data.as_deref()?)
    }

    /// Whether renderers know this kind of image.
    pub fn is_decodable(&self) -> bool {
        let known = ["image/png", "image/jpeg", "image/webp", "image/ktx2", "image/vnd-ms.dds"];
        self.media_type().is_some_and(|kind| known.contains(&kind))
    }
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
