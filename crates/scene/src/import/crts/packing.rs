//! Images whose channels are where a glTF material wants them.
//!
//! CRTS takes each textured parameter from any channel of any image; a glTF material has fixed channels, and a base colour
//! is always sRGB. Where a file differs, an image is made that has the values in their places, 8 bits deep if every source
//! is and nothing is converted between colour spaces, else 16.

use super::images::decode;
use super::{Converter, Result};
use crate::import::Place;
use crate::model::TextureId;
use image::{ExtendedColorType, ImageEncoder, Rgba};
use std::collections::HashMap;

/// Where the values of a channel come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// Nobody looks.
    Any,
    /// Everywhere this fraction of the most, in 255ths.
    Constant(u8),
    /// A channel (0 to 3) of an image of the file.
    Of { image: usize, channel: u8 },
}

/// What a slot of a material wants: the source of each channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Packing {
    pub channels: [Source; 4],
    /// Whether the slot takes red, green and blue for sRGB.
    pub srgb: bool,
}

impl Packing {
    /// The image that has it all in place, if there is one.
    fn in_place(&self, is_linear: impl Fn(usize) -> bool) -> Option<usize> {
        let mut found = None;
        for (position, source) in self.channels.into_iter().enumerate() {
            match source {
                Source::Any => {}
                Source::Constant(_) => return None,
                Source::Of { image, channel } => {
                    let same_space = position == 3 || is_linear(image) != self.srgb;
                    if usize::from(channel) != position || !same_space || found.is_some_and(|f| f != image) {
                        return None;
                    }
                    found = Some(image);
                }
            }
        }
        found
    }
}

/// The textures that were made, so that materials which want the same share one.
#[derive(Default)]
pub struct Packed(HashMap<Packing, Option<TextureId>>);

/// A decoded image.
type Texels = image::ImageBuffer<Rgba<u16>, Vec<u16>>;

impl Converter<'_> {
    /// The texture that a slot gets. `None` if an image that it needs cannot be decoded here.
    pub(super) fn packed(
        &mut self,
        packing: Packing,
        packed: &mut Packed,
        place: impl Fn() -> Place,
    ) -> Result<Option<TextureId>> {
        if let Some(image) = packing.in_place(|image| self.is_linear(image)) {
            // Texture number i shows image number i.
            return Ok(Some(super::nth(image)));
        }
        if let Some(&known) = packed.0.get(&packing) {
            return Ok(known);
        }
        let texture = match self.pack(&packing, &place)? {
            Some(png) => Some(self.add_image(&png, place)?),
            None => None,
        };
        packed.0.insert(packing, texture);
        Ok(texture)
    }

    fn pack(&self, packing: &Packing, place: &impl Fn() -> Place) -> Result<Option<Vec<u8>>> {
        let mut images: Vec<(usize, Texels)> = Vec::new();
        let mut charged = 0;
        let mut deep = false;
        for source in packing.channels {
            let Source::Of { image, .. } = source else { continue };
            if images.iter().any(|(known, _)| *known == image) {
                continue;
            }
            let Some(data) = self.image_bytes(image) else { return Ok(None) };
            let Some((width, height)) = dimensions(&data) else { return Ok(None) };
            // As the file has it, and as 16 bits of four channels.
            let bytes = 3 * 8 * u64::from(width) * u64::from(height) + (1 << 20);
            self.charge(bytes, place)?;
            charged += bytes;
            let Ok(decoded) = decode(&data) else { return Ok(None) };
            let color = decoded.color();
            deep |= color.bytes_per_pixel() > color.channel_count();
            images.push((image, decoded.into_rgba16()));
        }
        let Some(width) = images.iter().map(|(_, i)| i.width()).max() else { return Ok(None) };
        let height = images.iter().map(|(_, i)| i.height()).max().unwrap_or(1);
        // Not given back: renderers will hold the image decoded.
        self.charge(2 * 8 * u64::from(width) * u64::from(height), place)?;

        let converts = |position: usize, source: Source| match source {
            Source::Of { image, channel } => (channel < 3 && !self.is_linear(image)) != (packing.srgb && position < 3),
            _ => false,
        };
        deep |= packing.channels.iter().enumerate().any(|(position, &source)| converts(position, source));
        let has_alpha = packing.channels[3] != Source::Any;
        let channels = if has_alpha { 4 } else { 3 };
        let mut texels = Vec::with_capacity(width as usize * height as usize * channels);
        for y in 0..height {
            for x in 0..width {
                for (position, &source) in packing.channels[..channels].iter().enumerate() {
                    texels.push(match source {
                        Source::Any => 0,
                        Source::Constant(c) => u16::from(c) * 257,
                        Source::Of { image, channel } => {
                            let value = images.iter().find(|(known, _)| *known == image).map_or(0, |(_, image)| {
                                let nearest = |at: u32, size: u32, of: u32| {
                                    (u64::from(at) * u64::from(size) / u64::from(of)) as u32
                                };
                                let (x, y) = (nearest(x, image.width(), width), nearest(y, image.height(), height));
                                image.get_pixel(x, y).0[usize::from(channel)]
                            });
                            match (converts(position, source), packing.srgb && position < 3) {
                                (false, _) => value,
                                (true, true) => unorm16(srgb_from_linear(f64::from(value) / 65535.0)),
                                (true, false) => unorm16(linear_from_srgb(f64::from(value) / 65535.0)),
                            }
                        }
                    });
                }
            }
        }
        drop(images);
        self.budget.release(charged);
        Ok(Some(match (deep, has_alpha) {
            (true, true) => png(bytemuck::cast_slice(&texels), width, height, ExtendedColorType::Rgba16),
            (true, false) => png(bytemuck::cast_slice(&texels), width, height, ExtendedColorType::Rgb16),
            (false, _) => {
                let bytes: Vec<u8> = texels.iter().map(|&t| (t / 257) as u8).collect();
                let color = if has_alpha { ExtendedColorType::Rgba8 } else { ExtendedColorType::Rgb8 };
                png(&bytes, width, height, color)
            }
        }))
    }
}

fn dimensions(data: &[u8]) -> Option<(u32, u32)> {
    image::ImageReader::new(std::io::Cursor::new(data)).with_guessed_format().ok()?.into_dimensions().ok()
}

fn unorm16(value: f64) -> u16 {
    (value * 65535.0 + 0.5) as u16
}

/// IEC 61966-2-1.
fn srgb_from_linear(value: f64) -> f64 {
    if value <= 0.0031308 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 }
}

/// IEC 61966-2-1.
fn linear_from_srgb(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// Encodes texels, rows from top to bottom, 16 bits in the order of this machine.
pub fn png(texels: &[u8], width: u32, height: u32, color: ExtendedColorType) -> Vec<u8> {
    let mut out = Vec::new();
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(texels, width, height, color)
        .expect("memory takes every byte, and there are as many texels as the size says");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transfer_functions_are_inverse() {
        for i in 0..=65535u16 {
            let value = f64::from(i) / 65535.0;
            assert_eq!(unorm16(srgb_from_linear(linear_from_srgb(value))), i);
        }
    }

    #[test]
    fn an_image_is_in_place_only_if_channel_and_colour_space_are() {
        let of = |image, channel| Source::Of { image, channel };
        let packing = |channels, srgb| Packing { channels, srgb };
        let any = Source::Any;
        // Image 0 is linear, image 1 is sRGB.
        let find = |p: Packing| p.in_place(|image| image == 0);
        assert_eq!(find(packing([any, of(0, 1), of(0, 2), any], false)), Some(0));
        assert_eq!(find(packing([any, of(0, 2), any, any], false)), None, "another channel");
        assert_eq!(find(packing([any, of(1, 1), any, any], false)), None, "another colour space");
        assert_eq!(find(packing([any, any, any, of(1, 3)], false)), Some(1), "alpha is always linear");
        assert_eq!(find(packing([of(1, 0), of(1, 1), of(1, 2), any], true)), Some(1));
        assert_eq!(find(packing([of(0, 0), of(0, 1), of(0, 2), any], true)), None);
        assert_eq!(find(packing([any, of(0, 1), Source::Constant(255), any], false)), None);
    }
}
