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
    /// Expected node visits of a ray as the tree was built.
    built_cost: f64,
}

/// How much more work than a fresh tree a refitted one may be.
const MOST_GROWTH: f64 = 1.5;
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
        let built_cost = tree.expected_nodes();
        Self { tree, bounds, built_cost }
    }

    /// Follows vertices that have moved: new boxes, the same tree. Returns whether that will do. It will not if other triangles
    /// can be hit than before (one has lost its area, or got one), or if the boxes overlap so much that rays visit
    /// [`MOST_GROWTH`] times the nodes: then the tree is to be built anew.
    pub(crate) fn refit(&mut self, positions: &[[f32; 3]], indices: &[u32], desc: &MeshDesc) -> bool {
        let traceable = |triangle| corners(positions, indices, desc, triangle).filter(|corners| is_traceable(*corners));
        let count = (0..desc.triangle_count()).filter(|&triangle| traceable(triangle).is_some()).count();
        if count != self.tree.items.len() || self.tree.items.iter().any(|&item| traceable(item).is_none()) {
            return false;
        }
        self.tree.refit(|items| {
            let boxes = items.iter().filter_map(|&item| traceable(item)).map(|c| Bounds::of_points(&c.map(|p| *p)));
            boxes.fold(Bounds::EMPTY, |a, b| a.union(&b))
        });
        self.bounds = self.tree.bounds();
        self.tree.expected_nodes() <= MOST_GROWTH * self.built_cost
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
