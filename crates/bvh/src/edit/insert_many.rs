//! Many items at once: those that lie together go in together, as one subtree.

use crate::aabb::Aabb;
use crate::build::draft::Draft;
use crate::build::{morton, ploc};
use crate::error::BvhError;
use crate::node::{Child, ChildKind, NONE, NodeId};
use crate::scalar::{Real, Scalar};
use crate::tree::{ABSENT, Bvh};

/// Items from which on a tree of their own is built first.
const MANY: usize = 8;
/// A group goes in as it is if its surface is at most this many times that of its two halves. Halves that touch have more than
/// the whole; far more than both has only a group of two that lie apart, between which other items may be.
const COMPACT: f64 = 2.0;

impl<S: Scalar, const N: usize> Bvh<S, N> {
    /// Inserts items. They are built into a tree of their own, whose compact subtrees then go to the best place as wholes: of
    /// this tree O(depth) nodes are touched for every such group, however large it is.
    ///
    /// # Errors
    /// As [`Self::insert`], also for an item that is given twice; the tree is then unchanged.
    pub fn insert_many(&mut self, items: &[(u32, Aabb<S, N>)]) -> Result<(), BvhError> {
        self.check_new_items(items)?;
        if items.len() < MANY {
            for &(item, bounds) in items {
                self.len += 1;
                self.hang(Child::leaf(item), bounds, 0);
            }
            return Ok(());
        }
        let leaves: Vec<_> = morton::order(items.len(), |i| items[i].1).map(|i| items[i]).collect();
        let mut draft = Draft::default();
        let top = ploc::build(&mut draft, &leaves, 6, 2);
        let joined = join_bounds(&draft, top, &leaves);

        let mut open = vec![top];
        while let Some(part) = open.pop() {
            match part.kind() {
                ChildKind::Leaf(at) => {
                    let (item, bounds) = leaves[at as usize];
                    self.len += 1;
                    self.hang(Child::leaf(item), bounds, 0);
                }
                ChildKind::Node(join) => {
                    let halves = draft.joins[join.index()];
                    let [a, b] = halves.map(|child| draft_bounds(child, &joined, &leaves).half_area().to_f64());
                    if joined[join.index()].half_area().to_f64() > COMPACT * (a + b) {
                        open.extend([halves[1], halves[0]]);
                        continue;
                    }
                    let id = self.raise(&draft, join.0, NONE, &leaves);
                    self.parents_first = false;
                    self.len += draft.leaves_below(part);
                    let node = &self.arena[id];
                    let (bounds, height) = (node.union(), node.own_height());
                    self.hang(Child::node(NodeId(id)), bounds, height);
                }
                ChildKind::Empty => unreachable!("builders join what is there"),
            }
        }
        Ok(())
    }

    /// Refuses what [`Self::insert`] would, then makes room in the item map.
    fn check_new_items(&mut self, items: &[(u32, Aabb<S, N>)]) -> Result<(), BvhError> {
        let mut highest = 0;
        for &(item, bounds) in items {
            bounds.check(item)?;
            self.check_new_item(item)?;
            highest = highest.max(item);
        }
        if items.is_empty() {
            return Ok(());
        }
        self.make_place(highest);
        // Any place but ABSENT tells that the item came before; the true one follows with its leaf.
        for (i, &(item, _)) in items.iter().enumerate() {
            if std::mem::replace(&mut self.places[item as usize], 0) != ABSENT {
                for &(item, _) in &items[..i] {
                    self.places[item as usize] = ABSENT;
                }
                return Err(BvhError::DuplicateItem { item });
            }
        }
        Ok(())
    }
}

/// The bounds of every join below `top`.
fn join_bounds<S: Scalar, const N: usize>(draft: &Draft, top: Child, leaves: &[(u32, Aabb<S, N>)]) -> Vec<Aabb<S, N>> {
    let mut order = Vec::with_capacity(draft.joins.len());
    let mut open = vec![top];
    while let Some(part) = open.pop() {
        if let ChildKind::Node(join) = part.kind() {
            order.push(join.index());
            open.extend(draft.joins[join.index()]);
        }
    }
    let mut joined = vec![Aabb::EMPTY; draft.joins.len()];
    for &join in order.iter().rev() {
        let [a, b] = draft.joins[join].map(|child| draft_bounds(child, &joined, leaves));
        joined[join] = a.union(&b);
    }
    joined
}

/// The bounds of a part of a draft.
fn draft_bounds<S: Scalar, const N: usize>(
    part: Child,
    joined: &[Aabb<S, N>],
    leaves: &[(u32, Aabb<S, N>)],
) -> Aabb<S, N> {
    match part.kind() {
        ChildKind::Node(join) => joined[join.index()],
        ChildKind::Leaf(at) => leaves[at as usize].1,
        ChildKind::Empty => Aabb::EMPTY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Builder;

    fn row(first: u32, count: u32, at: [f32; 3]) -> Vec<(u32, Aabb<f32, 3>)> {
        let cube = |i: u32| {
            let min = [at[0] + (i % 10) as f32 * 1.5, at[1] + (i / 10) as f32 * 1.5, at[2]];
            Aabb::new(min, min.map(|c| c + 1.0))
        };
        (0..count).map(|i| (first + i, cube(i))).collect()
    }

    #[test]
    fn a_compact_group_touches_no_more_of_the_tree_than_one_item_does() {
        let mut bvh = Bvh::build_items(&row(0, 10_000, [0.0; 3]), Builder::fast()).expect("good boxes");
        bvh.take_writes();
        let before: Vec<_> = bvh.nodes().to_vec();
        bvh.insert_many(&row(10_000, 1000, [0.0, 0.0, 5.0])).expect("new items");
        let old = bvh.take_writes().written.iter().filter(|id| id.index() < before.len()).count();
        assert!(old < 60, "{old}");
        assert_eq!(bvh.len(), 11_000);
        bvh.validate().expect("every invariant holds");
    }

    #[test]
    fn groups_that_lie_apart_go_in_apart() {
        let mut bvh = Bvh::build_items(&row(0, 1000, [0.0; 3]), Builder::fast()).expect("good boxes");
        let mut two = row(1000, 100, [-100.0, 0.0, 0.0]);
        two.extend(row(1100, 100, [100.0, 0.0, 0.0]));
        let cost = |bvh: &Bvh<f32, 3>| {
            let mut rebuilt = bvh.clone();
            rebuilt.rebuild(Builder::best());
            bvh.sah_cost() / rebuilt.sah_cost()
        };
        bvh.insert_many(&two).expect("new items");
        bvh.validate().expect("every invariant holds");
        assert!(cost(&bvh) < 1.3, "{}", cost(&bvh));
    }

    #[test]
    fn boxes_that_nothing_tells_apart_go_in_too() {
        let mut bvh = Bvh::<f32, 3>::new();
        for first in [0, 50] {
            let same: Vec<_> = (first..first + 50).map(|i| (i, Aabb::new([1.0; 3], [2.0; 3]))).collect();
            bvh.insert_many(&same).expect("new items");
            bvh.validate().expect("every invariant holds");
        }
        assert_eq!(bvh.items().count(), 100);
    }

    #[test]
    fn a_refused_batch_changes_nothing() {
        let mut bvh = Bvh::build_items(&row(0, 20, [0.0; 3]), Builder::fast()).expect("good boxes");
        bvh.take_writes();
        let mut twice = row(20, 10, [0.0; 3]);
        twice.push(twice[3]);
        assert_eq!(bvh.insert_many(&twice), Err(BvhError::DuplicateItem { item: 23 }));
        assert_eq!(bvh.insert_many(&row(15, 10, [0.0; 3])), Err(BvhError::DuplicateItem { item: 15 }));
        assert!(!bvh.contains(22) && bvh.take_writes().written.is_empty());
        bvh.insert_many(&row(20, 10, [0.0; 3])).expect("they are new still");
        bvh.validate().expect("every invariant holds");
    }
}
