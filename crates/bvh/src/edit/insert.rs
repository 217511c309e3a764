//! Insertion beside the sibling that makes the tree grow least.
//!
//! The cost of a place is the surface that the new pair has, plus what every node above grows by: Bittner, Hapala and
//! Havran, "Fast Insertion-Based Optimization of Bounding Volume Hierarchies", Computer Graphics Forum 2013, section 3.1.
//! The greedy descent is that of Catto, "Dynamic Bounding Volume Hierarchies", GDC 2019.

use crate::aabb::Aabb;
use crate::edit::ascend::Rotations;
use crate::error::BvhError;
use crate::node::{Child, NONE, Node, NodeId};
use crate::scalar::{Real, Scalar};
use crate::tree::{Bvh, MAX_DEPTH};

/// How the sibling of what comes in is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SiblingSearch {
    /// One path down, always into the child whose bound on the cost is lower. Reads O(depth) nodes.
    Greedy,
    /// Branch and bound: every subtree whose bound beats the best place found, nearest first, reading at most `visits`
    /// nodes. It finds the best place of all if `visits` suffices.
    BranchAndBound {
        /// The most nodes read.
        visits: u32,
    },
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
                self.root = self.arena.alloc(Node { parent: NONE, ..Node::FREE });
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

    /// The best place for a box in the subtree of `start`; [`Site::Root`] only if `start` is the root.
    pub(crate) fn best_site(&mut self, start: u32, bounds: &Aabb<S, N>) -> Site {
        match self.search {
            SiblingSearch::Greedy => self.best_site_greedy(start, bounds),
            SiblingSearch::BranchAndBound { visits } => self.best_site_branch_and_bound(start, bounds, visits),
        }
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
        let joint = self.arena.alloc(Node {
            bounds: [beside_bounds, bounds],
            child: [beside, child],
            parent,
            height: [beside_height, height],
        });
        self.counters.written += 2;
        self.set_link(beside, joint, 0);
        self.set_link(child, joint, 1);
        match site {
            Site::Root => self.root = joint,
            // The walk up that follows sets the bounds and the height.
            Site::Beside(node, slot) => self.arena.write(node).child[slot] = Child::node(NodeId(joint)),
        }
        self.ascend(joint, Rotations::Yes);
        self.limit_depth();
    }

    fn best_site_greedy(&mut self, start: u32, bounds: &Aabb<S, N>) -> Site {
        let area = bounds.half_area();
        let centre = bounds.centre2();
        let (mut inherited, mut best, mut site) = self.open_search(start, bounds);
        let mut node = start;
        loop {
            self.counters.visited += 1;
            let n = &self.arena[node];
            // The least that a place below each child can cost: the pair has at least the surface of the new box.
            let mut bound = [S::Real::INFINITY; 2];
            let mut growth = [S::Real::ZERO; 2];
            for slot in 0..2 {
                let union = n.bounds[slot].union_half_area(bounds);
                let cost = inherited + union;
                if cost < best {
                    (best, site) = (cost, Site::Beside(node, slot));
                }
                if n.child[slot].is_node() {
                    growth[slot] = union - n.bounds[slot].half_area();
                    bound[slot] = inherited + growth[slot] + area;
                }
            }
            // Not below the best: also where both children are leaves.
            if bound[0] >= best && bound[1] >= best {
                return site;
            }
            let mut next = usize::from(bound[1] < bound[0]);
            if bound[0] == bound[1] {
                // Both hold the box already: the one whose centre is nearer.
                let distance = [0, 1].map(|slot| distance2::<S::Real, N>(&n.bounds[slot].centre2(), &centre));
                next = usize::from(distance[1] < distance[0]);
            }
            inherited += growth[next];
            node = n.child[next].0;
        }
    }

    fn best_site_branch_and_bound(&mut self, start: u32, bounds: &Aabb<S, N>, visits: u32) -> Site {
        let area = bounds.half_area();
        let (inherited, mut best, mut site) = self.open_search(start, bounds);
        // Depth first: at most one entry for every node above, and the one in hand.
        let mut stack = [Open { node: NONE, inherited: S::Real::ZERO }; MAX_DEPTH as usize + 1];
        stack[0] = Open { node: start, inherited };
        let mut open = 1;
        let mut left = visits.max(1);
        while open > 0 && left > 0 {
            open -= 1;
            let Open { node, inherited } = stack[open];
            if inherited + area >= best {
                continue;
            }
            left -= 1;
            self.counters.visited += 1;
            let n = &self.arena[node];
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
            let near = usize::from(below[1] < below[0]);
            for slot in [1 - near, near] {
                if below[slot] + area < best {
                    stack[open] = Open { node: n.child[slot].0, inherited: below[slot] };
                    open += 1;
                }
            }
        }
        site
    }

    /// What everything below `start` inherits, and the first candidate: beside everything if `start` is the root, else
    /// none. The growth of what lies above `start` is the same for all candidates and left out.
    fn open_search(&self, start: u32, bounds: &Aabb<S, N>) -> (S::Real, S::Real, Site) {
        let own = self.arena[start].union();
        let union = own.union_half_area(bounds);
        let best = if start == self.root { union } else { S::Real::INFINITY };
        (union - own.half_area(), best, Site::Root)
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
