//! `bump`: heights, or what many exporters write there, a normal map.

use crate::import::budget::{Budget, OverBudget};
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageReader, Limits, RgbImage};
use std::io::Cursor;

/// What the file of a `bump` statement is.
#[derive(Debug, PartialEq)]
pub enum Bump {
    /// A normal map: most of it is blue.
    Normals,
    /// Heights, as the normal map (PNG) that they make.
    Heights(Vec<u8>),
}

/// How high white stands above black with `-bm 1`, as a part of the image's width. The format names no unit.
const HEIGHT: f32 = 0.01;

/// Bytes that reading takes for each texel: as it is decoded, as RGB, the normals and their PNG, and the decoder's own.
const BYTES_PER_TEXEL: u64 = 24;

/// Reads the image of a `bump` statement with its `-bm`.
///
/// # Errors
/// Outside, that it does not fit the budget; inside, why it cannot be decoded.
pub fn read(data: &[u8], multiplier: f64, budget: &Budget) -> Result<Result<Bump, String>, OverBudget> {
    let reader = ImageReader::new(Cursor::new(data)).with_guessed_format();
    let mut decoder = match reader.map_err(image::ImageError::IoError).and_then(ImageReader::into_decoder) {
        Ok(decoder) => decoder,
        Err(error) => return Ok(Err(error.to_string())),
    };
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Ok(Err("it has no texels".to_owned()));
    }
    let texels = u64::from(width) * u64::from(height);
    let bytes = texels.saturating_mul(BYTES_PER_TEXEL).saturating_add(decoder.total_bytes()).saturating_add(1 << 20);
    budget.charge(bytes)?;
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(decoder.total_bytes().saturating_mul(2).saturating_add(1 << 20));
    let decoded = decoder.set_limits(limits).and_then(|()| DynamicImage::from_decoder(decoder));
    let bump = match decoded {
        Err(error) => Err(error.to_string()),
        Ok(image) => {
            let image = image.into_rgb8();
            if is_normal_map(&image) { Ok(Bump::Normals) } else { normals(&image, multiplier).map(Bump::Heights) }
        }
    };
    budget.release(bytes);
    if let Ok(Bump::Heights(png)) = &bump {
        budget.charge(png.len() as u64)?;
    }
    Ok(bump)
}

/// Heights are grey; normals are on the whole (0, 0, 1), which is (128, 128, 255).
fn is_normal_map(image: &RgbImage) -> bool {
    let mut sums = [0u64; 3];
    image.pixels().for_each(|p| (0..3).for_each(|c| sums[c] += u64::from(p.0[c])));
    let count = u64::from(image.width()) * u64::from(image.height());
    let [r, g, b] = sums.map(|sum| sum / count);
    b >= 160 && b > r + 24 && b > g + 24
}

/// The normals of heights that repeat at the edges, by central differences; v runs up, as in glTF's normal maps.
fn normals(image: &RgbImage, multiplier: f64) -> Result<Vec<u8>, String> {
    let (width, height) = image.dimensions();
    let scale = 0.5 * multiplier as f32 * HEIGHT * width as f32 / 255.0;
    let at = |x: u32, y: u32| {
        let [r, g, b] = image.get_pixel(x % width, y % height).0.map(f32::from);
        // Rec. 709; grey is what it is.
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let mut out = Vec::with_capacity(3 * width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let along_u = scale * (at(x + 1, y) - at(x + width - 1, y));
            let along_v = scale * (at(x, y + height - 1) - at(x, y + 1));
            let normal = glam::Vec3::new(-along_u, -along_v, 1.0).normalize_or(glam::Vec3::Z);
            out.extend(normal.to_array().map(|c| (127.5 * c + 127.5).round() as u8));
        }
    }
    let mut png = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut png);
    encoder.write_image(&out, width, height, ExtendedColorType::Rgb8).map_err(|error| error.to_string())?;
    Ok(png)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(width: u32, texels: &[[u8; 3]]) -> Vec<u8> {
        let mut out = Vec::new();
        image::codecs::png::PngEncoder::new(&mut out)
            .write_image(texels.as_flattened(), width, texels.len() as u32 / width, ExtendedColorType::Rgb8)
            .unwrap();
        out
    }

    fn bump(data: &[u8], multiplier: f64) -> Bump {
        read(data, multiplier, &Budget::new(1 << 24)).unwrap().unwrap()
    }

    #[test]
    fn a_normal_map_is_told_from_heights() {
        assert_eq!(bump(&png(2, &[[128, 128, 255], [100, 150, 230]]), 1.0), Bump::Normals);
        assert!(matches!(bump(&png(2, &[[200, 200, 200], [10, 10, 10]]), 1.0), Bump::Heights(_)));
    }

    #[test]
    fn a_ramp_leans_against_its_rise() {
        // Heights rise by 10 to the right, and by 20 upwards, but for the seam.
        let texels: Vec<[u8; 3]> = (0..25u8).map(|i| [(10 * (i % 5)) + 20 * (4 - i / 5); 3]).collect();
        let Bump::Heights(normals) = bump(&png(5, &texels), 100.0) else { panic!("grey is no normal map") };
        let normals = image::load_from_memory(&normals).unwrap().into_rgb8();
        let [x, y, z] = normals.get_pixel(2, 2).0.map(|b| f32::from(b) / 127.5 - 1.0);
        // White is 100 x 0.01 x 5 = 5 texels high, so 10 of 255 is 0.196, and 20 twice that.
        assert!((x / z + 0.196).abs() < 0.02 && (y / z + 0.392).abs() < 0.02, "{x} {y} {z}");
        let flat = bump(&png(1, &[[7; 3]; 3]), 1.0);
        let Bump::Heights(flat) = flat else { panic!("grey is no normal map") };
        assert_eq!(image::load_from_memory(&flat).unwrap().into_rgb8().get_pixel(0, 1).0, [128, 128, 255]);
    }

    #[test]
    fn what_does_not_decode_or_fit_is_said() {
        assert!(read(b"\x89PNG", 1.0, &Budget::new(1 << 20)).unwrap().is_err());
        let grey = png(64, &[[1; 3]; 64 * 64]);
        let small = Budget::new(1 << 20);
        assert!(read(&grey, 1.0, &small).is_err(), "the decoder's own part alone is a MiB");
        let budget = Budget::new(1 << 24);
        let Bump::Heights(kept) = read(&grey, 1.0, &budget).unwrap().unwrap() else { panic!("grey") };
        assert_eq!(budget.used(), kept.len() as u64);
    }
}
