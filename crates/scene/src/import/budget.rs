//! The bound on memory that an import may take. Memory is charged before it is taken, by sizes that are known before:
//! a file's length, what a data URI decodes to, an upper bound for what a JSON text becomes.

use std::sync::atomic::{AtomicU64, Ordering};

/// More memory would be taken than is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{needed} bytes of memory are needed, and {limit} are allowed; raise --max-memory")]
pub struct OverBudget {
    /// Bytes that would be in use.
    pub needed: u64,
    /// Bytes that are allowed.
    pub limit: u64,
}

/// Counts bytes up to a limit. Shared by the threads of one import.
#[derive(Debug)]
pub(crate) struct Budget {
    limit: u64,
    used: AtomicU64,
}

impl Budget {
    pub fn new(limit: u64) -> Self {
        Self { limit, used: AtomicU64::new(0) }
    }

    /// Charges bytes that are about to be taken. On an error nothing is charged.
    pub fn charge(&self, bytes: u64) -> Result<(), OverBudget> {
        let add = |used: u64| used.checked_add(bytes).filter(|&sum| sum <= self.limit);
        match self.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add) {
            Ok(_) => Ok(()),
            Err(used) => Err(OverBudget { needed: used.saturating_add(bytes), limit: self.limit }),
        }
    }

    /// Gives back what was charged and is free again.
    pub fn release(&self, bytes: u64) {
        self.used.fetch_sub(bytes, Ordering::Relaxed);
    }

    pub fn used(&self) -> u64 {
        self.used.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_charge_that_does_not_fit_changes_nothing() {
        let budget = Budget::new(100);
        budget.charge(60).unwrap();
        assert_eq!(budget.charge(41), Err(OverBudget { needed: 101, limit: 100 }));
        assert!(budget.charge(u64::MAX).is_err());
        budget.charge(40).unwrap();
        budget.release(1);
        assert_eq!(budget.used(), 99);
    }
}
