use super::bounds::Bounds;
use super::wide::{WIDTH, WideTree};
use crate::trace::triangle::is_traceable;
use orthant_resident::rows::MeshDesc;

/// The tree over the triangles of one RenderPrimitive, in its object space. Its items are triangle numbers.
///
/// A triangle without area, with a vertex that is not finite or with an index out of range is not in it: no ray can hit
/// it.
#[derive(Clone, Debug)]
pub struct Blas {
    pub(crate) tree: WideTree,
    bounds: Bounds,
}

/// Triangles in a leaf, at most.
const MAX_LEAF: u8 = 4;

impl Blas {
    /// Builds it from the resident streams.
    pub(crate) fn build(positions: &[[f32; 3]], indices: &[u32], desc: &MeshDesc) -> Self {
        let mut triangles = Vec::new();
        let mut boxes = Vec::new();
        for triangle in 0..desc.triangle_count() {
            if let Some(corners) = corners(positions, indices, desc, triangle)
                && is_traceable(corners)
            {
                triangles.push(triangle);
                boxes.push(Bounds::of_points(&corners.map(|p| *p)));
            }
        }
        let mut tree = WideTree::build(&boxes, MAX_LEAF);
        for item in &mut tree.items {
            *item = triangles[*item as usize];
        }
        let bounds = tree.bounds();
        Self { tree, bounds }
    }

    /// The object-space box of what rays can hit.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Boxes that hold all that rays can hit, together tighter than [`Blas::bounds`].
    pub(crate) fn parts(&self) -> [Bounds; WIDTH] {
        self.tree.nodes.first().map_or([Bounds::EMPTY; WIDTH], |root| std::array::from_fn(|slot| root.bounds(slot)))
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        self.tree.bytes()
    }
}

/// The corners of a triangle, or `None` where an index leads outside its MeshDesc or a stream.
#[inline(always)]
pub(crate) fn corners<'a>(
    positions: &'a [[f32; 3]],
    indices: &[u32],
    desc: &MeshDesc,
    triangle: u32,
) -> Option<[&'a [f32; 3]; 3]> {
    let first = desc.first_index as usize + 3 * triangle as usize;
    let &[a, b, c] = indices.get(first..first + 3)? else { return None };
    if a.max(b).max(c) >= desc.vertex_count {
        return None;
    }
    let at = |i: u32| positions.get(desc.first_vertex as usize + i as usize);
    Some([at(a)?, at(b)?, at(c)?])
}
