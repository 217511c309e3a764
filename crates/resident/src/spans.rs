//! [`SpanAllocator`]: which parts of a buffer are in use.
//!
//! Best fit with coalescing (Knuth, "The Art of Computer Programming", volume 1, section 2.5): a span goes where the
//! smallest free span holds it, at the lowest place of several; a freed span joins its free neighbours at once, and what is
//! free at the end of the buffer shortens it. An operation costs O(log n) of the free spans.

use std::collections::{BTreeMap, BTreeSet};

/// Spans of a buffer of rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SpanAllocator {
    /// Length of each free span by its first row. No two touch, and none ends at `end`.
    free: BTreeMap<u32, u32>,
    /// The same as (length, first row).
    by_length: BTreeSet<(u32, u32)>,
    end: u32,
    used: u32,
}

impl SpanAllocator {
    /// A buffer without rows.
    pub const fn new() -> Self {
        Self { free: BTreeMap::new(), by_length: BTreeSet::new(), end: 0, used: 0 }
    }

    /// A buffer whose first `end` rows are in use.
    pub const fn packed(end: u32) -> Self {
        Self { free: BTreeMap::new(), by_length: BTreeSet::new(), end, used: end }
    }

    /// One past the last row that is in use: the length of the buffer, free spans included.
    pub fn end(&self) -> u32 {
        self.end
    }

    /// Rows in use.
    pub fn used(&self) -> u32 {
        self.used
    }

    /// Free spans between those in use: first row and length, in ascending order.
    pub fn free_spans(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.free.iter().map(|(&first, &length)| (first, length))
    }

    /// Takes a span; its first row. An empty span takes nothing. `None` if the rows would not fit `u32`, whose last value
    /// stands for "none" in row layouts.
    pub fn allocate(&mut self, length: u32) -> Option<u32> {
        if length == 0 {
            return Some(0);
        }
        let first = match self.by_length.range((length, 0)..).next().copied() {
            Some((free, first)) => {
                self.forget(first, free);
                self.keep(first + length, free - length);
                first
            }
            None => {
                let first = self.end;
                self.end = first.checked_add(length).filter(|&end| end < u32::MAX)?;
                first
            }
        };
        self.used += length;
        Some(first)
    }

    /// The free span that [`Self::allocate`] would take rows from: its first row. `None` if it would lengthen the buffer.
    pub fn hole_for(&self, length: u32) -> Option<u32> {
        self.by_length.range((length, 0)..).next().map(|&(_, first)| first)
    }

    /// Takes rows at a place of the caller's choice.
    ///
    /// # Panics
    /// If they are not all in one free span.
    pub fn take(&mut self, first: u32, length: u32) {
        if length == 0 {
            return;
        }
        if first >= self.end {
            // Beyond the end all is free.
            let gap = first - self.end;
            let old = self.end;
            self.end = first + length;
            self.used += length;
            return self.keep(old, gap);
        }
        let span = self.free.range(..=first).next_back().map(|(&at, &free)| (at, free));
        let (at, free) = span
            .filter(|(at, free)| first + length <= at + free)
            .unwrap_or_else(|| panic!("rows {first}+{length} are not all free"));
        self.forget(at, free);
        self.keep(at, first - at);
        self.keep(first + length, at + free - (first + length));
        self.used += length;
    }

    /// Gives a span back.
    ///
    /// # Panics
    /// If a part of it is not in use: then somebody holds a range that belongs to another.
    pub fn free(&mut self, first: u32, length: u32) {
        if length == 0 {
            return;
        }
        let end = first.checked_add(length).filter(|&end| end <= self.end);
        let end = end.unwrap_or_else(|| panic!("rows {first}+{length} are not in a buffer of {}", self.end));
        let before = self.free.range(..end).next_back().map(|(&at, &free)| (at, free));
        if let Some((at, free)) = before {
            assert!(at + free <= first, "rows {first}..{end} are not all in use");
        }
        let (mut start, mut stop) = (first, end);
        if let Some((at, free)) = before.filter(|(at, free)| at + free == first) {
            self.forget(at, free);
            start = at;
        }
        if let Some(&free) = self.free.get(&end) {
            self.forget(end, free);
            stop += free;
        }
        if stop == self.end {
            self.end = start;
        } else {
            self.keep(start, stop - start);
        }
        self.used -= length;
    }

    fn keep(&mut self, first: u32, length: u32) {
        if length > 0 {
            self.free.insert(first, length);
            self.by_length.insert((length, first));
        }
    }

    fn forget(&mut self, first: u32, length: u32) {
        self.free.remove(&first);
        self.by_length.remove(&(length, first));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash_mix;

    #[test]
    fn the_smallest_span_that_holds_it_is_taken() {
        let mut spans = SpanAllocator::new();
        let firsts: Vec<u32> = [5, 1, 3, 1, 4, 1].iter().map(|&n| spans.allocate(n).unwrap()).collect();
        assert_eq!(firsts, [0, 5, 6, 9, 10, 14]);
        spans.free(0, 5);
        spans.free(6, 3);
        spans.free(10, 4);
        assert_eq!(spans.free_spans().collect::<Vec<_>>(), [(0, 5), (6, 3), (10, 4)]);
        assert_eq!(spans.allocate(3), Some(6));
        assert_eq!(spans.allocate(4), Some(10));
        assert_eq!(spans.allocate(2), Some(0));
        assert_eq!(spans.allocate(4), Some(15), "no free span holds it");
        assert_eq!((spans.end(), spans.used()), (19, 16));
    }

    #[test]
    fn rows_can_be_taken_in_the_middle_of_a_hole_and_beyond_the_end() {
        let mut spans = SpanAllocator::packed(10);
        spans.free(2, 6);
        assert_eq!((spans.hole_for(6), spans.hole_for(7)), (Some(2), None));
        spans.take(4, 2);
        assert_eq!(spans.free_spans().collect::<Vec<_>>(), [(2, 2), (6, 2)]);
        spans.take(12, 3);
        assert_eq!(spans.free_spans().collect::<Vec<_>>(), [(2, 2), (6, 2), (10, 2)]);
        assert_eq!((spans.end(), spans.used()), (15, 9));
    }

    #[test]
    #[should_panic(expected = "rows 4+3 are not all free")]
    fn rows_that_are_in_use_cannot_be_taken() {
        let mut spans = SpanAllocator::packed(10);
        spans.free(2, 4);
        spans.take(4, 3);
    }

    #[test]
    fn neighbours_join_and_the_end_comes_back() {
        let mut spans = SpanAllocator::packed(10);
        spans.free(2, 2);
        spans.free(6, 2);
        spans.free(4, 2);
        assert_eq!(spans.free_spans().collect::<Vec<_>>(), [(2, 6)]);
        spans.free(8, 2);
        assert_eq!((spans.end(), spans.used(), spans.free_spans().count()), (2, 2, 0));
        spans.free(0, 2);
        assert_eq!(spans, SpanAllocator::new());
    }

    #[test]
    fn an_empty_span_takes_nothing_and_too_many_rows_are_refused() {
        let mut spans = SpanAllocator::new();
        assert_eq!(spans.allocate(0), Some(0));
        spans.free(0, 0);
        assert_eq!(spans.allocate(u32::MAX - 1), Some(0));
        assert_eq!(spans.allocate(1), None);
        assert_eq!(spans.end(), u32::MAX - 1);
        assert_eq!(SpanAllocator::new().allocate(u32::MAX), None);
    }

    #[test]
    #[should_panic(expected = "not all in use")]
    fn a_span_cannot_be_freed_twice() {
        let mut spans = SpanAllocator::packed(10);
        spans.free(2, 3);
        spans.free(4, 2);
    }

    #[test]
    fn no_two_spans_overlap_and_holes_do_not_grow() {
        let mut state = 7u32;
        let mut random = |below: u32| {
            state += 1;
            hash_mix(state) % below
        };
        let mut spans = SpanAllocator::new();
        let mut live: Vec<(u32, u32)> = Vec::new();
        let (mut highest, mut most_used) = (0, 0);
        for step in 0..200_000u32 {
            // The set breathes: it fills up, and is taken down to a part.
            let wanted = if step / 10_000 % 2 == 0 { 800 } else { 200 };
            if live.len() < wanted && (live.is_empty() || random(3) > 0) {
                // Mostly small, a few large.
                let largest = if random(8) == 0 { 100 } else { 4 };
                let length = 1 + random(20) * random(20) * random(largest);
                let first = spans.allocate(length).unwrap();
                live.push((first, length));
            } else {
                let (first, length) = live.swap_remove(random(live.len() as u32) as usize);
                spans.free(first, length);
            }
            assert_eq!(spans.used(), live.iter().map(|(_, n)| n).sum());
            (highest, most_used) = (highest.max(spans.end()), most_used.max(spans.used()));
            if step % 1000 == 0 {
                let mut all: Vec<(u32, u32)> = live.iter().copied().chain(spans.free_spans()).collect();
                all.sort_unstable();
                let end = all.into_iter().fold(0, |end, (first, length)| {
                    assert_eq!(first, end, "every row is in one span");
                    first + length
                });
                assert_eq!(end, spans.end());
            }
        }
        assert!(f64::from(highest) <= 1.25 * f64::from(most_used), "{highest} rows for at most {most_used}");
        for (first, length) in live {
            spans.free(first, length);
        }
        assert_eq!(spans, SpanAllocator::new());
    }
}
