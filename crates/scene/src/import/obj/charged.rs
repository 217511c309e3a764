//! A vector whose memory is charged to the import's budget before it is taken.

use crate::import::budget::{Budget, OverBudget};

/// Grows by doubling; the charge is returned when it is dropped.
pub struct ChargedVec<'b, T> {
    items: Vec<T>,
    /// Items that are charged: the room asked for, which the allocator may exceed.
    room: usize,
    budget: &'b Budget,
}

impl<'b, T> ChargedVec<'b, T> {
    pub fn new(budget: &'b Budget) -> Self {
        Self { items: Vec::new(), room: 0, budget }
    }

    #[inline]
    pub fn push(&mut self, item: T) -> Result<(), OverBudget> {
        if self.items.len() == self.room {
            self.grow()?;
        }
        self.items.push(item);
        Ok(())
    }

    pub fn truncate(&mut self, length: usize) {
        self.items.truncate(length);
    }

    #[cold]
    fn grow(&mut self) -> Result<(), OverBudget> {
        let old = self.room;
        let new = (old * 2).max(64);
        // The old and the new block exist together while one is copied to the other.
        self.budget.charge(bytes::<T>(new))?;
        self.items.reserve_exact(new - self.items.len());
        self.budget.release(bytes::<T>(old));
        self.room = new;
        Ok(())
    }
}

fn bytes<T>(count: usize) -> u64 {
    (count * size_of::<T>()) as u64
}

impl<T> Drop for ChargedVec<'_, T> {
    fn drop(&mut self) {
        self.budget.release(bytes::<T>(self.room));
    }
}

impl<T> std::ops::Deref for ChargedVec<'_, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.items
    }
}

impl<T> std::ops::DerefMut for ChargedVec<'_, T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.items
    }
}
