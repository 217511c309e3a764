//! New boxes for many leaves at once: every node above is mended once.

use core::hint::select_unpredictable;

use crate::aabb::Aabb;
use crate::error::BvhError;
use crate::node::{Child, NONE, NodeId};
use crate::prefetch::prefetch;
use crate::scalar::Scalar;
use crate::tree::Bvh;

/// The place of the box of an item that gets none.
const NO_BOX: u32 = u32::MAX;

/// How far ahead memory is asked for.
const AHEAD: usize = 16;

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Gives items other boxes; leaves stay where they are. Nodes above are mended bottom up, each once, and rotated where
    /// that makes them smaller. Reads and writes the nodes above the given leaves and no others, unless half of all leaves
    /// or more are given at once and the tree was not edited since it was built: then one sweep over the arena mends all
    /// nodes, all count as written, and rotations are left to [`Self::optimize`]. Of two boxes for one item the later holds.
    ///
    /// # Errors
    /// [`BvhError::BadBounds`], [`BvhError::UnknownItem`]; the tree is then unchanged.
    pub fn refit(&mut self, boxes: &[(u32, Aabb<S, N>)]) -> Result<(), BvhError> {
        // Whether the boxes are those of the items 0, 1, 2, ....
        let mut by_item = true;
        for (at, (item, bounds)) in (0..).zip(boxes) {
            bounds.check(*item)?;
            if !self.contains(*item) {
                return Err(BvhError::UnknownItem { item: *item });
            }
            by_item &= *item == at;
        }
        if !self.parents_first || self.len < 2 || boxes.len() < self.len / 2 {
            self.refit_paths(boxes);
        } else if by_item {
            self.sweep(boxes, |item| item);
        } else {
            let mut given = vec![NO_BOX; self.places.len()];
            for (at, &(item, _)) in (0..).zip(boxes) {
                given[item as usize] = at;
            }
            self.sweep(boxes, |item| given.get(item as usize).copied().unwrap_or(NO_BOX));
        }
        Ok(())
    }

    /// Children come after their parents, so from the back every child is mended before its parent reads it. New boxes are
    /// fetched when the sweep comes to their leaves; `given` tells where in `boxes` an item's is, if it has one.
    ///
    /// Whether a child is a leaf cannot be foreseen, so that is not branched on: a leaf's bounds are the union of its box
    /// with itself, a node's that of its children's.
    fn sweep(&mut self, boxes: &[(u32, Aabb<S, N>)], given: impl Fn(u32) -> u32) {
        let nodes = self.arena.rewrite();
        for at in (0..nodes.len()).rev() {
            prefetch(&nodes[at.saturating_sub(4 * AHEAD)]);
            let ahead = nodes[at.saturating_sub(AHEAD)].child;
            for slot in 0..2 {
                let new = select_unpredictable(ahead[slot].is_node(), NO_BOX, given(ahead[slot].item_bits()));
                prefetch(&boxes[(new as usize).min(boxes.len() - 1)]);
            }
            for slot in 0..2 {
                let node = &nodes[at];
                let child = node.child[slot];
                let is_node = child.is_node();
                let leaf = match boxes.get(given(child.item_bits()) as usize) {
                    Some((_, bounds)) => bounds,
                    None => &node.bounds[slot],
                };
                let below = &nodes[select_unpredictable(is_node, child.0 as usize, at)];
                let first = select_unpredictable(is_node, &below.bounds[0], leaf);
                let second = select_unpredictable(is_node, &below.bounds[1], leaf);
                nodes[at].bounds[slot] = first.union(second);
            }
        }
        let count = nodes.len() as u64;
        self.counters.visited += count;
        self.counters.written += 2 * count;
    }

    /// Asks for the node that holds a leaf further on.
    #[inline(always)]
    fn prefetch_ahead(&self, boxes: &[(u32, Aabb<S, N>)], i: usize) {
        if let Some((item, _)) = boxes.get(i + AHEAD) {
            self.arena.prefetch(Child(self.places[*item as usize] >> 1));
        }
    }

    /// Asks for a node further on, and, half as far on, for what is above that.
    #[inline(always)]
    fn prefetch_list_ahead(&self, list: &[u32], i: usize) {
        if let Some(&node) = list.get(i + AHEAD) {
            self.arena.prefetch(Child(node));
        }
        if let Some(&node) = list.get(i + AHEAD / 2) {
            self.arena.prefetch(Child(self.arena[node].parent));
        }
    }

    /// The node whose child changed, or `None` if the item has this box already.
    fn set_leaf_bounds(&mut self, item: u32, bounds: Aabb<S, N>) -> Option<u32> {
        let (node, slot) = self.place(item)?;
        if self.arena[node].bounds[slot] == bounds {
            return None;
        }
        self.arena.write(node).bounds[slot] = bounds;
        self.counters.written += 1;
        Some(node)
    }

    /// Nodes wait in one list per height, and lower lists are done first. Where rotations lifted a child above its parent's
    /// list, the parent waits a second time.
    fn refit_paths(&mut self, boxes: &[(u32, Aabb<S, N>)]) {
        let mut waiting: Vec<Vec<u32>> = Vec::new();
        let mut queued = vec![0u64; if boxes.len() > 64 { self.arena.nodes().len().div_ceil(64) } else { 0 }];
        for (i, &(item, bounds)) in boxes.iter().enumerate() {
            self.prefetch_ahead(boxes, i);
            if let Some(node) = self.set_leaf_bounds(item, bounds) {
                let height = usize::from(self.arena[node].own_height());
                enqueue(&mut waiting, &mut queued, height, node);
            }
        }
        let mut height = 0;
        while height < waiting.len() {
            // A list does not grow while it is worked on: parents go to higher ones.
            let list = core::mem::take(&mut waiting[height]);
            for (i, &node) in list.iter().enumerate() {
                self.prefetch_list_ahead(&list, i);
                if let Some(word) = queued.get_mut(node as usize / 64) {
                    *word &= !(1u64 << (node % 64));
                }
                if let Some(parent) = self.mend(node) {
                    let above = usize::from(self.arena[parent].own_height()).max(height + 1);
                    enqueue(&mut waiting, &mut queued, above, parent);
                }
            }
            height += 1;
        }
        self.limit_depth();
    }

    /// Rotates a node and carries its bounds and height to its parent, which is returned if they changed.
    fn mend(&mut self, node: u32) -> Option<u32> {
        self.counters.visited += 1;
        self.rotate(node);
        let n = &self.arena[node];
        let (parent, bounds, height) = (n.parent, n.union(), n.own_height());
        if parent == NONE {
            return None;
        }
        let above = &self.arena[parent];
        let slot = above.slot_of(Child::node(NodeId(node)));
        if above.bounds[slot] != bounds {
            self.arena.write(parent).bounds[slot] = bounds;
            self.counters.written += 1;
        } else if above.height[slot] == height {
            return None;
        }
        self.arena.links(parent).height[slot] = height;
        Some(parent)
    }
}

/// Puts a node into the list of its height, if it is not waiting already. Without bits (few leaves) the lists are short enough to be searched.
fn enqueue(waiting: &mut Vec<Vec<u32>>, queued: &mut [u64], height: usize, node: u32) {
    if waiting.len() <= height {
        waiting.resize_with(height + 1, Vec::new);
    }
    let known = match queued.get_mut(node as usize / 64) {
        Some(word) => {
            let bit = 1u64 << (node % 64);
            let known = *word & bit != 0;
            *word |= bit;
            known
        }
        None => waiting[height].contains(&node),
    };
    if !known {
        waiting[height].push(node);
    }
}

#[cfg(test)]
mod tests {
    use crate::{Aabb, Builder, Bvh};

    const COUNT: u32 = 300;

    fn cube(at: u32) -> Aabb<i32, 3> {
        let at = at.wrapping_mul(2_654_435_761) >> 12;
        let min = [at & 63, at >> 6 & 63, at >> 12 & 63].map(|c| c as i32);
        Aabb::new(min, min.map(|c| c + 3))
    }

    fn fresh() -> Bvh<i32, 3> {
        let boxes: Vec<_> = (0..COUNT).map(cube).collect();
        Bvh::build(&boxes, Builder::fast()).expect("good boxes")
    }

    /// Every listed item has its last box, every other the one it had, and all nodes are as tight as these demand.
    fn refits(boxes: &[(u32, Aabb<i32, 3>)]) {
        let mut bvh = fresh();
        let before: Vec<_> = bvh.nodes().iter().map(|node| node.child).collect();
        bvh.refit(boxes).expect("items of the tree");
        bvh.validate().expect("every invariant holds");
        for item in 0..COUNT {
            let given = boxes.iter().rev().find(|(of, _)| *of == item).map_or(cube(item), |&(_, bounds)| bounds);
            assert_eq!(bvh.bounds_of(item), Some(given));
        }
        let after: Vec<_> = bvh.nodes().iter().map(|node| node.child).collect();
        assert_eq!(after, before, "a sweep does not rotate");
    }

    #[test]
    fn a_sweep_takes_the_boxes_of_all_items_in_any_order() {
        let mut boxes: Vec<_> = (0..COUNT).map(|item| (item, cube(item + 1000))).collect();
        refits(&boxes);
        boxes.reverse();
        refits(&boxes);
    }

    #[test]
    fn a_sweep_leaves_items_without_a_new_box_as_they_are() {
        let boxes: Vec<_> = (0..COUNT).map(|item| (item, cube(item + 1000))).collect();
        refits(&boxes[..200]);
        refits(&boxes[100..]);
    }

    #[test]
    fn of_two_boxes_for_one_item_a_sweep_takes_the_later() {
        let mut boxes: Vec<_> = (0..COUNT).map(|item| (item, cube(item + 1000))).collect();
        boxes.extend((0..50).map(|item| (item, cube(item + 2000))));
        refits(&boxes);
    }
}
