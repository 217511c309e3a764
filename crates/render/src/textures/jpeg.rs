//! JPEG straight to RGBA.

use image::ImageFormat;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The texels of a JPEG of luma and two chromas, as most are. The crate `image` would give RGB, which has to be spread;
/// this is its decoder, asked for RGBA. `None` for all else, broken files too: `image` decodes them or says what is wrong.
pub(super) fn rgba8(data: &[u8]) -> Option<Vec<u8>> {
    if image::guess_format(data).ok()? != ImageFormat::Jpeg {
        return None;
    }
    // As `image` has it.
    let options = DecoderOptions::default().set_strict_mode(false).set_max_width(usize::MAX).set_max_height(usize::MAX);
    let mut decoder =
        JpegDecoder::new_with_options(ZCursor::new(data), options.jpeg_set_out_colorspace(ColorSpace::RGBA));
    decoder.decode_headers().ok()?;
    if decoder.input_colorspace()? != ColorSpace::YCbCr {
        return None;
    }
    let (width, height) = decoder.dimensions()?;
    let mut texels = vec![0; width * height * 4];
    decoder.decode_into(&mut texels).ok()?;
    Some(texels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::{ExtendedColorType, ImageEncoder};

    #[test]
    fn texels_are_those_of_the_crate_image() {
        for (width, height) in [(1, 1), (7, 3), (16, 16), (33, 65), (100, 41), (257, 128)] {
            let rgb: Vec<u8> = (0..width * height * 3).map(|i: u32| (i.wrapping_mul(i) / 7 + i / 3) as u8).collect();
            for quality in [20, 95] {
                let mut file = Vec::new();
                let encoder = JpegEncoder::new_with_quality(&mut file, quality);
                encoder.write_image(&rgb, width, height, ExtendedColorType::Rgb8).unwrap();
                let expected = image::load_from_memory(&file).unwrap().into_rgba8().into_raw();
                assert_eq!(rgba8(&file).expect("it has chroma"), expected, "{width} x {height}");
            }
        }
    }

    #[test]
    fn other_files_are_left_alone() {
        let mut grey = Vec::new();
        JpegEncoder::new(&mut grey).write_image(&[1, 2, 3, 4], 2, 2, ExtendedColorType::L8).unwrap();
        assert_eq!(rgba8(&grey), None);
        assert_eq!(rgba8(&grey[..20]), None);
        assert_eq!(rgba8(b"\x89PNG"), None);
    }
}
