//! UASTC LDR 4x4: a block of 16 bytes in one of 19 modes, a subset of ASTC with plain bit fields.

use super::bits::Bits;
use std::sync::LazyLock;

/// One mode ("List of UASTC Modes").
#[derive(Clone, Copy)]
struct Mode {
    /// Bits of the mode's code.
    code_bits: u32,
    /// Bits of hints for transcoders, between the code and the data.
    hint_bits: u32,
    /// Bits of a weight.
    weight_bits: u32,
    /// Bits of an endpoint value, and the base of the digits that are stored before them (1, 3 or 5).
    endpoint_bits: u32,
    endpoint_base: u32,
    /// Regions with endpoints of their own.
    subsets: usize,
    /// Whether one channel has weights of its own.
    dual_plane: bool,
    /// Channels of an endpoint: 2 is luminance and alpha.
    channels: usize,
}

const fn mode(
    code_bits: u32,
    hint_bits: u32,
    weight_bits: u32,
    (endpoint_bits, endpoint_base): (u32, u32),
    subsets: usize,
    dual_plane: bool,
    channels: usize,
) -> Mode {
    Mode { code_bits, hint_bits, weight_bits, endpoint_bits, endpoint_base, subsets, dual_plane, channels }
}

/// Mode 8 is a block of one colour and has none of these fields.
const SOLID: usize = 8;

const MODES: [Mode; 19] = [
    mode(4, 15, 4, (6, 3), 1, false, 3),
    mode(6, 15, 2, (8, 1), 1, false, 3),
    mode(5, 15, 3, (4, 1), 2, false, 3),
    mode(5, 15, 2, (2, 3), 3, false, 3),
    mode(5, 15, 2, (3, 5), 2, false, 3),
    mode(5, 15, 3, (8, 1), 1, false, 3),
    mode(5, 15, 2, (5, 5), 1, true, 3),
    mode(5, 15, 2, (3, 5), 2, false, 3),
    mode(5, 0, 0, (0, 1), 0, false, 4),
    mode(5, 23, 2, (4, 1), 2, false, 4),
    mode(3, 17, 4, (4, 3), 1, false, 4),
    mode(2, 17, 2, (4, 3), 1, true, 4),
    mode(3, 17, 3, (6, 3), 1, false, 4),
    mode(5, 23, 1, (8, 1), 1, true, 4),
    mode(5, 23, 2, (8, 1), 1, false, 4),
    mode(7, 23, 4, (8, 1), 1, false, 2),
    mode(6, 23, 2, (8, 1), 2, false, 2),
    mode(6, 23, 2, (8, 1), 1, true, 2),
    mode(4, 15, 5, (5, 1), 1, false, 3),
];

/// Codes of modes 0..=18, and of 19, which is reserved; read from the lowest bit.
const CODES: [(u8, u32); 20] = [
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
    (0x45, 7),
];

/// Modes by the lowest seven bits of a block.
static MODE_OF: LazyLock<[u8; 128]> = LazyLock::new(|| {
    std::array::from_fn(|bits| {
        let fits = |&(code, length): &(u8, u32)| bits as u8 & ((1u8 << length).wrapping_sub(1)) == code;
        CODES.iter().position(fits).expect("the codes are a complete prefix code") as u8
    })
});

/// ASTC seeds of the partitions that BC7 has too: of two subsets, of three, and of two where BC7 has three.
const SEEDS_2: [u32; 30] = [
    28, 20, 16, 29, 91, 9, 107, 72, 149, 204, 50, 114, 496, 17, 78, 39, 252, 828, 43, 156, 116, 210, 476, 273, 684,
    359, 246, 195, 694, 524,
];
const SEEDS_3: [u32; 11] = [260, 74, 32, 156, 183, 15, 745, 0, 335, 902, 254];
const SEEDS_2_OF_3: [u32; 19] =
    [36, 48, 61, 137, 161, 183, 226, 281, 302, 307, 479, 495, 593, 594, 605, 799, 812, 988, 993];

/// Which subset each texel of a block belongs to.
type Partition = [u8; 16];

static PARTITIONS_2: LazyLock<[Partition; 30]> = LazyLock::new(|| SEEDS_2.map(|seed| partition(seed, 2)));
static PARTITIONS_3: LazyLock<[Partition; 11]> = LazyLock::new(|| SEEDS_3.map(|seed| partition(seed, 3)));
static PARTITIONS_2_OF_3: LazyLock<[Partition; 19]> = LazyLock::new(|| SEEDS_2_OF_3.map(|seed| partition(seed, 2)));

/// ASTC's partition of a 4 x 4 block (Khronos Data Format, "ASTC partition pattern generation").
fn partition(seed: u32, subsets: u32) -> Partition {
    let mut n = seed + (subsets - 1) * 1024;
    n ^= n >> 15;
    n = n.wrapping_sub(n << 17);
    n = n.wrapping_add(n << 7);
    n = n.wrapping_add(n << 4);
    n ^= n >> 5;
    n = n.wrapping_add(n << 16);
    n ^= n >> 7;
    n ^= n >> 3;
    n ^= n << 6;
    n ^= n >> 17;
    let mut seeds: [u32; 8] = std::array::from_fn(|i| (n >> (4 * i)) & 15);
    seeds.iter_mut().for_each(|s| *s *= *s);
    let sixth = if subsets == 3 { 6 } else { 5 };
    let (even, odd) = if seed & 1 == 1 {
        (if seed & 2 == 2 { 4 } else { 5 }, sixth)
    } else {
        (sixth, if seed & 2 == 2 { 4 } else { 5 })
    };
    for (i, s) in seeds.iter_mut().enumerate() {
        *s >>= if i % 2 == 0 { even } else { odd };
    }
    std::array::from_fn(|i| {
        // Blocks of fewer than 31 texels are looked at twice as large.
        let (x, y) = ((i as u32 % 4) * 2, (i as u32 / 4) * 2);
        let weight = |sx: usize, sy: usize, shift: u32| (seeds[sx] * x + seeds[sy] * y + (n >> shift)) & 63;
        let a = weight(0, 1, 14);
        let b = weight(2, 3, 10);
        let c = if subsets == 3 { weight(4, 5, 6) } else { 0 };
        if a >= b && a >= c {
            0
        } else if b >= c {
            1
        } else {
            2
        }
    })
}

/// A block that is none: magenta, as in ASTC.
const ERROR: [[u8; 4]; 16] = [[255, 0, 255, 255]; 16];

/// Decodes a block, rows from the top.
pub(in crate::textures) fn decode_block(block: &[u8; 16]) -> [[u8; 4]; 16] {
    let index = usize::from(MODE_OF[usize::from(block[0] & 127)]);
    let Some(&mode) = MODES.get(index) else { return ERROR };
    let bits = &mut Bits::new(block);
    bits.read(mode.code_bits);
    if index == SOLID {
        return [std::array::from_fn(|_| bits.read(8) as u8); 16];
    }
    bits.read(mode.hint_bits);
    let Some(subset_of) = read_partition(index, bits) else { return ERROR };
    let second_plane = match (mode.dual_plane, mode.channels) {
        (false, _) => None,
        // Luminance and alpha: alpha has the second weights.
        (true, 2) => Some(3),
        (true, _) => Some(bits.read(2) as usize),
    };
    let endpoints = read_endpoints(&mode, bits);
    let weights = read_weights(&mode, &subset_of, bits);
    std::array::from_fn(|i| {
        let [low, high] = endpoints[usize::from(subset_of[i])];
        std::array::from_fn(|c| {
            let weight = if second_plane == Some(c) { weights[i][1] } else { weights[i][0] };
            interpolate(low[c], high[c], weight)
        })
    })
}

/// The subset of each texel; `None` for a pattern that does not exist.
fn read_partition(mode: usize, bits: &mut Bits) -> Option<Partition> {
    match mode {
        2 | 4 | 9 | 16 => PARTITIONS_2.get(bits.read(5) as usize).copied(),
        3 => PARTITIONS_3.get(bits.read(4) as usize).copied(),
        7 => PARTITIONS_2_OF_3.get(bits.read(5) as usize).copied(),
        _ => Some([0; 16]),
    }
}

/// RGBA of the two ends of each subset. Digits of base 3 or 5 come first, several to a number, then the plain bits.
fn read_endpoints(mode: &Mode, bits: &mut Bits) -> [[[u8; 4]; 2]; 3] {
    let count = mode.subsets * mode.channels * 2;
    let mut values = [0u32; 18];
    let (together, widths): (usize, &[u32]) = match mode.endpoint_base {
        3 => (5, &[0, 2, 4, 5, 7, 8]),
        5 => (3, &[0, 3, 5, 7]),
        _ => (count, &[]),
    };
    if mode.endpoint_base > 1 {
        for group in values[..count].chunks_mut(together) {
            let mut packed = bits.read(widths[group.len()]);
            for value in group {
                *value = (packed % mode.endpoint_base) << mode.endpoint_bits;
                packed /= mode.endpoint_base;
            }
        }
    }
    for value in &mut values[..count] {
        *value |= bits.read(mode.endpoint_bits);
        *value = unquantize(*value, mode.endpoint_bits, mode.endpoint_base);
    }
    let mut ends = [[[255; 4]; 2]; 3];
    for (subset, values) in ends.iter_mut().zip(values[..count].chunks(mode.channels * 2)) {
        for (end, color) in subset.iter_mut().enumerate() {
            let value = |channel: usize| values[2 * channel + end] as u8;
            match mode.channels {
                2 => *color = [value(0), value(0), value(0), value(1)],
                3 => *color = [value(0), value(1), value(2), 255],
                _ => *color = [value(0), value(1), value(2), value(3)],
            }
        }
    }
    ends
}

/// An endpoint value as 0..=255 (Khronos Data Format, "ASTC endpoint unquantization").
fn unquantize(value: u32, bits: u32, base: u32) -> u32 {
    let low = value & ((1 << bits) - 1);
    if base == 1 {
        // The bits are repeated to fill a byte.
        return match bits {
            8 => low,
            5 => low << 3 | low >> 2,
            _ => low << 4 | low,
        };
    }
    let digit = value >> bits;
    let a = if low & 1 == 1 { 0x1ff } else { 0 };
    let x = low >> 1;
    let (b, c) = match (base, bits) {
        // B is made of the bits over the lowest, C is the step of a digit.
        (3, 2) => (x * 0b1_0001_0110, 93),
        (3, 4) => (x << 6 | x, 22),
        (3, 6) => (x << 4 | x >> 4, 5),
        (5, 3) => (x << 7 | x << 1 | x >> 1, 26),
        _ => (x << 5 | x >> 3, 6),
    };
    let t = (digit * c + b) ^ a;
    (a & 0x80) | (t >> 2)
}

/// Weights of each texel, 0..=64: of the plane, and of the second plane.
fn read_weights(mode: &Mode, subset_of: &Partition, bits: &mut Bits) -> [[u32; 2]; 16] {
    let mut weights = [[0; 2]; 16];
    let mut begun = [false; 3];
    let planes = 1 + usize::from(mode.dual_plane);
    for (texel, subset) in weights.iter_mut().zip(subset_of) {
        // The first weight of a subset is less than half, so that its highest bit is not stored.
        let begun = &mut begun[usize::from(*subset)];
        let n = mode.weight_bits - u32::from(!*begun);
        *begun = true;
        for weight in &mut texel[..planes] {
            *weight = weight_of(bits.read(n), mode.weight_bits);
        }
    }
    weights
}

/// A weight as 0..=64 (Khronos Data Format, "ASTC weight unquantization"): bits repeated to six, and one more over half.
fn weight_of(value: u32, bits: u32) -> u32 {
    let six = match bits {
        1 => value * 63,
        2 => value * 21,
        3 => value * 9,
        4 => value << 2 | value >> 2,
        _ => value << 1 | value >> 4,
    };
    six + u32::from(six > 32)
}

/// Between two ends, in 16 bits.
fn interpolate(low: u8, high: u8, weight: u32) -> u8 {
    let [low, high] = [low, high].map(|v| u32::from(v) << 8 | u32::from(v));
    (((low * (64 - weight) + high * weight + 32) >> 6) >> 8) as u8
}
