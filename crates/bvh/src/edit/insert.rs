//! Insertion beside the sibling that makes the tree grow least.
//!
//! The cost of a place is the surface that the new pair has, plus what every node above grows by, and a subtree is left out
//! if what all places in it cost at least is too much: Bittner, Hapala and Havran, "Fast Insertion-Based Optimization of
//! Bounding Volume Hierarchies", Computer Graphics Forum 2013, section 3.1. The search goes depth first into the child with
//! the lower bound, so that a good place is known early.

use crate::aabb::Aabb;
use crate::edit::ascend::Rotations;
use crate::error::BvhError;
use crate::node::{Child, NONE, NodeId};
use crate::scalar::{Real, Scalar};
use crate::tree::{Bvh, MAX_DEPTH};

/// How the sibling of what comes in is looked for.
///
/// One descent into the better child is not enough: where siblings overlap, several subtrees hold the new box without
/// growing, and the one whose centre is nearest is often not the one with the right place. Following all of them reads
/// about as many nodes as one path to the ground, if the search stops early elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SiblingSearch {
    /// The most nodes read.
    pub visits: u32,
    /// A subtree is looked into if its best place could be better than the best one known by more than this, in per cent.
    pub least_gain_percent: u8,
}

impl SiblingSearch {
    /// Within a per cent of the best place where boxes overlap little, in two thirds of the time.
    pub const fn fast() -> Self {
        Self { visits: 256, least_gain_percent: 60 }
    }

    /// The best place of all.
    pub const fn exhaustive() -> Self {
        Self { visits: u32::MAX, least_gain_percent: 0 }
    }
}

/// Where a subtree is put: beside a child of a node, or beside everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Site {
    Root,
    Beside(u32, usize),
}

/// What a search looks below: a node, and what all that is put below it costs at least (the growth of the nodes above).
#[derive(Clone, Copy)]
struct Open<R> {
    node: u32,
    inherited: R,
}

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Inserts an item. Reads and writes O(depth) nodes.
    ///
    /// # Errors
    /// [`BvhError::BadBounds`], [`BvhError::DuplicateItem`], [`BvhError::ItemOutOfRange`]; the tree is then unchanged.
    pub fn insert(&mut self, item: u32, bounds: Aabb<S, N>) -> Result<(), BvhError> {
        bounds.check(item)?;
        self.check_new_item(item)?;
        self.make_place(item);
        self.len += 1;
        self.hang(Child::leaf(item), bounds, 0);
        Ok(())
    }

    /// Finds a place for a subtree that is not in the tree yet, and puts it there.
    pub(crate) fn hang(&mut self, child: Child, bounds: Aabb<S, N>, height: u8) {
        if self.root == NONE {
            if child.is_node() {
                self.root = child.0;
                self.arena.links(child.0).parent = NONE;
            } else {
                self.root = self.arena.alloc(NONE);
                self.set_child(self.root, 0, child, bounds, height);
            }
            return;
        }
        if self.arena[self.root].child[1] == Child::EMPTY {
            self.parents_first = false;
            self.set_child(self.root, 1, child, bounds, height);
            return self.limit_depth();
        }
        let site = self.best_site(self.root, &bounds);
        self.attach(child, bounds, height, site);
    }

    /// The best place for a box, looked for from the subtree of `start` outwards. If `start` is not the root, then all nodes
    /// above it hold the box, and do not grow.
    pub(crate) fn best_site(&mut self, start: u32, bounds: &Aabb<S, N>) -> Site {
        let area = bounds.half_area();
        let centre = bounds.centre2();
        let part = S::Real::from_f64(f64::from(100 - self.search.least_gain_percent.min(100)) / 100.0);
        let own = self.arena[start].union();
        let union = own.union_half_area(bounds);
        let mut best = if start == self.root { union } else { S::Real::INFINITY };
        let mut site = Site::Root;
        // Depth first: at most one node waits for every one above, and one is in hand.
        let mut stack = [Open { node: NONE, inherited: S::Real::ZERO }; MAX_DEPTH as usize + 1];
        stack[0] = Open { node: start, inherited: union - own.half_area() };
        let mut open = 1;
        let mut visits = 0;
        let mut pivot = start;
        while visits < self.search.visits {
            if open == 0 {
                // One level up: beside the other child of the node above, and below it.
                let above = self.arena[pivot].parent;
                if above == NONE {
                    break;
                }
                visits += 1;
                let n = &self.arena[above];
                let other = 1 - n.slot_of(Child::node(NodeId(pivot)));
                pivot = above;
                let union = n.bounds[other].union_half_area(bounds);
                if union < best {
                    (best, site) = (union, Site::Beside(above, other));
                }
                let inherited = union - n.bounds[other].half_area();
                if n.child[other].is_node() && inherited + area < best * part {
                    stack[0] = Open { node: n.child[other].0, inherited };
                    open = 1;
                }
                continue;
            }
            open -= 1;
            let Open { node, inherited } = stack[open];
            // The first node is always looked at, since only the root is a place itself.
            if visits > 0 && inherited + area >= best * part {
                continue;
            }
            visits += 1;
            let n = &self.arena[node];
            self.arena.prefetch(n.child[0]);
            self.arena.prefetch(n.child[1]);
            let mut below = [S::Real::INFINITY; 2];
            for slot in 0..2 {
                let union = n.bounds[slot].union_half_area(bounds);
                let cost = inherited + union;
                if cost < best {
                    (best, site) = (cost, Site::Beside(node, slot));
                }
                if n.child[slot].is_node() {
                    below[slot] = inherited + (union - n.bounds[slot].half_area());
                }
            }
            let mut near = usize::from(below[1] < below[0]);
            if below[0] == below[1] && n.child[0].is_node() {
                // Both hold the box already, most often: the one whose centre is nearer first.
                let distance = [0, 1].map(|slot| distance2::<S::Real, N>(&n.bounds[slot].centre2(), &centre));
                near = usize::from(distance[1] < distance[0]);
            }
            for slot in [1 - near, near] {
                if below[slot] + area < best * part {
                    stack[open] = Open { node: n.child[slot].0, inherited: below[slot] };
                    open += 1;
                }
            }
        }
        self.counters.visited += u64::from(visits);
        site
    }

    /// Makes a node over what is at `site` and the given subtree, then carries the change to the root.
    pub(crate) fn attach(&mut self, child: Child, bounds: Aabb<S, N>, height: u8, site: Site) {
        self.parents_first = false;
        let (parent, beside, beside_bounds, beside_height) = match site {
            Site::Root => {
                let root = &self.arena[self.root];
                (NONE, Child::node(NodeId(self.root)), root.union(), root.own_height())
            }
            Site::Beside(node, slot) => {
                let n = &self.arena[node];
                (node, n.child[slot], n.bounds[slot], n.height[slot])
            }
        };
        let joint = self.arena.alloc(parent);
        self.set_child(joint, 0, beside, beside_bounds, beside_height);
        self.set_child(joint, 1, child, bounds, height);
        match site {
            Site::Root => self.root = joint,
            // The walk up that follows sets the bounds and the height.
            Site::Beside(node, slot) => self.arena.write(node).child[slot] = Child::node(NodeId(joint)),
        }
        self.ascend(joint, Rotations::Yes);
        self.limit_depth();
    }
}

fn distance2<R: Real, const N: usize>(a: &[R; N], b: &[R; N]) -> R {
    let mut sum = R::ZERO;
    for axis in 0..N {
        let d = a[axis] - b[axis];
        sum += d * d;
    }
    sum
}
