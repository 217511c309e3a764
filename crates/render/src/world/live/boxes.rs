//! [`BoxSet`]: disjoint boxes that cover exactly what was put in.

use orthant_bvh::{Aabb, Bvh, ChildKind, NodeId, NodeWrites};
use orthant_world::{Aabb4, Point4};
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};
use std::ops::ControlFlow;

/// A box that waits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waiting {
    /// The box.
    pub bounds: Aabb4,
    /// The tick in which the oldest part of it was put in.
    pub since: u64,
}

/// What putting a box in did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inserted {
    /// Boxes that are new in the set.
    pub added: u32,
    /// Boxes that were in the set and are a part of the new one.
    pub replaced: u32,
    /// Whether the box was waiting already, as a whole.
    pub covered: bool,
}

/// Disjoint boxes, with the tick since which each of them waits. Their union is exactly the union of what was put in, less what was
/// taken out: no hulls are formed, so the set never covers what nobody asked for.
///
/// The boxes are items of a [`Bvh`]: putting one in, taking the nearest or the oldest out costs O(log n).
#[derive(Clone, Debug, Default)]
pub struct BoxSet {
    slots: Vec<Option<Waiting>>,
    free: Vec<u32>,
    index: Bvh<i64, 4>,
    by_age: BTreeSet<(u64, u32)>,
    /// Nobody follows the index; its log is emptied into this.
    log: NodeWrites,
}

impl BoxSet {
    /// How many boxes wait.
    pub fn len(&self) -> usize {
        self.by_age.len()
    }

    /// Whether none does.
    pub fn is_empty(&self) -> bool {
        self.by_age.is_empty()
    }

    /// The boxes, oldest first.
    pub fn iter(&self) -> impl Iterator<Item = Waiting> + '_ {
        self.by_age.iter().filter_map(|&(_, slot)| self.slots[slot as usize])
    }

    /// Puts a box in. Boxes that it contains give way to it, and it takes over the age of the oldest; what other boxes cover of it
    /// is cut off.
    pub fn insert(&mut self, bounds: Aabb4, since: u64) -> Inserted {
        let found = self.overlapping(&bounds);
        let mut report = Inserted::default();
        let (mut cutting, mut since) = (Vec::new(), since);
        for (slot, waiting) in found {
            if waiting.bounds.contains(&bounds) {
                return Inserted { covered: true, ..Inserted::default() };
            }
            if bounds.contains(&waiting.bounds) {
                self.remove_slot(slot);
                since = since.min(waiting.since);
                report.replaced += 1;
            } else {
                cutting.push(waiting.bounds);
            }
        }
        let mut pieces = vec![bounds];
        for other in &cutting {
            pieces = pieces.iter().flat_map(|piece| piece.subtract(other).to_vec()).collect();
        }
        report.covered = pieces.is_empty();
        for piece in pieces {
            self.push(Waiting { bounds: piece, since });
            report.added += 1;
        }
        report
    }

    /// Takes out the boxes that lie in `done`, and says how many.
    pub fn remove_within(&mut self, done: &Aabb4) -> u32 {
        let within: Vec<u32> = self
            .overlapping(done)
            .into_iter()
            .filter(|(_, w)| done.contains(&w.bounds))
            .map(|(slot, _)| slot)
            .collect();
        for &slot in &within {
            self.remove_slot(slot);
        }
        within.len() as u32
    }

    /// Whether any box shares points with `bounds`.
    pub fn overlaps(&self, bounds: &Aabb4) -> bool {
        self.index.overlap(&closed(bounds), |_, _| ControlFlow::Break(())).is_break()
    }

    /// The box that waits longest.
    pub fn oldest(&self) -> Option<Waiting> {
        self.iter().next()
    }

    /// Takes out the box that waits longest.
    pub fn take_oldest(&mut self) -> Option<Waiting> {
        let &(_, slot) = self.by_age.first()?;
        self.remove_slot(slot)
    }

    /// Takes out the box that is nearest to a point; of several, the one that waits longest.
    pub fn take_nearest(&mut self, to: Point4) -> Option<Waiting> {
        let slot = self.nearest(to)?;
        self.remove_slot(slot)
    }

    /// Forgets all boxes.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Best-first search: what is next in the heap is at least as near as all that is in it.
    fn nearest(&self, to: Point4) -> Option<u32> {
        const NODE: u64 = 0;
        let mut heap = BinaryHeap::new();
        heap.push(Reverse((0_u64, NODE, self.index.root()?.0)));
        while let Some(Reverse((_, age, id))) = heap.pop() {
            if age != NODE {
                return Some(id);
            }
            let node = &self.index.nodes()[NodeId(id).index()];
            for (child, bounds) in node.child.iter().zip(&node.bounds) {
                // Bits of floats that are not negative are in the order of the floats.
                let key = || distance_squared(bounds.min, bounds.max, to).to_bits();
                match child.kind() {
                    ChildKind::Empty => {}
                    ChildKind::Node(node) => heap.push(Reverse((key(), NODE, node.0))),
                    ChildKind::Leaf(slot) => {
                        let since = self.slots[slot as usize].map_or(0, |waiting| waiting.since);
                        heap.push(Reverse((key(), since.saturating_add(1), slot)));
                    }
                }
            }
        }
        None
    }

    fn overlapping(&self, bounds: &Aabb4) -> Vec<(u32, Waiting)> {
        let mut found = Vec::new();
        let _all = self.index.overlap::<()>(&closed(bounds), |slot, _| {
            found.extend(self.slots[slot as usize].map(|waiting| (slot, waiting)));
            ControlFlow::Continue(())
        });
        found
    }

    fn push(&mut self, waiting: Waiting) {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.slots.push(None);
            self.slots.len() as u32 - 1
        });
        self.slots[slot as usize] = Some(waiting);
        self.by_age.insert((waiting.since, slot));
        self.index.insert(slot, closed(&waiting.bounds)).expect("a box of the space, under a slot that is free");
        self.index.take_writes_into(&mut self.log);
    }

    fn remove_slot(&mut self, slot: u32) -> Option<Waiting> {
        let waiting = self.slots[slot as usize].take()?;
        self.by_age.remove(&(waiting.since, slot));
        self.index.remove(slot).expect("every box is in the index");
        self.index.take_writes_into(&mut self.log);
        self.free.push(slot);
        Some(waiting)
    }
}

/// The box as the index takes it: closed, so that boxes that only touch do not overlap.
fn closed(bounds: &Aabb4) -> Aabb<i64, 4> {
    Aabb::new(bounds.min_raw(), bounds.max_raw().map(|max| max - 1))
}

/// The squared distance of a point from a closed box, in raw steps.
fn distance_squared(min: [i64; 4], max: [i64; 4], to: Point4) -> f64 {
    let to = to.raw();
    let along = |a: usize| min[a].saturating_sub(to[a]).max(to[a].saturating_sub(max[a])).max(0) as f64;
    (0..4).map(|a| along(a) * along(a)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ints(min: [i32; 4], max: [i32; 4]) -> Aabb4 {
        Aabb4::from_ints(min, max).unwrap()
    }

    fn voxel(x: i32) -> Aabb4 {
        ints([x, 0, 0, 0], [x + 1, 1, 1, 1])
    }

    #[test]
    fn a_box_that_waits_already_is_not_put_in_again() {
        let mut set = BoxSet::default();
        set.insert(ints([0; 4], [8; 4]), 1);
        assert!(set.insert(voxel(3), 2).covered);
        assert_eq!((set.len(), set.oldest().unwrap().since), (1, 1));
    }

    #[test]
    fn a_box_replaces_those_that_it_contains_and_takes_over_their_age() {
        let mut set = BoxSet::default();
        set.insert(voxel(1), 3);
        set.insert(voxel(5), 2);
        let report = set.insert(ints([0; 4], [8; 4]), 9);
        assert_eq!(report, Inserted { added: 1, replaced: 2, covered: false });
        assert_eq!(set.iter().collect::<Vec<_>>(), [Waiting { bounds: ints([0; 4], [8; 4]), since: 2 }]);
    }

    #[test]
    fn a_box_that_others_cover_together_is_not_put_in() {
        let mut set = BoxSet::default();
        set.insert(ints([0; 4], [4, 8, 8, 8]), 1);
        set.insert(ints([4, 0, 0, 0], [8; 4]), 1);
        assert!(set.insert(ints([2; 4], [6; 4]), 2).covered);
        assert_eq!(set.len(), 2);
    }

    #[test]
    fn two_boxes_that_meet_in_a_corner_never_become_their_hull() {
        let mut set = BoxSet::default();
        set.insert(ints([0; 4], [4; 4]), 1);
        set.insert(ints([3; 4], [7; 4]), 1);
        assert!(!set.overlaps(&ints([0, 5, 5, 5], [1, 6, 6, 6])));
        assert!(set.overlaps(&voxel(0)) && set.overlaps(&ints([6; 4], [7; 4])));
    }

    #[test]
    fn the_nearest_is_taken_first_and_of_equals_the_oldest() {
        let mut set = BoxSet::default();
        for (x, since) in [(50, 1), (-20, 2), (3, 3), (-4, 1)] {
            set.insert(voxel(x), since);
        }
        let mut taken = Vec::new();
        while let Some(waiting) = set.take_nearest(Point4::from_ints([0; 4])) {
            taken.push(waiting.bounds.min_raw()[0] >> 16);
        }
        // The boxes are half-open: the nearest point of -4..-3 is a step farther than that of 3..4.
        assert_eq!(taken, [3, -4, -20, 50]);
        set.insert(voxel(7), 2);
        set.insert(ints([7, 1, 0, 0], [8, 2, 1, 1]), 1);
        assert_eq!(set.take_nearest(Point4::from_raw([7 << 16, (1 << 16) - 1, 0, 0])).unwrap().since, 2);
        assert!(set.take_nearest(Point4::from_ints([i32::MAX; 4])).is_some() && set.is_empty());
    }

    fn any_box() -> impl Strategy<Value = Aabb4> {
        prop::array::uniform4((0i32..6, 1i32..5))
            .prop_map(|axes| ints(axes.map(|(min, _)| min), axes.map(|(min, extent)| min + extent)))
    }

    proptest! {
        #[test]
        fn the_set_covers_exactly_what_was_put_in_less_what_was_taken_out(
            boxes in prop::collection::vec((any_box(), 0u8..6), 1..40),
        ) {
            let mut set = BoxSet::default();
            let mut model = std::collections::HashSet::new();
            let cells = |b: &Aabb4| {
                let (min, max) = (b.min_raw().map(|c| c >> 16), b.max_raw().map(|c| c >> 16));
                let mut cells = Vec::new();
                for w in min[3]..max[3] { for z in min[2]..max[2] { for y in min[1]..max[1] { for x in min[0]..max[0] {
                    cells.push([x, y, z, w]);
                }}}}
                cells
            };
            for (tick, (bounds, action)) in boxes.iter().enumerate() {
                match action {
                    0 => if let Some(taken) = set.take_nearest(bounds.min()) {
                        cells(&taken.bounds).iter().for_each(|c| { model.remove(c); });
                    },
                    1 => {
                        let before: Vec<_> = set.iter().collect();
                        set.remove_within(bounds);
                        for gone in before.iter().filter(|w| bounds.contains(&w.bounds)) {
                            cells(&gone.bounds).iter().for_each(|c| { model.remove(c); });
                        }
                    }
                    _ => {
                        set.insert(*bounds, tick as u64);
                        model.extend(cells(bounds));
                    }
                }
                let mut covered: Vec<_> = set.iter().flat_map(|w| cells(&w.bounds)).collect();
                let count = covered.len();
                covered.sort_unstable();
                covered.dedup();
                prop_assert_eq!(covered.len(), count, "boxes overlap");
                let mut expected: Vec<_> = model.iter().copied().collect();
                expected.sort_unstable();
                prop_assert_eq!(covered, expected);
            }
        }
    }
}
