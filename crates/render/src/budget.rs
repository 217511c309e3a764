//! A bound on the memory that a derivation takes.

use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes that may be taken, and those that are. Shared by the threads of a derivation.
#[derive(Debug)]
pub struct Budget {
    max: u64,
    used: AtomicU64,
}

/// A charge that does not fit. Nothing was charged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OverBudget {
    /// Bytes that were asked for.
    pub needed: u64,
    /// Bytes that were left.
    pub left: u64,
}

impl Budget {
    /// At most `max` bytes.
    pub fn new(max: u64) -> Self {
        Self { max, used: AtomicU64::new(0) }
    }

    /// Bytes that may still be taken.
    pub fn left(&self) -> u64 {
        self.max - self.used.load(Ordering::Relaxed)
    }

    /// Gives back what was charged and is free again.
    pub fn release(&self, bytes: u64) {
        self.used.fetch_sub(bytes, Ordering::Relaxed);
    }

    /// Charges bytes before they are taken.
    ///
    /// # Errors
    /// When they do not fit.
    pub fn charge(&self, bytes: u64) -> Result<(), OverBudget> {
        let fits = |used: u64| used.checked_add(bytes).filter(|&total| total <= self.max);
        self.used
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits)
            .map(drop)
            .map_err(|used| OverBudget { needed: bytes, left: self.max - used })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_charge_that_does_not_fit_charges_nothing() {
        let budget = Budget::new(10);
        assert_eq!(budget.charge(7), Ok(()));
        assert_eq!(budget.charge(4), Err(OverBudget { needed: 4, left: 3 }));
        assert_eq!(budget.charge(u64::MAX), Err(OverBudget { needed: u64::MAX, left: 3 }));
        assert_eq!(budget.charge(3), Ok(()));
        budget.release(2);
        assert_eq!(budget.left(), 2);
    }
}
