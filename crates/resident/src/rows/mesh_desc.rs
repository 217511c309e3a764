use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bits of [`MeshDesc::flags`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshFlags;

impl MeshFlags {
    /// The file gave no normals and asks for flat shading: the normal is the triangle's own.
    pub const FLAT: u32 = 1;
    /// The first UV set was given (else it is (0, 0)).
    pub const UV0: u32 = 2;
    /// The second UV set was given (else it is (0, 0)).
    pub const UV1: u32 = 4;
    /// Vertex colours were given (else they are white).
    pub const COLOR: u32 = 8;
    /// Tangents are in the tangent stream (given, or made by MikkTSpace).
    pub const TANGENT: u32 = 16;
    /// The vertices are skinned or morphed: the span belongs to one node.
    pub const DEFORMED: u32 = 32;
    /// Mask of the number that [`MeshDesc::parallelogram`] reads: 0, or 1 + 3 a + b for corners a and b.
    pub const PARALLELOGRAM: u32 = 0xf << Self::PARALLELOGRAM_SHIFT;
    const PARALLELOGRAM_SHIFT: u32 = 8;

    /// The bits of [`Self::PARALLELOGRAM`] for object-space positions and local indices: set where two triangles with one
    /// front make a parallelogram, to a part in 100,000 of its sides.
    pub fn of_parallelogram(positions: &[[f32; 3]], indices: &[u32]) -> u32 {
        let &[a, b, c, d, e, f] = indices else { return 0 };
        let at = |i: u32| positions.get(i as usize).map_or(Vec3::NAN, |&p| Vec3::from_array(p));
        let (first, second) = ([a, b, c].map(at), [d, e, f].map(at));
        for i in 0..3 {
            let [p, p_next, p_last] = [first[i], first[(i + 1) % 3], first[(i + 2) % 3]];
            for j in 0..3 {
                let [q, q_next, q_last] = [second[j], second[(j + 1) % 3], second[(j + 2) % 3]];
                let sides = [p_next - p, p_last - p];
                let shortest = sides[0].length().min(sides[1].length());
                let closes = (p + sides[0] + sides[1]).distance(q) <= 1e-5 * shortest;
                if p_next == q_last && p_last == q_next && closes && shortest > 0.0 {
                    return (1 + 3 * i + j) as u32 * (1 << Self::PARALLELOGRAM_SHIFT);
                }
            }
        }
        0
    }
}

/// The ranges of one distinct piece of geometry in the global streams; its row is the RenderPrimitive index and the
/// BLAS slot. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MeshDesc {
    /// First element in the position and attribute streams.
    pub first_vertex: u32,
    /// Vertices.
    pub vertex_count: u32,
    /// First element in the index stream. Indices are local: 0 is `first_vertex`.
    pub first_index: u32,
    /// Indices: three a triangle.
    pub index_count: u32,
    /// First element in the tangent stream (one per index, in index order), or [`super::NONE`].
    pub first_tangent: u32,
    /// [`MeshFlags`].
    pub flags: u32,
    /// First row in the emitter-triangle table, or [`super::NONE`] where no material in use makes it emit.
    pub first_emitter_triangle: u32,
    /// Zero.
    pub reserved: u32,
    /// Smallest corner of the object-space bounds.
    pub bounds_min: [f32; 3],
    /// Sum of the triangles' object-space areas.
    pub area: f32,
    /// Largest corner of the object-space bounds.
    pub bounds_max: [f32; 3],
    /// Zero.
    pub reserved2: u32,
}

impl MeshDesc {
    /// Triangles.
    #[inline]
    pub fn triangle_count(&self) -> u32 {
        self.index_count / 3
    }

    /// Where an emissive primitive is a parallelogram, one corner of its first and one of its second triangle (0 to 2): the
    /// two that are in one triangle only. The sides from the first are to the next and the last corner of its triangle.
    #[inline]
    pub fn parallelogram(&self) -> Option<[usize; 2]> {
        let number = (self.flags & MeshFlags::PARALLELOGRAM) >> MeshFlags::PARALLELOGRAM_SHIFT;
        let corners = number.checked_sub(1)? as usize;
        (corners < 9).then_some([corners / 3, corners % 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 3]; 4] = [[1.0, 2.0, 3.0], [3.0, 2.0, 3.5], [4.0, 6.0, 4.5], [2.0, 6.0, 4.0]];

    fn parallelogram(positions: &[[f32; 3]], indices: &[u32]) -> Option<[usize; 2]> {
        let flags = MeshFlags::UV0 | MeshFlags::of_parallelogram(positions, indices);
        MeshDesc { flags, ..MeshDesc::zeroed() }.parallelogram()
    }

    #[test]
    fn a_parallelogram_is_known_however_its_triangles_are_written() {
        let (one, two) = ([0, 1, 2], [0, 2, 3]);
        for i in 0..3 {
            for j in 0..3 {
                let rotate = |t: [u32; 3], by: usize| [0, 1, 2].map(|k| t[(k + by) % 3]);
                let indices = [rotate(one, i), rotate(two, j)].concat();
                // Corner 1 is in the first triangle only, corner 3 in the second only.
                let corners = [(1 + 3 - i) % 3, (2 + 3 - j) % 3];
                assert_eq!(parallelogram(&CORNERS, &indices), Some(corners), "{indices:?}");
            }
        }
        // Corners of their own for each triangle, as writers of flat normals make them.
        let apart = [0, 1, 2, 0, 2, 3].map(|i| CORNERS[i]);
        assert_eq!(parallelogram(&apart, &[0, 1, 2, 3, 4, 5]), Some([1, 2]));
    }

    #[test]
    fn other_pairs_of_triangles_are_none() {
        assert_eq!(parallelogram(&CORNERS, &[0, 1, 2, 0, 3, 2]), None, "one of them is turned over");
        assert_eq!(parallelogram(&CORNERS, &[0, 1, 2]), None);
        assert_eq!(parallelogram(&CORNERS, &[0, 1, 2, 0, 2, 3, 0, 1, 2]), None);
        assert_eq!(parallelogram(&CORNERS, &[0, 0, 0, 0, 0, 0]), None);
        assert_eq!(parallelogram(&CORNERS, &[0, 1, 2, 0, 2, 9]), None);
        let mut kite = CORNERS;
        kite[3][0] += 0.01;
        assert_eq!(parallelogram(&kite, &[0, 1, 2, 0, 2, 3]), None);
        let mut folded = CORNERS;
        folded[3][2] += 0.01;
        assert_eq!(parallelogram(&folded, &[0, 1, 2, 0, 2, 3]), None);
    }
}
