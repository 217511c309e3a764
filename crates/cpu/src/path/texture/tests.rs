use super::*;

/// Texels that differ everywhere, in any format, with two levels.
fn noise(format: TexelFormat, width: u32, height: u32) -> ImageData {
    let mut image = ImageData { format, levels: vec![], texels: vec![] };
    let mut state = 12345u32;
    for (w, h) in [(width, height), ((width / 2).max(1), (height / 2).max(1))] {
        image.levels.push(MipLevel { width: w, height: h, offset: image.texels.len() });
        for _ in 0..w * h * 4 {
            state = orthant_resident::sampling::hash_mix(state.wrapping_add(1));
            match format.bytes() {
                4 => image.texels.push(state as u8),
                8 => image.texels.extend((state as u16).to_le_bytes()),
                _ => image.texels.extend(((state >> 8) as f32 / 1e6).to_le_bytes()),
            }
        }
    }
    image
}

/// One texel by the letter of the formats, in `f64`.
fn reference_texel(image: &ImageData, level: usize, x: i64, y: i64) -> [f64; 4] {
    let l = &image.levels[level];
    let i = (y as usize * l.width as usize + x as usize) * image.format.bytes() + l.offset;
    let bytes = &image.texels[i..i + image.format.bytes()];
    std::array::from_fn(|k| {
        let (value, srgb) = match image.format {
            TexelFormat::Rgba8Linear => (bytes[k] as f64 / 255.0, false),
            TexelFormat::Rgba8Srgb => (bytes[k] as f64 / 255.0, true),
            TexelFormat::Rgba16Linear | TexelFormat::Rgba16Srgb => {
                let v = u16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]]) as f64 / 65535.0;
                (v, image.format == TexelFormat::Rgba16Srgb)
            }
            TexelFormat::Rgba32Float => (f32::from_le_bytes(bytes[4 * k..4 * k + 4].try_into().unwrap()) as f64, false),
        };
        if srgb && k < 3 {
            if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        } else {
            value
        }
    })
}

fn reference_wrap(wrap: Wrap, i: i64, n: i64) -> i64 {
    match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::MirroredRepeat => {
            let j = i.rem_euclid(2 * n);
            if j < n { j } else { 2 * n - 1 - j }
        }
        Wrap::ClampToEdge => i.clamp(0, n - 1),
    }
}

fn reference_level(image: &ImageData, level: usize, s: Sampling, u: f64, v: f64, nearest: bool) -> [f64; 4] {
    let l = &image.levels[level];
    let (w, h) = (l.width as i64, l.height as i64);
    let texel =
        |i: i64, j: i64| reference_texel(image, level, reference_wrap(s.wrap_s, i, w), reference_wrap(s.wrap_t, j, h));
    let (x, y) = (u * w as f64, v * h as f64);
    if nearest {
        return texel(x.floor() as i64, y.floor() as i64);
    }
    // A sum over all texels nearby, weighed by a tent
    let mut sum = [0.0; 4];
    for j in y.floor() as i64 - 2..=y.floor() as i64 + 2 {
        for i in x.floor() as i64 - 2..=x.floor() as i64 + 2 {
            let weight = (1.0 - (x - i as f64 - 0.5).abs()).max(0.0) * (1.0 - (y - j as f64 - 0.5).abs()).max(0.0);
            let t = texel(i, j);
            for k in 0..4 {
                sum[k] += weight * t[k];
            }
        }
    }
    sum
}

const FORMATS: [TexelFormat; 5] = [
    TexelFormat::Rgba8Linear,
    TexelFormat::Rgba8Srgb,
    TexelFormat::Rgba16Linear,
    TexelFormat::Rgba16Srgb,
    TexelFormat::Rgba32Float,
];
const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];

fn coordinates() -> impl Iterator<Item = Vec2> {
    // Offsets keep away from the borders of texels, where nearest filtering may go either way.
    (0..400).map(|i| {
        Vec2::new(((i * 37) % 401) as f32 / 67.0 - 3.0 + 0.0037, ((i * 91) % 397) as f32 / 71.0 - 2.5 + 0.0021)
    })
}

#[track_caller]
fn assert_texel(value: Vec4, reference: [f64; 4], what: &str) {
    for k in 0..4 {
        let error = (value[k] as f64 - reference[k]).abs();
        assert!(error <= 2e-5 * reference[k].abs().max(1.0), "{what}: {} instead of {}", value[k], reference[k]);
    }
}

#[test]
fn filtering_agrees_with_brute_force() {
    for format in FORMATS {
        for (w, h) in [(7, 5), (1, 1), (8, 3)] {
            let image = noise(format, w, h);
            for wrap_s in WRAPS {
                for wrap_t in WRAPS {
                    for nearest in [false, true] {
                        let s =
                            Sampling { wrap_s, wrap_t, mag_nearest: nearest, min_nearest: nearest, mip: MipMode::Base };
                        for uv in coordinates() {
                            // A nearest texel near a border may be either one.
                            let near = |v: f32, n: u32| ((v * n as f32).fract().abs() - 0.5).abs() > 0.499;
                            if nearest && (near(uv.x, w) || near(uv.y, h)) {
                                continue;
                            }
                            let value = sample_image(&image, s, uv, -1.0);
                            let reference = reference_level(&image, 0, s, uv.x as f64, uv.y as f64, nearest);
                            assert_texel(value, reference, &format!("{format:?} {w}x{h} {s:?} {uv}"));
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn levels_are_mixed_in_proportion() {
    let image = noise(TexelFormat::Rgba8Srgb, 8, 8);
    for uv in coordinates() {
        let at = |s: Sampling, level: f32| sample_image(&image, s, uv, level);
        let s = Sampling::default();
        let (fine, coarse) = (
            reference_level(&image, 0, s, uv.x as f64, uv.y as f64, false),
            reference_level(&image, 1, s, uv.x as f64, uv.y as f64, false),
        );
        let mixed = std::array::from_fn(|k| 0.75 * fine[k] + 0.25 * coarse[k]);
        assert_texel(at(s, 0.25), mixed, "trilinear");
        assert_texel(at(s, 9.0), coarse, "the last level");
        assert_texel(at(Sampling { mip: MipMode::Nearest, ..s }, 0.4), fine, "nearest level");
        assert_texel(at(Sampling { mip: MipMode::Nearest, ..s }, 0.6), coarse, "nearest level");
        assert_texel(at(Sampling { mip: MipMode::Base, ..s }, 5.0), fine, "no mips");
    }
}

#[test]
fn eight_bit_srgb_is_decoded_exactly() {
    for (i, &v) in SRGB8.iter().enumerate() {
        let x = i as f64 / 255.0;
        let reference = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        assert_eq!(v, reference as f32, "{i}");
    }
}

#[test]
fn wild_coordinates_do_no_harm() {
    let image = noise(TexelFormat::Rgba32Float, 5, 4);
    for wrap in WRAPS {
        for nearest in [false, true] {
            let s = Sampling {
                wrap_s: wrap,
                wrap_t: wrap,
                mag_nearest: nearest,
                min_nearest: nearest,
                mip: MipMode::Linear,
            };
            for u in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30, -1e-30, 1.0, 2.0, -1.0, 0.999_999_94] {
                for level in [f32::NAN, f32::INFINITY, -1.0, 0.5] {
                    assert!(sample_image(&image, s, Vec2::new(u, 0.3), level).is_finite());
                    assert!(sample_image(&image, s, Vec2::new(0.3, u), level).is_finite());
                }
            }
        }
    }
}
