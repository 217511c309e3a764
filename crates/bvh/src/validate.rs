//! A walk over the whole tree that checks every invariant.

use crate::error::ValidateError;
use crate::node::{Child, ChildKind, NONE};
use crate::scalar::Scalar;
use crate::tree::{ABSENT, Bvh, MAX_DEPTH};

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Checks every invariant: links both ways, bounds that are exactly the union of what lies below, heights, the depth
    /// bound, the item map, the counts, and a free list that together with the tree is the whole arena, each node once.
    ///
    /// # Errors
    /// The first invariant that does not hold, and the node where.
    pub fn validate(&self) -> Result<(), ValidateError> {
        let mut seen = vec![false; self.arena.nodes().len()];
        for &id in self.arena.free_list() {
            let wrong = self.arena.is_live(id) || seen.get(id as usize).is_none_or(|&twice| twice);
            if wrong {
                return Err(ValidateError::FreeListWrong { node: id });
            }
            seen[id as usize] = true;
        }

        let mut leaves = 0;
        let mut stack = Vec::new();
        if self.root != NONE {
            if !self.arena.is_live(self.root) {
                return Err(ValidateError::DanglingChild { node: NONE, slot: 0, child: self.root });
            }
            stack.push((self.root, NONE, 1));
        }
        while let Some((id, parent, depth)) = stack.pop() {
            if core::mem::replace(&mut seen[id as usize], true) {
                return Err(ValidateError::ReachedTwice { node: id });
            }
            let node = &self.arena[id];
            if node.parent != parent {
                return Err(ValidateError::ParentWrong { node: id, stored: node.parent, actual: parent });
            }
            if depth > MAX_DEPTH {
                return Err(ValidateError::TooDeep { node: id });
            }
            for slot in 0..2 {
                match node.child[slot].kind() {
                    ChildKind::Node(child) => {
                        self.validate_inner_child(id, slot, child.0)?;
                        stack.push((child.0, id, depth + 1));
                    }
                    ChildKind::Leaf(item) => {
                        leaves += 1;
                        self.validate_leaf(id, slot, item)?;
                    }
                    ChildKind::Empty if id == self.root && slot == 1 && node.height[1] == 0 && self.len == 1 => {}
                    ChildKind::Empty => return Err(ValidateError::EmptyChild { node: id, slot }),
                }
            }
        }

        if let Some(node) = seen.iter().position(|&reached| !reached) {
            return Err(ValidateError::Unreachable { node: node as u32 });
        }
        let mapped = self.places.iter().filter(|&&place| place != ABSENT).count();
        if mapped != leaves || self.len != leaves {
            return Err(ValidateError::CountWrong { counted: self.len, mapped, leaves });
        }
        Ok(())
    }

    fn validate_inner_child(&self, node: u32, slot: usize, child: u32) -> Result<(), ValidateError> {
        if !self.arena.is_live(child) {
            return Err(ValidateError::DanglingChild { node, slot, child });
        }
        let (above, below) = (&self.arena[node], &self.arena[child]);
        if below.child[1] == Child::EMPTY {
            return Err(ValidateError::EmptyChild { node: child, slot: 1 });
        }
        if above.bounds[slot] != below.union() {
            return Err(ValidateError::BoundsNotExact { node, slot });
        }
        let (stored, actual) = (u32::from(above.height[slot]), u32::from(below.own_height()));
        if stored != actual {
            return Err(ValidateError::HeightWrong { node, slot, stored, actual });
        }
        Ok(())
    }

    fn validate_leaf(&self, node: u32, slot: usize, item: u32) -> Result<(), ValidateError> {
        if self.place(item) != Some((node, slot)) {
            return Err(ValidateError::ItemMapWrong { node, slot, item });
        }
        let holder = &self.arena[node];
        if let Some(axis) = holder.bounds[slot].bad_axis() {
            return Err(ValidateError::BadLeafBounds { node, slot, axis });
        }
        if holder.height[slot] != 0 {
            return Err(ValidateError::HeightWrong { node, slot, stored: u32::from(holder.height[slot]), actual: 0 });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb, Builder};

    fn tree() -> Bvh<i32, 3> {
        let boxes: Vec<_> = (0..8).map(|i| Aabb::new([i * 3, 0, 0], [i * 3 + 1, 1, 1])).collect();
        let bvh = Bvh::build(&boxes, Builder::fast()).expect("boxes are good");
        bvh.validate().expect("a fresh tree is valid");
        bvh
    }

    /// A node that has an inner child, and the slot of that child.
    fn inner_child(bvh: &Bvh<i32, 3>) -> (u32, usize, u32) {
        let root = &bvh.arena[bvh.root];
        let slot = usize::from(!root.child[0].is_node());
        (bvh.root, slot, root.child[slot].0)
    }

    #[test]
    fn a_broken_parent_link_is_named() {
        let mut bvh = tree();
        let (_, _, child) = inner_child(&bvh);
        bvh.arena.links(child).parent = child;
        let actual = bvh.root;
        assert_eq!(bvh.validate(), Err(ValidateError::ParentWrong { node: child, stored: child, actual }));
    }

    #[test]
    fn bounds_that_are_only_conservative_are_named() {
        let mut bvh = tree();
        let (node, slot, _) = inner_child(&bvh);
        bvh.arena.links(node).bounds[slot].max[1] += 1;
        assert_eq!(bvh.validate(), Err(ValidateError::BoundsNotExact { node, slot }));
    }

    #[test]
    fn a_wrong_height_is_named() {
        let mut bvh = tree();
        let (node, slot, _) = inner_child(&bvh);
        bvh.arena.links(node).height[slot] += 1;
        assert!(matches!(bvh.validate(), Err(ValidateError::HeightWrong { node: n, .. }) if n == node));
    }

    #[test]
    fn a_wrong_item_map_is_named() {
        let mut bvh = tree();
        bvh.places.swap(2, 7);
        assert!(matches!(bvh.validate(), Err(ValidateError::ItemMapWrong { item: 2 | 7, .. })));
    }

    #[test]
    fn a_leaked_node_is_named() {
        let mut bvh = tree();
        let leaked = bvh.arena.alloc(NONE);
        assert_eq!(bvh.validate(), Err(ValidateError::Unreachable { node: leaked }));
    }

    #[test]
    fn a_live_node_on_the_free_list_is_named() {
        let mut bvh = tree();
        let (_, _, child) = inner_child(&bvh);
        let kept = bvh.arena[child];
        bvh.arena.release(child);
        *bvh.arena.links(child) = kept;
        assert_eq!(bvh.validate(), Err(ValidateError::FreeListWrong { node: child }));
    }

    #[test]
    fn a_wrong_count_is_named() {
        let mut bvh = tree();
        bvh.len += 1;
        assert_eq!(bvh.validate(), Err(ValidateError::CountWrong { counted: 9, mapped: 8, leaves: 8 }));
    }
}
