//! Strips and fans become lists of triangles (glTF 2.0, section 3.7.2.1).

use orthant_scene::model::PrimitiveMode;

/// Indices of the triangle list that `count` vertices (or indices) of a topology make; 0 for points and lines.
pub fn triangle_index_count(mode: PrimitiveMode, count: usize) -> usize {
    match mode {
        PrimitiveMode::Triangles => count / 3 * 3,
        PrimitiveMode::TriangleStrip | PrimitiveMode::TriangleFan => count.saturating_sub(2) * 3,
        PrimitiveMode::Points | PrimitiveMode::Lines | PrimitiveMode::LineLoop | PrimitiveMode::LineStrip => 0,
    }
}

/// Writes the triangle list of a topology. `source(i)` is the vertex of the `i`-th of `count` elements; `out` has
/// [`triangle_index_count`] elements.
pub(super) fn write_triangles(mode: PrimitiveMode, count: usize, source: impl Fn(usize) -> u32, out: &mut [u32]) {
    match mode {
        PrimitiveMode::Triangles => {
            for (i, o) in out.iter_mut().enumerate() {
                *o = source(i);
            }
        }
        PrimitiveMode::TriangleStrip => {
            // p_i = {v_i, v_(i + 1 + i mod 2), v_(i + 2 - i mod 2)}
            for (i, triangle) in out.chunks_exact_mut(3).enumerate() {
                triangle.copy_from_slice(&[source(i), source(i + 1 + i % 2), source(i + 2 - i % 2)]);
            }
        }
        PrimitiveMode::TriangleFan => {
            // p_i = {v_(i + 1), v_(i + 2), v_0}
            for (i, triangle) in out.chunks_exact_mut(3).enumerate() {
                triangle.copy_from_slice(&[source(i + 1), source(i + 2), source(0)]);
            }
        }
        _ => debug_assert!(out.is_empty() && count < usize::MAX),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(mode: PrimitiveMode, count: usize) -> Vec<u32> {
        let mut out = vec![0; triangle_index_count(mode, count)];
        write_triangles(mode, count, |i| i as u32 + 10, &mut out);
        out
    }

    #[test]
    fn strips_and_fans_keep_their_winding() {
        assert_eq!(triangles(PrimitiveMode::TriangleStrip, 5), [10, 11, 12, 11, 13, 12, 12, 13, 14]);
        assert_eq!(triangles(PrimitiveMode::TriangleFan, 4), [11, 12, 10, 12, 13, 10]);
        assert_eq!(triangles(PrimitiveMode::Triangles, 7), [10, 11, 12, 13, 14, 15]);
    }

    #[test]
    fn what_is_too_short_has_no_triangle() {
        for mode in [PrimitiveMode::Triangles, PrimitiveMode::TriangleStrip, PrimitiveMode::TriangleFan] {
            for count in 0..3 {
                assert_eq!(triangle_index_count(mode, count), 0);
            }
        }
        assert_eq!(triangle_index_count(PrimitiveMode::LineStrip, 9), 0);
    }
}
