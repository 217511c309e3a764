use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// One element of the attribute stream (positions are a stream of their own, `[f32; 3]`). 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct VertexRow {
    /// First UV set; (0, 0) is the upper left corner of the image.
    pub uv0: [f32; 2],
    /// Second UV set.
    pub uv1: [f32; 2],
    /// Linear RGBA, 16-bit unorm.
    pub color: [u16; 4],
    /// Object-space normal, see [`encode_normal`].
    pub normal: u32,
    /// Zero.
    pub reserved: u32,
}

/// Packs a unit vector as an octahedron, two 16-bit snorms, x in the low half (Cigolle et al. 2014, "A Survey of
/// Efficient Representations for Independent Unit Vectors", section 3.2). The error is below 7e-5 radians.
#[inline]
pub fn encode_normal(n: Vec3) -> u32 {
    let p = octahedral(n);
    let snorm = |v: f32| (round(v.clamp(-1.0, 1.0) * 32767.0) as i16 as u16) as u32;
    snorm(p.x) | (snorm(p.y) << 16)
}

/// Unpacks what [`encode_normal`] packed, to a unit vector.
#[inline]
pub fn decode_normal(bits: u32) -> Vec3 {
    let snorm = |v: u32| (v as u16 as i16 as f32 / 32767.0).max(-1.0);
    from_octahedral(Vec2::new(snorm(bits), snorm(bits >> 16)))
}

/// Packs a unit tangent and the sign of its bitangent: an octahedron of 16 + 15 bits, and the sign (1 = negative) in
/// the highest bit.
#[inline]
pub fn encode_tangent(t: Vec3, bitangent_sign: f32) -> u32 {
    let p = octahedral(t);
    let x = (round(p.x.clamp(-1.0, 1.0) * 32767.0) as i16 as u16) as u32;
    let y = (round(p.y.clamp(-1.0, 1.0) * 16383.0) as u32) & 0x7fff;
    x | (y << 16) | (u32::from(bitangent_sign < 0.0) << 31)
}

/// Unpacks what [`encode_tangent`] packed: the unit tangent and the sign (1 or -1) of the bitangent
/// `cross(normal, tangent) * sign`.
#[inline]
pub fn decode_tangent(bits: u32) -> (Vec3, f32) {
    let x = (bits as u16 as i16 as f32 / 32767.0).max(-1.0);
    let y = ((((bits >> 16) as i32) << 17) >> 17) as f32 / 16383.0;
    (from_octahedral(Vec2::new(x, y.max(-1.0))), if bits >> 31 == 1 { -1.0 } else { 1.0 })
}

/// The nearest integer, halves away from zero, as `f32::round` has it: that is a call where the processor has no
/// instruction for it, and a load of vertices makes millions. The fraction of what is cut off is exact.
#[inline]
fn round(v: f32) -> i32 {
    let whole = v as i32;
    let fraction = v - whole as f32;
    whole + i32::from(fraction >= 0.5) - i32::from(fraction <= -0.5)
}

fn octahedral(n: Vec3) -> Vec2 {
    let l1 = n.x.abs() + n.y.abs() + n.z.abs();
    let p = Vec2::new(n.x, n.y) / l1.max(f32::MIN_POSITIVE);
    if n.z >= 0.0 { p } else { fold(p) }
}

fn from_octahedral(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let q = if z >= 0.0 { p } else { fold(p) };
    Vec3::new(q.x, q.y, z).normalize()
}

fn fold(p: Vec2) -> Vec2 {
    let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
    Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..20_000u32).map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 20_000.0;
            let (s, c) = (i as f32 * 2.399_963).sin_cos();
            Vec3::new(c, s, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
        })
    }

    #[test]
    fn a_packed_normal_is_within_its_error() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        for n in directions().chain(axes) {
            // The chord: the arc cosine of a product near 1 has no digits left.
            assert!((decode_normal(encode_normal(n)) - n).length() < 7e-5, "{n}");
        }
        for n in axes {
            assert_eq!(decode_normal(encode_normal(n)), n);
        }
    }

    #[test]
    fn a_packed_tangent_keeps_its_sign() {
        for (i, t) in directions().enumerate() {
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let (t2, s2) = decode_tangent(encode_tangent(t, sign));
            assert_eq!(s2, sign);
            assert!((t2 - t).length() < 2e-4, "{t} {t2}");
        }
    }

    #[test]
    fn rounding_is_that_of_the_standard_library() {
        for i in -70_000..=70_000 {
            let half = i as f32 * 0.5;
            for v in [half.next_down(), half, half.next_up(), half + 0.3] {
                assert_eq!(round(v), v.round() as i32, "{v}");
            }
        }
        assert_eq!(round(f32::NAN), 0);
    }
}
