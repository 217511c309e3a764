//! Samplers, images and textures. Images stay encoded.

use super::buffers::data_uri_fault;
use super::{Converter, Members, Result, invalid};
use crate::import::ImportFault;
use crate::import::data_uri::{self, DataUriFault};
use crate::import::files::FileFault;
use crate::import::gltf::extensions::UNDECODABLE_SOURCES;
use crate::import::gltf::schema::{self, Int};
use crate::import::warning::WarningKind;
use crate::model::*;
use crate::place::At;

impl Converter<'_> {
    pub(super) fn samplers(&mut self, samplers: Vec<schema::Sampler<'_>>) -> Result<()> {
        let at = &At::Root.key("samplers");
        self.scene.samplers.reserve(samplers.len());
        for (i, s) in samplers.into_iter().enumerate() {
            let at = &at.index(i);
            let sampler = Sampler {
                name: s.name,
                mag_filter: self.known(s.mag_filter, mag_filter, &at.key("magFilter")),
                min_filter: self.known(s.min_filter, min_filter, &at.key("minFilter")),
                wrap_s: self.known(s.wrap_s, wrap_mode, &at.key("wrapS")),
                wrap_t: self.known(s.wrap_t, wrap_mode, &at.key("wrapT")),
                extra: Members::new(s.extensions, s.rest).finish(s.extras, at)?,
            };
            self.scene.samplers.insert_nth(i, sampler);
        }
        Ok(())
    }

    fn known<T>(&mut self, value: Option<Int>, from: fn(u64) -> Option<T>, at: &At<'_>) -> Option<T> {
        let known = from(value?.0);
        if known.is_none() {
            self.tolerate("this is no value that a sampler can have; the default is used", at);
        }
        known
    }

    pub(super) fn images(&mut self, images: Vec<schema::Image<'_>>) -> Result<()> {
        let at = &At::Root.key("images");
        self.scene.images.reserve(images.len());
        for (i, image) in images.into_iter().enumerate() {
            let at = &at.index(i);
            let (source, data) = match (image.buffer_view, image.uri) {
                (Some(view), uri) => {
                    if uri.is_some() {
                        self.tolerate("the image has a uri and a bufferView; the uri is ignored", at);
                    }
                    let view = self.counts.buffer_view(view, &at.key("bufferView"))?;
                    (ImageSource::View(view), self.scene.view_blob(view))
                }
                (None, Some(schema::Text(uri))) => self.image_file(&uri, &at.key("uri"))?,
                (None, None) => return invalid(at, "the image has neither a uri nor a bufferView"),
            };
            let extra = Members::new(image.extensions, image.rest).finish(image.extras, at)?;
            let image = Image { name: image.name, source, mime_type: image.mime_type, data, extra };
            if let (Some(declared), Some(content)) = (&image.mime_type, image.media_type())
                && declared != content
            {
                let kind = WarningKind::MimeType { declared: declared.clone(), content };
                self.warn(kind, &at.key("mimeType"));
            }
            self.scene.images.insert_nth(i, image);
        }
        Ok(())
    }

    fn image_file(&mut self, uri: &str, at: &At<'_>) -> Result<(ImageSource, Option<Blob>)> {
        if let Some(decoded) = data_uri::decode(uri, self.budget) {
            return match decoded {
                Ok((media_type, data)) => Ok((ImageSource::DataUri(media_type.to_owned()), Some(Blob::new(data)))),
                Err(fault @ DataUriFault::OverBudget(_)) => Err(data_uri_fault(fault, at)),
                Err(fault) => {
                    self.warn(WarningKind::MissingImage(fault.to_string()), at);
                    Ok((ImageSource::Uri(uri.to_owned()), None))
                }
            };
        }
        let data = match self.files.read_uri(uri, None) {
            Ok(data) => Some(Blob::new(data)),
            Err(fault @ (FileFault::Missing(_) | FileFault::Io { .. } | FileFault::NotAFile(_))) => {
                self.warn(WarningKind::MissingImage(fault.to_string()), at);
                None
            }
            Err(fault) => return Err((at.place(), ImportFault::from(fault))),
        };
        Ok((ImageSource::Uri(uri.to_owned()), data))
    }

    pub(super) fn textures(&mut self, textures: Vec<schema::Texture<'_>>) -> Result<()> {
        let at = &At::Root.key("textures");
        self.scene.textures.reserve(textures.len());
        for (i, t) in textures.into_iter().enumerate() {
            let at = &at.index(i);
            // A texture without an image or with the default sampler is harmless, and there are files that need this.
            let source = self.texture_image(t.source, &at.key("source"));
            let sampler = t.sampler.and_then(|s| self.counts.sampler(s, &at.key("sampler")).ok());
            if t.sampler.is_some() && sampler.is_none() {
                self.tolerate("there is no such sampler; the default is used", &at.key("sampler"));
            }
            let members = &mut Members::new(t.extensions, t.rest);
            let alternatives = TextureAlternatives {
                webp: self.texture_source("EXT_texture_webp", members, at)?,
                basisu: self.texture_source("KHR_texture_basisu", members, at)?,
                dds: self.texture_source("MSFT_texture_dds", members, at)?,
            };
            let undecodable = UNDECODABLE_SOURCES.iter().find(|name| members.has(name));
            let extra = std::mem::take(members).finish(t.extras, at)?;
            let texture = Texture { name: t.name, source, alternatives, sampler, extra };
            match (texture.best_source(&self.scene.images), undecodable) {
                (None, Some(name)) => self.warn(WarningKind::NoImage((*name).to_owned()), at),
                (None, None) => {}
                (Some(id), _) => {
                    let image = &self.scene.images[id];
                    if image.data.is_some() && !image.is_decodable() {
                        let kind = WarningKind::UndecodableImage(image.media_type().unwrap_or("of no known type"));
                        self.warn(kind, &at.key("source"));
                    }
                }
            }
            self.scene.textures.insert_nth(i, texture);
        }
        Ok(())
    }

    /// An image that a texture names, if there is such an image.
    fn texture_image(&mut self, source: Option<Int>, at: &At<'_>) -> Option<ImageId> {
        let image = self.counts.image(source?, at).ok();
        if image.is_none() {
            self.tolerate("there is no such image; the texture has none", at);
        }
        image
    }

    /// The image that an extension names. What else its object holds is kept.
    fn texture_source<'a>(
        &mut self,
        name: &'static str,
        members: &mut Members<'a>,
        at: &At<'_>,
    ) -> Result<Option<ImageId>> {
        let Some(object) = members.take::<schema::TextureSource<'a>>(name, at)? else { return Ok(None) };
        members.keep_rest(name, object.extensions, object.extras, object.rest, at)?;
        let extensions = at.key("extensions");
        Ok(self.texture_image(object.source, &extensions.key(name).key("source")))
    }
}

fn mag_filter(value: u64) -> Option<MagFilter> {
    match value {
        9728 => Some(MagFilter::Nearest),
        9729 => Some(MagFilter::Linear),
        _ => None,
    }
}

fn min_filter(value: u64) -> Option<MinFilter> {
    match value {
        9728 => Some(MinFilter::Nearest),
        9729 => Some(MinFilter::Linear),
        9984 => Some(MinFilter::NearestMipmapNearest),
        9985 => Some(MinFilter::LinearMipmapNearest),
        9986 => Some(MinFilter::NearestMipmapLinear),
        9987 => Some(MinFilter::LinearMipmapLinear),
        _ => None,
    }
}

fn wrap_mode(value: u64) -> Option<WrapMode> {
    match value {
        33071 => Some(WrapMode::ClampToEdge),
        33648 => Some(WrapMode::MirroredRepeat),
        10497 => Some(WrapMode::Repeat),
        _ => None,
    }
}
