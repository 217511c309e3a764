//! Texture files against independent decoders, and against damage.
//!
//! Golden figures are 64-bit FNV-1a hashes over the RGBA texels of all the levels that a file has, largest first:
//! * ETC1S and UASTC: the reference transcoder (`basis_transcoder.wasm` of the JavaScript package `three`), target
//!   `RGBA32`;
//! * BC7, and the means of BC1 and ASTC: the Python package `texture2ddecoder` (another code base than the crates used here);
//! * uncompressed: Python, `struct` and `zstandard`;
//! * WebP: the Python package `Pillow` (libwebp), with means, since lossy upsampling of chroma differs by decoder.

use super::basis::uastc;
use super::decode::{self, Decoded, Levels};
use super::need::{self, Need};
use orthant_resident::image::{ImageData, TexelFormat};
use proptest::prelude::*;
use std::path::PathBuf;

const LIMIT: u64 = 1 << 28;

fn assets() -> Option<PathBuf> {
    let assets = std::env::var_os("ORTHANT_ASSETS").map(PathBuf::from);
    if assets.is_none() {
        println!("skipped: ORTHANT_ASSETS is not set");
    }
    assets
}

fn read(name: &str, assets: &std::path::Path) -> Vec<u8> {
    let path = assets.join(name);
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The images that are views of a GLB, in order.
fn images_of_glb(glb: &[u8]) -> Vec<&[u8]> {
    let n = u32::from_le_bytes(glb[12..16].try_into().expect("four bytes")) as usize;
    let document: serde_json::Value = serde_json::from_slice(&glb[20..20 + n]).expect("the document is JSON");
    let image = |image: &serde_json::Value| {
        let view = &document["bufferViews"][image["bufferView"].as_u64().expect("a view") as usize];
        let start = 28 + n + view["byteOffset"].as_u64().unwrap_or(0) as usize;
        &glb[start..start + view["byteLength"].as_u64().expect("a length") as usize]
    };
    document["images"].as_array().expect("there are images").iter().map(image).collect()
}

enum Failure {
    Warning(String),
    OverBudget { needed: u64 },
}

/// One image alone, as it is decoded among others.
fn decode_bytes(data: &[u8], srgb: bool, max_bytes: u64) -> Result<Decoded, Failure> {
    let broken = |decode::Broken(reason)| Failure::Warning(reason);
    let need = [Ok::<_, ()>(Need::of(data, srgb, Levels::All).map_err(broken)?)];
    need::check(&need, max_bytes, 1).map_err(|over| Failure::OverBudget { needed: over.needed })?;
    decode::decode(data, srgb, Levels::All).map_err(broken)
}

fn decode(data: &[u8], srgb: bool) -> ImageData {
    match decode_bytes(data, srgb, LIMIT) {
        Ok((image, note)) => {
            assert_eq!(note, None);
            image
        }
        Err(Failure::Warning(reason)) => panic!("{reason}"),
        Err(Failure::OverBudget { needed }) => panic!("{needed} bytes"),
    }
}

fn reason(data: &[u8]) -> String {
    match decode_bytes(data, true, LIMIT) {
        Ok(_) => panic!("the file is decoded"),
        Err(Failure::Warning(reason)) => reason,
        Err(Failure::OverBudget { needed }) => format!("over budget: {needed}"),
    }
}

fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, &b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

fn mean(image: &ImageData) -> [f64; 4] {
    let end = image.levels.get(1).map_or(image.texels.len(), |l| l.offset);
    let texels = image.texels[..end].as_chunks::<4>().0;
    std::array::from_fn(|c| texels.iter().map(|t| f64::from(t[c])).sum::<f64>() / texels.len() as f64)
}

#[test]
fn ktx2_files_of_every_kind_decode_to_the_texels_of_other_decoders() {
    let Some(assets) = assets() else { return };
    for (name, format, golden) in [
        ("2d_rgb8", TexelFormat::Rgba8Srgb, 0x837c_644c_aaf7_545a_u64),
        ("2d_rgba8", TexelFormat::Rgba8Srgb, 0x3d26_1ca1_a7fe_f1f2),
        ("2d_rgba16_linear", TexelFormat::Rgba32Float, 0x3ea2_2a1b_fc0b_36b2),
        ("2d_rgba32_linear", TexelFormat::Rgba32Float, 0xa86b_a3fb_056c_d734),
        ("2d_bc7", TexelFormat::Rgba8Srgb, 0x0627_df9a_83c3_f36d),
        ("2d_etc1s", TexelFormat::Rgba8Srgb, 0xcd37_b43f_9a56_68b8),
        ("2d_uastc", TexelFormat::Rgba8Srgb, 0x71ed_5370_3883_ff55),
    ] {
        let data = read(&format!("hdr/ktx2-raw/{name}.ktx2"), &assets);
        let image = decode(&data, true);
        assert_eq!(image.format, format, "{name}");
        let sizes: Vec<_> = image.levels.iter().map(|l| (l.width, l.height)).collect();
        assert_eq!(sizes, [(40, 40), (20, 20), (10, 10), (5, 5), (2, 2), (1, 1)], "{name}");
        assert_eq!(fnv1a(&image.texels), golden, "{name}");
        // The use, not the file, says whether colours are encoded.
        let linear = decode(&data, false);
        assert_eq!(linear.texels, image.texels, "{name}");
        assert!(!matches!(linear.format, TexelFormat::Rgba8Srgb | TexelFormat::Rgba16Srgb), "{name}");
    }
}

/// Decoders may round colours between the ends of a BC1 or an ASTC block one way or the other: by one unit.
#[test]
fn bc1_and_astc_files_have_the_mean_of_another_decoder() {
    let Some(assets) = assets() else { return };
    for (name, theirs) in
        [("bc1", [255.0, 130.7425, 7.968_75, 255.0]), ("astc4x4", [68.138_75, 134.465, 188.658_75, 255.0])]
    {
        let ours = mean(&decode(&read(&format!("hdr/ktx2-raw/2d_{name}.ktx2"), &assets), true));
        assert!(ours.iter().zip(theirs).all(|(a, b)| (a - b).abs() < 0.6), "{name}: {ours:?}");
    }
}

#[test]
fn basislz_textures_of_models_decode_to_the_texels_of_the_reference() {
    let Some(assets) = assets() else { return };
    for (name, levels, golden) in [
        ("gltf-ext/ktx2-agi-hq-tile/0.glb", 11, 0xccbf_1a36_95f9_d43d_u64),
        ("gltf-ext/ktx2-meshopt-box-textured/box-textured-ktx2.glb", 9, 0xf1d5_a1a7_37e4_dc73),
    ] {
        let glb = read(name, &assets);
        let image = decode(images_of_glb(&glb)[0], true);
        assert_eq!((image.levels.len(), fnv1a(&image.texels)), (levels, golden), "{name}");
    }
}

#[test]
fn zstandard_levels_are_inflated_and_missing_levels_made() {
    let Some(assets) = assets() else { return };
    for (name, size, golden) in
        [("anisotropy", 512, 0xc30d_860e_6b31_1e2b_u64), ("occlusionroughnessmetal", 512, 0x17f9_bce3_8b9d_93ab)]
    {
        let data = read(&format!("gltf-khronos/AnisotropyBarnLamp/AnisotropyBarnLamp_{name}.ktx2"), &assets);
        let image = decode(&data, false);
        assert_eq!(image.levels.len(), 10);
        assert_eq!(fnv1a(&image.texels[..size * size * 4]), golden, "{name}");
    }
}

/// A block of each mode in turn, its other bits from a generator; patterns are those that exist.
fn uastc_blocks() -> Vec<[u8; 16]> {
    const CODES: [(u128, u32); 19] = [
        (0x01, 4),
        (0x35, 6),
        (0x1d, 5),
        (0x03, 5),
        (0x13, 5),
        (0x0b, 5),
        (0x1b, 5),
        (0x07, 5),
        (0x17, 5),
        (0x0f, 5),
        (0x02, 3),
        (0x00, 2),
        (0x06, 3),
        (0x1f, 5),
        (0x0d, 5),
        (0x05, 7),
        (0x15, 6),
        (0x25, 6),
        (0x09, 4),
    ];
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        u128::from(state)
    };
    let put = |block: u128, at: u32, n: u32, value: u128| block & !(((1 << n) - 1) << at) | value << at;
    let block = |i: usize| {
        let mode = i % 19;
        let (low, high) = (next(), next());
        let block = put(low | high << 64, 0, CODES[mode].1, CODES[mode].0);
        let (at, n, patterns) = match mode {
            2 | 4 => (20, 5, 30),
            3 => (20, 4, 11),
            7 => (20, 5, 19),
            9 => (28, 5, 30),
            16 => (29, 5, 30),
            _ => return block.to_le_bytes(),
        };
        put(block, at, n, (block >> at & 31) % patterns).to_le_bytes()
    };
    (0..100).map(block).collect()
}

/// The figure is from the reference transcoder, for these blocks as an image of 40 x 40 texels.
#[test]
fn every_mode_of_uastc_decodes_as_the_reference_does() {
    let mut image = vec![[0; 4]; 1600];
    for (i, block) in uastc_blocks().iter().enumerate() {
        for (t, texel) in uastc::decode_block(block).into_iter().enumerate() {
            image[(i / 10 * 4 + t / 4) * 40 + i % 10 * 4 + t % 4] = texel;
        }
    }
    assert_eq!(fnv1a(image.as_flattened()), UASTC_MODES);
}

const UASTC_MODES: u64 = 0xc0ab_538f_f37a_b4e9;

#[test]
fn reserved_uastc_blocks_are_magenta() {
    let mut block = [0; 16];
    block[0] = 0x45;
    assert_eq!(uastc::decode_block(&block), [[255, 0, 255, 255]; 16]);
    // Mode 3 with the pattern 15 of 11.
    let block = (0x03u128 | 15 << 20).to_le_bytes();
    assert_eq!(uastc::decode_block(&block), [[255, 0, 255, 255]; 16]);
}

/// Mean of the images' mean RGBA.
const WEBP_MEANS: [(&str, [f64; 4]); 3] = [
    ("gltf-ext/webp-box-separate/cesium logo.webp", [154.713_806, 186.264_709, 176.429_443, 255.0]),
    (
        "gltf-scenes/issum-town/issum_the_town_on_capital_isle-transformed.glb",
        [109.029_681, 91.112_429, 85.834_347, 254.913_647],
    ),
    ("gltf-scenes/room/room-transformed.glb", [34.811_560, 29.086_790, 22.321_080, 255.0]),
];

#[test]
fn webp_images_decode_to_the_texels_of_libwebp() {
    let Some(assets) = assets() else { return };
    for (name, golden) in WEBP_MEANS {
        let data = read(name, &assets);
        let images = if name.ends_with("glb") { images_of_glb(&data) } else { vec![&data[..]] };
        let images: Vec<_> = images.into_iter().filter(|d| d.starts_with(b"RIFF")).map(|d| decode(d, true)).collect();
        let count = images.len() as f64;
        let means = images.iter().map(mean).fold([0.0; 4], |sum, m| std::array::from_fn(|c| sum[c] + m[c] / count));
        for (ours, theirs) in means.iter().zip(golden) {
            assert!((ours - theirs).abs() < 0.05, "{name}: {means:?} where libwebp has {golden:?}");
        }
    }
}

/// A KTX2 file of one layer and face.
fn ktx2(vk_format: u32, (width, height): (u32, u32), scheme: u32, metadata: &[u8], levels: &[&[u8]]) -> Vec<u8> {
    let head = 80 + 24 * levels.len();
    let mut file = super::ktx2::MAGIC.to_vec();
    let metadata_length = metadata.len() as u32;
    for word in [vk_format, 1, width, height, 0, 0, 1, levels.len() as u32, scheme] {
        file.extend(word.to_le_bytes());
    }
    for word in [head as u32, 0, head as u32, metadata_length, 0, 0, 0, 0] {
        file.extend(word.to_le_bytes());
    }
    let mut at = head + metadata.len();
    for level in levels {
        for word in [at, level.len(), level.len()] {
            file.extend((word as u64).to_le_bytes());
        }
        at += level.len();
    }
    file.extend(metadata);
    levels.iter().for_each(|level| file.extend(*level));
    file
}

fn metadata(key: &str, value: &str) -> Vec<u8> {
    let mut entry = format!("{key}\0{value}\0").into_bytes();
    let length = entry.len() as u32;
    entry.resize(entry.len().next_multiple_of(4), 0);
    [&length.to_le_bytes()[..], &entry].concat()
}

#[test]
fn channels_that_are_not_stored_are_zero_and_alpha_is_one() {
    for (vk_format, stored, expected) in [
        (9, &[7][..], [7, 0, 0, 255]),
        (16, &[7, 8], [7, 8, 0, 255]),
        (23, &[7, 8, 9], [7, 8, 9, 255]),
        (30, &[7, 8, 9], [9, 8, 7, 255]),
        (44, &[7, 8, 9, 10], [9, 8, 7, 10]),
    ] {
        assert_eq!(decode(&ktx2(vk_format, (1, 1), 0, &[], &[stored]), true).texels, expected, "{vk_format}");
    }
    let wide = decode(&ktx2(77, (1, 1), 0, &[], &[&[1, 2, 3, 4]]), true);
    assert_eq!(wide.format, TexelFormat::Rgba16Srgb);
    assert_eq!(bytemuck::pod_collect_to_vec::<u8, u16>(&wide.texels), [0x0201, 0x0403, 0, 0xffff]);
    let half = decode(&ktx2(76, (1, 1), 0, &[], &[&[0x00, 0x3c]]), true);
    assert_eq!(bytemuck::pod_collect_to_vec::<u8, f32>(&half.texels), [1.0, 0.0, 0.0, 1.0]);
}

#[test]
fn a_swizzle_is_applied_and_another_orientation_is_said() {
    let swizzled = ktx2(9, (1, 1), 0, &metadata("KTXswizzle", "rrr1"), &[&[7]]);
    assert_eq!(decode(&swizzled, true).texels, [7, 7, 7, 255]);
    let turned = ktx2(9, (1, 1), 0, &metadata("KTXorientation", "ru"), &[&[7]]);
    let Ok((image, Some(note))) = decode_bytes(&turned, true, LIMIT) else { panic!("a note is due") };
    assert_eq!(image.texels, [7, 0, 0, 255]);
    assert!(note.contains("KTXorientation is \"ru\""), "{note}");
    decode(&ktx2(9, (1, 1), 0, &metadata("KTXorientation", "rd"), &[&[7]]), true);
}

#[test]
fn the_files_own_levels_are_used_where_all_are_there() {
    let (large, small) = ([1, 2, 3, 4], [200]);
    let whole = decode(&ktx2(9, (2, 2), 0, &[], &[&large, &small]), false);
    assert_eq!(whole.levels.len(), 2);
    assert_eq!(whole.texels[16..], [200, 0, 0, 255]);
    let ours = decode(&ktx2(9, (2, 2), 0, &[], &[&large]), false);
    assert_eq!(ours.levels.len(), 2);
    assert_eq!(ours.texels[16], 3);
}

#[test]
fn zlib_levels_are_inflated_and_not_beyond_their_size() {
    let level = miniz_oxide::deflate::compress_to_vec_zlib(&[5; 16], 6);
    assert_eq!(decode(&ktx2(9, (4, 4), 3, &[], &[&level]), false).texels[..4], [5, 0, 0, 255]);
    let bomb = miniz_oxide::deflate::compress_to_vec_zlib(&vec![5; 1 << 24], 9);
    assert!(reason(&ktx2(9, (4, 4), 3, &[], &[&bomb])).contains("cannot be inflated"));
}

#[test]
fn a_zstandard_frame_gives_no_more_than_the_level_needs() {
    // A frame of one repeated byte: no checksum, a window of 1 KiB, one block of run length, of 100000 bytes.
    let frame = |length: u32| {
        let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x58];
        frame.extend(&(length << 3 | 1 << 1 | 1).to_le_bytes()[..3]);
        frame.push(9);
        frame
    };
    assert_eq!(decode(&ktx2(9, (4, 4), 2, &[], &[&frame(16)]), false).texels[..4], [9, 0, 0, 255]);
    let message = reason(&ktx2(9, (4, 4), 2, &[], &[&frame(100_000)]));
    assert!(message.contains("level 0 has 17 bytes where 16 are needed"), "{message}");
    assert!(reason(&ktx2(9, (4, 4), 2, &[], &[&frame(15)])).contains("15 bytes where 16"));
    // A window of 1 TiB is not taken.
    let mut wide = frame(16);
    wide[5] = 30 << 3;
    assert!(reason(&ktx2(9, (4, 4), 2, &[], &[&wide])).contains("Zstandard"));
}

#[test]
fn sizes_that_the_data_does_not_hold_take_no_memory() {
    for vk_format in [37, 109, 145, 157, 183] {
        let message = reason(&ktx2(vk_format, (65_535, 65_535), 0, &[], &[&[0; 8]]));
        assert!(message.starts_with("over budget"), "{message}");
        let message = reason(&ktx2(vk_format, (256, 256), 0, &[], &[&[0; 8]]));
        assert!(message.contains("level 0 has 8 bytes"), "{message}");
    }
    assert!(reason(&ktx2(37, (u32::MAX, u32::MAX), 0, &[], &[&[0; 8]])).starts_with("over budget"));
    let file = ktx2(37, (4, 4), 0, &[], &[&[0; 8]]);
    assert!(reason(&file[..60]).contains("cut off"));
    assert!(reason(&file[..100]).contains("level 0 at byte 104 with 8 bytes ends behind"));
}

#[test]
fn what_is_not_one_picture_is_refused_with_the_reason() {
    let file = ktx2(9, (1, 1), 0, &[], &[&[7]]);
    let changed = |at: usize, value: u32| {
        let mut file = file.clone();
        file[at..at + 4].copy_from_slice(&value.to_le_bytes());
        reason(&file)
    };
    assert!(changed(28, 2).contains("a volume"));
    assert!(changed(32, 3).contains("an array"));
    assert!(changed(36, 6).contains("a cube map"));
    assert!(changed(20, 0).contains("no texels"));
    assert!(changed(24, 0).contains("no texels"));
    assert!(changed(40, 1 << 31).contains("levels"));
    assert!(changed(44, 9).contains("supercompression 9"));
    assert!(changed(12, 140).contains("Vulkan format 140"));
    assert!(changed(12, 0).contains("colour model 0"));
}

/// A DDS file: pixel format flags, FourCC, bits, masks, then perhaps the DX10 header.
fn dds((width, height): (u32, u32), mips: u32, pixels: [u32; 7], dx10: Option<u32>, data: &[u8]) -> Vec<u8> {
    let mut words = vec![0u32; 31];
    (words[0], words[2], words[3], words[6]) = (124, height, width, mips);
    words[18] = 32;
    words[19..26].copy_from_slice(&pixels);
    if let Some(format) = dx10 {
        words[20] = u32::from_le_bytes(*b"DX10");
        words.extend([format, 3, 0, 1, 0]);
    }
    let mut file = b"DDS ".to_vec();
    words.iter().for_each(|w| file.extend(w.to_le_bytes()));
    file.extend(data);
    file
}

const FOURCC: u32 = 4;
const RGB: u32 = 0x40;
const RGBA: u32 = 0x41;

#[test]
fn dds_masks_say_where_channels_are() {
    let texels = |pixels, data: &[u8]| decode(&dds((1, 1), 1, pixels, None, data), true).texels;
    let bgra = [RGBA, 0, 32, 0xff_0000, 0xff00, 0xff, 0xff00_0000];
    assert_eq!(texels(bgra, &[1, 2, 3, 4]), [3, 2, 1, 4]);
    assert_eq!(texels([RGB, 0, 32, 0xff_0000, 0xff00, 0xff, 0], &[1, 2, 3, 4]), [3, 2, 1, 255]);
    assert_eq!(texels([RGB, 0, 24, 0xff, 0xff00, 0xff_0000, 0], &[1, 2, 3]), [1, 2, 3, 255]);
    assert_eq!(texels([RGB, 0, 16, 0xf800, 0x07e0, 0x001f, 0], &[0xff, 0x07]), [0, 255, 255, 255]);
    assert_eq!(texels([0x2_0000, 0, 8, 0xff, 0, 0, 0], &[9]), [9, 9, 9, 255]);
    assert_eq!(decode(&dds((1, 1), 1, [FOURCC, 0, 0, 0, 0, 0, 0], Some(29), &[1, 2, 3, 4]), true).texels, [1, 2, 3, 4]);
}

#[test]
fn dds_and_ktx2_hold_the_same_blocks() {
    let block: Vec<u8> = (0..16).map(|i| (i * 37 + 11) as u8).collect();
    for (vk_format, fourcc, dxgi) in [
        (133, Some(b"DXT1"), 71),
        (135, Some(b"DXT3"), 74),
        (137, Some(b"DXT5"), 77),
        (139, Some(b"ATI1"), 80),
        (141, Some(b"ATI2"), 83),
        (143, None, 95),
        (144, None, 96),
        (145, None, 98),
    ] {
        let block = if matches!(vk_format, 133 | 139) { &block[..8] } else { &block[..] };
        let image = decode(&ktx2(vk_format, (4, 4), 0, &[], &[block]), false);
        let ours = decode(&dds((4, 4), 1, [FOURCC, 0, 0, 0, 0, 0, 0], Some(dxgi), block), false);
        assert_eq!(ours, image, "{dxgi}");
        if let Some(code) = fourcc {
            let pixels = [FOURCC, u32::from_le_bytes(*code), 0, 0, 0, 0, 0];
            assert_eq!(decode(&dds((4, 4), 1, pixels, None, block), false), image, "{}", code.escape_ascii());
        }
    }
}

#[test]
fn dds_files_that_are_no_picture_are_refused_with_the_reason() {
    let pixels = [RGBA, 0, 32, 0xff_0000, 0xff00, 0xff, 0xff00_0000];
    let file = dds((1, 1), 1, pixels, None, &[1, 2, 3, 4]);
    let changed = |at: usize, value: u32| {
        let mut file = file.clone();
        file[at..at + 4].copy_from_slice(&value.to_le_bytes());
        reason(&file)
    };
    assert!(changed(112, 0x200).contains("cube map"));
    assert!(changed(112, 0x20_0000).contains("volume"));
    assert!(changed(16, 0).contains("no texels"));
    assert!(changed(88, 64).contains("64 bits"));
    assert!(changed(16, 1 << 30).contains("ends behind the file"));
    assert!(reason(&file[..90]).contains("cut off"));
    assert!(reason(&dds((1, 1), 1, [FOURCC, 0, 0, 0, 0, 0, 0], Some(1000), &[])).contains("DXGI format 1000"));
}

#[test]
fn cut_and_changed_files_decode_or_are_refused() {
    let Some(assets) = assets() else { return };
    let names = ["etc1s", "uastc", "bc1", "bc7", "astc4x4", "rgb8", "rgba16_linear"];
    let mut files: Vec<_> = names.iter().map(|n| read(&format!("hdr/ktx2-raw/2d_{n}.ktx2"), &assets)).collect();
    files.push(images_of_glb(&read("gltf-ext/ktx2-meshopt-box-textured/box-textured-ktx2.glb", &assets))[0].to_vec());
    files.push(read("gltf-ext/webp-box-separate/cesium logo.webp", &assets));
    for file in files {
        for i in 0..100 {
            let n = file.len() * i / 100;
            let _ = decode_bytes(&file[..n], true, 1 << 24);
        }
        let mut state = 1u32;
        for _ in 0..300 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let mut damaged = file.clone();
            // The heads of files are short, and where most can go wrong.
            let reach = if state & 1 == 0 { damaged.len() } else { damaged.len().min(512) };
            let at = (state >> 8) as usize % reach;
            damaged[at] ^= 1 << ((state >> 4) & 7);
            let _ = decode_bytes(&damaged, false, 1 << 24);
        }
    }
}

proptest! {
    #[test]
    fn any_blocks_of_any_format_decode(
        vk_format in prop::sample::select((131..=184).filter(|f| ![140, 142, 154, 156].contains(f)).collect::<Vec<u32>>()),
        blocks in prop::collection::vec(any::<u128>(), 9..10),
        size in (1u32..9, 1u32..9),
    ) {
        let bytes: Vec<u8> = blocks.iter().flat_map(|b| b.to_le_bytes()).collect();
        let file = ktx2(vk_format, size, 0, &[], &[&bytes]);
        let needed = super::ktx2::open(&file).map(|f| match f.content {
            super::file::Content::Texels { encoding, .. } => encoding.level_bytes(size.0, size.1),
            super::file::Content::BasisLz(_) => None,
        });
        let needed = needed.unwrap().unwrap() as usize;
        let image = decode(&ktx2(vk_format, size, 0, &[], &[&bytes[..needed]]), true);
        prop_assert_eq!(image.levels[0].width, size.0);
    }

    #[test]
    fn any_uastc_block_decodes(block in any::<u128>()) {
        uastc::decode_block(&block.to_le_bytes());
    }
}
