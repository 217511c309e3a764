//! Textures, images and samplers.

use super::{Document, Typed};
use crate::export::gltf::images::Placement;
use crate::export::json::Object;
use crate::model::*;

impl Document<'_> {
    pub(super) fn texture(&self, o: &mut Object<'_>, x: &Texture) {
        o.optional_string("name", &x.name);
        self.index(o, "sampler", x.sampler);
        self.index(o, "source", x.source);
        let TextureAlternatives { webp, basisu, dds } = x.alternatives;
        let webp_source = |o: &mut Object<'_>| self.index(o, "source", webp);
        let basisu_source = |o: &mut Object<'_>| self.index(o, "source", basisu);
        let dds_source = |o: &mut Object<'_>| self.index(o, "source", dds);
        let typed: [(bool, Typed<'_>); 3] = [
            (webp.is_some(), ("EXT_texture_webp", &webp_source)),
            (basisu.is_some(), ("KHR_texture_basisu", &basisu_source)),
            (dds.is_some(), ("MSFT_texture_dds", &dds_source)),
        ];
        self.rest_with(o, &x.extra, typed.into_iter().filter_map(|(has, typed)| has.then_some(typed)));
    }

    pub(super) fn image(&self, o: &mut Object<'_>, number: usize, x: &Image) {
        o.optional_string("name", &x.name);
        let mut mime_type = x.mime_type.as_deref();
        match &self.images.placements[number] {
            Placement::Uri { uri, .. } => o.string("uri", uri),
            Placement::DataUri { media_type } => {
                o.data_uri("uri", media_type, x.data.as_ref().map_or(&[], Blob::as_slice));
            }
            Placement::View(index) => o.integer("bufferView", *index),
            Placement::NewView { index, media_type } => {
                o.integer("bufferView", *index);
                mime_type = Some(media_type);
            }
        }
        if let Some(mime_type) = mime_type {
            o.string("mimeType", mime_type);
        }
        self.rest(o, &x.extra);
    }

    pub(super) fn sampler(&self, o: &mut Object<'_>, x: &Sampler) {
        o.optional_string("name", &x.name);
        let codes = [
            ("magFilter", x.mag_filter.map(|filter| filter as u32)),
            ("minFilter", x.min_filter.map(|filter| filter as u32)),
            ("wrapS", x.wrap_s.map(|mode| mode as u32)),
            ("wrapT", x.wrap_t.map(|mode| mode as u32)),
        ];
        for (key, code) in codes {
            if let Some(code) = code {
                o.integer(key, code.into());
            }
        }
        self.rest(o, &x.extra);
    }
}
