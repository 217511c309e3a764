//! [`Budget`]: what the edits of one frame may cost.

use std::time::{Duration, Instant};

/// What the edits of one frame may cost. An operation that is begun is finished, so a frame may exceed its budget by one; what does
/// not fit stays queued.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Milliseconds of the frame's thread.
    pub ms: f64,
    /// Bytes that are uploaded.
    pub bytes: u64,
    /// Operations: batches for the active set or the staging set.
    pub operations: u32,
}

impl Budget {
    /// Everything at once.
    pub const UNLIMITED: Self = Self { ms: f64::INFINITY, bytes: u64::MAX, operations: u32::MAX };
}

impl Default for Budget {
    /// A quarter of a frame at 120 frames a second, four megabytes, 1,024 operations.
    fn default() -> Self {
        Self { ms: 2.0, bytes: 4 << 20, operations: 1024 }
    }
}

/// What has been spent of a budget.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meter {
    budget: Budget,
    start: Instant,
    pub bytes: u64,
    pub operations: u32,
}

impl Meter {
    /// The time runs from now.
    pub fn start(budget: Budget) -> Self {
        Self { budget, start: Instant::now(), bytes: 0, operations: 0 }
    }

    /// Whether one more operation may begin.
    pub fn has_room(&self) -> bool {
        self.has_room_at(self.start.elapsed())
    }

    fn has_room_at(&self, elapsed: Duration) -> bool {
        elapsed.as_secs_f64() * 1e3 < self.budget.ms && self.has_room_but_for_time(1.0)
    }

    /// Whether one more operation may begin within a share of the budget (0 to 1).
    pub fn has_room_within(&self, share: f64) -> bool {
        self.start.elapsed().as_secs_f64() * 1e3 < self.budget.ms * share && self.has_room_but_for_time(share)
    }

    fn has_room_but_for_time(&self, share: f64) -> bool {
        (self.bytes as f64) < self.budget.bytes as f64 * share
            && f64::from(self.operations) < f64::from(self.budget.operations) * share
    }

    /// Counts an operation.
    pub fn spend(&mut self, bytes: u64) {
        self.bytes += bytes;
        self.operations += 1;
    }

    /// Milliseconds since the start.
    pub fn elapsed_ms(&self) -> f64 {
        self.start.elapsed().as_secs_f64() * 1e3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meter(ms: f64, bytes: u64, operations: u32) -> Meter {
        Meter::start(Budget { ms, bytes, operations })
    }

    #[test]
    fn each_of_the_three_ends_a_frame_and_one_operation_may_exceed_it() {
        let none = Duration::ZERO;
        let mut bytes = meter(1.0, 100, 9);
        assert!(bytes.has_room_at(none));
        bytes.spend(99);
        assert!(bytes.has_room_at(none), "a byte is left");
        bytes.spend(500);
        assert!(!bytes.has_room_at(none));
        let mut operations = meter(1.0, 100, 1);
        operations.spend(0);
        assert!(!operations.has_room_at(none));
        assert!(meter(1.0, 100, 1).has_room_at(Duration::from_micros(999)));
        assert!(!meter(1.0, 100, 1).has_room_at(Duration::from_micros(1000)));
    }

    #[test]
    fn a_budget_of_nothing_lets_nothing_begin() {
        assert!(!meter(0.0, 1, 1).has_room());
        assert!(!meter(1e9, 0, 1).has_room());
        assert!(!meter(1e9, 1, 0).has_room());
        assert!(Meter::start(Budget::UNLIMITED).has_room());
    }
}
