//! Images, as they are encoded.

use super::Writer;
use super::objects::LightParts;
use crate::import::crts::images::{COLOR_SPACE, GENERATED, LINEAR, mark, media_type};
use crate::import::crts::schema::{self, Dtype};
use crate::model::*;
use serde_json::Value;
use std::collections::{HashMap, HashSet};

/// The index of each image in the file. Those without bytes have none.
pub type Images = HashMap<ImageId, i64>;

/// Whether import has made the image from others.
pub fn is_generated(image: &Image) -> bool {
    mark(&image.extra, GENERATED) == Some(&Value::Bool(true))
}

impl Writer<'_> {
    /// Writes every image but those that import will make again.
    pub(super) fn images(&mut self, lights: &LightParts) -> Images {
        let scene = self.scene;
        let mut images = Images::new();
        let mut wanted = HashSet::new();
        let mut colors = HashSet::new();
        for (_, material) in scene.materials().iter().filter(|(id, _)| !lights.materials.contains(id)) {
            let converted = material.without_specular_glossiness();
            let material = converted.as_ref().map_or(material, |(converted, _)| converted);
            let best = |texture: TextureId| scene.textures()[texture].best_source(scene.images());
            let source = |info: &Option<TextureInfo>| info.as_ref().and_then(|i| best(i.texture));
            colors.extend(source(&material.base_color_texture));
            let disney = super::materials::disney(scene, material).0;
            wanted.extend(disney.all_textures().filter_map(best));
        }
        for (id, image) in scene.images().iter() {
            if is_generated(image) && !wanted.contains(&id) {
                continue;
            }
            let pointer = format!("/images/{}", Store::<ImageId, Image>::slot(id));
            let Some(data) = &image.data else {
                self.note(pointer, "an image whose file is missing is left out");
                continue;
            };
            let color_space = match mark(&image.extra, COLOR_SPACE).and_then(Value::as_str) {
                Some(space) => space,
                None if colors.contains(&id) || !wanted.contains(&id) => "sRGB",
                None => LINEAR,
            };
            let view = self.view(Dtype::UINT_8, data.iter().copied());
            self.header.images.push(schema::Image {
                name: Some(image.name.clone().unwrap_or_default()),
                view,
                media_type: media_type(data).or_else(|| image.mime_type.clone()).unwrap_or_default(),
                color_space: Some(color_space.to_owned()),
            });
            images.insert(id, self.header.images.len() as i64 - 1);
        }
        images
    }
}
