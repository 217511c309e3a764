//! Rays: slab tests, near child first.
//!
//! The slab test is that of Williams, Barrus, Morley and Shirley, "An Efficient and Robust Ray-Box Intersection Algorithm",
//! JGT 2005, with the near plane chosen by the sign of the direction, so that a NaN (a ray in a plane of the box) drops out
//! of the comparisons; the far distance is rounded up as in Ize, "Robust BVH Ray Traversal", JCGT 2013.

use crate::aabb::Aabb;
use crate::node::{Child, ChildKind, NONE};
use crate::scalar::{Real, Scalar};
use crate::tree::{Bvh, MAX_DEPTH};

/// The points `origin + t * direction` for `t_min <= t <= t_max`.
#[derive(Clone, Copy, Debug)]
pub struct Ray<R, const N: usize> {
    origin: [R; N],
    inverse: [R; N],
    t_min: R,
    t_max: R,
}

impl<R: Real, const N: usize> Ray<R, N> {
    /// A ray. The direction need not be a unit vector; `t` counts in its lengths. It may be zero on any number of axes.
    pub fn new(origin: [R; N], direction: [R; N], t_min: R, t_max: R) -> Self {
        Self { origin, inverse: direction.map(R::recip), t_min, t_max }
    }

    /// Where the ray enters the box, at least `t_min`; [`Real::INFINITY`] if it misses it or enters it beyond `t_max`. Boxes
    /// are closed. Rounding may let a ray hit a box that it just misses, never the other way round.
    #[inline(always)]
    pub fn enter<S: Scalar<Real = R>>(&self, bounds: &Aabb<S, N>, t_max: R) -> R {
        let (mut near, mut far) = (self.t_min, R::INFINITY);
        for a in 0..N {
            let (min, max) = (bounds.min[a].to_real(), bounds.max[a].to_real());
            let backwards = self.inverse[a] < R::ZERO;
            let (first, second) = if backwards { (max, min) } else { (min, max) };
            let t_first = (first - self.origin[a]) * self.inverse[a];
            let t_second = (second - self.origin[a]) * self.inverse[a];
            near = if t_first > near { t_first } else { near };
            far = if t_second < far { t_second } else { far };
        }
        if near <= far * R::FAR_ROUNDING && near <= t_max { near } else { R::INFINITY }
    }
}

/// A box that a ray enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit<R> {
    /// The item.
    pub item: u32,
    /// Where the ray enters the item's box, at least the ray's `t_min`.
    pub t: R,
    /// How far the ray still reaches.
    pub t_max: R,
}

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Visits the items whose boxes the ray enters, roughly from near to far. The visitor returns how far the ray reaches
    /// from then on: `hit.t_max` to see everything, the distance of what it hit to see only what is nearer, anything
    /// below the ray's `t_min` to stop.
    ///
    /// Returns the nodes that were read.
    #[inline(always)]
    pub fn ray(&self, ray: &Ray<S::Real, N>, mut visit: impl FnMut(RayHit<S::Real>) -> S::Real) -> u32 {
        let mut t_max = ray.t_max;
        if self.root == NONE {
            return 0;
        }
        let root = &self.arena[self.root];
        if root.child[1] == Child::EMPTY {
            // The bounds of an empty child are no box to test.
            let t = ray.enter(&root.bounds[0], t_max);
            if let ChildKind::Leaf(item) = root.child[0].kind()
                && t < S::Real::INFINITY
            {
                visit(RayHit { item, t, t_max });
            }
            return 1;
        }
        let mut stack = [(0u32, S::Real::ZERO); MAX_DEPTH as usize];
        let mut waiting = 0;
        let mut visited = 0;
        let mut node = self.root;
        loop {
            visited += 1;
            let n = &self.arena[node];
            self.arena.prefetch(n.child[0]);
            self.arena.prefetch(n.child[1]);
            let t = [ray.enter(&n.bounds[0], t_max), ray.enter(&n.bounds[1], t_max)];
            let near = usize::from(t[1] < t[0]);
            let mut next = NONE;
            for slot in [near, 1 - near] {
                if t[slot] > t_max || t[slot] == S::Real::INFINITY {
                    continue;
                }
                match n.child[slot].kind() {
                    ChildKind::Node(child) if next == NONE => next = child.0,
                    ChildKind::Node(child) => {
                        stack[waiting] = (child.0, t[slot]);
                        waiting += 1;
                    }
                    ChildKind::Leaf(item) => {
                        t_max = visit(RayHit { item, t: t[slot], t_max });
                        if t_max < ray.t_min {
                            return visited;
                        }
                    }
                    ChildKind::Empty => {}
                }
            }
            while next == NONE {
                if waiting == 0 {
                    return visited;
                }
                waiting -= 1;
                let (child, t) = stack[waiting];
                if t <= t_max {
                    next = child;
                }
            }
            node = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_in_a_face_of_a_closed_box_hits_it() {
        let cube = Aabb::new([0.0f32; 3], [1.0; 3]);
        for y in [0.0, 1.0] {
            for dir in [[1.0, 0.0, 0.0], [1.0, -0.0, 0.0]] {
                assert_eq!(Ray::new([-1.0, y, 0.5], dir, 0.0, 9.0).enter(&cube, 9.0), 1.0);
            }
        }
        assert_eq!(Ray::new([-1.0, 1.1, 0.5], [1.0, 0.0, 0.0], 0.0, 9.0).enter(&cube, 9.0), f32::INFINITY);
    }

    #[test]
    fn a_ray_enters_an_unbounded_box() {
        let floor = Aabb::new([f64::NEG_INFINITY, -8.0], [f64::INFINITY, 0.0]);
        assert_eq!(Ray::new([5.0, 2.0], [0.0, -1.0], 0.0, f64::INFINITY).enter(&floor, f64::INFINITY), 2.0);
        assert_eq!(Ray::new([5.0, 2.0], [1.0, 0.0], 0.0, 1e9).enter(&floor, 1e9), f64::INFINITY);
        assert_eq!(Ray::new([5.0, -2.0], [1.0, 0.0], 0.0, 1e9).enter(&floor, 1e9), 0.0);
    }

    #[test]
    fn a_ray_from_within_enters_at_its_start() {
        let cube = Aabb::new([0i32; 4], [4; 4]);
        assert_eq!(Ray::new([1.0; 4], [0.0, 0.0, 0.0, -1.0], 0.25, 9.0).enter(&cube, 9.0), 0.25);
        assert_eq!(Ray::new([1.0; 4], [0.0, 0.0, 0.0, -1.0], 1.5, 9.0).enter(&cube, 9.0), f64::INFINITY);
    }
}
