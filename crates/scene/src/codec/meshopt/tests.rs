//! The streams here were written by the reference encoder (meshoptimizer 1.x, its JavaScript package) from data of a
//! formula: `encodeVertexBufferLevel(data, count, stride, level, version)`, `encodeIndexBuffer`, `encodeIndexSequence`;
//! and `encodeFilter...` with what `decodeGltfBuffer` makes of it.

use super::*;
use proptest::prelude::*;

const V0: &str = "a02a066666666666666666666666666666666666666600000000150000800080008000800000001f000e2a46627e9ab6d2eef5d9bda185694d311506223e5a7692aecae6fde1c5a9ffdf00008d7155391d1a36001500f03c0f6f706f706f7003c0f03c6f706f706f700f0300006f706f1e02165a9edfffffff121116151a191e1d222126252a292e2d323136353a393effff00003d424146454a494e1f004a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4affff00004a4a4a4a4a4a4a4a150848484848484848484800000000000000000000000000000000000000000000000000000000000900000000";
const V1_LEVEL_3: &str = "a1b57d2a0666666666666666666666666666666666666666000000000000010201010202010002000e2a46627e9ab6d2eef5d9bda185694d311506223e5a7692aecae6fde1c5a98d7155391d011a360030c66f706f706f7018636f706f706f708c006f706f00020106050a090e0d121116151a191e1d222126252a292e2d323136353a393e3d424146454a494e004a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a15084848484848484848480000000000000000000000000000000000000009000000000000";
const V1_LEVEL_0: &str = "a195552a06666666666666666666666666666666666666660000000000000102010102020100020f000e2a46627e9ab6d2eef5d9bda185694d311506223e5a7692aecae6fde1c5a9ff008d7155391d011a360030c66f706f706f7018636f706f706f708c006f706f0e02165a9edfffffff121116151a191e1d222126252a292e2d323136353a393eff003d424146454a494e0f004a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4a4aff004a4a4a4a4a4a4a4a15084848484848484848480000000000000000000000000000000000000009000000000000";
const V1_WORDS: &str = "a1570058585858585858585858585858585858585858585858585858585858585858052aaaaaaaaaaaaaaa0a099999999999999999999999999999990a0444444444444444444444444444444400000000000000000000000000000000000000e80360ea01";
const V1_FLOATS: &str = "a178020190000000c0c000004040501068e8a8786494b484fa5acab252eab53151fd55c93945cd0513fb71c1fd03ff07030f30430040030700000000000000000000000000000000000000000040c022";
const GRID: &str = "e1fe1e001e001e001e001e001efe1e0b1e0a1e091e081e071eff1e071e071e071e071e071eff1e071e071e071e071e071eff1e071e071e071e071e071eff1e071e071e071e071e071ef00efb02f60b0ef60b0ef60b0ef60b0e007687566778a9866589689801690000";
const SEQUENCE: &str = "d100f591f4011017101710171017101710171017101710171017101700000000";

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len() / 2)
        .map(|i| u8::from_str_radix(&hex[2 * i..2 * i + 2], 16).expect("two hexadecimal digits"))
        .collect()
}

fn view(mode: Mode, count: usize, stride: usize) -> View {
    View { mode, filter: Filter::None, count, stride }
}

fn decode_hex(view: View, hex: &str) -> Vec<u8> {
    decode(view, &bytes(hex), 1 << 20).expect("the stream is whole")
}

/// 40 elements of 8 bytes that take every kind of difference: none, small, large, rare and all over.
fn mixed() -> Vec<u8> {
    (0..40u32)
        .flat_map(|i| {
            [i * 3, i >> 3, i * i * 7, 9, if i % 5 == 4 { 200 } else { 0 }, i * (i & 1), i * 37, (i >> 1) & 1]
                .map(|v| v as u8)
        })
        .collect()
}

fn grid() -> Vec<u32> {
    (0..36).map(|i| i / 6 * 7 + i % 6).flat_map(|v| [v, v + 7, v + 1, v + 1, v + 7, v + 8]).collect()
}

#[test]
fn attributes_of_version_0_are_byte_differences() {
    assert_eq!(decode_hex(view(Mode::Attributes, 40, 8), V0), mixed());
}

#[test]
fn attributes_of_version_1_choose_their_widths_by_byte_position() {
    assert_eq!(decode_hex(view(Mode::Attributes, 40, 8), V1_LEVEL_0), mixed());
    assert_eq!(decode_hex(view(Mode::Attributes, 40, 8), V1_LEVEL_3), mixed());
}

#[test]
fn attributes_of_version_1_have_word_differences_and_rotated_exclusive_or() {
    let words: Vec<u8> = (0..32u32)
        .flat_map(|i| [(1000 + i * 300) as u16, (60_000 - i * 517) as u16])
        .flat_map(u16::to_le_bytes)
        .collect();
    assert_eq!(bytes(V1_WORDS).last(), Some(&1), "the encoder chose word differences");
    assert_eq!(decode_hex(view(Mode::Attributes, 32, 4), V1_WORDS), words);
    let floats: Vec<u8> = (0..32).flat_map(|i| (0.25 * (i * i) as f32 - 3.0).to_le_bytes()).collect();
    assert_eq!(bytes(V1_FLOATS).last().map(|m| m & 15), Some(2), "the encoder chose exclusive or");
    assert_eq!(decode_hex(view(Mode::Attributes, 32, 4), V1_FLOATS), floats);
}

#[test]
fn triangles_come_in_order_with_their_corners_turned_at_most() {
    let decoded = decode_hex(view(Mode::Triangles, 216, 4), GRID);
    let decoded: Vec<u32> = decoded.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
    for (ours, source) in decoded.as_chunks::<3>().0.iter().zip(grid().as_chunks::<3>().0) {
        let [a, b, c] = *source;
        assert!([[a, b, c], [b, c, a], [c, a, b]].contains(ours), "{ours:?} of {source:?}");
    }
    let narrow = decode_hex(view(Mode::Triangles, 216, 2), GRID);
    let narrow: Vec<u32> = narrow.as_chunks::<2>().0.iter().map(|b| u32::from(u16::from_le_bytes(*b))).collect();
    assert_eq!(narrow, decoded);
}

#[test]
fn indices_follow_two_baselines() {
    let source: Vec<u32> = (0..24).map(|i| if i % 2 == 1 { 1_000_000 - i * 3 } else { i * 2 }).collect();
    let wide: Vec<u8> = source.iter().flat_map(|i| i.to_le_bytes()).collect();
    assert_eq!(decode_hex(view(Mode::Indices, 24, 4), SEQUENCE), wide);
    let narrow: Vec<u8> = source.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect();
    assert_eq!(decode_hex(view(Mode::Indices, 24, 2), SEQUENCE), narrow);
}

/// `(filter, stride, before, after)`.
const FILTERED: [(Filter, usize, &str, &str); 6] = [
    (
        Filter::Octahedral,
        4,
        "7f007f7f7f7f7f8136b77f7fad5c7f002a2a7f7f81407f81",
        "7f00007f000081814c9a007fc44cae0049494a7fa700a581",
    ),
    (
        Filter::Octahedral,
        8,
        "ff070000ff07ff7fff07ff07ff0701806d036efbff07ff7fcbfac405ff070000aa02aa02ff07ff7f01f80004ff070180",
        "ff7f00000000ff7f0000000001800180c54c95990000ff7f97c2ca4c0dae0000dd49dd49f949ff7f8aa5000073a50180",
    ),
    (
        Filter::Quaternion,
        8,
        "000000000000ff1f60e9a01660e9fc1f86046df2930dfc1f0000dae40000ff1f",
        "000000000000ff7fff3f00c0004000c03373cc0c9ad96626000035b300006666",
    ),
    (
        Filter::Exponential,
        4,
        "000000f2002000f300e0fff3003400f4392f00b06ecfff31333300ef483c0003",
        "000000000000803f000080bf0000504000e43c1e0048c2de00cccc3d0020f147",
    ),
    (Filter::Color, 4, "407fc1ff7f007fc080c10080ff0000ff", "fe0100ff00fe00804180bf00ffffffff"),
    (
        Filter::Color,
        8,
        "0004ff0701fcff0fff070000ff07000c000801fc00000008ff0f00000000ff0f",
        "efff10000000ffff0000efff0000088014400880fbbf0000ffffffffffffffff",
    ),
];

#[test]
fn filters_agree_with_the_reference_decoder_to_one_unit() {
    for (filter, stride, before, after) in FILTERED {
        let mut data = bytes(before);
        filters::apply(filter, stride, &mut data);
        let after = bytes(after);
        if filter == Filter::Exponential {
            assert_eq!(data, after, "{filter} is exact");
        } else if stride == 4 {
            assert!(
                data.iter().zip(&after).all(|(a, b)| (*a as i8).wrapping_sub(*b as i8).abs() <= 1),
                "{filter} {data:?}"
            );
        } else {
            let words = |b: &[u8]| b.as_chunks::<2>().0.iter().map(|w| i16::from_le_bytes(*w)).collect::<Vec<_>>();
            let (ours, theirs) = (words(&data), words(&after));
            assert!(
                ours.iter().zip(&theirs).all(|(a, b)| a.wrapping_sub(*b).abs() <= 1),
                "{filter} {ours:?} {theirs:?}"
            );
        }
    }
}

#[test]
fn exponents_outside_of_the_normal_floats_are_right_too() {
    for (bits, value) in
        [(0x7f00_0001u32, 2f64.powi(127)), (0x8000_0003, 3.0 * 2f64.powi(-128)), (0x81ff_ffff, -(2f64.powi(-127)))]
    {
        let mut data = bits.to_le_bytes();
        filters::apply(Filter::Exponential, 4, &mut data);
        assert_eq!(f32::from_le_bytes(data), value as f32);
    }
}

#[test]
fn every_rule_of_the_extension_object_is_checked() {
    let check = |mode, filter, count, stride| View { mode, filter, count, stride }.check().is_ok();
    for stride in [0, 2, 6, 260] {
        assert!(!check(Mode::Attributes, Filter::None, 1, stride), "{stride}");
    }
    assert!(!check(Mode::Triangles, Filter::None, 4, 2));
    assert!(!check(Mode::Triangles, Filter::None, 3, 1));
    assert!(!check(Mode::Indices, Filter::None, 3, 8));
    assert!(!check(Mode::Indices, Filter::Octahedral, 3, 4));
    assert!(!check(Mode::Attributes, Filter::Octahedral, 1, 12));
    assert!(!check(Mode::Attributes, Filter::Quaternion, 1, 4));
    assert!(!check(Mode::Attributes, Filter::Color, 1, 16));
    assert!(check(Mode::Attributes, Filter::Exponential, 1, 12));
}

#[test]
fn a_count_that_the_data_cannot_hold_takes_no_memory() {
    let streams = [
        (Mode::Attributes, V0, 8),
        (Mode::Attributes, V1_LEVEL_3, 8),
        (Mode::Triangles, GRID, 4),
        (Mode::Indices, SEQUENCE, 4),
    ];
    for (mode, hex, stride) in streams {
        // 3 x 2^37 bytes would be asked for.
        let declared = view(mode, 3 << 35, stride);
        let error = decode(declared, &bytes(hex), u64::MAX).expect_err("far too many elements");
        assert!(matches!(error, MeshoptError::TooShort { .. }), "{mode}: {error}");
        let error = decode(declared, &bytes(hex), 1 << 30).expect_err("far too many bytes");
        assert!(matches!(error, MeshoptError::OverBudget { .. }), "{mode}: {error}");
        assert!(matches!(
            decode(view(mode, usize::MAX / 3 * 3, stride), &[], u64::MAX),
            Err(MeshoptError::OverBudget { .. })
        ));
    }
}

#[test]
fn a_stream_that_ends_early_or_late_is_refused() {
    let streams = [
        (view(Mode::Attributes, 40, 8), V0),
        (view(Mode::Attributes, 40, 8), V1_LEVEL_3),
        (view(Mode::Triangles, 216, 4), GRID),
        (view(Mode::Indices, 24, 4), SEQUENCE),
    ];
    for (view, hex) in streams {
        let whole = bytes(hex);
        for n in 0..whole.len() {
            assert!(decode(view, &whole[..n], 1 << 20).is_err(), "{view:?} cut to {n}");
        }
        let mut longer = whole.clone();
        longer.insert(whole.len() - 40.min(whole.len() - 2), 0);
        longer.insert(1, 0);
        assert!(decode(view, &longer, 1 << 20).is_err(), "{view:?} with more bytes");
    }
}

#[test]
fn a_triangle_that_refers_to_nothing_is_refused() {
    // One triangle by the newest edge, of which there is none.
    let mut stream = vec![0xe1, 0x00];
    stream.extend([0; 16]);
    let error = decode(view(Mode::Triangles, 3, 4), &stream, 100).expect_err("there is no edge yet");
    assert_eq!(error, MeshoptError::Fifo { offset: 1 });
    let mut table = vec![0xe1, 0xf0];
    table.extend([0; 16]);
    table[2 + 15] = 1;
    let error = decode(view(Mode::Triangles, 3, 4), &table, 100).expect_err("the table ends with zeros");
    assert_eq!(error, MeshoptError::CodeTable { offset: 17, value: 1 });
}

#[test]
fn a_number_of_six_bytes_is_refused() {
    let stream = [0xd1, 0x80, 0x80, 0x80, 0x80, 0x80, 0x00, 0, 0, 0, 0];
    assert_eq!(decode(view(Mode::Indices, 1, 4), &stream, 100), Err(MeshoptError::Varint { offset: 1 }));
}

proptest! {
    #[test]
    fn damaged_streams_decode_or_are_refused(
        which in 0..6usize,
        at in any::<proptest::sample::Index>(),
        value in any::<u8>(),
        more in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 0..4),
        filter in 0..5usize,
    ) {
        let (mode, hex, count, stride) = [
            (Mode::Attributes, V0, 40, 8),
            (Mode::Attributes, V1_LEVEL_0, 40, 8),
            (Mode::Attributes, V1_LEVEL_3, 40, 8),
            (Mode::Attributes, V1_FLOATS, 32, 4),
            (Mode::Triangles, GRID, 216, 2),
            (Mode::Indices, SEQUENCE, 24, 4),
        ][which];
        let mut data = bytes(hex);
        let n = data.len();
        data[at.index(n)] = value;
        for (at, value) in more {
            data[at.index(n)] = value;
        }
        let view = View { mode, filter: Filter::ALL[filter], count, stride };
        if let Ok(decoded) = decode(view, &data, 1 << 20) {
            prop_assert_eq!(decoded.len(), count * stride);
        }
    }

    #[test]
    fn any_bytes_decode_or_are_refused(
        mode in 0..3usize,
        header in 0..4usize,
        mut data in proptest::collection::vec(any::<u8>(), 0..400),
        count in 0..400usize,
        stride in 0..12usize,
    ) {
        let mode = [Mode::Attributes, Mode::Triangles, Mode::Indices][mode];
        if let Some(first) = data.first_mut() {
            *first = [0xa0, 0xa1, 0xe1, 0xd1][header];
        }
        let stride = if mode == Mode::Attributes { 4 * stride } else { stride };
        if let Ok(decoded) = decode(view(mode, count, stride), &data, 1 << 20) {
            prop_assert_eq!(decoded.len(), count * stride);
        }
    }
}
