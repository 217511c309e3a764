//! Images: the encoded files inside the blob. One that does not decode is replaced by a warning texture.

use super::schema::{self, Dtype};
use super::{Converter, Result, at, name, nth};
use crate::import::Place;
use crate::import::warning::WarningKind;
use crate::model::*;
use image::{DynamicImage, ImageDecoder, ImageError, ImageReader};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::io::Cursor;

/// The member of glTF `extras` under which Orthant keeps what a CRTS file says and glTF has no place for.
pub const ORTHANT: &str = "orthant";
/// Marks an image that was made from others, under [`ORTHANT`]: CRTS gets back the others.
pub const GENERATED: &str = "generated";
/// The key of an image's colour space, under [`ORTHANT`].
pub const COLOR_SPACE: &str = "color_space";
/// The only colour space that is not sRGB.
pub const LINEAR: &str = "LINEAR";

/// What became of an image.
enum Decoded {
    Fine,
    /// It is of a kind that is known and not read here: kept as it is.
    Unsupported(&'static str),
    Broken(String),
}

impl Converter<'_> {
    /// Image and texture number i are image number i of the file.
    pub(super) fn images(&mut self, images: &[schema::Image], dtypes: &[Dtype]) -> Result<()> {
        let mut needed = 0;
        for (i, image) in images.iter().enumerate() {
            let view = self.view_of(image.view, Dtype::UINT_8, dtypes, "images", i, "view")?;
            let bytes = decoding_bytes(self.view_bytes(view));
            // Charged for all at once: they are decoded in parallel.
            self.charge(bytes, || at("images", i, "view"))?;
            needed += bytes;
        }
        let decoded: Vec<_> = images.par_iter().map(|image| check(self.view_bytes(image.view as usize))).collect();
        self.budget.release(needed);

        self.scene.images.reserve(images.len());
        self.scene.textures.reserve(images.len());
        for (i, (image, decoded)) in images.iter().zip(decoded).enumerate() {
            let view = nth(image.view as usize);
            let data = self.scene.view_blob(view);
            let mime_type = data.as_deref().and_then(media_type);
            let linear = image.color_space.as_deref() == Some(LINEAR);
            let color_space = if linear { LINEAR } else { "sRGB" };
            let extra = orthant(json!({ COLOR_SPACE: color_space }));
            self.scene.images.insert_nth(
                i,
                Image { name: name(&image.name), source: ImageSource::View(view), mime_type, data, extra },
            );
            self.scene.textures.insert_nth(i, Texture { source: Some(nth(i)), ..Texture::default() });
            match decoded {
                Decoded::Fine => {}
                Decoded::Unsupported(kind) => {
                    self.warnings.push(WarningKind::UndecodableImage(kind), || at("images", i, ""));
                }
                Decoded::Broken(reason) => {
                    let what = format!(
                        "image {:?} does not decode ({reason}); a warning texture is shown in its place",
                        image.name.as_deref().unwrap_or_default()
                    );
                    self.warnings.push(WarningKind::Replaced(what), || at("images", i, ""));
                    self.replace_image(nth(i), &warning_texture(), || at("images", i, ""))?;
                }
            }
        }
        Ok(())
    }

    /// An image that is made anew, with its texture.
    pub(super) fn add_image(&mut self, png: &[u8], place: impl FnOnce() -> Place) -> Result<TextureId> {
        let extra = orthant(json!({ GENERATED: true }));
        // Its source and bytes follow.
        let source = ImageSource::Uri(String::new());
        let image = self.scene.images.insert(Image { name: None, source, mime_type: None, data: None, extra });
        self.replace_image(image, png, place)?;
        Ok(self.scene.textures.insert(Texture { source: Some(image), ..Texture::default() }))
    }

    fn replace_image(&mut self, id: ImageId, png: &[u8], place: impl FnOnce() -> Place) -> Result<()> {
        let start = self.make_room(png.len(), place)?;
        self.generated.bytes.extend_from_slice(png);
        let view = self.generated_view(start);
        self.generated.images.push((id, view));
        if let Some(image) = self.scene.images.get_mut(id) {
            image.source = ImageSource::View(view);
            image.mime_type = Some("image/png".to_owned());
            // It is in buffer 1, which is not there yet.
            image.data = None;
        }
        Ok(())
    }

    /// Whether an image of the file is read as linear values.
    pub(super) fn is_linear(&self, image: usize) -> bool {
        is_linear(&self.scene.images[nth(image)])
    }

    /// The bytes of an image of the file, or of the warning texture in its place.
    pub(super) fn image_bytes(&self, image: usize) -> Option<Blob> {
        let image = &self.scene.images[nth(image)];
        match (&image.data, &image.source) {
            (Some(data), _) => Some(data.clone()),
            (None, ImageSource::View(view)) => {
                let view = &self.scene.buffer_views[*view];
                let bytes = self.generated.bytes.get(view.offset..view.offset + view.length)?;
                Some(Blob::new(bytes.to_vec()))
            }
            _ => None,
        }
    }
}

/// Whether the values of an image of a CRTS file are linear.
pub fn is_linear(image: &Image) -> bool {
    mark(&image.extra, COLOR_SPACE).and_then(Value::as_str) == Some(LINEAR)
}

/// What Orthant keeps in the `extras` of an object under a key.
pub fn mark<'e>(extra: &'e Extra, key: &str) -> Option<&'e Value> {
    extra.extras.as_ref()?.get(ORTHANT)?.get(key)
}

/// `extras` that hold what Orthant keeps.
pub fn orthant(members: Value) -> Extra {
    Extra { extras: Some(Box::new(json!({ ORTHANT: members }))), ..Extra::default() }
}

/// What an image is, by its first bytes.
pub fn media_type(data: &[u8]) -> Option<String> {
    image::guess_format(data).ok().map(|format| format.to_mime_type().to_owned())
}

/// Bytes that decoding takes, by the image's own header, the decoder's buffers included. Nothing for what is no image.
fn decoding_bytes(data: &[u8]) -> u64 {
    let reader = ImageReader::new(Cursor::new(data)).with_guessed_format();
    reader.ok().and_then(|r| r.into_decoder().ok()).map_or(0, |d| 2 * d.total_bytes() + (1 << 20))
}

/// Decodes an image within what [`decoding_bytes`] says.
pub fn decode(data: &[u8]) -> std::result::Result<DynamicImage, ImageError> {
    let mut decoder = ImageReader::new(Cursor::new(data)).with_guessed_format()?.into_decoder()?;
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(decoder.total_bytes().saturating_mul(2).saturating_add(1 << 20));
    decoder.set_limits(limits)?;
    DynamicImage::from_decoder(decoder)
}

fn check(data: &[u8]) -> Decoded {
    match decode(data) {
        Ok(image) if image.width() > 0 && image.height() > 0 => Decoded::Fine,
        Ok(_) => Decoded::Broken("it has no texels".to_owned()),
        Err(ImageError::Unsupported(error)) => match image::guess_format(data) {
            Ok(format) => Decoded::Unsupported(format.to_mime_type()),
            Err(_) => Decoded::Broken(error.to_string()),
        },
        Err(error) => Decoded::Broken(error.to_string()),
    }
}

/// Two by two texels of magenta and black.
fn warning_texture() -> Vec<u8> {
    const MAGENTA: [u8; 3] = [255, 0, 255];
    const BLACK: [u8; 3] = [0; 3];
    super::packing::png([MAGENTA, BLACK, BLACK, MAGENTA].as_flattened(), 2, 2, image::ExtendedColorType::Rgb8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_warning_texture_is_an_image() {
        let decoded = decode(&warning_texture()).unwrap().into_rgb8();
        assert_eq!(decoded.dimensions(), (2, 2));
        assert_eq!(decoded.get_pixel(0, 0).0, [255, 0, 255]);
    }
}
