//! OpenEXR: written as one scan-line layer of 32-bit floats (ZIP by 16 lines), read in any layout of R, G, B or Y.

use super::{Encoding, ImageError, Picture, check_size};
use crate::failure::Failure;
use crate::output::write_atomically;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding as ExrEncoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, ReadChannels, ReadLayers, Text, Vec2, WritableImage,
};
use std::io::Cursor;
use std::path::Path;

/// One channel of an EXR file.
pub struct Channel<'a> {
    /// Its name, such as `R`, `Z` or `id`.
    pub name: &'a str,
    /// Its values, row by row.
    pub values: Vec<f32>,
}

/// Writes channels as one layer of 32-bit floats, whole or not at all.
///
/// # Errors
/// An I/O error that names the file.
pub fn write_channels(path: &Path, width: u32, height: u32, channels: Vec<Channel<'_>>) -> Result<(), Failure> {
    let list = channels
        .into_iter()
        .map(|c| AnyChannel {
            name: Text::from(c.name),
            sample_data: FlatSamples::F32(c.values),
            quantize_linearly: false,
            sampling: Vec2(1, 1),
        })
        .collect();
    let size = (width as usize, height as usize);
    let layer = Layer::new(
        size,
        LayerAttributes::default(),
        ExrEncoding { compression: exr::prelude::Compression::ZIP16, ..ExrEncoding::SMALL_LOSSLESS },
        AnyChannels::sort(list),
    );
    let image = Image::new(ImageAttributes::new(IntegerBounds::from_dimensions(size)), layer);
    write_atomically(path, |file| {
        // Blocks are compressed one after another, so that the bytes do not depend on the number of threads.
        image
            .write()
            .non_parallel()
            .to_buffered(file)
            .map_err(|e| Failure::bad_input(path, format!("cannot write the EXR: {e}")))
    })
}

pub(super) fn write(path: &Path, width: u32, height: u32, pixels: &[[f32; 3]]) -> Result<(), Failure> {
    let channel = |name, c: usize| Channel { name, values: pixels.iter().map(|p| p[c]).collect() };
    write_channels(path, width, height, vec![channel("R", 0), channel("G", 1), channel("B", 2)])
}

/// The most pixels that a byte of a file can stand for: a block of 256 lines may compress to a few dozen bytes.
const PIXELS_PER_BYTE: u64 = 1 << 14;

pub(super) fn read(path: &Path, bytes: &[u8], max_memory: u64) -> Result<Picture, ImageError> {
    let damaged = |what: String| ImageError::Damaged { path: path.to_owned(), what };
    let meta =
        exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| damaged(e.to_string()))?;
    for header in &meta.headers {
        let (w, h) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
        let bytes_per_pixel = 12 + header.channels.bytes_per_pixel as u64;
        check_size(path, (w, h), bytes.len(), bytes_per_pixel, PIXELS_PER_BYTE, max_memory)?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| damaged(e.to_string()))?;
    let layer = image
        .layer_data
        .iter()
        .find(|layer| colour_channels(&layer.channel_data.list).is_some())
        .ok_or_else(|| damaged("no layer has channels R, G and B, or Y".into()))?;
    let picked = colour_channels(&layer.channel_data.list).expect("the layer was found by this");
    let (width, height) = (layer.size.width(), layer.size.height());
    let planes = picked.map(|c| c.sample_data.values_as_f32().collect::<Vec<f32>>());
    if planes.iter().any(|p| p.len() != width * height) {
        return Err(damaged("colour channels are subsampled, which is not supported".into()));
    }
    let pixels = (0..width * height).map(|i| [planes[0][i], planes[1][i], planes[2][i]]).collect();
    // The header's sizes were bounded above, so they fit.
    Ok(Picture { width: width as u32, height: height as u32, pixels, encoding: Encoding::Linear })
}

/// The channels to show as red, green and blue: `R`, `G`, `B` with a common prefix (`beauty.R`) or none, whatever their
/// case; `X`, `Y`, `Z` together; else one channel for all three (`Y`, `Z`, `id`, or the only one).
fn colour_channels(list: &[AnyChannel<FlatSamples>]) -> Option<[&AnyChannel<FlatSamples>; 3]> {
    let parts = |channel: &AnyChannel<FlatSamples>| {
        let name = channel.name.to_string();
        match name.rsplit_once('.') {
            Some((prefix, last)) => (prefix.to_owned(), last.to_ascii_uppercase()),
            None => (String::new(), name.to_ascii_uppercase()),
        }
    };
    let find = |prefix: &str, last: &str| list.iter().find(|c| parts(c) == (prefix.to_owned(), last.to_owned()));
    let mut prefixes: Vec<String> = list.iter().map(|c| parts(c).0).collect();
    prefixes.sort();
    prefixes.dedup();
    for names in [["R", "G", "B"], ["X", "Y", "Z"], ["Y"; 3], ["Z"; 3], ["ID"; 3]] {
        for prefix in &prefixes {
            if let [Some(r), Some(g), Some(b)] = names.map(|last| find(prefix, last)) {
                return Some([r, g, b]);
            }
        }
    }
    match list {
        [only] => Some([only; 3]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_found_whatever_their_order_prefix_and_company() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.exr");
        let channel = |name, value| Channel { name, values: vec![value; 6] };
        type Case<'a> = (&'a [(&'a str, f32)], [f32; 3]);
        let cases: [Case; 5] = [
            (&[("beauty.R", 1.0), ("beauty.G", 2.0), ("beauty.B", 3.0), ("Z", 9.0)], [1.0, 2.0, 3.0]),
            (&[("A", 0.5), ("b", 3.0), ("g", 2.0), ("r", 1.0)], [1.0, 2.0, 3.0]),
            (&[("Y", 4.0), ("A", 1.0)], [4.0; 3]),
            (&[("X", 1.0), ("Y", 2.0), ("Z", 3.0)], [1.0, 2.0, 3.0]),
            (&[("id", 7.0)], [7.0; 3]),
        ];
        for (channels, expected) in cases {
            write_channels(&path, 3, 2, channels.iter().map(|&(n, v)| channel(n, v)).collect()).expect("write");
            let back = super::super::read(&path, 1 << 20).expect("read");
            assert_eq!(back.pixels, vec![expected; 6]);
        }
    }

    #[test]
    fn the_bytes_do_not_depend_on_when_or_where_they_are_written() {
        let folder = tempfile::tempdir().expect("folder");
        let pixels: Vec<[f32; 3]> = (0..64 * 40).map(|i| [(i as f32).sin(), 0.5, i as f32]).collect();
        let bytes = ["a.exr", "b.exr"].map(|name| {
            let path = folder.path().join(name);
            write(&path, 64, 40, &pixels).expect("write");
            std::fs::read(path).expect("bytes")
        });
        assert_eq!(bytes[0], bytes[1]);
    }
}
