//! Asks the memory for a value that will be read soon.
//!
//! A tree of a million items does not fit into the caches near the processor: a walk waits for memory at every step, unless
//! both children are asked for while their parent is looked at.
#![allow(unsafe_code, reason = "the prefetch instruction takes a pointer, and has no safe form")]

/// Brings the cache lines of `value` near; changes nothing else.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let start = core::ptr::from_ref(value).cast::<i8>();
        for line in (0..size_of::<T>()).step_by(64) {
            // SAFETY: the address lies within `value`, and a prefetch of any address neither faults nor writes.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(line)) };
        }
        if align_of::<T>() < 64 && size_of::<T>() > 1 {
            // It may end in a line more than its size has.
            // SAFETY: as above.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(size_of::<T>() - 1)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
