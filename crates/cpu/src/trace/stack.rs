//! The stack of a walk: fixed, not cleared before use, sorted in part.
#![allow(unsafe_code, reason = "clearing two kilobytes for each instance that a ray enters costs a few percent")]

use crate::accel::wide::MAX_STACK;
use std::mem::MaybeUninit;

/// What is to be visited: the entry parameter's bits over a reference, so that comparing entries compares parameters
/// (which are never negative).
#[derive(Clone, Copy, PartialEq, PartialOrd)]
pub(super) struct Entry(u64);

impl Entry {
    /// Makes an entry; `t` is not negative.
    #[inline(always)]
    pub fn new(t: f32, reference: u32) -> Self {
        Self(u64::from(t.to_bits()) << 32 | u64::from(reference))
    }

    /// The entry parameter.
    #[inline(always)]
    pub fn t(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    /// The reference.
    #[inline(always)]
    pub fn reference(self) -> u32 {
        self.0 as u32
    }
}

/// See the module. Entries below `len` are initialised.
pub(super) struct Stack {
    entries: [MaybeUninit<Entry>; MAX_STACK],
    len: usize,
}

impl Stack {
    /// An empty stack.
    #[inline(always)]
    pub fn new() -> Self {
        Self { entries: [MaybeUninit::uninit(); MAX_STACK], len: 0 }
    }

    /// Its height.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Puts an entry on top.
    ///
    /// # Panics
    /// When it is full, which no tree makes happen (see [`MAX_STACK`]).
    #[inline(always)]
    pub fn push(&mut self, entry: Entry) {
        self.entries[self.len] = MaybeUninit::new(entry);
        self.len += 1;
    }

    /// Puts an entry among those at `bottom` and above, which stay sorted with the smallest on top.
    #[inline(always)]
    pub fn insert(&mut self, bottom: usize, entry: Entry) {
        let mut at = self.len;
        while at > bottom {
            // SAFETY: `at - 1` is below `len`, where entries are initialised.
            let below = unsafe { self.entries[at - 1].assume_init() };
            if below >= entry {
                break;
            }
            self.entries[at] = MaybeUninit::new(below);
            at -= 1;
        }
        self.entries[at] = MaybeUninit::new(entry);
        self.len += 1;
    }

    /// Takes the topmost entry.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<Entry> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        // SAFETY: it was below the old `len`, where entries are initialised.
        Some(unsafe { self.entries[self.len].assume_init() })
    }
}
