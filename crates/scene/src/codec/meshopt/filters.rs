//! Appendix B: filters. Values outside of what the specification allows give some value, never a fault.

use super::Filter;

/// Applies a filter in place. The stride was checked to go with the filter.
pub(super) fn apply(filter: Filter, stride: usize, data: &mut [u8]) {
    match (filter, stride) {
        (Filter::None, _) => {}
        (Filter::Octahedral, 4) => {
            for v in data.as_chunks_mut::<4>().0 {
                let [x, y, one] = [v[0], v[1], v[2]].map(|b| f32::from(b as i8));
                let [x, y, z] = octahedral(x, y, one).map(|n| (n * 127.0).round() as i8 as u8);
                (v[0], v[1], v[2]) = (x, y, z);
            }
        }
        (Filter::Octahedral, _) => {
            for_each_i16x4(data, |[x, y, one, rest]| {
                let [x, y, z] = octahedral(f32::from(x), f32::from(y), f32::from(one)).map(unit_i16);
                [x, y, z, rest]
            });
        }
        (Filter::Quaternion, _) => for_each_i16x4(data, quaternion),
        (Filter::Exponential, _) => {
            for v in data.as_chunks_mut::<4>().0 {
                *v = exponential(i32::from_le_bytes(*v)).to_le_bytes();
            }
        }
        (Filter::Color, 4) => {
            for v in data.as_chunks_mut::<4>().0 {
                let [y, a] = [v[0], v[3]].map(i32::from);
                let [co, cg] = [v[1], v[2]].map(|b| i32::from(b as i8));
                *v = color(y, co, cg, a).map(|n| (n * 255.0).round() as u8);
            }
        }
        (Filter::Color, _) => {
            for_each_i16x4(data, |[y, co, cg, a]| {
                let [y, a] = [y, a].map(|n| i32::from(n as u16));
                color(y, i32::from(co), i32::from(cg), a).map(|n| (n * 65535.0).round() as u16 as i16)
            });
        }
    }
}

fn for_each_i16x4(data: &mut [u8], f: impl Fn([i16; 4]) -> [i16; 4]) {
    for v in data.as_chunks_mut::<8>().0 {
        let values = f(std::array::from_fn(|k| i16::from_le_bytes([v[2 * k], v[2 * k + 1]])));
        v.copy_from_slice(values.map(i16::to_le_bytes).as_flattened());
    }
}

fn unit_i16(v: f32) -> i16 {
    (v * 32767.0).round() as i16
}

/// Filter 1: a unit vector from its place on the unfolded octahedron. `one` is what 1.0 is stored as.
fn octahedral(x: f32, y: f32, one: f32) -> [f32; 3] {
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x / length, y / length, z / length]
}

/// Filter 2: a unit quaternion from its three smaller components.
fn quaternion(v: [i16; 4]) -> [i16; 4] {
    let one = f32::from(v[3] | 3);
    let [x, y, z] = [v[0], v[1], v[2]].map(|n| f32::from(n) / one * std::f32::consts::FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = (v[3] & 3) as usize;
    let mut out = [0; 4];
    for (i, value) in [w, x, y, z].into_iter().enumerate() {
        out[(largest + i) % 4] = unit_i16(value);
    }
    out
}

/// Filter 3: m 2^e, exactly.
fn exponential(v: i32) -> f32 {
    let (exponent, mantissa) = (v >> 24, (v << 8) >> 8);
    // Bits of 2^e; the two least exponents are subnormal.
    let power = match exponent {
        -126..=127 => f32::from_bits(((exponent + 127) as u32) << 23),
        _ => f32::from_bits(1 << (exponent + 149)),
    };
    mantissa as f32 * power
}

/// Filter 4: RGBA as 0..=1 from YCoCg, whose width is told by the highest bit of alpha.
fn color(y: i32, co: i32, cg: i32, a: i32) -> [f32; 4] {
    let bits = (32 - a.leading_zeros()).max(1);
    let scale = ((1u32 << bits) - 1) as i32;
    let alpha = a & (scale >> 1);
    let alpha = alpha << 1 | (alpha & 1);
    [y + co - cg, y + cg, y - co - cg, alpha].map(|n| n as f32 / scale as f32)
}
