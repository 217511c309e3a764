//! The inner loops over vertices: attributes to rows, and bounds.

use glam::Vec3;
use orthant_resident::rows::{VertexRow, encode_normal};

/// Attributes of some vertices; `None` where the primitive has none. All have as many elements as there are rows to write.
pub(super) struct Attributes<'a> {
    pub normals: Option<&'a [[f32; 3]]>,
    pub uv0: Option<&'a [[f32; 2]]>,
    pub uv1: Option<&'a [[f32; 2]]>,
    pub colors: Option<&'a [[f32; 4]]>,
}

impl Attributes<'_> {
    /// Writes one row for each vertex.
    pub fn write_rows(&self, rows: &mut [VertexRow]) {
        let plain = VertexRow { uv0: [0.0; 2], uv1: [0.0; 2], color: [u16::MAX; 4], normal: 0, reserved: 0 };
        // What most meshes have is written in one pass.
        match (self.normals, self.uv0) {
            (Some(normals), Some(uv0)) => {
                for ((row, normal), uv) in rows.iter_mut().zip(normals).zip(uv0) {
                    *row = VertexRow { uv0: *uv, normal: encode_normal(unit(*normal)), ..plain };
                }
            }
            (Some(normals), None) => {
                for (row, normal) in rows.iter_mut().zip(normals) {
                    *row = VertexRow { normal: encode_normal(unit(*normal)), ..plain };
                }
            }
            (None, Some(uv0)) => {
                for (row, uv) in rows.iter_mut().zip(uv0) {
                    *row = VertexRow { uv0: *uv, ..plain };
                }
            }
            (None, None) => rows.fill(plain),
        }
        for (row, uv) in rows.iter_mut().zip(self.uv1.unwrap_or_default()) {
            row.uv1 = *uv;
        }
        for (row, color) in rows.iter_mut().zip(self.colors.unwrap_or_default()) {
            row.color = color.map(unorm16);
        }
    }
}

/// A box in object space.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Bounds {
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The bounds of all positions that are finite.
    pub fn of(positions: &[[f32; 3]]) -> Self {
        positions.iter().fold(Self::EMPTY, |Self { min, max }, p| {
            let p = Vec3::from_array(*p);
            if p.is_finite() { Self { min: min.min(p), max: max.max(p) } } else { Self { min, max } }
        })
    }

    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
}

fn unit(n: [f32; 3]) -> Vec3 {
    Vec3::from_array(n).normalize_or(Vec3::Z)
}

fn unorm16(v: f32) -> u16 {
    (v.clamp(0.0, 1.0) * 65535.0).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_what_the_primitive_has_and_defaults_for_the_rest() {
        let (normals, uv0, uv1) = ([[0.0, 0.0, 2.0]; 2], [[0.25, 0.5]; 2], [[0.75, 1.0]; 2]);
        let colors = [[0.0, 0.5, 1.0, 2.0]; 2];
        for has in 0..16 {
            let given = |bit: u32| has >> bit & 1 == 1;
            let source = Attributes {
                normals: given(0).then_some(&normals),
                uv0: given(1).then_some(&uv0),
                uv1: given(2).then_some(&uv1),
                colors: given(3).then_some(&colors),
            };
            let mut rows = [bytemuck::Zeroable::zeroed(); 2];
            source.write_rows(&mut rows);
            let expected = VertexRow {
                uv0: if given(1) { [0.25, 0.5] } else { [0.0; 2] },
                uv1: if given(2) { [0.75, 1.0] } else { [0.0; 2] },
                color: if given(3) { [0, 32768, 65535, 65535] } else { [u16::MAX; 4] },
                normal: if given(0) { encode_normal(Vec3::Z) } else { 0 },
                reserved: 0,
            };
            assert_eq!(rows, [expected; 2]);
        }
    }

    #[test]
    fn positions_that_are_not_finite_have_no_part_in_the_bounds() {
        let bounds = Bounds::of(&[[1.0, -2.0, 3.0], [f32::NAN, 9.0, 9.0], [0.0, f32::INFINITY, 0.0], [-1.0, 0.0, 5.0]]);
        assert_eq!((bounds.min.to_array(), bounds.max.to_array()), ([-1.0, -2.0, 3.0], [1.0, 0.0, 5.0]));
    }
}
