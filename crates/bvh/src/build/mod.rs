//! Builders: from a set of boxes to a tree in one go.

pub(crate) mod draft;
pub(crate) mod morton;
pub(crate) mod ploc;
pub(crate) mod sah;

use crate::aabb::Aabb;
use crate::error::BvhError;
use crate::node::{Child, ChildKind, MAX_ITEM, NONE};
use crate::scalar::Scalar;
use crate::tree::{ABSENT, Bvh, MAX_DEPTH};
use draft::{Draft, Part};

/// How a tree is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Builder {
    /// Bottom up along a Morton curve (PLOC): every pass joins the clusters that are each other's nearest among `radius`
    /// neighbours on either side.
    Ploc {
        /// Neighbours on each side that are looked at, 1 to 32.
        radius: usize,
        /// Passes, from the first on, that look at one neighbour only, whatever `radius` says: these are the longest.
        coarse_passes: usize,
    },
    /// Top down by the surface area heuristic in 16 bins on every axis.
    Sah,
    /// As [`Self::Sah`], but splits of more than `sample` boxes are found from about that many of them.
    SampledSah {
        /// Boxes that a split looks at, at most; at least 2.
        sample: usize,
    },
}

impl Builder {
    /// The least time: PLOC with one neighbour.
    pub const fn fastest() -> Self {
        Self::Ploc { radius: 1, coarse_passes: 0 }
    }

    /// Little more time than [`Self::fastest`], and a better tree.
    pub const fn fast() -> Self {
        Self::Ploc { radius: 6, coarse_passes: 2 }
    }

    /// PLOC with enough neighbours for a good tree.
    pub const fn medium() -> Self {
        Self::Ploc { radius: 14, coarse_passes: 3 }
    }

    /// The best tree: binned SAH.
    pub const fn best() -> Self {
        Self::Sah
    }

    /// Nearly the best tree over very many boxes: the upper half of the levels, where every split would look at all of them, by
    /// samples.
    pub const fn large() -> Self {
        Self::SampledSah { sample: 1024 }
    }
}

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Builds a tree over boxes; the item of each is its index.
    ///
    /// # Errors
    /// [`BvhError::BadBounds`], [`BvhError::ItemOutOfRange`].
    pub fn build(boxes: &[Aabb<S, N>], builder: Builder) -> Result<Self, BvhError> {
        let mut bvh = Self::new();
        bvh.build_from(boxes.len(), |i| (i as u32, boxes[i]), builder)?;
        Ok(bvh)
    }

    /// Builds a tree over items with their boxes.
    ///
    /// # Errors
    /// [`BvhError::BadBounds`], [`BvhError::ItemOutOfRange`], [`BvhError::DuplicateItem`].
    pub fn build_items(items: &[(u32, Aabb<S, N>)], builder: Builder) -> Result<Self, BvhError> {
        let mut bvh = Self::new();
        bvh.build_from(items.len(), |i| items[i], builder)?;
        Ok(bvh)
    }

    /// Makes the tree that another builder has found: `joins` holds the two children of every inner node, the root's first;
    /// a [`Child::node`] leads to another entry of `joins`, a [`Child::leaf`] to a place in `items`.
    ///
    /// # Errors
    /// [`BvhError::NoTree`] if the joins are not one tree over all items, each once; and as [`Self::build_items`].
    pub fn from_joins(items: &[(u32, Aabb<S, N>)], joins: &[[Child; 2]]) -> Result<Self, BvhError> {
        if items.len() < 2 {
            return if joins.is_empty() { Self::build_items(items, Builder::fastest()) } else { Err(BvhError::NoTree) };
        }
        check_joins(items.len(), joins)?;
        let mut bvh = Self::new();
        bvh.enter_items(items.len(), |i| items[i])?;
        bvh.len = items.len();
        bvh.arena.reserve(joins.len());
        bvh.root = bvh.raise(&Draft { joins: joins.to_vec() }, 0, NONE, items);
        bvh.parents_first = true;
        bvh.limit_depth();
        Ok(bvh)
    }

    /// Builds the tree anew from its own leaves. Every node is written or freed.
    pub fn rebuild(&mut self, builder: Builder) {
        let leaves = self.leaves_in_order();
        self.clear();
        let rebuilt = self.build_from(leaves.len(), |i| leaves[i], builder);
        debug_assert_eq!(rebuilt, Ok(()), "the boxes and items of a tree are good");
    }

    /// Builds into an empty tree. On an error the tree stays empty.
    fn build_from(
        &mut self,
        count: usize,
        item: impl Fn(usize) -> (u32, Aabb<S, N>),
        builder: Builder,
    ) -> Result<(), BvhError> {
        if count > MAX_ITEM as usize + 1 {
            return Err(BvhError::ItemOutOfRange { item: MAX_ITEM + 1 });
        }
        self.enter_items(count, &item).inspect_err(|_| self.places.clear())?;
        self.len = count;

        if count == 0 {
            return Ok(());
        }
        let mut draft = Draft::default();
        let leaves: Vec<_>;
        let top = match builder {
            _ if count == 1 => {
                leaves = vec![item(0)];
                Child::leaf(0)
            }
            Builder::Ploc { radius, coarse_passes } => {
                // In this order the leaves of the tree are nearly those of the list.
                leaves = morton::order(count, |i| item(i).1).map(&item).collect();
                ploc::build(&mut draft, &leaves, radius, coarse_passes)
            }
            Builder::Sah | Builder::SampledSah { .. } => {
                let sample = if let Builder::SampledSah { sample } = builder { sample } else { usize::MAX };
                leaves = (0..count).map(&item).collect();
                sah::build(&mut draft, &mut Part::leaves(&leaves), MAX_DEPTH, sample)
            }
        };
        self.arena.reserve(leaves.len());
        if let ChildKind::Node(root) = top.kind() {
            self.root = self.raise(&draft, root.0, NONE, &leaves);
        } else {
            let (item, bounds) = leaves[0];
            self.root = self.arena.alloc(NONE);
            self.set_child(self.root, 0, Child::leaf(item), bounds, 0);
        }
        self.parents_first = self.arena.free_list().is_empty();
        self.limit_depth();
        Ok(())
    }

    /// Checks every item and box, and makes the item map, as large as the highest item demands.
    fn enter_items(&mut self, count: usize, item: impl Fn(usize) -> (u32, Aabb<S, N>)) -> Result<(), BvhError> {
        let mut highest = 0;
        for i in 0..count {
            let (item, bounds) = item(i);
            bounds.check(item)?;
            highest = highest.max(item);
        }
        if highest > MAX_ITEM {
            return Err(BvhError::ItemOutOfRange { item: highest });
        }
        self.places = vec![ABSENT; if count == 0 { 0 } else { highest as usize + 1 }];
        for i in 0..count {
            let (item, _) = item(i);
            // Any place but ABSENT tells that the item came before; the true one follows with its leaf.
            if core::mem::replace(&mut self.places[item as usize], 0) != ABSENT {
                return Err(BvhError::DuplicateItem { item });
            }
        }
        Ok(())
    }
}

/// Whether joins are a tree whose root is the first, with every leaf once: n - 1 joins that lead to n leaves and n - 2 other
/// joins, each once, are one if nothing leads to the root and all of them are reached from it.
fn check_joins(items: usize, joins: &[[Child; 2]]) -> Result<(), BvhError> {
    if joins.len() + 1 != items {
        return Err(BvhError::NoTree);
    }
    let mut leaves = vec![false; items];
    let mut reached = vec![false; joins.len()];
    reached[0] = true;
    let mut open = vec![0u32];
    while let Some(join) = open.pop() {
        for child in joins[join as usize] {
            let (seen, at) = match child.kind() {
                ChildKind::Node(id) => (&mut reached, id.0),
                ChildKind::Leaf(at) => (&mut leaves, at),
                ChildKind::Empty => return Err(BvhError::NoTree),
            };
            let Some(seen) = seen.get_mut(at as usize) else { return Err(BvhError::NoTree) };
            if std::mem::replace(seen, true) {
                return Err(BvhError::NoTree);
            }
            if child.is_node() {
                open.push(at);
            }
        }
    }
    // As many leaves and joins as there are, none of them twice: all.
    if leaves.iter().all(|&leaf| leaf) { Ok(()) } else { Err(BvhError::NoTree) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::NodeId;

    fn boxes(count: u32) -> Vec<(u32, Aabb<i32, 3>)> {
        (0..count).map(|i| (10 + i, Aabb::new([i as i32, 0, 0], [i as i32 + 1, 1, 1]))).collect()
    }

    fn node(id: u32) -> Child {
        Child::node(NodeId(id))
    }

    #[test]
    fn a_tree_of_another_builder_has_its_shape_and_the_callers_items() {
        let joins = [[Child::leaf(2), node(1)], [Child::leaf(0), Child::leaf(1)]];
        let bvh = Bvh::from_joins(&boxes(3), &joins).expect("it is a tree");
        bvh.validate().expect("every invariant holds");
        let root = bvh.root().expect("it has items");
        assert_eq!(bvh.nodes()[root.index()].child[0], Child::leaf(12));
        assert_eq!(bvh.nodes()[root.index()].bounds[1], Aabb::new([0, 0, 0], [2, 1, 1]));
        assert_eq!((bvh.len(), bvh.leaf_of(11).map(|leaf| leaf.1)), (3, Some(1)));
    }

    #[test]
    fn joins_that_are_no_tree_are_refused() {
        let wrong: [&[[Child; 2]]; 5] = [
            &[[Child::leaf(0), Child::leaf(1)]],
            &[[node(1), Child::leaf(0)], [Child::leaf(1), Child::leaf(1)]],
            &[[node(1), Child::leaf(0)], [node(0), Child::leaf(1)]],
            &[[node(1), Child::leaf(0)], [Child::leaf(1), Child::leaf(3)]],
            &[[node(1), Child::EMPTY], [Child::leaf(1), Child::leaf(2)]],
        ];
        for joins in wrong {
            assert_eq!(Bvh::from_joins(&boxes(3), joins).map(|b| b.len()), Err(BvhError::NoTree));
        }
    }
}
