//! [`EditQueue`]: where the resident set is behind the world.

use super::boxes::{BoxSet, Inserted, Waiting};
use orthant_world::{Aabb4, BlockId, Point4};
use std::collections::BTreeSet;

/// Ticks that a box may wait before it takes turns with the nearest: ten seconds at 60 frames a second.
pub const PATIENCE: u64 = 600;

/// Where the resident set is behind the world: disjoint boxes whose content changed, boxes whose content is right in more pieces than
/// it needs, and materials.
///
/// The nearest box is next. A box that has waited longer than the patience takes turns with it, oldest first, so that every box is
/// reached whatever goes on near the camera: with `m` boxes before it in age, at most `2 m + 1` operations after its patience.
#[derive(Clone, Debug)]
pub struct EditQueue {
    dirty: BoxSet,
    untidy: BoxSet,
    palette: BTreeSet<BlockId>,
    patience: u64,
    is_turn_of_age: bool,
}

/// What is to be done next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Next {
    /// The box's content changed.
    Dirty(Waiting),
    /// The box's content is right, in too many pieces.
    Untidy(Waiting),
}

impl EditQueue {
    /// A queue in which boxes wait for so many ticks before age counts.
    pub fn new(patience: u64) -> Self {
        Self {
            dirty: BoxSet::default(),
            untidy: BoxSet::default(),
            palette: BTreeSet::new(),
            patience,
            is_turn_of_age: false,
        }
    }

    /// Notes that the content of a box changed.
    pub fn push(&mut self, bounds: Aabb4, tick: u64) -> Inserted {
        self.dirty.insert(bounds, tick)
    }

    /// Notes that a box is in more pieces than it needs.
    pub fn push_untidy(&mut self, bounds: Aabb4, tick: u64) {
        self.untidy.insert(bounds, tick);
    }

    /// Notes materials that changed.
    pub fn push_palette(&mut self, ids: &[BlockId]) {
        self.palette.extend(ids);
    }

    /// Takes at most so many materials out.
    pub fn take_palette(&mut self, most: usize) -> Vec<BlockId> {
        let ids: Vec<BlockId> = self.palette.iter().copied().take(most).collect();
        for id in &ids {
            self.palette.remove(id);
        }
        ids
    }

    /// Boxes whose content changed.
    pub fn dirty(&self) -> &BoxSet {
        &self.dirty
    }

    /// Boxes whose content is right, in too many pieces.
    pub fn untidy(&self) -> &BoxSet {
        &self.untidy
    }

    /// Materials that changed.
    pub fn palette_len(&self) -> usize {
        self.palette.len()
    }

    /// Whether the resident set shows what the world is.
    pub fn is_empty(&self) -> bool {
        self.dirty.is_empty() && self.palette.is_empty()
    }

    /// Whether nothing is left to do, tidying included.
    pub fn is_idle(&self) -> bool {
        self.is_empty() && self.untidy.is_empty()
    }

    /// Takes out what is to be done next: what changed first, near the camera first.
    pub fn next(&mut self, camera: Point4, tick: u64) -> Option<Next> {
        let is_overdue = self.dirty.oldest().is_some_and(|oldest| oldest.since.saturating_add(self.patience) <= tick);
        self.is_turn_of_age = is_overdue && !self.is_turn_of_age;
        let dirty = if self.is_turn_of_age { self.dirty.take_oldest() } else { self.dirty.take_nearest(camera) };
        dirty.map(Next::Dirty).or_else(|| self.untidy.take_oldest().map(Next::Untidy))
    }

    /// Notes that the resident set equals the world in a box, and says how many waiting boxes that settles.
    pub fn synced(&mut self, done: &Aabb4) -> u32 {
        self.dirty.remove_within(done)
    }

    /// Notes that the resident set has the world's own pieces in a box.
    pub fn tidied(&mut self, done: &Aabb4) {
        self.untidy.remove_within(done);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn voxel(x: i32) -> Aabb4 {
        Aabb4::from_ints([x, 0, 0, 0], [x + 1, 1, 1, 1]).unwrap()
    }

    fn x_of(next: Option<Next>) -> i64 {
        match next {
            Some(Next::Dirty(waiting) | Next::Untidy(waiting)) => waiting.bounds.min_raw()[0] >> 16,
            None => panic!("nothing is next"),
        }
    }

    #[test]
    fn the_queue_serves_what_changed_before_it_tidies() {
        let mut queue = EditQueue::new(PATIENCE);
        queue.push_untidy(voxel(0), 0);
        queue.push(voxel(9), 1);
        let camera = Point4::from_ints([0; 4]);
        assert_eq!(queue.next(camera, 1), Some(Next::Dirty(Waiting { bounds: voxel(9), since: 1 })));
        assert!(queue.is_empty() && !queue.is_idle());
        assert_eq!(queue.next(camera, 1), Some(Next::Untidy(Waiting { bounds: voxel(0), since: 0 })));
        assert!(queue.is_idle());
    }

    #[test]
    fn a_far_box_is_reached_while_near_ones_keep_coming() {
        let mut queue = EditQueue::new(20);
        queue.push(voxel(1000), 0);
        // Two new boxes near the camera for each operation: the nearest alone would never come to an end.
        let mut near = 0;
        for tick in 1.. {
            assert!(tick < 25, "the far box starves");
            for _ in 0..2 {
                near += 1;
                queue.push(voxel(near % 900), tick);
            }
            if x_of(queue.next(Point4::from_ints([0; 4]), tick)) == 1000 {
                break;
            }
        }
    }

    #[test]
    fn the_overdue_take_turns_with_the_nearest() {
        let mut queue = EditQueue::new(5);
        for x in 1..=6 {
            queue.push(voxel(10 * x), x as u64);
        }
        let camera = Point4::from_ints([60, 0, 0, 0]);
        let order: Vec<i64> = (0..6).map(|_| x_of(queue.next(camera, 100))).collect();
        assert_eq!(order, [10, 60, 20, 50, 30, 40]);
    }
}
