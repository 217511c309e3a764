//! Samplers, images and textures. Images stay encoded.

use super::buffers::data_uri_fault;
use super::{Converter, Members, Result, invalid};
use crate::import::ImportFault;
use crate::import::data_uri::{self, DataUriFault};
use crate::import::files::FileFault;
use crate::import::gltf::extensions::TEXTURE_SOURCES;
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
            if let (Some(declared), Some(content)) = (&image.mime_type, data.as_deref().and_then(media_type))
                && declared != content
            {
                let kind = WarningKind::MimeType { declared: declared.clone(), content };
                self.warn(kind, &at.key("mimeType"));
            }
            let extra = Members::new(image.extensions, image.rest).finish(image.extras, at)?;
            let image = Image { name: image.name, source, mime_type: image.mime_type, data, extra };
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
            let source = t.source.and_then(|s| self.counts.image(s, &at.key("source")).ok());
            if t.source.is_some() && source.is_none() {
                self.tolerate("there is no such image; the texture has none", &at.key("source"));
            }
            let sampler = t.sampler.and_then(|s| self.counts.sampler(s, &at.key("sampler")).ok());
            if t.sampler.is_some() && sampler.is_none() {
                self.tolerate("there is no such sampler; the default is used", &at.key("sampler"));
            }
            let members = Members::new(t.extensions, t.rest);
            match source {
                None => {
                    if let Some(name) = TEXTURE_SOURCES.iter().find(|name| members.has(name)) {
                        self.warn(WarningKind::NoImage((*name).to_owned()), at);
                    }
                }
                Some(id) => {
                    let content = self.scene.images[id].data.as_deref().map(media_type);
                    match content {
                        None | Some(Some("image/png" | "image/jpeg")) => {}
                        Some(other) => {
                            let kind = WarningKind::UndecodableImage(other.unwrap_or("of no known type"));
                            self.warn(kind, &at.key("source"));
                        }
                    }
                }
            }
            let texture = Texture { name: t.name, source, sampler, extra: members.finish(t.extras, at)? };
            self.scene.textures.insert_nth(i, texture);
        }
        Ok(())
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
