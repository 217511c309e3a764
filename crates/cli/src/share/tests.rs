use super::*;
use orthant_resident::film::FilmBlock;
use std::path::Path;

const WIDTH: u32 = 6;
const HEIGHT: u32 = 4;
const SPP: u32 = 40;

fn header(tile: [u32; 4], samples: [u32; 2]) -> Header {
    Header {
        program: "test 1".into(),
        backend: "cpu".into(),
        width: WIDTH,
        height: HEIGHT,
        tile,
        samples,
        spp: SPP,
        seed: 7,
        settings: "abc".into(),
        tonemap: "agx".into(),
        exposure: 0.5,
    }
}

/// A sum that depends on the pixel and the block, and whose order of addition matters in floats.
fn sum_of(x: u32, y: u32, block: u32) -> [f32; 3] {
    let v = (x * 31 + y * 17 + block * 7) as f32;
    [v * 0.1, v * 1.0e6 + 0.3, 1.0 / (v + 1.0)]
}

fn write_share(path: &Path, header: &Header) {
    let file = std::fs::File::create(path).expect("create");
    let mut writer = ShareWriter::new(file, header.clone()).expect("header");
    let t = header.tile();
    for index in header.blocks() {
        let pixels = (t.y..t.y + t.height).flat_map(|y| (t.x..t.x + t.width).map(move |x| (x, y)));
        let sum = pixels.map(|(x, y)| sum_of(x, y, index)).collect();
        writer.block(&FilmBlock { index, samples: header.block_samples(index), sum }).expect("block");
    }
    writer.finish();
}

fn shares(folder: &Path, parts: &[([u32; 4], [u32; 2])]) -> Vec<PathBuf> {
    parts
        .iter()
        .enumerate()
        .map(|(i, &(tile, samples))| {
            let path = folder.join(format!("{i}.share"));
            write_share(&path, &header(tile, samples));
            path
        })
        .collect()
}

#[test]
fn shares_in_any_order_give_the_bits_of_the_whole() {
    let folder = tempfile::tempdir().expect("folder");
    let whole = folder.path().join("whole.share");
    write_share(&whole, &header([0, 0, WIDTH, HEIGHT], [0, SPP]));
    let expected = merge(&[whole], u64::MAX).expect("one share is a whole image");
    let mut parts = shares(
        folder.path(),
        &[
            ([0, 0, 2, 4], [0, 16]),
            ([0, 0, 2, 4], [16, 40]),
            ([2, 0, 4, 1], [0, 40]),
            ([2, 1, 4, 3], [32, 40]),
            ([2, 1, 4, 3], [0, 32]),
        ],
    );
    for _ in 0..parts.len() {
        parts.rotate_left(1);
        let merged = merge(&parts, u64::MAX).expect("a cover");
        let bits = |m: &Merged| m.pixels.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&merged), bits(&expected));
    }
    let by_hand = (0..3).fold(0.0f32, |sum, block| sum + sum_of(3, 2, block)[1]) / SPP as f32;
    assert_eq!(expected.pixels[(2 * WIDTH + 3) as usize][1], by_hand);
}

#[test]
fn a_gap_and_an_overlap_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    let parts = shares(folder.path(), &[([0, 0, 6, 2], [0, 40]), ([0, 2, 5, 2], [0, 40]), ([5, 2, 1, 2], [0, 32])]);
    let gap = merge(&parts, u64::MAX).expect_err("a gap").to_string();
    assert!(gap.contains("pixel 5,2 in the samples 32..40"), "{gap}");
    let parts = shares(folder.path(), &[([0, 0, 6, 3], [0, 40]), ([0, 2, 6, 2], [16, 40])]);
    let overlap = merge(&parts, u64::MAX).expect_err("an overlap").to_string();
    assert!(overlap.contains("the tile 0,2,6,1 in the samples 16..40"), "{overlap}");
}

#[test]
fn shares_of_different_renderings_do_not_mix() {
    let folder = tempfile::tempdir().expect("folder");
    let parts = shares(folder.path(), &[([0, 0, 6, 2], [0, 40]), ([0, 2, 6, 2], [0, 40])]);
    write_share(&parts[1], &Header { seed: 8, ..header([0, 2, 6, 2], [0, 40]) });
    let error = merge(&parts, u64::MAX).expect_err("another seed").to_string();
    assert!(error.contains("its seed is 8, but"), "{error}");
    write_share(&parts[1], &Header { backend: "vulkan".into(), ..header([0, 2, 6, 2], [0, 40]) });
    let error = merge(&parts, u64::MAX).expect_err("another backend").to_string();
    assert!(error.contains("its backend is vulkan, but"), "{error}");
    write_share(&parts[1], &Header { settings: "xyz".into(), ..header([0, 2, 6, 2], [0, 40]) });
    assert!(matches!(merge(&parts, u64::MAX), Err(ShareError::Foreign { .. })));
}

#[test]
fn every_truncation_and_every_flipped_byte_is_found() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.share");
    write_share(&path, &header([0, 0, WIDTH, HEIGHT], [0, SPP]));
    let bytes = std::fs::read(&path).expect("bytes");
    for cut in 0..bytes.len() {
        std::fs::write(&path, &bytes[..cut]).expect("write");
        match merge(std::slice::from_ref(&path), u64::MAX) {
            Err(ShareError::Damaged { offset, .. }) => assert!(offset <= cut as u64),
            other => panic!("cut at {cut}: {other:?}"),
        }
    }
    for at in 0..bytes.len() {
        let mut bad = bytes.clone();
        bad[at] ^= 0x10;
        std::fs::write(&path, &bad).expect("write");
        match merge(std::slice::from_ref(&path), u64::MAX) {
            // The offset is that of the checked section which has the byte.
            Err(ShareError::Damaged { offset, .. }) => assert!(offset <= at as u64, "{offset} {at}"),
            other => panic!("flipped at {at}: {other:?}"),
        }
    }
    let mut long = bytes;
    long.push(0);
    std::fs::write(&path, &long).expect("write");
    let error = merge(&[path], u64::MAX).expect_err("too long").to_string();
    assert!(error.contains(&format!("byte {}: 1 bytes follow", long.len() - 1)), "{error}");
}

#[test]
fn a_header_that_makes_no_sense_is_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("a.share");
    for bad in [
        header([0, 0, 7, 4], [0, 40]),
        header([0, 0, 6, 4], [8, 40]),
        header([0, 0, 6, 4], [0, 24]),
        header([0, 0, 6, 4], [0, 48]),
        header([u32::MAX, 0, 6, 4], [0, 40]),
        Header { width: 1 << 20, height: 1 << 20, ..header([0, 0, 6, 4], [0, 40]) },
    ] {
        let file = std::fs::File::create(&path).expect("create");
        ShareWriter::new(file, bad).expect("header");
        assert!(matches!(Share::open(&path), Err(ShareError::Damaged { offset: 16, .. })));
    }
}
