//! Keeps the tree within [`MAX_DEPTH`].
//!
//! Joining subtrees of given heights into a tree of the least height is solved by always joining the two lowest
//! (Golumbic, "Combinatorial Merging", IEEE Transactions on Computers 1976). Applied to what hangs off a stretch of the
//! deepest path it undoes the chains that degenerate input makes, writing as many nodes as the stretch is long.

use crate::aabb::Aabb;
use crate::build::draft::{Draft, Part};
use crate::build::sah;
use crate::edit::ascend::Rotations;
use crate::node::{Child, ChildKind, NodeId};
use crate::scalar::Scalar;
use crate::tree::{Bvh, MAX_DEPTH};

/// A subtree that hangs off the path.
struct Hanging<S, const N: usize> {
    child: Child,
    bounds: Aabb<S, N>,
    height: u8,
}

/// The lowest stretch that saves this many levels is taken, so that a repair lasts for some time.
const SAVING: u8 = 4;
/// Paths that are joined anew before a subtree is rebuilt instead: then many paths are deep.
const PATHS: u32 = 16;

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Called after every edit that can make the tree deeper.
    #[inline(always)]
    pub(crate) fn limit_depth(&mut self) {
        if self.depth() > MAX_DEPTH {
            self.repair_depth();
        }
    }

    #[cold]
    fn repair_depth(&mut self) {
        let mut paths = 0;
        while self.depth() > MAX_DEPTH {
            self.counters.depth_repairs += 1;
            self.parents_first = false;
            let path = self.deepest_path();
            if paths == PATHS || !self.join_anew(&path) {
                self.rebuild_lowest(&path);
            } else {
                paths += 1;
            }
        }
    }

    /// The nodes from the root to a deepest leaf.
    fn deepest_path(&mut self) -> Vec<u32> {
        let mut path = Vec::new();
        let mut next = Child::node(NodeId(self.root));
        while let ChildKind::Node(id) = next.kind() {
            path.push(id.0);
            let n = &self.arena[id.0];
            next = n.child[tall_slot(n.height)];
        }
        self.counters.visited += path.len() as u64;
        path
    }

    /// Joins what hangs off the lowest stretch of the path that can be [`SAVING`] levels lower; failing that, off the one
    /// that saves most. False if none saves a level.
    fn join_anew(&mut self, path: &[u32]) -> bool {
        let mut hanging: Vec<u8> = Vec::with_capacity(path.len() + 1);
        let mut best: Option<(usize, u8)> = None;
        for (i, &node) in path.iter().enumerate().rev() {
            let heights = self.arena[node].height;
            if i + 1 == path.len() {
                hanging.push(heights[tall_slot(heights)]);
            }
            hanging.push(heights[1 - tall_slot(heights)]);
            let saving = self.arena[node].own_height().saturating_sub(least_height(&hanging));
            if best.is_none_or(|(_, most)| saving > most) {
                best = Some((i, saving));
            }
            if saving >= SAVING {
                break;
            }
        }
        match best {
            Some((from, saving)) if saving > 0 => {
                self.join_stretch(&path[from..]);
                true
            }
            _ => false,
        }
    }

    /// Golumbic's joining of what hangs off a stretch of nodes that ends at a deepest leaf. The nodes are used again, the
    /// first one at the top.
    fn join_stretch(&mut self, stretch: &[u32]) {
        let mut parts = Vec::with_capacity(stretch.len() + 1);
        for (i, &node) in stretch.iter().enumerate() {
            let n = &self.arena[node];
            let tall = tall_slot(n.height);
            for slot in [1 - tall, tall] {
                if slot != tall || i + 1 == stretch.len() {
                    parts.push(Hanging { child: n.child[slot], bounds: n.bounds[slot], height: n.height[slot] });
                }
            }
        }
        for &node in stretch.iter().rev() {
            // Highest first, so that the two lowest are popped from the back.
            parts.sort_by_key(|part| core::cmp::Reverse(part.height));
            let (Some(a), Some(b)) = (parts.pop(), parts.pop()) else { unreachable!("one part more than nodes") };
            self.set_child(node, 0, a.child, a.bounds, a.height);
            self.set_child(node, 1, b.child, b.bounds, b.height);
            let n = &self.arena[node];
            parts.push(Hanging { child: Child::node(NodeId(node)), bounds: n.union(), height: n.own_height() });
        }
        self.ascend(stretch[0], Rotations::No);
    }

    /// Rebuilds the lowest subtree on the path that is much deeper than its leaves demand. There is one on any path longer
    /// than [`MAX_DEPTH`], since an id has 31 bits.
    fn rebuild_lowest(&mut self, path: &[u32]) {
        let mut leaves = 1;
        for (i, &node) in path.iter().enumerate().rev() {
            let n = &self.arena[node];
            let (tall, height) = (tall_slot(n.height), n.own_height());
            leaves += self.leaves_below(n.child[1 - tall]);
            let needed = leaves.next_power_of_two().trailing_zeros();
            if needed + u32::from(SAVING) <= u32::from(height) || i == 0 {
                return self.rebuild_below(node, needed.max(u32::from(height - SAVING)));
            }
        }
    }

    fn leaves_below(&self, child: Child) -> usize {
        let mut stack = vec![child];
        let mut leaves = 0;
        while let Some(child) = stack.pop() {
            match child.kind() {
                ChildKind::Node(id) => stack.extend(self.arena[id.0].child),
                ChildKind::Leaf(_) => leaves += 1,
                ChildKind::Empty => {}
            }
        }
        leaves
    }

    /// Builds the subtree of `node` anew, at most `height` nodes high, and puts it where it was.
    fn rebuild_below(&mut self, node: u32, height: u32) {
        let parent = self.arena[node].parent;
        let mut leaves = Vec::new();
        self.release_below(node, &mut leaves);
        let mut draft = Draft::default();
        let top = sah::build(&mut draft, &mut Part::leaves(&leaves), height, usize::MAX);
        let ChildKind::Node(top) = top.kind() else { unreachable!("a deep subtree has more than one leaf") };
        let id = self.raise(&draft, top.0, parent, &leaves);
        if parent == crate::node::NONE {
            self.root = id;
            return;
        }
        let slot = self.arena[parent].slot_of(Child::node(NodeId(node)));
        let n = &self.arena[id];
        let (bounds, own_height) = (n.union(), n.own_height());
        self.set_child(parent, slot, Child::node(NodeId(id)), bounds, own_height);
        self.ascend(parent, Rotations::No);
    }

    /// Frees the nodes of a subtree and collects its leaves.
    pub(crate) fn release_below(&mut self, node: u32, leaves: &mut Vec<(u32, Aabb<S, N>)>) {
        let mut stack = vec![node];
        while let Some(id) = stack.pop() {
            let n = self.arena[id];
            for slot in [1, 0] {
                match n.child[slot].kind() {
                    ChildKind::Node(child) => stack.push(child.0),
                    ChildKind::Leaf(item) => leaves.push((item, n.bounds[slot])),
                    ChildKind::Empty => {}
                }
            }
            self.counters.visited += 1;
            self.arena.release(id);
        }
    }
}

/// The taller of two children.
fn tall_slot(heights: [u8; 2]) -> usize {
    usize::from(heights[1] > heights[0])
}

/// The height of the lowest tree over subtrees of these heights.
fn least_height(heights: &[u8]) -> u8 {
    let mut open = heights.to_vec();
    open.sort_unstable_by_key(|&height| core::cmp::Reverse(height));
    while let (Some(a), Some(b)) = (open.pop(), open.pop()) {
        let joint = 1 + a.max(b);
        if open.is_empty() {
            return joint;
        }
        let at = open.partition_point(|&height| height > joint);
        open.insert(at, joint);
    }
    heights[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb, Builder};

    #[test]
    fn joining_the_lowest_first_is_as_low_as_krafts_inequality_allows() {
        for heights in [vec![0u8; 9], vec![24, 0, 0, 0, 3], vec![5, 5, 5, 5], (0..30).collect()] {
            let sum: u64 = heights.iter().map(|&h| 1u64 << h).sum();
            let expected = sum.next_power_of_two().trailing_zeros() as u8;
            assert_eq!(least_height(&heights), expected, "{heights:?}");
        }
    }

    /// A chain of nested boxes, hung one beside all before, as no heuristic would.
    fn chain(count: u32) -> Bvh<i64, 3> {
        use crate::edit::insert::Site;
        let mut bvh = Bvh::new();
        for item in 0..count {
            let bounds = Aabb::new([0; 3], [i64::from(item) + 1; 3]);
            bvh.make_place(item);
            bvh.len += 1;
            if item < 2 {
                bvh.hang(Child::leaf(item), bounds, 0);
            } else {
                bvh.attach(Child::leaf(item), bounds, 0, Site::Root);
            }
        }
        bvh
    }

    #[test]
    fn a_chain_of_a_thousand_never_gets_deeper_than_the_bound() {
        let mut bvh = chain(1000);
        assert!(bvh.depth() <= MAX_DEPTH);
        assert!(bvh.take_counters().depth_repairs > 0);
        bvh.validate().expect("repairs keep every invariant");
    }

    #[test]
    fn a_repair_writes_no_more_than_a_few_paths() {
        let mut bvh = chain(MAX_DEPTH + 1);
        assert_eq!(bvh.depth(), MAX_DEPTH);
        bvh.take_writes();
        let bounds = Aabb::new([0; 3], [1 << 40; 3]);
        bvh.make_place(500);
        bvh.len += 1;
        bvh.attach(Child::leaf(500), bounds, 0, crate::edit::insert::Site::Root);
        assert_eq!(bvh.take_counters().depth_repairs, 1);
        assert!(bvh.take_writes().written.len() <= 2 * MAX_DEPTH as usize);
        bvh.validate().expect("repairs keep every invariant");
    }

    #[test]
    fn a_rebuild_below_keeps_the_leaves_and_the_rest() {
        let boxes: Vec<_> = (0..200i64).map(|i| Aabb::new([i * i, 0, 0], [i * i + 1, 1, 1])).collect();
        let mut bvh = Bvh::build(&boxes, Builder::fast()).expect("boxes are good");
        let path = bvh.deepest_path();
        bvh.rebuild_below(path[1], 12);
        bvh.validate().expect("a rebuilt subtree is valid");
        assert_eq!(bvh.len(), 200);
        assert!((0..200).all(|item| bvh.bounds_of(item) == Some(boxes[item as usize])));
    }
}
