//! Insertion beside the sibling that makes the tree grow least.
//!
//! The cost of a place is the surface that the new pair has, plus what every node above grows by, and a subtree is left out
//! if what all places in it cost at least is too much: Bittner, Hapala and Havran, "Fast Insertion-Based Optimization of
//! Bounding Volume Hierarchies", Computer Graphics Forum 2013, section 3.1. The search goes depth first into the child with
//! the lower bound, so that a good place is known early.

use core::hint::select_unpredictable;

use crate::aabb::Aabb;
use crate::edit::ascend::Rotations;
use crate::error::BvhError;
use crate::node::{Child, NONE, NodeId};
use crate::scalar::{Real, Scalar, lesser};
use crate::tree::{Bvh, MAX_DEPTH};

/// How the sibling of what comes in is looked for.
///
/// One descent into the better child is not enough: where siblings overlap, several subtrees hold the new box without
/// growing, and the one whose centre is nearest is often not the one with the right place. Following those that promise much
/// more than the best place known reads two fifths more nodes than one path to the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SiblingSearch {
    /// The most nodes read.
    pub visits: u32,
    /// The way down goes on while the best place below could be better than the best one known by more than this, in per cent.
    pub least_gain_percent: u8,
    /// Another subtree than the one that looks best is looked into if its best place could be better than the best one known
    /// by more than this, in per cent.
    pub least_gain_aside_percent: u8,
}

impl SiblingSearch {
    /// A tree that is made by these insertions alone is within a tenth of what the best places give, in three fifths of the time.
    pub const fn fast() -> Self {
        Self { visits: 256, least_gain_percent: 60, least_gain_aside_percent: 90 }
    }

    /// The best place of all.
    pub const fn exhaustive() -> Self {
        Self { visits: u32::MAX, least_gain_percent: 0, least_gain_aside_percent: 0 }
    }
}

/// Where a subtree is put: beside a child of a node, or beside everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Site {
    Root,
    Beside(u32, usize),
}

/// The search has found no place yet but beside everything.
const NO_PLACE: u32 = u32::MAX;

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
    ///
    /// What is chosen at a node cannot be foreseen, so it is selected, not branched on.
    pub(crate) fn best_site(&mut self, start: u32, bounds: &Aabb<S, N>) -> Site {
        let area = bounds.half_area();
        let part = |percent: u8| S::Real::from_f64(f64::from(100 - percent.min(100)) / 100.0);
        let (ahead, aside) = (part(self.search.least_gain_percent), part(self.search.least_gain_aside_percent));
        let limit = self.search.visits;
        let own = self.arena[start].union();
        let union = own.union_half_area(bounds);
        let mut best = if start == self.root { union } else { S::Real::INFINITY };
        // A node, times two, plus the slot beside which the place is.
        let mut place = NO_PLACE;
        // Depth first: at most one node waits for every one above.
        let mut stack = [Open { node: NONE, inherited: S::Real::ZERO }; MAX_DEPTH as usize + 1];
        let mut open = 0;
        let (mut pivot, mut node, mut inherited) = (start, start, union - own.half_area());
        let mut visits = 0;
        'search: while visits < limit {
            visits += 1;
            let n = &self.arena[node];
            self.arena.prefetch(n.child[0]);
            self.arena.prefetch(n.child[1]);
            self.arena.prefetch_behind(node, 2);
            self.arena.prefetch_behind(n.child[1].0, 1);
            let mut below = [S::Real::INFINITY; 2];
            for slot in 0..2 {
                let union = n.bounds[slot].union_half_area(bounds);
                let cost = inherited + union;
                place = select_unpredictable(cost < best, node << 1 | slot as u32, place);
                best = lesser(cost, best);
                let grown = inherited + (union - n.bounds[slot].half_area());
                below[slot] = select_unpredictable(n.child[slot].is_node(), grown, S::Real::INFINITY);
            }
            let mut second_is_near = below[1] < below[0];
            if below[0] == below[1] {
                // Both hold the box already, most often: the one whose centre is nearer first.
                second_is_near = second_centre_is_nearer(&n.bounds, bounds);
            }
            let child = n.child;
            let near = select_unpredictable(second_is_near, child[1], child[0]);
            let far = select_unpredictable(second_is_near, child[0], child[1]);
            let near_below = select_unpredictable(second_is_near, below[1], below[0]);
            let far_below = select_unpredictable(second_is_near, below[0], below[1]);
            let worth = best * aside;
            if near_below + area < best * ahead {
                stack[open] = Open { node: far.0, inherited: far_below };
                open += usize::from(far_below + area < worth);
                (node, inherited) = (near.0, near_below);
                self.arena.prefetch_behind(node, 2);
                self.arena.prefetch_behind(node, 3);
                continue;
            }
            loop {
                while open > 0 {
                    open -= 1;
                    Open { node, inherited } = stack[open];
                    if inherited + area < worth {
                        continue 'search;
                    }
                }
                // One level up: beside the other child of the node above, and below it. No place costs less than the new
                // box has surface.
                let above = self.arena[pivot].parent;
                if above == NONE || visits >= limit || area >= best * aside {
                    break 'search;
                }
                visits += 1;
                let n = &self.arena[above];
                let other = 1 - n.slot_of(Child::node(NodeId(pivot)));
                pivot = above;
                let union = n.bounds[other].union_half_area(bounds);
                if union < best {
                    (best, place) = (union, above << 1 | other as u32);
                }
                inherited = union - n.bounds[other].half_area();
                if n.child[other].is_node() && inherited + area < best * aside {
                    node = n.child[other].0;
                    continue 'search;
                }
            }
        }
        self.counters.visited += u64::from(visits);
        if place == NO_PLACE { Site::Root } else { Site::Beside(place >> 1, (place & 1) as usize) }
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

/// Whether the centre of the second box is nearer to that of `bounds` than the centre of the first.
#[inline(always)]
fn second_centre_is_nearer<S: Scalar, const N: usize>(pair: &[Aabb<S, N>; 2], bounds: &Aabb<S, N>) -> bool {
    let centre = bounds.centre2();
    distance2::<S::Real, N>(&pair[1].centre2(), &centre) < distance2::<S::Real, N>(&pair[0].centre2(), &centre)
}

#[inline(always)]
fn distance2<R: Real, const N: usize>(a: &[R; N], b: &[R; N]) -> R {
    let mut sum = R::ZERO;
    for axis in 0..N {
        let d = a[axis] - b[axis];
        sum += d * d;
    }
    sum
}
